"""The coarsest law that is accurate enough."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

from .._checks import above
from .._progress import track
from ..resolution import Resolution
from .suite import Suite, reference_resolution, scaled, standard_suite

if TYPE_CHECKING:
    from ..law import JointLaw

MARGIN = 1.5  # how many times better than the tolerance, calibrated by `benchmarks/tolerance.py`
EXCURSIONS = 128  # random paths beside the standard ones: what others ask shows in few of them
_FINER = (1.0, 1.5, 2.0)  # times the reference
_U = _DEPTH = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48)
_PHI = (3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32)
_SHARES = (0.5, 0.75)  # of the reference, for the directions that are not being tried


def at_tolerance(law: JointLaw, tolerance: float) -> JointLaw:
    """See `JointLaw.at_tolerance`."""
    bound = above("tolerance", tolerance, 0.0) / MARGIN
    found, reached = coarsest(law, bound, EXCURSIONS)
    if found is None:
        raise ValueError(
            f"tolerance = {tolerance:g} cannot be met for orientation.a = {law.orientation.a:g}: "
            f"{reached:.2g} was reached on the standard paths, where {bound:.2g} "
            "is needed to keep it on others; ask for less, or give a Resolution of your own"
        )
    return replace(law, resolution=found)


def coarsest(law: JointLaw, bound: float, excursions: int = 0) -> tuple[Resolution | None, float]:
    """The fewest sliders whose error on the suite is at most `bound`, and the least error reached.

    None where no resolution within the reference's meets it.
    """
    for finer in _FINER:
        suite = standard_suite(law, finer, excursions)
        best = scaled(reference_resolution(law), finer)
        if _left_out(suite, 1.0) <= bound / 2:  # the reference must be better than what it judges
            break
    if (left_out := _left_out(suite, 1.0)) > bound:
        return None, left_out
    known: dict[Resolution, float] = {}

    def error(r: Resolution) -> float:
        if r not in known:
            known[r] = float(suite.errors(replace(law, resolution=r))[0].max())
        return known[r]

    # What each direction needs by itself, the others being fine: a resolution with less of it can
    # meet the suite by luck alone, when errors of two directions cancel. Orientations, whose error
    # wavers as contacts slip and part one by one, must meet it with the next finer choice as well.
    share = next((s for s in _SHARES if _left_out(suite, s) < bound / 4), _SHARES[-1])
    rest = scaled(best, share)
    needs = []
    for name, choices, times in (("u", _U, 2), ("phi", _PHI, 2), ("depth", _DEPTH, 1)):
        below = [n for n in choices if n <= getattr(best, name)]
        alone: list[float] = []
        closest = float("inf")
        for n in track(below, f"nodes of {name}", len(below)):
            alone.append(error(replace(rest, **{name: n})))
            if len(alone) >= times:
                closest = min(closest, max(alone[-times:]))
            if closest <= bound:
                break
        else:
            return None, closest
        needs.append(below[len(alone) - times :])  # finer ones too, for errors add up
    tried = [Resolution(*nodes) for nodes in product(*needs)]
    for r in sorted(tried, key=lambda r: (r.sliders, r.u, r.phi)):
        if error(r) <= bound:
            return r, error(r)
    return None, min(map(error, tried))


def _left_out(suite: Suite, share: float) -> float:
    """Error to expect of a share of the reference: second order, from that of two thirds of it."""
    order = float(suite.uncertainty.max()) / (1.5**2 - 1.0)
    return order if share == 1.0 else order * (share**-2 - 1.0)
