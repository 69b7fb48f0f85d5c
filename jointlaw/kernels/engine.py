"""Which kernel advances a law's joints, and on how many threads.

Both engines keep states in blocks (blocks, rows, lanes) and offer the same `advance`: numba
compiles the inner loops (extra `fast`), numpy is the readable reference. JOINTLAW_KERNEL=numpy or
numba chooses; by default numba is taken where it can be imported. JOINTLAW_THREADS bounds the
threads.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..law import JointLaw, Tables
from ..support.checks import Array, one_of
from . import reference

LANES = 128  # joints per block; again in compiled, where a change discards compiled code
CHUNK = 4096  # joints per call of the numpy kernel: keeps its temporaries in cache
SERIAL = 20_000  # sliders below which a second thread costs more than it saves

Index = NDArray[np.intp]
Call = Callable[..., None]


class Engine(Protocol):
    """What a batch asks of a kernel."""

    name: str
    rows: int  # of a block: those of the state, then what the kernel keeps beside it

    def advance(
        self,
        state: Array,
        d: Array,
        F: Array,
        C: Array | None,
        index: Index | None,
        keep: bool,
        ledger: bool,
    ) -> None:
        """Advance the joints of `index` (all if None) by d (m, dim): write F, C, state."""

    def refresh(self, state: Array, n: int) -> None:
        """Bring what the kernel keeps beside the first n states up to date with them."""

    def measures(self, state: Array, out: Array) -> None:
        """Write the `Measures` of the first n joints into the rows of out (5, n)."""


def engine(law: JointLaw) -> Engine:
    """The engine of a law, which all its joints share: it holds nothing of theirs."""
    choice = os.environ.get("JOINTLAW_KERNEL", "")
    if choice:
        one_of("JOINTLAW_KERNEL", choice, ("numpy", "numba"))
    made = law.engines
    if choice not in made:
        made[choice] = _make(law.tables, choice)
    return made[choice]


def _make(tables: Tables, choice: str) -> Engine:
    if choice != "numpy":
        try:
            return NumbaEngine(tables)
        except ImportError:
            if choice == "numba":
                raise
        except RuntimeError as error:
            if "cannot cache" not in str(error):
                raise
            raise OSError(
                "numba finds no folder that it can write compiled kernels to: set NUMBA_CACHE_DIR "
                "to one, or JOINTLAW_KERNEL=numpy to do without numba"
            ) from error
    return NumpyEngine(tables)


def rows_of(state: Array, n: int, index: Index | None = None) -> Array:
    """State of n joints, or those of `index`, as a copy (rows, n) with joints last."""
    if index is None:
        blocks = -(-n // state.shape[2])
        part = state[:blocks].transpose(1, 0, 2).reshape(state.shape[1], -1)[:, :n]
        return np.array(part, order="C")  # never a view
    lanes = state.shape[2]
    return np.ascontiguousarray(state[index // lanes, :, index % lanes].T)


def write_rows(state: Array, rows: Array, index: Index) -> None:
    """Write states (rows, n) of the joints of `index` back into the blocks."""
    lanes = state.shape[2]
    state[index // lanes, :, index % lanes] = rows.T


class NumpyEngine:
    """The reference: whole chunks of joints through `reference.step`."""

    name = "numpy"

    def __init__(self, tables: Tables) -> None:
        self.tables, self.rows = tables, tables.rows

    def advance(
        self,
        state: Array,
        d: Array,
        F: Array,
        C: Array | None,
        index: Index | None,
        keep: bool,
        ledger: bool,
    ) -> None:
        """As `Engine.advance`; the ledger is always kept."""
        where = np.arange(len(d)) if index is None else index
        for first in range(0, len(d), CHUNK):
            part = slice(first, first + CHUNK)
            old = rows_of(state, 0, where[part])
            new, F_part, C_part = reference.step(self.tables, old, d[part].T, C is not None)
            F[part] = F_part.T
            if C is not None and C_part is not None:
                C[part] = np.moveaxis(C_part, 2, 0)
            if keep:
                write_rows(state, new, where[part])

    def refresh(self, state: Array, n: int) -> None:
        """As `Engine.refresh`: nothing."""

    def measures(self, state: Array, out: Array) -> None:
        """As `Engine.measures`."""
        n = out.shape[1]
        for first in range(0, n, CHUNK):
            index = np.arange(first, min(first + CHUNK, n))
            rows = rows_of(state, 0, index)
            out[:, index] = reference.measures(self.tables, rows)


class NumbaEngine:
    """The compiled kernel, on all threads where there is work for them."""

    name = "numba"

    def __init__(self, tables: Tables) -> None:
        from . import compiled as kernel

        self._kernel = kernel
        packed = (*kernel.pack(tables, reference.compliance(tables).ravel()), tables.dim)
        self._fixed = {  # last arguments of the kernel: (ledger, tangent)
            (ledger, tangent): (*packed, True if ledger else None, True if tangent else None)
            for ledger in (False, True)
            for tangent in (False, True)
        }
        self._fixed_measures = (*packed, tables.curve.T.ravel().copy())
        self.rows, self._sliders = kernel.block_rows(tables), tables.sliders
        self._packed = packed
        self._all = np.empty(0, np.intp)
        self._none = np.empty((0, tables.dim, tables.dim))

    def advance(
        self,
        state: Array,
        d: Array,
        F: Array,
        C: Array | None,
        index: Index | None,
        keep: bool,
        ledger: bool,
    ) -> None:
        """As `Engine.advance`."""
        tangent = C is not None
        given = (state, d, F, C if tangent else self._none,
                 self._all if index is None else index, keep)  # fmt: skip
        self._run(self._kernel.advance, len(d), given, self._fixed[ledger, tangent])

    def refresh(self, state: Array, n: int) -> None:
        """As `Engine.refresh`."""
        self._run(self._kernel.refresh, n, (state,), self._packed)

    def measures(self, state: Array, out: Array) -> None:
        """As `Engine.measures`."""
        self._run(self._kernel.measures, out.shape[1], (state, out), self._fixed_measures)

    def _run(self, call: Call, n: int, given: tuple[Any, ...], fixed: tuple[Any, ...]) -> None:
        """call(*given, first, last, *work, *fixed) over n joints, on one thread or several."""
        if n * self._sliders <= SERIAL or (threads := min(thread_count(), -(-n // LANES))) == 1:
            call(*given, 0, n, *self._work(), *fixed)
            return
        share = -(-n // (threads * LANES)) * LANES  # whole blocks, so threads change no result

        def part(k: int) -> None:
            call(*given, min(k * share, n), min((k + 1) * share, n), *self._work(), *fixed)

        waiting = [_pool().submit(part, k) for k in range(1, threads)]
        try:
            part(0)
        finally:
            wait(waiting)
        for one in waiting:
            one.result()

    def _work(self) -> tuple[Any, ...]:
        """Working space of the thread that asks: shared by all batches it advances."""
        try:
            space: tuple[Any, ...] = _spaces.by_rows[self.rows]
        except (AttributeError, KeyError):
            space = self._kernel.work(self.rows)
            _spaces.__dict__.setdefault("by_rows", {})[self.rows] = space
        return space


_spaces = threading.local()


def thread_count() -> int:
    """Threads that a large batch may use: JOINTLAW_THREADS, or all processors of this process."""
    asked = os.environ.get("JOINTLAW_THREADS", "")
    if asked:
        if not asked.isdigit() or int(asked) < 1:
            raise ValueError(f"JOINTLAW_THREADS = {asked!r} is out of bounds: a whole number >= 1")
        return int(asked)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


_pools: dict[int, ThreadPoolExecutor] = {}


def _pool() -> ThreadPoolExecutor:
    """Threads of this process: a forked child starts its own."""
    process = os.getpid()
    if process not in _pools:
        _pools.clear()
        _pools[process] = ThreadPoolExecutor(max(thread_count() - 1, 1), "jointlaw")
    return _pools[process]
