"""The law with the fewest sliders whose errors stay within a tolerance."""

import math
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

from ..parameters.resolution import Resolution
from ..support.checks import finite, more_than
from ..support.progress import track
from .slip import JointLaw
from .suite import Suite, reference_resolution, scale_resolution, standard_suite

# Tolerance over the error allowed on the suite: with this margin 30 random laws met the tolerance
# on all paths outside the suite, with 0.88 of it at most (docs/measure/random_laws.py)
SAFETY_MARGIN = 1.75
EXCURSIONS = 128  # random paths of the suite: the largest errors occur on few of them
DILATED = 32  # random paths of joints that are open and pressed by their slopes
_MAX_REFERENCE_SLIDERS = 4  # over the sliders of the usual reference
_DIRECTIONS = ("u", "phi", "depth")
_U = _DEPTH = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112)
_PHI = (3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32, 40, 48)
_MAX_RANGE_RATIO = 3.0  # of closure ranges between which the tolerance of both holds
_CELLS_PER_DECADE = 0.5  # of the cells of one range, added for each decade of smaller ranges
_LOWEST_CELL = 0.25  # of the smallest range: most loads on a path are below its largest
_FINE_FRACTIONS = (0.5, 0.75)  # of the reference, for the directions that are not varied


def at_tolerance(
    law: JointLaw, tolerance: float, stress: tuple[float, float] | None = None
) -> JointLaw:
    """See `JointLaw.at_tolerance`."""
    bound = more_than("tolerance", tolerance, 0.0) / SAFETY_MARGIN
    lowest = 1.0
    if stress is not None:
        limits = finite("stress", stress, "Pa")
        if limits.shape != (2,) or not 0.0 < limits[0] <= limits[1]:
            raise ValueError(
                f"stress = {stress!r}: give the smallest and the largest normal stress of the "
                "scene in Pa, such as (3e4, 1e6), both > 0"
            )
        min_closure, max_closure = law.closure(limits).tolist()
        law = replace(law, closure_range=max_closure)
        lowest = min_closure / max_closure
    resolution, error = find_coarsest_resolution(law, bound, EXCURSIONS, lowest, DILATED)
    if resolution is None:
        raise ValueError(
            f"tolerance = {tolerance:g} cannot be met for orientation.a = {law.orientation.a:g}: "
            f"the smallest error on the standard paths is {error:.2g}, but {bound:.2g} is needed "
            "to meet it on other paths; use a larger tolerance, or give a Resolution of your own"
        )
    return replace(law, resolution=resolution)


def find_coarsest_resolution(
    law: JointLaw, bound: float, excursions: int = 0, lowest: float = 1.0, dilated: int = 0
) -> tuple[Resolution | None, float]:
    """The resolution with the fewest sliders whose error on the suite is at most `bound`.

    excursions, dilated: numbers of random and of dilated paths of the suite.
    lowest: smallest closure range over the law's; the bound holds on suites of all ranges between.

    Returns the resolution and its error; or None and the smallest error, if no resolution up to the
    reference meets the bound.
    """
    suites, best = _make_references(law, bound, (excursions, dilated), lowest)
    if (reference_error := _expected_error(suites, 1.0)) > bound:
        return None, reference_error

    @cache
    def error(r: Resolution) -> float:
        coarse = replace(law, resolution=r)
        return max(float(suite.errors(coarse).traction.max()) for suite in suites)

    # First find the nodes that each of u, phi and depth needs while the other two are fine: with
    # fewer nodes a resolution meets the bound only by chance, where two errors cancel. The errors
    # of u and phi rise and fall as contacts slip and separate one by one: so the next finer choice
    # must meet the bound too, unless there are as many nodes as in the reference.
    fraction = next((f for f in _FINE_FRACTIONS if _expected_error(suites, f) < bound / 3), 1.0)
    fine = scale_resolution(best, fraction)
    candidates = []
    for name, choices, confirmations in (("u", _U, 2), ("phi", _PHI, 2), ("depth", _DEPTH, 1)):
        largest = getattr(best, name)
        counts = [n for n in choices if n < largest] + [largest]
        errors: list[float] = []
        for n in track(counts, f"nodes of {name}", len(counts)):
            errors.append(error(replace(fine, **{name: n})))
            if len(errors) >= confirmations and max(errors[-confirmations:]) <= bound:
                break
        first = next((k for k in range(len(errors)) if max(errors[k:]) <= bound), None)
        if first is None:
            return None, min(errors)
        candidates.append(counts[first:])  # finer ones too, for errors add up
    resolutions = [
        replace(best, u=u, phi=phi, depth=depth) for u, phi, depth in product(*candidates)
    ]
    for r in sorted(resolutions, key=lambda r: (r.sliders, r.u, r.phi)):
        if error(r) <= bound:
            return r, error(r)
    return None, min(map(error, resolutions))


def _make_references(
    law: JointLaw, bound: float, paths: tuple[int, int], lowest: float
) -> tuple[list[Suite], Resolution]:
    """Suites of closure ranges down to `lowest`, and the finest resolution for all of them."""
    count = 1 + math.ceil(math.log(1.0 / lowest, _MAX_RANGE_RATIO))
    ranges = (law.closure_range * np.geomspace(1.0, lowest, count)).tolist()
    references = [
        _make_reference(replace(law, closure_range=closure_range), bound, paths)
        for closure_range in ranges
    ]
    u, phi, depth = (max(getattr(r, name) for _, r in references) for name in _DIRECTIONS)
    depth = round(depth * (1.0 - _CELLS_PER_DECADE * math.log10(lowest)))
    lowest_cell = float(f"{_LOWEST_CELL * lowest:.2g}") if lowest < 1.0 else 1.0
    return [suite for suite, _ in references], Resolution(u, phi, depth, lowest_cell)


def _make_reference(
    law: JointLaw, bound: float, paths: tuple[int, int]
) -> tuple[Suite, Resolution]:
    """Reference suite of a law, and its resolution.

    paths: numbers of random and of dilated paths.
    The resolution is refined, in the direction (u, phi or depth) that matters most, by 1.5 times at
    a time, until its own error is at most half of `bound`, or until it would have too many sliders;
    then the error may be larger.
    """
    best = finer = reference_resolution(law)
    max_sliders = _MAX_REFERENCE_SLIDERS * best.sliders
    while finer.sliders <= max_sliders:
        best = finer
        suite = standard_suite(law, best, *paths)
        if _expected_error([suite], 1.0) <= bound / 2:
            break
        # 1.5 times the nodes in the direction with the largest error at two thirds of its nodes
        fewer = {name: getattr(scale_resolution(best, 2 / 3), name) for name in _DIRECTIONS}
        more = {name: getattr(scale_resolution(best, 1.5), name) for name in _DIRECTIONS}
        errors = {}
        for name in _DIRECTIONS:
            coarse = replace(law, resolution=replace(best, **{name: fewer[name]}))
            errors[name] = suite.errors(coarse).traction.max()
        worst = max(errors, key=errors.__getitem__)
        finer = replace(best, **{worst: more[worst]})
    return suite, best


def _expected_error(suites: list[Suite], fraction: float) -> float:
    """Expected error with this fraction of the reference's nodes, from second-order convergence.

    The difference from the solution with two thirds of the nodes gives the constant.
    """
    constant = max(float(suite.uncertainty.max()) for suite in suites) / (1.5**2 - 1.0)
    return constant if fraction == 1.0 else constant * (fraction**-2 - 1.0)
