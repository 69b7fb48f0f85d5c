"""Calls the compiled step and relaxation of the blocks, `dem_demo/native`.

Python owns every array, and the library holds their addresses: arrays are changed in place. When
the number of contacts changes there are new arrays, and a new `StepArrays` with their addresses.
"""

import ctypes
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from jointlaw.kernels.threads import run_on_threads
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
    "update_contacts": ([INTEGER] * 2, INTEGER),
    "find_candidates": ([INTEGER, *[POINTER] * 4, INTEGER, *[POINTER] * 4], INTEGER),
    "changed_lengths": ([POINTER], INTEGER),
    "edge_pairs": ([POINTER], None),
    "laws_of": ([POINTER, INTEGER, POINTER, POINTER], None),
    "find_neighbours": ([], INTEGER),
    "compute_rates": ([], None),
    "set_increments": ([DOUBLE], None),
    "set_increments_of": ([DOUBLE, INTEGER, POINTER], None),
    "check_speeds": ([DOUBLE], None),
    "move_blocks": ([DOUBLE], None),
    "run_phase": ([DOUBLE, INTEGER], None),
    "add_energies": ([DOUBLE], None),
    "read_joints": ([], None),
    "read_joints_of": ([INTEGER, POINTER], None),
    "continue_joints": ([INTEGER, POINTER, POINTER], None),
    "compute_forces": ([DOUBLE], None),
    "finish_step": ([DOUBLE], None),
    "compute_unbalanced": ([], ctypes.c_int),
    "pull_bolts": ([], DOUBLE),
    "bolt_tractions": ([ctypes.c_int], ctypes.c_int),
    "relax": ([INTEGER], ctypes.c_int),
    "place_solids": ([], None),
    "near_pairs": ([POINTER] * 2 + [INTEGER, POINTER], INTEGER),
    "separations": ([INTEGER, POINTER, DOUBLE, POINTER], None),
    "update_face_points": ([INTEGER] * 2, INTEGER),
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
        return find_function(name)(ctypes.byref(self), *arguments)


class StepArrays(Arrays):
    """`dem_step` of layout.h: numbers of a step, and addresses of its arrays.

    threads: that share a step, see `divide`.
    """

    _fields_ = [(name, field.ctype) for name, field in layout.STEP.items()]
    threads = 1

    def divide(self, block_a: np.ndarray, block_b: np.ndarray, threads: int = 1) -> None:
        """Divide the blocks among threads, by the contact points (k,) of their two blocks.

        The results of a step do not depend on the number of threads, which may exceed one only for
        a geometry that has parts.
        """
        n = self.n_blocks
        k = self.n_contacts
        size = layout.BLOCKS_PER_PART
        first_block = np.array([0, n])
        if threads > 1:
            points = np.bincount(block_a, minlength=n) + np.bincount(block_b, minlength=n)
            work_before = np.concatenate([[0], np.cumsum(points + 1)])
            shares = np.arange(1, threads) / threads * work_before[-1]
            inner = np.rint(np.searchsorted(work_before, shares) / size) * size
            first_block = np.concatenate([[0], np.minimum(inner, n), [n]]).astype(np.int64)
        self.threads = threads
        self.n_ranges = threads
        self.bind(
            first_block=first_block,
            point_forces=np.zeros((k, 2, self.dim)),
            block_sums=np.zeros((n // size + 1, len(layout.BLOCK_SUMS))),
            point_sums=np.zeros((k // layout.POINTS_PER_PART + 1, len(layout.POINT_SUMS))),
        )

    def move_blocks(self, dt: float) -> None:
        """Move the blocks by a step (s), update their points, and set the increments of the law."""
        if self.threads == 1:
            self.call("move_blocks", dt)
            return
        self.call("check_speeds", dt)
        if self.too_fast < 0:
            self._run_phase("move", dt)
            self._run_phase("update", dt)

    def finish_step(self, dt: float) -> None:
        """Compute forces, energies and velocities after the law has advanced by a step (s)."""
        if self.threads == 1:
            self.call("finish_step", dt)
            return
        self.stiffened = 0
        self._run_phase("finish_points", dt)
        self._run_phase("finish_blocks", dt)
        self.call("add_energies", dt)

    def _run_phase(self, name: str, dt: float) -> None:
        """Run a phase of the step on all threads."""
        self.next_part = 0
        work = partial(self.call, "run_phase", dt, layout.PHASES.index(name))
        run_on_threads(work, self.threads)


class CornerArrays(Arrays):
    """`dem_corners` of layout.h: outlines of the blocks, and contacts of corners on edges."""

    _fields_ = [(name, field.ctype) for name, field in layout.CORNERS.items()]


class EdgeLawArrays(Arrays):
    """`dem_edge_laws` of layout.h: laws of edges and blocks."""

    _fields_ = [(name, field.ctype) for name, field in layout.EDGE_LAWS.items()]


class SeamArrays(Arrays):
    """`dem_seams` of layout.h: contacts and joints at seams between coplanar edges."""

    _fields_ = [(name, field.ctype) for name, field in layout.SEAMS.items()]


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


@cache
def find_function(name: str) -> Any:
    """Return the function `dem_NAME` of the library."""
    return getattr(library(), f"dem_{name}")


def function_address(name: str) -> int:
    """Return the address of the function `dem_NAME`, for a structure that holds it."""
    return ctypes.cast(find_function(name), ctypes.c_void_p).value or 0


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
