"""The coarsest law that is accurate enough."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

from .._checks import above
from ..resolution import Resolution
from .suite import Suite, reference_resolution, scaled, standard_suite

if TYPE_CHECKING:
    from ..law import JointLaw

_U = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40)
_PHI = (3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32)
_DEPTH = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40)
_SHARES = (0.5, 0.75)  # of the reference, for the directions that are not being tried


def margin(tolerance: float) -> float:
    """How many times better than the tolerance the suite must be met, to keep it on other paths.

    The finer the tolerance, the more paths differ in what they ask of the nodes. Calibrated by
    `benchmarks/tolerance.py`: 1.5 at 5 %, 1.8 at 1 %, 2.4 at 0.1 %.
    """
    return float(1.5 * (0.05 / tolerance) ** 0.12)


def at_tolerance(law: JointLaw, tolerance: float) -> JointLaw:
    """See `JointLaw.at_tolerance`."""
    tolerance = above("tolerance", tolerance, 0.0)
    bound = tolerance / margin(tolerance)
    suite = standard_suite(law)
    best = reference_resolution(law)
    if _left_out(suite, 1.0) > bound / 2:  # the reference itself must be better than what it judges
        suite, best = standard_suite(law, 1.5), scaled(best, 1.5)

    def error(u: int, phi: int, depth: int) -> float:
        resolution = Resolution(u, phi, depth)
        return float(suite.errors(replace(law, resolution=resolution))[0].max())

    # What each direction needs by itself, the others being fine: a resolution with less of it can
    # meet the suite by luck alone, when errors of two directions cancel. Orientations, whose error
    # wavers as contacts slip and part one by one, must meet it with the next finer choice as well.
    share = next((s for s in _SHARES if _left_out(suite, s) < bound / 4), _SHARES[-1])
    rest = scaled(best, share)
    sure = bound * min(tolerance / 0.01, 1.0) ** 0.15
    needs = []
    for name, choices, limit, times in (("u", _U, sure, 2), ("phi", _PHI, sure, 2),
                                        ("depth", _DEPTH, bound, 1)):  # fmt: skip
        below = [n for n in choices if n <= getattr(best, name)]
        reached: list[float] = []
        for n in below:
            reached.append(error(*_with(rest, name, n)))
            if max(reached[-times:]) <= limit and len(reached) >= times:
                break
        else:
            raise _unreachable(law, tolerance, min(reached))
        needs.append(below[len(reached) - times :])
    closest = float("inf")
    for u, phi, depth in sorted(product(*needs), key=lambda r: (r[0] * r[1] * r[2], r)):
        closest = min(closest, found := error(u, phi, depth))
        if found <= bound:
            return replace(law, resolution=Resolution(u, phi, depth))
    raise _unreachable(law, tolerance, closest)


def _left_out(suite: Suite, share: float) -> float:
    """Error to expect of a share of the reference: second order, from that of two thirds of it."""
    order = float(suite.uncertainty.max()) / (1.5**2 - 1.0)
    return order if share == 1.0 else order * (share**-2 - 1.0)


def _with(r: Resolution, name: str, n: int) -> tuple[int, int, int]:
    r = replace(r, **{name: n})
    return r.u, r.phi, r.depth


def _unreachable(law: JointLaw, tolerance: float, reached: float) -> ValueError:
    needed = tolerance / margin(tolerance)
    return ValueError(
        f"tolerance = {tolerance:g} cannot be met for orientation.a = {law.orientation.a:g}: "
        f"{reached:.2g} was reached on the standard paths, where {needed:.2g} "
        "is needed to keep it on others; ask for less, or give a Resolution of your own"
    )
