"""Builds the library of the compiled law, with the standard library of Python alone.

Compilers are taken in the order clang, g++, gcc, zig: as fast as they make the law. A compiler that
is there may still be a stub, so a trial file is compiled first. On x86-64 a library is built for
the width of vectors of this processor, or for all three with JOINTLAW_LEVELS=all.
"""

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from . import layout

HERE = Path(__file__).parent
BUILT = HERE / "built"  # the library, and headers that are made
# no fused operations: the same bits with every compiler; the others change no result. Without the
# passes "gcse" gcc takes 0.6 times as long, and the law is as fast.
FLAGS = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fno-gcse",
         "-fno-gcse-after-reload", "-w")  # fmt: skip
LEVELS = {8: "x86-64-v4", 4: "x86-64-v3", 2: "x86-64"}  # of lanes of vectors, on x86-64
ENDINGS = {"linux": "so", "macos": "dylib", "windows": "dll"}
TARGETS = {  # of zig, and what wheels call them
    "x86_64-linux-gnu.2.17": "manylinux_2_17_x86_64",
    "aarch64-linux-gnu.2.17": "manylinux_2_17_aarch64",
    "x86_64-macos.11.0": "macosx_11_0_x86_64",
    "aarch64-macos.11.0": "macosx_11_0_arm64",
    "x86_64-windows-gnu": "win_amd64",
    "aarch64-windows-gnu": "win_arm64",
}
TRIAL = """#include <math.h>
#include <stdlib.h>
typedef double real __attribute__((vector_size(64)));
typedef int whole __attribute__((vector_size(32)));
#ifdef __AVX512DQ__
#include <immintrin.h>
#endif
double trial(double x)
{
  real v = {x, 1.0};
  v[0] = exp(v[0]);
  return __builtin_convertvector(__builtin_convertvector(v, whole), real)[0];
}
"""


class Compiler(NamedTuple):
    """A command and what of it differs from others."""

    command: tuple[str, ...]
    target: str = ""  # of zig, for another machine than this

    @property
    def machine(self) -> tuple[str, str]:
        """Processor and system that it builds for."""
        if self.target:
            processor, system = self.target.split("-")[:2]
            return processor, system.partition(".")[0]
        system = {"Darwin": "macos", "Windows": "windows"}.get(platform.system(), "linux")
        return {"AMD64": "x86_64", "arm64": "aarch64"}.get(
            platform.machine(), platform.machine()
        ), system

    def flags(self, lanes: int) -> list[str]:
        """Flags, for vectors of so many lanes; at the least those of every such processor."""
        processor, system = self.machine
        flags = [*FLAGS, "-fvisibility=hidden", *([] if system == "windows" else ["-fPIC"])]
        if processor != "x86_64":
            return flags
        if "ziglang" not in self.command:
            return [*flags, f"-march={LEVELS[lanes]}"]
        return [*flags, f"-mcpu={'baseline' if lanes == 2 else LEVELS[lanes].replace('-', '_')}"]

    def run(self, *arguments: object) -> None:
        """Compile; RuntimeError tells the compiler's words. OSError where it does not start."""
        command = [*self.command, *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")

    def link(self, objects: Iterable[Path], out: Path) -> None:
        """Make a library."""
        system = self.machine[1]
        words = tuple(word for word in self.command if word not in ("-x", "c++"))
        needed = ["-Wl,--as-needed"] if system == "linux" else []
        math = [] if system == "windows" else ["-lm"]
        self._replace(command=words).run("-shared", *needed, *objects, "-o", out, *math)


def zig(target: str = "") -> Compiler:
    """The compiler of the package `ziglang`, for this machine or another."""
    known = target or f"{platform.machine()}-linux-gnu.2.17"
    if not target and platform.system() != "Linux":
        return Compiler((sys.executable, "-m", "ziglang", "cc"))
    return Compiler((sys.executable, "-m", "ziglang", "cc", "-target", known), target)


def installed() -> list[Compiler]:
    """Compilers of this machine that may work, the one that makes the fastest library first."""
    commands = [("clang",), ("g++", "-x", "c++", "-fno-exceptions"), ("gcc",), ("cc",)]
    return [Compiler(command) for command in commands if shutil.which(command[0])]


def lanes_here(compiler: Compiler) -> int:
    """Lanes of vectors that this processor has, told by a library that the compiler makes.

    OSError or RuntimeError where it makes none.
    """
    # Windows keeps the file of a library that is loaded
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        source, out = folder / "trial.c", folder / "trial.out"
        source.write_text(TRIAL)
        parts = (source, max(LEVELS)), (HERE / "processor.c", min(LEVELS))
        objects = [folder / f"{lanes}.o" for _, lanes in parts]
        for (part, lanes), made in zip(parts, objects, strict=True):
            compiler.run(*compiler.flags(lanes), "-c", part, "-o", made)
        compiler.link(objects, out)
        return int(ctypes.CDLL(str(out)).jlaw_lanes())


def works(compiler: Compiler) -> bool:
    """Whether the compiler makes a library that this Python loads."""
    try:
        return lanes_here(compiler) > 0
    except (OSError, RuntimeError):
        return False


def chosen_levels(compiler: Compiler) -> tuple[int, ...]:
    """Lanes of the vectors that a library is built for: all for another machine, else those of this
    processor, all by JOINTLAW_LEVELS=all. ValueError for another value."""
    asked = os.environ.get("JOINTLAW_LEVELS", "")
    if asked not in ("", "all"):
        raise ValueError(f"JOINTLAW_LEVELS = {asked!r} is unknown; write all, or leave it out")
    if compiler.machine[0] != "x86_64":
        return (min(LEVELS),)
    return tuple(LEVELS) if asked or compiler.target else (lanes_here(compiler),)


def find_compiler() -> Compiler | None:
    """The first compiler of this machine that works, zig included; None if none does."""
    return next((c for c in [*installed(), zig()] if works(c)), None)


def sources() -> str:
    """Hash of all that a library is built from."""
    digest = hashlib.sha256(layout.layout_h().encode())
    for path in sorted([*HERE.glob("*.[ch]"), HERE / "build.py"]):
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:16]


def write_headers(folder: Path = BUILT) -> None:
    """Write layout.h, for the library, and jointlaw.h, for hosts in C."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "layout.h").write_text(layout.layout_h(), encoding="utf-8")
    (folder / "jointlaw.h").write_text(layout.jointlaw_h(), encoding="utf-8")


def library_name(system: str) -> str:
    """Name of the library's file on this system."""
    return f"libjointlaw.{ENDINGS[system]}"


def build(compiler: Compiler, folder: Path = BUILT) -> Path:
    """Build the library into the folder; its path. RuntimeError tells the compiler's words."""
    levels = chosen_levels(compiler)
    write_headers(folder)
    out = folder / library_name(compiler.machine[1])
    holds = f"-DJLAW_LEVELS={sum(levels)}", f'-DJLAW_SOURCES="{sources()}"'
    own = ("processor.c", min(LEVELS), ()), ("blocks.c", min(LEVELS), ())
    parts = [("library.c", min(LEVELS), holds), *own]
    for lanes in levels:
        parts += [
            ("batch.c", lanes, (f"-DJL_W={lanes}", f"-DKIND=_{lanes}")),
            ("batch.c", lanes, ("-DJL_W=4", f"-DKIND=_{lanes}_alone", "-DJLAW_ABREAST")),
        ]
    with tempfile.TemporaryDirectory() as scratch:
        objects = [Path(scratch) / f"{i}.o" for i in range(len(parts))]

        def compile_one(part: tuple[str, int, tuple[str, ...]], to: Path) -> None:
            source, lanes, what = part
            compiler.run(
                *compiler.flags(lanes), *what, f"-I{folder}", "-c", HERE / source, "-o", to
            )

        with ThreadPoolExecutor() as pool:
            list(pool.map(compile_one, parts, objects))
        made = Path(scratch) / out.name
        compiler.link(objects, made)
        # a library that is in use must not be written over: another file takes its place
        fresh = out.with_name(f"{out.name}.new")
        shutil.copyfile(made, fresh)
        fresh.replace(out)
    return out
