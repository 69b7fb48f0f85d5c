"""The kernel that advances the joints of a law, and the threads that it runs on.

Two engines have the same methods: "native" is the compiled law of `jointlaw/native`, "numpy" the
readable reference. JOINTLAW_KERNEL chooses; the default is native if its library was built. A law
with an element without a C version runs in numpy. JOINTLAW_THREADS limits the threads.

States are stored in blocks of eight joints, (blocks, rows, 8): a row of a block holds one number of
eight joints side by side, so that the compiled law advances several joints by one vector
instruction. A batch of one joint has a block of one. Joint i is in lane i % 8 of block i // 8. The
compiled law keeps more rows in a block than a state has: the first-loading curve of every facet at
the end of the last step, which halves the evaluations of the next one. `refresh` computes these
rows from the state, so snapshots do without.

An engine for float sliders stores packed states (float_sliders.py), without the first-loading
curve, since its states are to be small. `pack` and `unpack` convert states to rows of a block.
"""

import ctypes
import math
import os
import warnings
from enum import IntEnum
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..native import library
from ..native.layout import LawStruct
from ..native.library import address
from ..support.checks import Array, one_of
from . import reference
from .pack import pack
from .reference import LawTables
from .threads import run_on_threads, thread_count

Index = NDArray[np.intp]
JOINTS_PER_BLOCK = 8  # JLAW_JOINTS_PER_BLOCK in native/batch.h
CACHE_LINE_BYTES = 64
MAX_JOINTS_OF_ENTRIES = 2**32  # whose numbers the entries of a list hold (native/batch.h)
JOINTS_PER_NUMPY_CALL = 4096  # keeps the temporaries of the numpy kernel in cache
CHUNKS_PER_THREAD = 16  # a thread fetches as many chunks of joints if all threads are equally fast
MIN_SLIDERS_FOR_THREADS = 20_000  # with fewer a second thread costs more than it saves
MISSING_LIBRARY = (
    "the compiled law was not built, and numpy's kernel is about forty times slower: install a C "
    "compiler or `pip install ziglang`, then run `python -m jointlaw.native`"
)


def allocate_blocks(n: int, rows: int, lanes: int = JOINTS_PER_BLOCK) -> Array:
    """Zeros for n states, (blocks, rows, lanes), aligned to a cache line."""
    shape = -(-n // lanes), rows, lanes
    raw = np.zeros(math.prod(shape) + CACHE_LINE_BYTES // 8)
    first = -raw.ctypes.data % CACHE_LINE_BYTES // 8
    return raw[first : first + math.prod(shape)].reshape(shape)


def block_index(state: Array, joints: Index, rows: Any = slice(None)) -> tuple[Index, Any, Index]:
    """Index that selects rows of some joints from an array of states in blocks.

    state: (blocks, rows, lanes). joints: numbers of joints, (n,). rows: a slice selects all those
    rows, so that `state[index]` has the shape (n, rows).
    """
    block, lane = np.divmod(joints, state.shape[2])
    return block, rows, lane


class ListVerdict(IntEnum):
    """Verdict on a list of joints (batch.h); the first two are valid lists."""

    INCREASING = 1
    ANY_ORDER = 0
    OUTSIDE = -1  # names a joint that is not in the batch
    REPEATED = -2  # names a joint twice


class Step:
    """Arrays of a step of m joints of one batch. It may be repeated with new increments in d.

    d: increments (m, dim) in m. F: tractions (m, dim) in Pa, written. C: tangents (m, dim, dim) in
    Pa/m, written; None for no tangent. where: indices (m,) of the joints, None for all. commit:
    whether the states advance. measures: (m, 6 + dim), written unless None, at little cost in the
    same pass: fractions sliding, slipping and separated, stored and dissipated energy (J/m2),
    damage of bond or cohesion, displacement (m).

    Raises ValueError unless all arrays are C-contiguous, as the compiled law requires.
    """

    def __init__(
        self,
        d: Array,
        F: Array,
        C: Array | None,
        where: Index | None = None,
        commit: bool = True,
        measures: Array | None = None,
    ) -> None:
        for name, array in {"d": d, "F": F, "C": C, "where": where, "measures": measures}.items():
            if array is not None and not array.flags.c_contiguous:
                raise ValueError(f"{name} is not C-contiguous: give np.ascontiguousarray({name})")
        self.d = d
        self.F = F
        self.C = C
        self.measures = measures
        self.where = where
        self.commit = commit
        # verdict on `where`, if the caller has checked it for the batch: `ListVerdict`
        self.list_verdict: int | None = None
        # the states of the last call, the call, its address, and the arrays that it refers to:
        # `NativeEngine`
        self.call: tuple[Array | None, Any, int, Any] = None, None, 0, None

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"call": (None, None, 0, None)}  # a call holds addresses


def require_valid_list(
    kernel: "NumpyEngine | NativeEngine", joints: Index, count: int, can_repeat: bool = False
) -> int:
    """The verdict on a list of joints (m,) of a batch of `count`: `ListVerdict`.

    Raises ValueError if it names a joint outside the batch or, unless `can_repeat`, a joint twice.
    """
    verdict = kernel.check_list(joints, count)
    if verdict == ListVerdict.OUTSIDE:
        lowest = int(joints.min())
        invalid = lowest if lowest < 0 else int(joints.max())
        raise ValueError(f"where names joint {invalid}; joints are 0 to {count - 1}")
    if verdict == ListVerdict.REPEATED and not can_repeat:
        raise ValueError("where names a joint twice; each joint takes one increment per step")
    return verdict


def engine(tables: LawTables, float_sliders: bool = False) -> "NumpyEngine | NativeEngine":
    """The engine of a law's tables. All its joints share it, because it keeps no state of theirs.

    float_sliders: whether states store the forces of sliders as float.
    Raises ImportError where JOINTLAW_KERNEL requires a kernel that is not available.
    """
    choice = os.environ.get("JOINTLAW_KERNEL", "")
    if choice:
        one_of("JOINTLAW_KERNEL", choice, ("numpy", "native"))
    return _engine(tables, choice, float_sliders)


@lru_cache(maxsize=64)
def _engine(tables: LawTables, choice: str, float_sliders: bool) -> "NumpyEngine | NativeEngine":
    if tables.python_only and choice == "native":
        raise ImportError(
            f"JOINTLAW_KERNEL = 'native', but the element {tables.python_only[0]} has no C version"
        )
    if tables.python_only or choice == "numpy":
        return NumpyEngine(tables, float_sliders)
    loaded = library.load()
    if loaded is not None:
        return NativeEngine(tables, loaded, float_sliders)
    if choice == "native":
        raise ImportError(f"JOINTLAW_KERNEL = 'native', but {MISSING_LIBRARY}")
    _warn_once()
    return NumpyEngine(tables, float_sliders)


@lru_cache(maxsize=1)
def _warn_once() -> None:
    warnings.warn(MISSING_LIBRARY, stacklevel=2)


class StateRows:
    """Rows of a block that hold the state of a joint, with sliders as double or as float."""

    def __init__(self, tables: LawTables, float_sliders: bool) -> None:
        self.float_sliders = float_sliders
        self._packing = tables.slider_packing if float_sliders else None
        self.state_rows = tables.rows if self._packing is None else self._packing.packed_rows

    @property
    def float_rows(self) -> tuple[int, int] | None:
        """First and last + 1 row of a state that are stored as float; None for none."""
        packing = self._packing
        if packing is None:
            return None
        return packing.first, packing.first + 2 * packing.sliders

    def pack(self, states: Array) -> Array:
        """Rows (n, state_rows) of a block for states (n, rows).

        Raises ValueError for a slider force that does not fit into a float.
        """
        return states if self._packing is None else self._packing.pack(states)

    def unpack(self, rows: Array) -> Array:
        """States (n, rows) in rows (n, state_rows) of a block."""
        return rows if self._packing is None else self._packing.unpack(rows)

    def row(self, row: int) -> int:
        """Row of a block for a row of a state that belongs to no slider."""
        return row if self._packing is None else self._packing.packed_row(row)


class NumpyEngine(StateRows):
    """The reference: `reference.step` for groups of joints."""

    name = "numpy"

    def __init__(self, tables: LawTables, float_sliders: bool = False) -> None:
        super().__init__(tables, float_sliders)
        self.tables = tables.with_float_sliders if float_sliders else tables
        self.rows = self.state_rows  # of a block

    def advance(self, state: Array, step: Step, track_dissipation: bool) -> None:
        """Advance joints by a step; the dissipated energy is always tracked."""
        joints = np.arange(len(step.d)) if step.where is None else step.where
        if step.where is not None and step.list_verdict is None:
            require_valid_list(self, joints, state.shape[0] * state.shape[2])
        for first in range(0, len(step.d), JOINTS_PER_NUMPY_CALL):
            part = slice(first, first + JOINTS_PER_NUMPY_CALL)
            index = block_index(state, joints[part])
            old = np.ascontiguousarray(self.unpack(state[index]).T)
            new, F, C = reference.step(self.tables, old, step.d[part].T, step.C is not None)
            step.F[part] = F.T
            if step.C is not None and C is not None:
                step.C[part] = np.moveaxis(C, 2, 0)
            if step.commit:
                state[index] = self.pack(new.T)
            if step.measures is not None:
                dim = self.tables.dim
                measures = reference.measures(self.tables, new)[:4]
                damage = reference.damage(self.tables, new)
                rows = [*measures, new[dim], damage, *new[:dim]]
                step.measures[part] = np.stack(rows).T

    def check_list(self, joints: Index, count: int) -> ListVerdict:
        """Verdict on a list of joints (m,) of a batch of `count`, contiguous, by `ListVerdict`."""
        if len(joints) and not 0 <= joints.min() <= joints.max() < count:
            return ListVerdict.OUTSIDE
        if (joints[1:] > joints[:-1]).all():
            return ListVerdict.INCREASING
        if np.bincount(joints).max() > 1:
            return ListVerdict.REPEATED
        return ListVerdict.ANY_ORDER

    def refresh(self, state: Array, n: int) -> None:
        """Do nothing: a block has no other rows than its states."""

    def evaluate(self, quantity: str, state: Array, n: int) -> Array:
        """A quantity of the first n states, joints first, by a function of `reference`.

        "traction" (n, dim) in Pa, "stiffness" (n,) in Pa/m or "measures" (n, 5).
        """
        states = self.unpack(state[block_index(state, np.arange(n))])
        rows = np.ascontiguousarray(states.T)
        return np.array(getattr(reference, quantity)(self.tables, rows)).T


class NativeEngine(StateRows):
    """The compiled law, on several threads if there are enough sliders."""

    name = "native"

    def __init__(self, tables: LawTables, loaded: ctypes.CDLL, float_sliders: bool = False) -> None:
        super().__init__(tables, float_sliders)
        numbers, arrays = pack(tables)
        # referenced here because the structure holds their addresses
        self._arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
        pointers = {name: array.ctypes.data for name, array in self._arrays.items()}
        self._law = LawStruct(**numbers, **pointers)
        rows = loaded.jlaw_state_rows(ctypes.addressof(self._law))
        if rows != tables.rows:
            raise ValueError(
                f"a state of this law has {tables.rows} rows in Python and {rows} in C: the rows "
                "of an element in kernels/ and in native/ differ"
            )
        self._sliders = tables.sliders
        self._library_run = loaded.jlaw_run
        self._library_sort = loaded.jlaw_sort_by_block
        self._library_check = loaded.jlaw_check_list
        self.lanes = library.vector_lanes(loaded)
        # rows of a block: the state, then Phi and Phi' of all facets; with plastic indentation,
        # Phi and Phi' at the indentation too
        facets = 0 if tables.asperities is None or float_sliders else len(tables.asperities.c1)
        self.rows = self.state_rows + 2 * (1 + tables.yields) * facets

    def advance(self, state: Array, step: Step, track_dissipation: bool) -> None:
        """Advance joints by a step; without `track_dissipation` it stays as it is in the state."""
        state_of_call, call, call_address, _ = step.call
        if state_of_call is not state:
            arrays = step.d, step.F, step.C, step.measures, *self._sort_by_block(state, step)
            call = self._prepare_call(state, len(step.d), *map(address, arrays))
            call_address = ctypes.addressof(call)
            step.call = state, call, call_address, arrays
        call.track_dissipation = track_dissipation
        call.commit = step.commit
        call.next = 0
        if call.n * self._sliders <= MIN_SLIDERS_FOR_THREADS:
            self._work(call_address, library.ADVANCE)
        else:
            self._run(library.ADVANCE, call)

    def check_list(self, joints: Index, count: int) -> int:
        """As `NumpyEngine.check_list`."""
        verdict: int = self._library_check(address(joints), len(joints), count)
        if verdict < ListVerdict.REPEATED:
            raise MemoryError("no memory to check a list of joints")
        return verdict

    def refresh(self, state: Array, n: int) -> None:
        """Compute Phi and Phi' in the blocks of the first n states from these states."""
        self._run(library.REFRESH, self._prepare_call(state, n))

    def evaluate(self, quantity: str, state: Array, n: int) -> Array:
        """As `NumpyEngine.evaluate`; the traction is bitwise the traction of the last step."""
        operation, *shape = {
            "traction": (library.TRACTION, n, self._law.dim),
            "stiffness": (library.STIFFNESS, n),
            "measures": (library.MEASURE, n, 5),
        }[quantity]
        out = np.empty(shape)
        self._run(operation, self._prepare_call(state, n, None, address(out)))
        return out

    def _sort_by_block(self, state: Array, step: Step) -> tuple[Index | None, Any]:
        """The list of joints of a step as the library reads it: an index or entries, or neither.

        Entries (m, 2) are pairs of a joint and its row in the arrays of the step, sorted by block.
        Raises ValueError for a list that names a joint twice or a joint outside the batch.
        """
        where = step.where
        if where is None:
            return None, None
        blocks, _, lanes = state.shape
        verdict = step.list_verdict
        if verdict is None:
            verdict = require_valid_list(self, where, blocks * lanes)
        if lanes == 1 or verdict == ListVerdict.INCREASING:
            return where, None
        if blocks * lanes > MAX_JOINTS_OF_ENTRIES:
            raise ValueError(
                f"where is a list in any order of a batch of more than {MAX_JOINTS_OF_ENTRIES} "
                "joints: sort it, or make several batches"
            )
        if len(where) < blocks // JOINTS_PER_BLOCK:  # the library counts the joints of every block
            order = np.argsort(where)
            return None, np.stack([where[order], order], axis=1).astype(np.uint32)
        entries = np.empty((len(where), 2), np.uint32)
        if self._library_sort(address(where), len(where), blocks, address(entries)):
            raise MemoryError("no memory to sort a list of joints")
        return None, entries

    def _prepare_call(self, state: Array, n: int, *arrays: int | None) -> library.BatchCall:
        """A call for n joints; arrays: addresses of d, F, C, measures, index, entries."""
        _, rows, lanes = state.shape
        addresses = address(state), *arrays, *[None] * (6 - len(arrays))
        return library.BatchCall(
            ctypes.addressof(self._law),
            *addresses,
            n,
            0,
            n,
            rows,
            lanes == 1,
            self.float_sliders,
            self.lanes,
        )

    def _run(self, operation: int, call: library.BatchCall) -> None:
        """Call the library on one thread or several, which fetch chunks of joints."""
        call_address = ctypes.addressof(call)
        call.next = 0
        threads = 1
        if call.n * self._sliders > MIN_SLIDERS_FOR_THREADS:
            threads = min(thread_count(), -(-call.n // JOINTS_PER_BLOCK))
        if threads == 1:
            self._work(call_address, operation)
            return
        chunks = CHUNKS_PER_THREAD * threads
        call.chunk = -(-call.n // (chunks * JOINTS_PER_BLOCK)) * JOINTS_PER_BLOCK
        run_on_threads(partial(self._work, call_address, operation), threads)

    def _work(self, call_address: int, operation: int) -> None:
        """Let the library process joints of a call until none is left."""
        if self._library_run(call_address, operation):
            raise MemoryError("no memory for a copy of a block of states")
