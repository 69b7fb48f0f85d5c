"""Load the compiled library of the law and call it."""

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import Any

from . import build

ADVANCE, MEASURE, REFRESH, STIFFNESS, TRACTION = range(5)  # operations of jlaw_run

REBUILD_HINT = (
    "rebuild it with `python -m jointlaw.native`, or set JOINTLAW_KERNEL=numpy to run without it"
)


class UnfitLibraryError(ImportError):
    """The library was built from sources other than the installed ones or for another processor."""


class BatchCall(ctypes.Structure):
    """`jlaw_batch` of batch.h."""

    _fields_ = [
        *(
            (name, ctypes.c_void_p)
            for name in ("law", "state", "d", "F", "C", "measures", "index", "entries")
        ),
        *((name, ctypes.c_longlong) for name in ("n", "next", "chunk")),
        *(
            (name, ctypes.c_int)
            for name in (
                "rows",
                "contiguous",
                "float_sliders",
                "lanes",
                "track_dissipation",
                "commit",
            )
        ),
    ]


@lru_cache(maxsize=1)
def load() -> ctypes.CDLL | None:
    """Load the installed library.

    Returns
    -------
    The library, or None if it was not built.

    Raises
    ------
    UnfitLibraryError
        If it does not fit the installed sources or this processor.
    """
    path = build.BUILT / build.library_name(build.Compiler(()).machine[1])
    return load_file(path) if path.exists() else None


def load_file(path: Path) -> ctypes.CDLL:
    """Load and check the library at this path.

    Raises UnfitLibraryError for a file that is no library for this machine, that was built from
    other sources than the installed ones, or whose vectors are wider than this processor supports.
    """
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        message = f"{path} cannot be loaded here ({error}): {REBUILD_HINT}"
        raise UnfitLibraryError(message) from error
    library.jlaw_sources.restype = ctypes.c_char_p
    library.jlaw_run.argtypes = [ctypes.c_void_p, ctypes.c_int]
    library.jlaw_state_rows.argtypes = [ctypes.c_void_p]
    if library.jlaw_sources().decode() != build.hash_sources():
        raise UnfitLibraryError(
            f"{path} was built from sources other than the installed ones: {REBUILD_HINT}"
        )
    if not vector_lanes(library):
        raise UnfitLibraryError(
            f"{path} was built on another machine, for wider vectors than this processor has: "
            f"{REBUILD_HINT}; `JOINTLAW_LEVELS=all python -m jointlaw.native` builds for mixed "
            "machines"
        )
    pointer = ctypes.c_void_p
    count = ctypes.c_longlong
    library.jlaw_sort_by_block.argtypes = [pointer, count, count, pointer]
    library.jlaw_check_list.argtypes = [pointer, count, count]
    library.jlaw_contact_step.argtypes = [pointer, ctypes.c_int, ctypes.c_int]
    library.jlaw_contact_step.restype = None
    return library


def vector_lanes(library: Any) -> int:
    """Number of doubles in the widest vector that library and processor support; 0 for none."""
    of_processor = library.jlaw_lanes()
    of_library = library.jlaw_levels()
    supported = (n for n in build.LEVELS if n <= of_processor and n & of_library)
    return max(supported, default=0)


def address(array: Any) -> int | None:
    """Address of the first number of a contiguous array; None for None."""
    if array is None:
        return None
    try:  # four times as fast as array.ctypes
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # an empty or read-only array
        return int(array.ctypes.data)
