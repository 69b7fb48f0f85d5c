"""Calls the compiled step and relaxation of the blocks, `dem_demo/native`.

Python owns every array, and the library holds their addresses: arrays are changed in place. When
the number of contacts changes there are new arrays, and a new `StepArrays` with their addresses.
"""

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from jointlaw.native.build import Compiler

from .native import build, layout
from .scene import SceneError

REBUILD = "run `python -m dem_demo.native` to build it anew"
DOUBLE = ctypes.c_double
INTEGER = ctypes.c_longlong
POINTER = ctypes.c_void_p
# Arguments of each function after its structure, and what it returns
FUNCTIONS: dict[str, tuple[list[Any], Any]] = {
    "locate_contacts": ([], None),
    "next_contacts": ([POINTER] * 2, None),
    "update_contacts": ([], INTEGER),
    "find_candidates": ([INTEGER, *[POINTER] * 4, INTEGER, *[POINTER] * 4], INTEGER),
    "compute_rates": ([], None),
    "set_increments": ([DOUBLE], None),
    "move_blocks": ([DOUBLE], None),
    "read_joints": ([], None),
    "compute_forces": ([DOUBLE], None),
    "finish_step": ([DOUBLE], None),
    "compute_unbalanced": ([], ctypes.c_int),
    "pull_bolts": ([], DOUBLE),
    "bolt_tractions": ([ctypes.c_int], ctypes.c_int),
    "relax": ([INTEGER], ctypes.c_int),
    "place_solids": ([], None),
    "near_pairs": ([POINTER] * 2 + [INTEGER, POINTER], INTEGER),
    "separations": ([INTEGER, POINTER, DOUBLE, POINTER], None),
    "update_face_points": ([], INTEGER),
    "face_contacts": ([INTEGER, *[POINTER] * 6], INTEGER),
}


class LawJointArrays(ctypes.Structure):
    """`dem_law_joints` of layout.h: arrays of the joints of one law."""

    _fields_ = [(name, field.ctype) for name, field in layout.LAW_JOINTS.items()]


class RelaxedLaw(ctypes.Structure):
    """`dem_relaxed_law` of layout.h: the joints of one law in a relaxation."""

    _fields_ = [(name, field.ctype) for name, field in layout.RELAXED_LAW.items()]


class Arrays(ctypes.Structure):
    """A structure of numbers and of addresses of arrays that functions of the library take."""

    def bind(self, holder: Any = None, *names: str, **arrays: Any) -> None:
        """Store the addresses of arrays, and keep the arrays alive.

        names: of attributes of `holder` that are arrays; arrays: others, by their field.
        """
        arrays |= {name: getattr(holder, name) for name in names}
        self.__dict__.setdefault("bound_arrays", {}).update(arrays)
        for name, array in arrays.items():
            setattr(self, name, address(array))

    def call(self, name: str, *arguments: Any) -> Any:
        """Call the function `dem_NAME` of the library with these arrays."""
        return getattr(library(), f"dem_{name}")(ctypes.byref(self), *arguments)


class StepArrays(Arrays):
    """`dem_step` of layout.h: numbers of a step, and addresses of its arrays."""

    _fields_ = [(name, field.ctype) for name, field in layout.STEP.items()]


class CornerArrays(Arrays):
    """`dem_corners` of layout.h: outlines of the blocks, and contacts of corners on edges."""

    _fields_ = [(name, field.ctype) for name, field in layout.CORNERS.items()]


class RelaxationArrays(Arrays):
    """`dem_relaxation` of layout.h: numbers of a relaxation, and addresses of its arrays."""

    _fields_ = [(name, field.ctype) for name, field in layout.RELAXATION.items()]


class SolidArrays(Arrays):
    """`dem_solids` of layout.h: polyhedra in space, and addresses of their arrays."""

    _fields_ = [(name, field.ctype) for name, field in layout.SOLIDS.items()]


class PointArrays(Arrays):
    """`dem_points` of layout.h: contact points of polyhedra."""

    _fields_ = [(name, field.ctype) for name, field in layout.POINTS.items()]


class FacePointArrays(Arrays):
    """`dem_face_points` of layout.h: contact points of polyhedra while the blocks move."""

    _fields_ = [(name, field.ctype) for name, field in layout.FACE_POINTS.items()]


class BoltArrays(Arrays):
    """`dem_bolts` of layout.h: numbers of rock bolts, and addresses of their arrays."""

    _fields_ = [(name, field.ctype) for name, field in layout.BOLTS.items()]


class RelaxedBolts(Arrays):
    """`dem_relaxed_bolts` of layout.h: rock bolts in a relaxation."""

    _fields_ = [(name, field.ctype) for name, field in layout.RELAXED_BOLTS.items()]


def function_address(name: str) -> int:
    """Return the address of the function `dem_NAME`, for a structure that holds it."""
    return ctypes.cast(getattr(library(), f"dem_{name}"), ctypes.c_void_p).value or 0


def address(array: Any) -> int:
    """Address of the numbers of an array, of numpy or of ctypes.

    Raises ValueError for an array that is not contiguous.
    """
    if not isinstance(array, np.ndarray):
        return ctypes.addressof(array)
    if not array.flags.c_contiguous:
        raise ValueError("an array of the compiled step must be contiguous")
    return array.ctypes.data


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The library. Raises SceneError where it was not built, or was built from other sources."""
    path: Path = build.BUILT / build.library_name(Compiler(()).machine[1])
    if not path.exists():
        raise SceneError(
            f"blocks need their compiled library, and {path} is missing: install a C compiler or "
            f"`pip install ziglang`, then {REBUILD}"
        )
    try:
        loaded = ctypes.CDLL(str(path))
    except OSError as error:
        raise SceneError(f"{path} cannot be loaded here ({error}): {REBUILD}") from error
    loaded.dem_sources.restype = ctypes.c_char_p
    if loaded.dem_sources().decode() != build.hash_sources():
        raise SceneError(f"{path} was built from other sources than are installed here: {REBUILD}")
    for name, (arguments, result) in FUNCTIONS.items():
        function = getattr(loaded, f"dem_{name}")
        function.argtypes = [POINTER, *arguments]
        function.restype = result
    return loaded
