"""Tables of facets: everything that a kernel reads of the asperities of a law."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..parameters.asperity import Asperity
from ..support.checks import Array, read_only
from .facets import Facets
from .first_loading_curve import FirstLoadingCurve
from .nodes import UNUSED, cell_limits

VERSION = 3  # of the discretisation: increase it with a change of nodes or states
_MAX_NUMBER = 1e140  # Pa and J/m2: squares of larger numbers overflow


@dataclass(frozen=True, eq=False)
class FacetTables(Facets):
    """Tables of M facets with D cells for the interlocked position, physical axes first.

    m (dim, M): maps closure and offset to the effective closure y of a facet. azimuth (2, M): unit
    vector of its azimuth. tan_theta (M,): its slope. c1 (M,): cos(theta). area (M,): A = N w lam K
    c1^(1+eta). cell_depth (M, D + 1): cell limits zeta in m; cell_force and cell_slope: Phi and
    Phi' there, the slope at the first limit 0 by definition. A facet with fewer cells has its
    limits first; cells that begin at UNUSED stay empty. yield_depth (M,): yield interference along
    y, infinite if asperities do not yield. opposite (M,): the facet that shares the plastic
    indentation, the facet itself if none does.
    """

    curve: FirstLoadingCurve
    asperity: Asperity
    m: Array
    azimuth: Array
    tan_theta: Array
    c1: Array
    area: Array
    cell_depth: Array
    cell_force: Array
    cell_slope: Array
    mating_length: float
    yield_depth: Array
    slope_wear: float
    slope_residual: float
    degradation_stress: float

    def __post_init__(self) -> None:
        read_only(tuple(vars(self).values()))

    @property
    def lam(self) -> float:
        """Normal over shear stiffness of an asperity."""
        return self.asperity.lam

    @property
    def mu(self) -> float:
        """Friction coefficient of an asperity."""
        return self.asperity.mu

    @property
    def yields(self) -> bool:
        """Whether asperities are elastic-perfectly plastic."""
        return bool(self.yield_depth[0] < math.inf)

    @property
    def interlock_decays(self) -> bool:
        """Whether the interlock decays with slip, over the mating length."""
        return self.mating_length < math.inf

    @property
    def degrades(self) -> bool:
        """Whether asperities degrade by the work of shear."""
        return self.slope_wear < math.inf

    @property
    def degrades_by_stress(self) -> bool:
        """Whether asperities degrade by the contact stress."""
        return self.degradation_stress < math.inf

    @property
    def slopes_change(self) -> bool:
        """Whether asperities degrade, by work or by stress: then a state holds the lost slopes."""
        return self.degrades or self.degrades_by_stress

    @property
    def dim(self) -> int:
        """Components of a displacement: 3, 2 in one plane, 1 for closure alone."""
        return len(self.m)

    @property
    def cells(self) -> int:
        """Largest number of cells of a facet."""
        return int(self.cell_depth.shape[1]) - 1

    @property
    def sliders(self) -> int:
        """Number of sliders per joint: one for each cell of each facet."""
        return int(np.count_nonzero(self.cell_depth[:, :-1] < UNUSED))


def facet_tables(
    facets: Facets,
    curve: FirstLoadingCurve,
    asperity: Asperity,
    asperity_density: float,
    closure_range: float,
    cells: int,
    mating_length: float,
    slope_wear: float,
    slope_residual: float,
    degradation_stress: float,
    lowest: float,
) -> FacetTables:
    """Tables of these facets, with the parameters of a law.

    cells: number of cells of the facet of largest weight; every facet has one if the curve is
    linear.
    """
    c1 = np.cos(facets.theta)
    slope = np.tan(facets.theta)
    fraction = np.zeros_like(facets.cell_fraction) if curve.is_linear else facets.cell_fraction
    cell_counts = np.maximum(np.rint(cells * fraction), 1).astype(np.intp)
    cell_depth = cell_limits(curve, closure_range, slope, cell_counts, lowest)
    cell_force, cell_slope = _curve_at_limits(curve, cell_depth)
    # if slopes change, both sides of an asperity must have one plastic indentation, or energy is
    # created; if not, each side has its own
    if math.isinf(mating_length):
        facets = replace(facets, opposite=np.arange(len(c1)))
    return FacetTables(
        **vars(facets),
        curve=curve,
        asperity=asperity,
        m=facets.n / c1,
        azimuth=np.stack([np.cos(facets.phi), np.sin(facets.phi)]),
        tan_theta=slope,
        c1=c1,
        area=facets.scale(asperity, asperity_density),
        cell_depth=cell_depth,
        cell_force=cell_force,
        cell_slope=cell_slope,
        mating_length=mating_length,
        yield_depth=asperity.yield_interference / c1,
        slope_wear=slope_wear,
        slope_residual=slope_residual,
        degradation_stress=degradation_stress,
    )


def _curve_at_limits(curve: FirstLoadingCurve, cell_depth: Array) -> tuple[Array, Array]:
    """Force and slope of the first-loading curve at the depth limits of cells, (M, D + 1) each.

    Limits of unused cells stay at their marker. Slopes never decrease with depth, and the slope at
    the upper side of depth zero counts as part of the first cell.
    """
    is_used = cell_depth < UNUSED
    force, slope = curve.force(np.where(is_used, cell_depth, 0.0))
    force = np.where(is_used, force, cell_depth)
    slope = np.where(is_used, slope, cell_depth)
    slope[:, 0] = 0.0  # a spring that engages at zero (eta = 0) belongs to the first cell
    return force, np.maximum.accumulate(slope, axis=1)  # increasing, but for rounding


def max_effective_closure(
    curve: FirstLoadingCurve, scale: Array, theta: Array, asperity: Asperity
) -> float:
    """Effective closure (m) up to which forces, energies and their squares stay finite.

    scale, theta: A and inclination of every facet (M,).
    """
    p = asperity
    y = 10.0 ** np.arange(-300.0, 101.0)
    stiffest = float(np.max(scale / np.cos(theta))) * max(p.lam, 1 / p.lam, 1.0) * (1.0 + p.mu)
    with np.errstate(over="ignore", invalid="ignore"):
        force, slope = curve.force(y)
        largest = stiffest * (force + y * slope) + float(np.max(scale)) * curve.energy(y)
    overflows = ~(largest < _MAX_NUMBER)
    if overflows[0]:
        return 0.0
    return float(y[int(np.argmax(overflows)) - 1]) if overflows.any() else float(y[-1])
