"""The coarsest law that is accurate enough."""

import math
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

from ..parameters.resolution import Resolution
from ..support.checks import finite, more_than
from ..support.progress import track
from .slip import JointLaw
from .suite import Suite, reference_resolution, scaled, standard_suite

# How many times better than the tolerance: 30 random laws then kept it on all paths that were not
# tried, the worst at 0.88 of it (docs/measure/random_laws.py)
MARGIN = 1.75
EXCURSIONS = 128  # random paths beside the standard ones: what others ask shows in few of them
_LARGEST = 4  # times the sliders of the usual reference: the finest that is tried
_NODES = ("u", "phi", "depth")
_U = _DEPTH = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112)
_PHI = (3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32, 40, 48)
_APART = 3.0  # most, of two closure ranges between which a tolerance holds as it does at both
_MORE = 0.5  # of the cells of one range: added for each ten times that the lowest is smaller
_BELOW = 0.25  # of the lowest range is what cells are made for: most loads are below the largest
_SHARES = (0.5, 0.75)  # of the reference, for the directions that are not being tried


def at_tolerance(
    law: JointLaw, tolerance: float, stress: tuple[float, float] | None = None
) -> JointLaw:
    """See `JointLaw.at_tolerance`."""
    bound, lowest = more_than("tolerance", tolerance, 0.0) / MARGIN, 1.0
    if stress is not None:
        ends = finite("stress", stress, "Pa")
        if ends.shape != (2,) or not 0.0 < ends[0] <= ends[1]:
            raise ValueError(
                f"stress = {stress!r}: give the smallest and the largest normal stress of the "
                "scene in Pa, such as (3e4, 1e6), both > 0"
            )
        least, most = law.closure(ends).tolist()
        law, lowest = replace(law, closure_range=most), least / most
    found, reached = coarsest(law, bound, EXCURSIONS, lowest)
    if found is None:
        raise ValueError(
            f"tolerance = {tolerance:g} cannot be met for orientation.a = {law.orientation.a:g}: "
            f"{reached:.2g} was reached on the standard paths, where {bound:.2g} "
            "is needed to keep it on others; ask for less, or give a Resolution of your own"
        )
    return replace(law, resolution=found)


def coarsest(
    law: JointLaw, bound: float, excursions: int = 0, lowest: float = 1.0
) -> tuple[Resolution | None, float]:
    """The fewest sliders whose error on the suite is at most `bound`, and the least error reached.

    lowest: share of the closure range from which on suites of all ranges must be met. None where no
    resolution within the reference's meets it.
    """
    suites, best = _references(law, bound, excursions, lowest)
    if (left_out := _left_out(suites, 1.0)) > bound:
        return None, left_out

    @cache
    def error(r: Resolution) -> float:
        made = replace(law, resolution=r)
        return max(float(suite.miss(made).largest.max()) for suite in suites)

    # What each of u, phi and depth needs while the other two are fine: with less of it a resolution
    # meets the suite only by chance, where two errors cancel. The errors of u and phi rise and fall
    # as contacts slip and part one by one: so the next finer choice must meet the suite too, unless
    # there are as many as in the reference.
    rest = scaled(best, next((s for s in _SHARES if _left_out(suites, s) < bound / 3), 1.0))
    needs = []
    for name, choices, times in (("u", _U, 2), ("phi", _PHI, 2), ("depth", _DEPTH, 1)):
        most = getattr(best, name)
        tried = [n for n in choices if n < most] + [most]
        alone: list[float] = []
        for n in track(tried, f"nodes of {name}", len(tried)):
            alone.append(error(replace(rest, **{name: n})))
            if len(alone) >= times and max(alone[-times:]) <= bound:
                break
        meets = next((k for k in range(len(alone)) if max(alone[k:]) <= bound), None)
        if meets is None:
            return None, min(alone)
        needs.append(tried[meets:])  # finer ones too, for errors add up
    several = [replace(best, u=u, phi=phi, depth=depth) for u, phi, depth in product(*needs)]
    for r in sorted(several, key=lambda r: (r.sliders, r.u, r.phi)):
        if error(r) <= bound:
            return r, error(r)
    return None, min(map(error, several))


def _references(
    law: JointLaw, bound: float, excursions: int, lowest: float
) -> tuple[list[Suite], Resolution]:
    """Suites of closure ranges down to the `lowest`, and the finest resolution for all of them."""
    steps = 1 + math.ceil(math.log(1.0 / lowest, _APART))
    ranges = (law.closure_range * np.geomspace(1.0, lowest, steps)).tolist()
    known = [_reference(replace(law, closure_range=R), bound, excursions) for R in ranges]
    u, phi, depth = (max(getattr(r, name) for _, r in known) for name in _NODES)
    depth = round(depth * (1.0 - _MORE * math.log10(lowest)))
    spread = float(f"{_BELOW * lowest:.2g}") if lowest < 1.0 else 1.0
    return [suite for suite, _ in known], Resolution(u, phi, depth, spread)


def _reference(law: JointLaw, bound: float, excursions: int) -> tuple[Suite, Resolution]:
    """The suite with a reference that errs by half of `bound` at most, or the finest, and which."""
    best = finer = reference_resolution(law)
    most = _LARGEST * best.sliders
    while finer.sliders <= most:
        best = finer
        suite = standard_suite(law, best, excursions)
        if _left_out([suite], 1.0) <= bound / 2:
            break
        # 1.5 times the nodes in the direction that errs most with two thirds of them
        fewer, more = ({n: getattr(scaled(best, by), n) for n in _NODES} for by in (2 / 3, 1.5))
        lost = {n: suite.miss(replace(law, resolution=replace(best, **{n: fewer[n]}))).largest.max()
                for n in _NODES}  # fmt: skip
        worst = max(lost, key=lost.__getitem__)
        finer = replace(best, **{worst: more[worst]})
    return suite, best


def _left_out(suites: list[Suite], share: float) -> float:
    """Error to expect of a share of the reference: second order, from that of two thirds of it."""
    order = max(float(suite.uncertainty.max()) for suite in suites) / (1.5**2 - 1.0)
    return order if share == 1.0 else order * (share**-2 - 1.0)
