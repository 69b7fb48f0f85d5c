"""Which kernel advances a law's joints, and on how many threads.

Both engines keep states in blocks and offer the same methods: "native" is the compiled law of
`jointlaw/native`, "numpy" the readable reference. JOINTLAW_KERNEL chooses; by default native is
taken where its library was built. JOINTLAW_THREADS bounds the threads.
"""

import ctypes
import math
import os
import warnings
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
from .threads import share_out, thread_count

Index = NDArray[np.intp]
LANES = 8  # joints of a block, which lie side by side: JLAW_JOINTS_PER_BLOCK in native/batch.h
LINE = 64  # bytes that a processor reads at once
CHUNK = 4096  # joints per call of the numpy kernel: keeps its temporaries in cache
GRAINS = 16  # of joints: a thread takes as many, one after the other, if all are equally fast
SERIAL = 20_000  # sliders below which a second thread costs more than it saves
MISSING = (
    "the compiled law was not built, and numpy's kernel is about forty times slower: install a C "
    "compiler or `pip install ziglang`, then run `python -m jointlaw.native`"
)


def blocks(n: int, rows: int, lanes: int = LANES) -> Array:
    """Zeros for n states, (blocks, rows, lanes), which begin where a line of memory does."""
    shape = -(-n // lanes), rows, lanes
    raw = np.zeros(math.prod(shape) + LINE // 8)
    first = -raw.ctypes.data % LINE // 8
    return raw[first : first + math.prod(shape)].reshape(shape)


def at(state: Array, index: Index, rows: Any = slice(None)) -> tuple[Index, Any, Index]:
    """Where the blocks `state` hold these rows of the joints of `index`: (n, rows)."""
    block, lane = np.divmod(index, state.shape[2])
    return block, rows, lane


class Step:
    """A step of m joints of one batch: increments in, results out. It may be taken many times.

    d (m, dim) in m; F (m, dim) and C (m, dim, dim), which are written, C None for no tangent;
    where: the joints that move (m,), None for all; keep: whether the states advance. shown
    (m, 6 + dim), written if given, as it costs little in the same pass: shares sliding, slipping
    and separated, stored and dissipated energy (J/m2), damage of the bond, displacement (m).
    """

    def __init__(
        self, d: Array, F: Array, C: Array | None, where: Index | None = None, keep: bool = True,
        shown: Array | None = None,
    ) -> None:  # fmt: skip
        self.d, self.F, self.C, self.shown, self.where, self.keep = d, F, C, shown, where, keep
        self.call: tuple[Array | None, Any] = None, None  # of these states, for `NativeEngine`

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"call": (None, None)}  # it holds addresses


def engine(tables: LawTables) -> "NumpyEngine | NativeEngine":
    """The engine of a law's tables, which all its joints share: it holds nothing of theirs."""
    choice = os.environ.get("JOINTLAW_KERNEL", "")
    if choice:
        one_of("JOINTLAW_KERNEL", choice, ("numpy", "native"))
    return _engine(tables, choice)


@lru_cache(maxsize=64)
def _engine(tables: LawTables, choice: str) -> "NumpyEngine | NativeEngine":
    if tables.python_only and choice == "native":
        raise ImportError(
            f"JOINTLAW_KERNEL = 'native', but the element {tables.python_only[0]} has no C version"
        )
    if tables.python_only or choice == "numpy":
        return NumpyEngine(tables)
    loaded = library.load()
    if loaded is not None:
        return NativeEngine(tables, loaded)
    if choice == "native":
        raise ImportError(f"JOINTLAW_KERNEL = 'native', but {MISSING}")
    if choice == "":
        _warn_once()
    return NumpyEngine(tables)


@lru_cache(maxsize=1)
def _warn_once() -> None:
    warnings.warn(MISSING, stacklevel=2)


class NumpyEngine:
    """The reference: whole chunks of joints through `reference.step`."""

    name = "numpy"

    def __init__(self, tables: LawTables) -> None:
        self.tables, self.rows = tables, tables.rows  # rows of a block

    def advance(self, state: Array, step: Step, ledger: bool) -> None:
        """Take a step; the ledger, the sum of the dissipated energy, is always kept."""
        index = np.arange(len(step.d)) if step.where is None else step.where
        for first in range(0, len(step.d), CHUNK):
            part = slice(first, first + CHUNK)
            place = at(state, index[part])
            old = np.ascontiguousarray(state[place].T)
            new, F, C = reference.step(self.tables, old, step.d[part].T, step.C is not None)
            step.F[part] = F.T
            if step.C is not None and C is not None:
                step.C[part] = np.moveaxis(C, 2, 0)
            if step.keep:
                state[place] = new.T
            if step.shown is not None:
                now = reference.parts(self.tables, new)
                damage = np.minimum(getattr(now, "damage", np.ones(len(F.T))), 1.0)
                shares = reference.measures(self.tables, new)[:4]
                all_shown = np.stack([*shares, now.dissipated, damage, *now.delta])
                step.shown[part] = all_shown.T

    def refresh(self, state: Array, n: int) -> None:
        """Nothing is kept beside the states."""

    def of_states(self, what: str, state: Array, n: int) -> Array:
        """What the first n states amount to, joints first, by a function of `reference`:

        "traction" (n, dim) in Pa, "stiffness" (n,) in Pa/m or "measures" (n, 5).
        """
        rows = np.ascontiguousarray(state[at(state, np.arange(n))].T)
        return np.array(getattr(reference, what)(self.tables, rows)).T


class NativeEngine:
    """The compiled law, on all threads where there is work for them."""

    name = "native"

    def __init__(self, tables: LawTables, loaded: ctypes.CDLL) -> None:
        numbers, arrays = pack(tables)
        # kept, for the structure points to them
        self._arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
        pointers = {name: array.ctypes.data for name, array in self._arrays.items()}
        self._law, self._sliders = LawStruct(**numbers, **pointers), tables.sliders
        self._library_run, self.lanes = loaded.jlaw_run, library.vector_lanes(loaded)
        # rows of a block: the state, then Phi and Phi' of all facets, which save half the look-ups;
        # with flattened facets, the same at their depth
        facets = 0 if tables.asperities is None else len(tables.asperities.c1)
        self.rows = tables.rows + 2 * (1 + tables.yields) * facets

    def advance(self, state: Array, step: Step, ledger: bool) -> None:
        """Take a step; `ledger` adds up the dissipated energy."""
        of, call = step.call
        if of is not state:
            arrays = (address(array) for array in (step.d, step.F, step.C, step.shown, step.where))
            call = self._prepared(state, len(step.d), *arrays)
            step.call = state, call
        call.track_dissipation, call.commit = ledger, step.keep
        self._run(library.ADVANCE, call)

    def refresh(self, state: Array, n: int) -> None:
        """Bring Phi and Phi', kept beside the first n states, up to date with them."""
        self._run(library.REFRESH, self._prepared(state, n))

    def of_states(self, what: str, state: Array, n: int) -> Array:
        """As `NumpyEngine.of_states`; the traction is that of a step by nothing."""
        call, *shape = {
            "traction": (library.ADVANCE, n, self._law.dim),
            "stiffness": (library.STIFFNESS, n),
            "measures": (library.MEASURE, n, 5),
        }[what]
        out = np.empty(shape)
        self._run(call, self._prepared(state, n, None, address(out)))
        return out

    def _prepared(self, state: Array, n: int, *arrays: int | None) -> library.BatchCall:
        """A call for n joints; arrays: where d, F, C, what is shown and the index begin."""
        _, rows, lanes = state.shape
        given = address(state), *arrays, *[None] * (5 - len(arrays))
        return library.BatchCall(
            ctypes.addressof(self._law), *given, n, 0, n, rows, lanes == 1, self.lanes
        )

    def _run(self, what: int, call: library.BatchCall) -> None:
        """Call the library on one thread or several, which share the joints out."""
        where, n = ctypes.addressof(call), call.n
        threads = min(thread_count(), -(-n // LANES)) if n * self._sliders > SERIAL else 1
        call.next = 0
        if threads == 1:
            self._work(where, what)
            return
        call.chunk = -(-n // (GRAINS * threads * LANES)) * LANES
        share_out(partial(self._work, where, what), threads)

    def _work(self, where: int, what: int) -> None:
        """Have the library take joints of a call until none are left."""
        if self._library_run(where, what):
            raise MemoryError("no memory for a copy of a block of states")
