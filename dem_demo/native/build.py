"""Builds the library of the compiled step, by the compilers that `jointlaw.native.build` finds."""

import hashlib
from pathlib import Path

from jointlaw.native.build import LEVELS, Compiler, Unit, build_library
from jointlaw.native.build import library_name as law_library_name

from . import layout

HERE = Path(__file__).parent
NAMES = ("blocks.c", "corners.c", "bolts.c", "relaxation.c", "face_contacts.c", "face_points.c")
SOURCES = tuple(HERE / name for name in NAMES)
BUILT = HERE / "built"  # the library, and layout.h


def hash_sources() -> str:
    """Hash of the sources of the library, by which a stale library is recognised."""
    digest = hashlib.sha256(layout.layout_h().encode())
    for path in (*SOURCES, HERE / "export.h", HERE / "build.py"):
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:16]


def library_name(system: str) -> str:
    """File name of the library on an operating system."""
    return law_library_name(system, "libdem_demo")


def build(compiler: Compiler, folder: Path = BUILT) -> Path:
    """Build the library in the folder and return its path.

    Raises RuntimeError with the messages of the compiler if it fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "layout.h").write_text(layout.layout_h(), encoding="utf-8")
    # the narrowest vectors: one library for every processor of this kind
    identity = f'-DDEM_SOURCES="{hash_sources()}"'
    units = [Unit(path, min(LEVELS), (identity,)) for path in SOURCES]
    library = folder / library_name(compiler.machine[1])
    return build_library(compiler, units, library)
