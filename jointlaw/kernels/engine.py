"""Which kernel advances a law's joints, and on how many threads.

Both engines keep states in blocks and offer the same methods: numba compiles the inner loops
(extra `fast`), numpy is the readable reference. JOINTLAW_KERNEL=numpy or numba chooses; by default
numba is taken where it can be imported. JOINTLAW_THREADS bounds the threads.
"""

import os
import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..discretisation.tables import Tables
from ..support.checks import Array, one_of
from . import reference
from .blocks import LANES, Index, rows_of, write_rows
from .threads import share_out, thread_count

CHUNK = 4096  # joints per call of the numpy kernel: keeps its temporaries in cache
SERIAL = 20_000  # sliders below which a second thread costs more than it saves

Call = Callable[..., None]


class Step(NamedTuple):
    """One step of m joints: increments in, results out."""

    d: Array  # (m, dim) in m
    F: Array  # (m, dim), written
    C: Array | None  # (m, dim, dim), written; None for no tangent
    where: Index | None  # the joints that move, (m,); None for all
    keep: bool  # whether the states advance, or stay as they were


def engine(tables: Tables) -> "NumpyEngine | NumbaEngine":
    """The engine of a law's tables, which all its joints share: it holds nothing of theirs."""
    choice = os.environ.get("JOINTLAW_KERNEL", "")
    if choice:
        one_of("JOINTLAW_KERNEL", choice, ("numpy", "numba"))
    return _engine(tables, choice)


@lru_cache(maxsize=64)
def _engine(tables: Tables, choice: str) -> "NumpyEngine | NumbaEngine":
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


class NumpyEngine:
    """The reference: whole chunks of joints through `reference.step`."""

    name = "numpy"

    def __init__(self, tables: Tables) -> None:
        self.tables, self.rows = tables, tables.rows  # rows of a block

    def advance(self, state: Array, step: Step, ledger: bool) -> None:
        """Take a step; the ledger, the sum of the dissipated energy, is always kept."""
        index = np.arange(len(step.d)) if step.where is None else step.where
        for first in range(0, len(step.d), CHUNK):
            part = slice(first, first + CHUNK)
            old, d = rows_of(state, 0, index[part]), step.d[part].T
            new, F, C = reference.step(self.tables, old, d, step.C is not None)
            step.F[part] = F.T
            if step.C is not None and C is not None:
                step.C[part] = np.moveaxis(C, 2, 0)
            if step.keep:
                write_rows(state, new, index[part])

    def refresh(self, state: Array, n: int) -> None:
        """Nothing is kept beside the states."""

    def measures(self, state: Array, out: Array) -> None:
        """Write the `Measures` of the first n joints into the rows of out (5, n)."""
        n = out.shape[1]
        for first in range(0, n, CHUNK):
            index = np.arange(first, min(first + CHUNK, n))
            rows = rows_of(state, 0, index)
            out[:, index] = reference.measures(self.tables, rows)


class NumbaEngine:
    """The compiled kernel, on all threads where there is work for them."""

    name = "numba"

    def __init__(self, tables: Tables) -> None:
        from . import compiled

        self._kernel, self._sliders = compiled, tables.sliders
        self.rows = compiled.block_rows(tables)
        options = tables.yields or None, tables.wears or None
        self._law: tuple[Any, ...] = (*compiled.pack(tables), *options)
        self._with: dict[tuple[bool, bool], tuple[Any, ...]] = {
            # True or None, for which the compiler leaves the code out; slip is made of the ledger
            (ledger, tangent): (*self._law, ledger or tables.wears or None, tangent or None)
            for ledger in (False, True)
            for tangent in (False, True)
        }
        self._energy = tables.curve.T.ravel().copy()
        self._all = np.empty(0, np.intp)
        self._none = np.empty((0, tables.dim, tables.dim))

    def advance(self, state: Array, step: Step, ledger: bool) -> None:
        """Take a step; `ledger` adds up the dissipated energy."""
        d, F, C, where, keep = step
        given = (state, d, F, self._none if C is None else C,
                 self._all if where is None else where, keep)  # fmt: skip
        self._run(self._kernel.advance, len(d), given, self._with[ledger, C is not None])

    def refresh(self, state: Array, n: int) -> None:
        """Bring Phi and Phi', kept beside the first n states, up to date with them."""
        self._run(self._kernel.refresh, n, (state,), self._law)

    def measures(self, state: Array, out: Array) -> None:
        """As `NumpyEngine.measures`."""
        given = (state, out)
        self._run(self._kernel.measures, out.shape[1], given, (*self._law, self._energy))

    def _run(self, call: Call, n: int, given: tuple[Any, ...], law: tuple[Any, ...]) -> None:
        """call(*given, first, last, *work, *law) over n joints, on one thread or several."""
        if n * self._sliders <= SERIAL or (threads := min(thread_count(), -(-n // LANES))) == 1:
            call(*given, 0, n, *self._work(), *law)
            return
        share = -(-n // (threads * LANES)) * LANES  # whole blocks, so threads change no result

        def part(k: int) -> None:
            call(*given, min(k * share, n), min((k + 1) * share, n), *self._work(), *law)

        share_out(part, threads)

    def _work(self) -> tuple[Any, ...]:
        """Working space of the thread that asks: one for all laws, as large as any has needed."""
        space: tuple[Any, ...] = _space.work
        if len(space) == 0 or len(space[0]) < self.rows:
            space = _space.work = self._kernel.new_work(self.rows)
        return space


class _Space(threading.local):
    work: tuple[Any, ...] = ()


_space = _Space()
