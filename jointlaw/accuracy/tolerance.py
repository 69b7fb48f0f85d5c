"""The coarsest law that is accurate enough."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

from .._checks import above
from ..resolution import Resolution
from .suite import Suite, coarser, reference_resolution, standard_suite

if TYPE_CHECKING:
    from ..law import JointLaw

# The suite must be met with this much to spare: with it, `benchmarks/tolerance.py` finds the
# tolerance kept on other paths
MARGIN = 1.25
_SHARES = (0.25, 0.5, 1.0)  # of the reference, for the directions that are not being tried
_U = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28)
_PHI = (3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24)
_DEPTH = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28)


def at_tolerance(law: JointLaw, tolerance: float) -> JointLaw:
    """See `JointLaw.at_tolerance`."""
    tolerance = above("tolerance", tolerance, 0.0)
    suite = standard_suite(law)
    best = reference_resolution(law)
    bound = tolerance / MARGIN

    def error(u: int, phi: int, depth: int) -> float:
        resolution = Resolution(u, phi, depth)
        return float(suite.errors(replace(law, resolution=resolution))[0].max())

    # What each direction needs by itself, the others being fine: a resolution with less of it can
    # meet the suite by luck alone, when errors of two directions cancel
    rest = coarser(best, next(s for s in _SHARES if _left_out(suite, s) < bound / 4 or s == 1.0))
    needs = []
    for name, choices in (("u", _U), ("phi", _PHI), ("depth", _DEPTH)):
        reached = []
        for n in (n for n in choices if n <= getattr(best, name)):
            reached.append(error(*_with(rest, name, n)))
            if reached[-1] <= bound:
                break
        else:
            raise _unreachable(law, tolerance, min(reached))
        needs.append([m for m in choices if n <= m <= getattr(best, name)])
    closest = float("inf")
    for u, phi, depth in sorted(product(*needs), key=lambda r: (r[0] * r[1] * r[2], r)):
        closest = min(closest, found := error(u, phi, depth))
        if found <= bound:
            return replace(law, resolution=Resolution(u, phi, depth))
    raise _unreachable(law, tolerance, closest)


def _left_out(suite: Suite, share: float) -> float:
    """Error to expect of a share of the reference: second order, from that of two thirds."""
    return float(suite.uncertainty.max()) * (share**-2 - 1.0) / (1.5**2 - 1.0)


def _with(r: Resolution, name: str, n: int) -> tuple[int, int, int]:
    r = replace(r, **{name: n})
    return r.u, r.phi, r.depth


def _unreachable(law: JointLaw, tolerance: float, reached: float) -> ValueError:
    return ValueError(
        f"tolerance = {tolerance:g} cannot be met: the finest resolution tried reaches "
        f"{MARGIN * reached:.2g} with orientation.a = {law.orientation.a:g}; ask for "
        f"{1.1 * MARGIN * reached:.2g} or more, or give a Resolution of your own"
    )
