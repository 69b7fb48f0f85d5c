"""The library of the compiled law: finds, loads and calls it."""

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..discretisation.tables import Tables
from . import build
from .layout import Law
from .pack import in_blocks, pack

ADVANCE, MEASURE, REFRESH = range(3)  # what jlaw_run calls


class StaleLibraryError(ImportError):
    """The library was built from other sources than lie beside it."""


class BatchCall(ctypes.Structure):
    """`jlaw_batch` of batch.h."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("law", "state", "d", "F", "C", "shown", "index")),
        *((name, ctypes.c_longlong) for name in ("n", "taken", "grain")),
        *((name, ctypes.c_int) for name in ("rows", "alone", "lanes", "ledger", "keep")),
    ]


@lru_cache(maxsize=1)
def load() -> ctypes.CDLL | None:
    """The library, None if there is none; raises StaleLibraryError if it is of other sources."""
    path = build.BUILT / build.library_name(build.Compiler(()).machine[1])
    return load_file(path) if path.exists() else None


def load_file(path: Path) -> ctypes.CDLL:
    """The library of this file."""
    library = ctypes.CDLL(str(path))
    library.jlaw_sources.restype = ctypes.c_char_p
    library.jlaw_run.argtypes = [ctypes.c_void_p, ctypes.c_int]
    if library.jlaw_sources().decode() != build.sources():
        raise StaleLibraryError(
            f"{path} was built from other sources than lie beside it: build it anew with "
            "`python -m jointlaw.native`, or set JOINTLAW_KERNEL=numpy to do without it"
        )
    return library


class NativeLaw:
    """The tables of a law as the library reads them."""

    def __init__(self, tables: Tables) -> None:
        numbers, arrays = pack(tables)
        arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
        for name in ("facet", "depth"):
            arrays[name] = in_blocks(arrays[name])
        pointers = {name: array.ctypes.data for name, array in arrays.items()}
        self._arrays = arrays  # which the structure points to
        self._law = Law(**numbers, **pointers)
        self.address = ctypes.addressof(self._law)


def address(array: Any) -> int | None:
    """Where the numbers of a contiguous array begin; None for None."""
    if array is None:
        return None
    try:  # four times as fast as numpy's own
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # it is empty, or may only be read
        return int(array.ctypes.data)
