"""Where a fit of closure and shear together starts: each kind of curve first by itself."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..support.checks import Array
from .measured import ShearCurve
from .problem import Problem, minimise

OF_CLOSURE = ("alpha", "beta", "overlap", "asperity_density", "K", "yield_interference")
# Critical slips to try, as shares of the longest way sheared: far from the measured one the misfit
# is flat, and no descent comes back
SLIPS = (0.5, 0.15, 0.05, 0.015)


def staged(problem: Problem, starts: list[Array]) -> list[Array]:
    """One start near the best fit of closure and shear curves, for fits that have shear curves.

    The closure curves place what acts on them, then the shear curves the rest. Kept as they are are
    starts for closure alone, and a single start without a critical slip to find.
    """
    shears = tuple(curve for curve in problem.curves if isinstance(curve, ShearCurve))
    finds_slip = "critical_slip" in problem.free
    if not shears or (len(starts) == 1 and not finds_slip):
        return starts
    values, rest = [problem.unpack(x) for x in starts], problem.free
    if closures := tuple(curve for _, curve in problem.closures):
        mine = tuple(n for n in rest if n in OF_CLOSURE or n.startswith("seating"))
        rest = tuple(n for n in rest if n not in mine)
        if mine:
            values = [_best(replace(problem, curves=closures, free=mine), values)]
    if finds_slip:
        span = max(float(np.ptp(curve.shear)) for curve in shears)
        values = [v | {"critical_slip": share * span} for v in values for share in SLIPS]
    if rest:
        values = [_best(replace(problem, curves=shears, free=rest, values=values[0]), values)]
    return [problem.pack_scaled(values[0])]


def _best(problem: Problem, starts: Sequence[dict[str, float]]) -> dict[str, float]:
    """The values of least misfit that are found from these, at the noise that is expected."""
    residuals = partial(
        problem.residuals, sigma=problem.sigma([curve.expected for curve in problem.curves])
    )
    fits = [minimise(residuals, problem.pack(v), *problem.bounds()) for v in starts]
    return problem.unpack(min(fits, key=lambda fit: float(fit.cost)).x)
