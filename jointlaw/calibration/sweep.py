"""Many fits at once, through any executor: a process pool here, dask beyond one machine."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial
from typing import Any

from numpy.typing import ArrayLike

from ..support.progress import track
from .calibrate import fit_closure
from .fit import Fit


def fit_many(
    curves: Sequence[tuple[ArrayLike, ArrayLike]],
    executor: Executor | None = None,
    workers: int | None = None,
    **options: Any,
) -> list[Fit]:
    """Fit many closure curves; the results stand in the order of the curves.

    Parameters
    ----------
    curves: pairs (stress in Pa, closure in m), each as `fit_closure` takes them.
    executor: any `concurrent.futures.Executor`, left open; None makes a process pool of `workers`
        (as many as there are cores by default). For more than one machine:
        `dask.distributed.Client(address).get_executor()`, extra `sweep`.
    options: keywords of `fit_closure`.

    Raises what `fit_closure` raises for the first curve that cannot be fitted. A fit does not
    depend on where it runs: every executor gives the same numbers.
    """
    if executor is None:
        with ProcessPoolExecutor(workers) as pool:
            return fit_many(curves, pool, **options)
    job = partial(_fit, options=options)
    futures = [executor.submit(job, curve) for curve in curves]
    return [future.result() for future in track(futures, "fits", len(futures))]


def _fit(curve: tuple[ArrayLike, ArrayLike], options: dict[str, Any]) -> Fit:
    return fit_closure(*curve, **options)
