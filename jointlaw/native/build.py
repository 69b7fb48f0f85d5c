"""Build the library of the compiled law; needs only the standard library of Python.

Compilers are tried in the order clang, g++, gcc, zig, the order of the speed of their code for this
law. A compiler on PATH may be a stub, so a trial file is compiled, linked and loaded first. On
x86-64 the library is built for the vector width of this processor, or, with JOINTLAW_LEVELS=all,
for all three widths.
"""

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from . import layout

HERE = Path(__file__).parent
BUILT = HERE / "built"  # the library and the generated headers
# -ffp-contract=off: the same bits with every compiler. The other flags change no result. Without
# its gcse passes gcc compiles in 0.6 of the time, and the law runs as fast.
FLAGS = (
    "-O3",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-gcse",
    "-fno-gcse-after-reload",
    "-w",
)
LEVELS = {8: "x86-64-v4", 4: "x86-64-v3", 2: "x86-64"}  # doubles in a vector: instruction set
SUFFIXES = {"linux": "so", "macos": "dylib", "windows": "dll"}
TARGETS = {  # target of zig: platform tag of the wheel
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
    """A C compiler: its command, and the target if it compiles for another machine."""

    command: tuple[str, ...]
    target: str = ""  # of zig; empty: this machine

    @property
    def machine(self) -> tuple[str, str]:
        """Processor ("x86_64", "aarch64") and system ("linux", "macos", "windows") of the compiled
        code.
        """
        if self.target:
            processor, system = self.target.split("-")[:2]
            return processor, system.partition(".")[0]
        processor = platform.machine()
        processor = {"AMD64": "x86_64", "arm64": "aarch64"}.get(processor, processor)
        system = {"Darwin": "macos", "Windows": "windows"}.get(platform.system(), "linux")
        return processor, system

    def flags(self, lanes: int) -> list[str]:
        """Flags for vectors of `lanes` doubles; 2 is the baseline of every x86-64."""
        processor, system = self.machine
        flags = [*FLAGS, "-fvisibility=hidden", *([] if system == "windows" else ["-fPIC"])]
        if processor != "x86_64":
            return flags
        if "ziglang" not in self.command:
            return [*flags, f"-march={LEVELS[lanes]}"]
        return [*flags, f"-mcpu={'baseline' if lanes == 2 else LEVELS[lanes].replace('-', '_')}"]

    def run(self, *arguments: object) -> None:
        """Run the compiler; RuntimeError holds its messages, OSError if it cannot be started."""
        command = [*self.command, *map(str, arguments)]
        process = subprocess.run(command, capture_output=True, text=True)
        if process.returncode:
            raise RuntimeError(f"{' '.join(command)}\n{process.stderr}")

    def link(self, objects: Iterable[Path], library: Path) -> None:
        """Link object files into a shared library."""
        system = self.machine[1]
        linker = tuple(word for word in self.command if word not in ("-x", "c++"))
        link_flags = ["-Wl,--as-needed"] if system == "linux" else []
        math = [] if system == "windows" else ["-lm"]
        self._replace(command=linker).run("-shared", *link_flags, *objects, "-o", library, *math)


def zig(target: str = "") -> Compiler:
    """The compiler of the package `ziglang`.

    target: a target of `TARGETS`; "" compiles for this machine, on Linux for glibc 2.17 and later.
    """
    command = (sys.executable, "-m", "ziglang", "cc")
    if target:
        return Compiler((*command, "-target", target), target)
    if platform.system() == "Linux":
        return Compiler((*command, "-target", f"{platform.machine()}-linux-gnu.2.17"))
    return Compiler(command)


def compilers_on_path() -> list[Compiler]:
    """Compilers on PATH, in the order in which they are tried."""
    commands = [("clang",), ("g++", "-x", "c++", "-fno-exceptions"), ("gcc",), ("cc",)]
    return [Compiler(command) for command in commands if shutil.which(command[0])]


def processor_lanes(compiler: Compiler) -> int:
    """Doubles in the widest vector of this processor, as a library built by the compiler reports.

    Raises OSError or RuntimeError if the compiler builds no library that this Python loads.
    """
    # Windows locks the file of a loaded library, so that its folder cannot be removed
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        trial = folder / "trial.c"
        trial.write_text(TRIAL)
        objects = []
        for source, lanes in ((trial, max(LEVELS)), (HERE / "processor.c", min(LEVELS))):
            objects.append(folder / f"{source.stem}.o")
            compiler.run(*compiler.flags(lanes), "-c", source, "-o", objects[-1])
        library = folder / "trial.out"
        compiler.link(objects, library)
        return int(ctypes.CDLL(str(library)).jlaw_lanes())


def works(compiler: Compiler) -> bool:
    """Whether the compiler builds a library that this Python loads."""
    try:
        return processor_lanes(compiler) > 0
    except (OSError, RuntimeError):
        return False


def select_levels(compiler: Compiler) -> tuple[int, ...]:
    """Vector widths to build for: this processor's; all for another machine or JOINTLAW_LEVELS=all.

    Raises ValueError for another value of JOINTLAW_LEVELS.
    """
    setting = os.environ.get("JOINTLAW_LEVELS", "")
    if setting not in ("", "all"):
        raise ValueError(f"JOINTLAW_LEVELS = {setting!r} is unknown; set it to all, or unset it")
    if compiler.machine[0] != "x86_64":
        return (min(LEVELS),)
    if setting or compiler.target:
        return tuple(LEVELS)
    return (processor_lanes(compiler),)


def find_compiler() -> Compiler | None:
    """The first working compiler of this machine, zig included; None if there is none."""
    return next((c for c in [*compilers_on_path(), zig()] if works(c)), None)


def hash_sources() -> str:
    """Hash of the sources of the library, by which a stale library is recognised."""
    digest = hashlib.sha256(layout.layout_h().encode())
    for path in sorted([*HERE.glob("*.[ch]"), HERE / "build.py"]):
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:16]


def write_headers(folder: Path = BUILT) -> None:
    """Write layout.h, for the library, and jointlaw.h, for host codes, into `folder`.

    The folder is made if it does not exist; files of these names are overwritten.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "layout.h").write_text(layout.layout_h(), encoding="utf-8")
    (folder / "jointlaw.h").write_text(layout.jointlaw_h(), encoding="utf-8")


def library_name(system: str, stem: str = "libjointlaw") -> str:
    """File name of a library on an operating system of `SUFFIXES`."""
    return f"{stem}.{SUFFIXES[system]}"


class Unit(NamedTuple):
    """A translation unit of a library: source file, vector width, macros."""

    source: Path
    lanes: int
    macros: tuple[str, ...] = ()


def translation_units(levels: Iterable[int]) -> list[Unit]:
    """All sources of a library with the vector width and the defines of each.

    batch.c is compiled three times per width in `levels` (doubles per vector): for joints side by
    side in vectors, whose slider forces are stored as double or as float, and for facets of one
    joint side by side. contacts.c is compiled once per width.
    """
    baseline = min(LEVELS)
    identity = (f"-DJLAW_LEVELS={sum(levels)}", f'-DJLAW_SOURCES="{hash_sources()}"')
    units = [
        Unit(HERE / "library.c", baseline, identity),
        Unit(HERE / "processor.c", baseline),
    ]
    batch = HERE / "batch.c"
    for lanes in levels:
        contiguous = ("-DJL_W=4", f"-DKIND=_{lanes}_contiguous", "-DJLAW_FACET_VECTORS")
        units.append(Unit(batch, lanes, (f"-DJL_W={lanes}", f"-DKIND=_{lanes}")))
        floats = (f"-DJL_W={lanes}", f"-DKIND=_{lanes}_float", "-DJLAW_FLOAT_SLIDERS")
        units.append(Unit(batch, lanes, floats))
        units.append(Unit(batch, lanes, contiguous))
        units.append(Unit(HERE / "contacts.c", lanes, (f"-DKIND=_{lanes}",)))
    return units


def build(compiler: Compiler, folder: Path = BUILT) -> Path:
    """Build the library in the folder and return its path.

    Raises RuntimeError with the messages of the compiler if it fails.
    """
    units = translation_units(select_levels(compiler))
    write_headers(folder)
    return build_library(compiler, units, folder / library_name(compiler.machine[1]))


def build_library(compiler: Compiler, units: Sequence[Unit], library: Path) -> Path:
    """Compile the units in parallel, link them to a library, and return its path.

    Generated headers are included from the folder of the library. Raises RuntimeError with the
    messages of the compiler if it fails.
    """
    with tempfile.TemporaryDirectory() as scratch:
        objects = [Path(scratch) / f"{i}.o" for i in range(len(units))]

        def compile_unit(unit: Unit, object_file: Path) -> None:
            flags = [*compiler.flags(unit.lanes), *unit.macros, f"-I{library.parent}"]
            compiler.run(*flags, "-c", unit.source, "-o", object_file)

        with ThreadPoolExecutor() as pool:
            list(pool.map(compile_unit, units, objects))
        linked = Path(scratch) / library.name
        compiler.link(objects, linked)
        # a process may have the library loaded: replace the file, do not write into it
        staged = library.with_name(f"{library.name}.new")
        shutil.copyfile(linked, staged)
        staged.replace(library)
    return library
