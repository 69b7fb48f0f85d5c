"""The compiled step of the blocks: `jointlaw/native/blocks.c`, and its arrays.

Python owns every array. The library is told where they lie, so they are changed in place; a new
list of contacts has new arrays, in a new `World`.
"""

import ctypes
from functools import lru_cache
from typing import Any

import numpy as np

from jointlaw.native.library import load

from .scene import SceneError

SHOWN = 6  # of a joint: shares sliding, slipping, separated; J/m2 stored, lost; damage of its bond
NUMBERS = "blocks", "corners", "contacts", "driven"
REALS = (
    "thickness", "corner_length", "soft", "parts", "dashpot_normal", "dashpot_shear", "max_path",
    "max_stale",
)  # fmt: skip
ARRAYS = (
    "motion", "velocity", "renewed", "force", "last", "inertia", "gravity", "loads", "lightness",
    "reach", "skin", "deepest", "mobile", "urgent",
    "local", "way", "side", "block", "before", "after", "placed", "turned",
    "corner", "edge", "a", "b", "at", "normal", "pull", "closure", "length", "twist", "opening",
    "sliding", "rise", "carried", "inside", "own", "was", "offset", "out",
    "pools", "law", "place", "touch", "reduction", "traction", "delta", "shares", "area", "lost",
    "checked", "rows", "axes", "aim", "energy",
)  # fmt: skip
FOUND = "fast", "deep", "moved", "stale", "stiffer"


class Pool(ctypes.Structure):
    """`jl_pool` of blocks.h."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("d", "F", "shown", "stress", "stiffness")),
        *((name, ctypes.c_longlong) for name in ("points", "holds")),
    ]


class World(ctypes.Structure):
    """`jl_world` of blocks.h, which describes its arrays."""

    _fields_ = [
        *((name, ctypes.c_longlong) for name in NUMBERS),
        *((name, ctypes.c_double) for name in REALS),
        *((name, ctypes.c_void_p) for name in ARRAYS),
        *((name, ctypes.c_longlong) for name in FOUND),
    ]

    def bind(self, holder: Any = None, *names: str, **arrays: Any) -> None:
        """Tell the library where arrays lie, and keep them: those of these names of an object, and
        others."""
        arrays |= {name: getattr(holder, name) for name in names}
        self.__dict__.setdefault("held", {}).update(arrays)
        for name, array in arrays.items():
            setattr(self, name, address(array))

    def call(self, name: str, *arguments: Any) -> Any:
        """Call `jl_blocks_NAME`."""
        return getattr(library(), f"jl_blocks_{name}")(ctypes.byref(self), *arguments)


def address(array: Any) -> int:
    """Where the numbers of an array begin, of numpy or of ctypes."""
    if not isinstance(array, np.ndarray):
        return ctypes.addressof(array)
    if not array.flags.c_contiguous:
        raise ValueError("an array of the compiled step must lie in one piece")
    return array.ctypes.data


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The library. Raises SceneError where it was not built."""
    loaded = load()
    if loaded is None:
        raise SceneError(
            "blocks need the compiled library: install a C compiler or `pip install ziglang`, then "
            "run `python -m jointlaw.native`"
        )
    for name in ("press", "before", "forces", "after"):
        getattr(loaded, f"jl_blocks_{name}").argtypes = [ctypes.c_void_p, ctypes.c_double]
    whole, array = ctypes.c_longlong, ctypes.c_void_p
    loaded.jl_blocks_following.argtypes = [array] * 3
    loaded.jl_blocks_find.argtypes = [array, whole, *[array] * 4, whole, *[array] * 4]
    loaded.jl_blocks_find.restype = whole
    return loaded
