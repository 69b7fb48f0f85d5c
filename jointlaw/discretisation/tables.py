"""The tables of facets: all that a kernel reads of the asperities of a law."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..parameters.asperity import Asperity
from ..support.checks import Array, read_only
from .facets import Facets
from .nodes import UNUSED, depth_nodes
from .virgin_curve import VirginCurve

VERSION = 3  # of the discretisation: a change of nodes or state changes it, old states are refused
_OVERFLOW = 1e140  # Pa and J/m2: squares beyond it overflow


@dataclass(frozen=True, eq=False)
class FacetTables(Facets):
    """Everything per facet (M facets, D depth cells), physical axes first, of the mated joint.

    `m` (dim, M) maps closure and offset to the effective closure y of a facet, `azimuth` (2, M) is
    the unit vector of the facet's azimuth and `steep` (M,) its tan(theta),
    `area` is A = N w lam K c1^(1+eta),
    `depth` (M, D+1) the cell limits zeta with the virgin force and slope there (slope 0 at the
    first by definition).
    A facet of fewer cells has its limits first; cells that begin at UNUSED stay empty.
    `yield_depth` (M,) is the yield interference along y, infinite if asperities do not yield;
    `opposite` (M,) names the facet that shares its flattened depth, each itself if none does.
    """

    curve: VirginCurve
    asperity: Asperity
    m: Array
    azimuth: Array
    steep: Array
    c1: Array
    area: Array
    depth: Array
    depth_force: Array
    depth_slope: Array
    mating_length: float
    yield_depth: Array
    slope_wear: float
    slope_residual: float

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
        """Whether asperities yield."""
        return bool(self.yield_depth[0] < math.inf)

    @property
    def fades(self) -> bool:
        """Whether slopes fade with the distance from the mated position."""
        return self.mating_length < math.inf

    @property
    def wears(self) -> bool:
        """Whether slopes wear by the work of friction."""
        return self.slope_wear < math.inf

    @property
    def dim(self) -> int:
        """Components of a displacement: 3, 2 in one plane, 1 for closure alone."""
        return len(self.m)

    @property
    def cells(self) -> int:
        """Depth cells of the facet that has most of them."""
        return int(self.depth.shape[1]) - 1

    @property
    def sliders(self) -> int:
        """Sliders per joint: one for each cell of each facet."""
        return int(np.count_nonzero(self.depth[:, :-1] < UNUSED))


def facet_tables(
    facets: Facets,
    curve: VirginCurve,
    asperity: Asperity,
    asperity_density: float,
    closure_range: float,
    cells: int,
    mating_length: float,
    slope_wear: float,
    slope_residual: float,
    lowest: float,
) -> FacetTables:
    """Lay out the tables; `cells` for the facet of most weight, one where the curve is linear."""
    c1, slope = np.cos(facets.theta), np.tan(facets.theta)
    share = np.zeros_like(facets.share) if curve.linear else facets.share
    several = np.maximum(np.rint(cells * share), 1).astype(np.intp)
    depth = depth_nodes(curve, closure_range, slope, several, lowest)
    force, bend = _at_limits(curve, depth)
    # slopes that change need one flattened depth for both sides of an asperity, else it creates
    # energy; with others each side has its own
    if math.isinf(mating_length):
        facets = replace(facets, opposite=np.arange(len(c1)))
    return FacetTables(
        **vars(facets),
        curve=curve,
        asperity=asperity,
        m=facets.n / c1,
        azimuth=np.stack([np.cos(facets.phi), np.sin(facets.phi)]),
        steep=slope,
        c1=c1,
        area=facets.scale(asperity, asperity_density),
        depth=depth,
        depth_force=force,
        depth_slope=bend,
        mating_length=mating_length,
        yield_depth=asperity.yield_interference / c1,
        slope_wear=slope_wear,
        slope_residual=slope_residual,
    )


def _at_limits(curve: VirginCurve, depth: Array) -> tuple[Array, Array]:
    """Virgin force and slope at the cell limits (M, D + 1)."""
    force, slope = curve.force(np.where(depth < UNUSED, depth, 0.0))
    force = np.where(depth < UNUSED, force, depth)
    slope = np.where(depth < UNUSED, slope, depth)
    slope[:, 0] = 0.0  # a spring that touches at once (eta = 0) belongs to the first cell
    return force, np.maximum.accumulate(slope, axis=1)  # it rises, but for rounding


def largest_reach(curve: VirginCurve, scale: Array, theta: Array, asperity: Asperity) -> float:
    """Effective closure (m) up to which forces, energies and their squares stay finite.

    scale, theta: A and inclination of every facet (M,).
    """
    y, p = 10.0 ** np.arange(-300.0, 101.0), asperity
    stiffest = float(np.max(scale / np.cos(theta))) * max(p.lam, 1 / p.lam, 1.0) * (1.0 + p.mu)
    with np.errstate(over="ignore", invalid="ignore"):
        force, slope = curve.force(y)
        worst = stiffest * (force + y * slope) + float(np.max(scale)) * curve.energy(y)
    bad = ~(worst < _OVERFLOW)
    if bad[0]:
        return 0.0
    return float(y[int(np.argmax(bad)) - 1]) if bad.any() else float(y[-1])
