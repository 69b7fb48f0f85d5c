"""The library of the compiled law: finds, loads and calls it."""

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import Any

from . import build

ADVANCE, MEASURE, REFRESH, STIFFNESS = range(4)  # what jlaw_run calls


ANEW = "build it anew with `python -m jointlaw.native`, or set JOINTLAW_KERNEL=numpy to do without"


class UnfitLibraryError(ImportError):
    """The library was built from other sources than lie beside it, or for another processor."""


class BatchCall(ctypes.Structure):
    """`jlaw_batch` of batch.h."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("law", "state", "d", "F", "C", "shown", "index")),
        *((name, ctypes.c_longlong) for name in ("n", "taken", "grain")),
        *((name, ctypes.c_int) for name in ("rows", "alone", "lanes", "ledger", "keep")),
    ]


@lru_cache(maxsize=1)
def load() -> ctypes.CDLL | None:
    """The library, None if there is none; raises UnfitLibraryError if it is not of this place."""
    path = build.BUILT / build.library_name(build.Compiler(()).machine[1])
    return load_file(path) if path.exists() else None


def load_file(path: Path) -> ctypes.CDLL:
    """The library of this file."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise UnfitLibraryError(f"{path} cannot be loaded here ({error}): {ANEW}") from error
    library.jlaw_sources.restype = ctypes.c_char_p
    library.jlaw_run.argtypes = [ctypes.c_void_p, ctypes.c_int]
    if library.jlaw_sources().decode() != build.sources():
        raise UnfitLibraryError(f"{path} was built from other sources than lie beside it: {ANEW}")
    if not lanes(library):
        raise UnfitLibraryError(
            f"{path} was built on another machine, for wider vectors than this processor has: "
            f"{ANEW}; `JOINTLAW_LEVELS=all python -m jointlaw.native` builds for mixed machines"
        )
    return library


def lanes(library: Any) -> int:
    """Lanes of the widest vectors that the library and this processor have; 0 for none."""
    here, built = library.jlaw_lanes(), library.jlaw_levels()
    return max((n for n in build.LEVELS if n <= here and n & built), default=0)


def address(array: Any) -> int | None:
    """Where the numbers of a contiguous array begin; None for None."""
    if array is None:
        return None
    try:  # four times as fast as numpy's own
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # it is empty, or may only be read
        return int(array.ctypes.data)
