"""The law of a rough joint: parameters in, joints out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..discretisation.facets import Facets, facets
from ..discretisation.first_loading import FirstLoading, closure_at
from ..discretisation.tables import facet_tables, largest_reach
from ..discretisation.virgin_curve import VirginCurve, virgin_curve
from ..kernels.asperities import Asperities
from ..kernels.bond import Bonded
from ..kernels.reference import LawTables
from ..parameters.asperity import Asperity
from ..parameters.bond import Bond
from ..parameters.declared import check, declared, parameter
from ..parameters.heights import KINDS, HeightDistribution, require_heights
from ..parameters.orientation import Orientation
from ..parameters.resolution import NAMED, Resolution, named, resolve
from ..support.checks import finite, more_than
from ..support.thresholds import UNDERFLOW
from .law import DEFAULT_STRESS, Law

if TYPE_CHECKING:
    from ..accuracy.tradeoff import Tradeoff

SHORTEST = 0.1  # closure ranges: asperities of a smaller mating length are lower than the closure


@declared
@dataclass(frozen=True, kw_only=True)
class JointLaw(Law, kind="joint"):
    """A micromechanical, anisotropic, path-dependent law for a rough rock joint (Misra 1999).

    Raises ValueError when a parameter is out of bounds or the virgin curve is not convex.

    >>> asperity = jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3)
    >>> made = jl.JointLaw(orientation=jl.Orientation(a=3.0), asperity=asperity,
    ...                    asperity_density=1e10)
    """

    orientation: Orientation = parameter(
        "density of asperity inclinations and azimuths", kind=Orientation
    )
    asperity: Asperity = parameter("stiffness and friction of one asperity contact", kind=Asperity)
    heights: HeightDistribution | None = parameter(
        "distribution of asperity heights, `GammaHeights`, `Heights` or a class like them; None "
        "when all asperities touch at zero closure", "", None, kind=KINDS,
    )  # fmt: skip
    asperity_density: float = parameter(
        "N, asperities per area", "1/m2", above=0.0, fit=(1e-3, 1e18)
    )
    closure_range: float = parameter(
        "largest closure that the depth cells are placed for; beyond it the normal force stays "
        'exact. None takes the closure at 20 MPa without yielding, by the orientations of '
        '"balanced" whatever the resolution', "m", None, above=0.0,
    )  # fmt: skip
    resolution: Resolution = parameter(
        '"fast", "balanced", "fine", "reference" or a `Resolution`. A name becomes the '
        "`Resolution` that suits mating_length over closure_range (docs/accuracy.md); where "
        "`replace` changes these, give it the name again", "", "balanced", kind=Resolution,
    )  # fmt: skip
    plane: float | None = parameter(
        "None for motion in 3-D, or the azimuth of the one plane in which the joint moves: vectors "
        "then have two components, closure and shear along the plane. The traction across the "
        "plane, which is zero only for c = 0 or on a symmetry axis, is dropped", "rad", None,
    )  # fmt: skip
    closure_only: bool = parameter(
        "True for a joint that only opens and closes: vectors then have one component, the "
        "closure. Exact, whatever c, for all azimuths then share one motion", "", False, kind=bool,
    )  # fmt: skip
    mating_length: float = parameter(
        "distance from the mated position over which slopes fade, and dilation and friction with "
        "them, >= 0.1 closure_range. Infinite: dilation never ends", "m", math.inf,
        above=0.0, infinite=True, fit=(1e-12, 1e3),
    )  # fmt: skip
    slope_wear: float = parameter(
        "work of shear that wears slopes down by a factor e; with a finite mating_length. "
        "Infinite: no wear", "J/m2", math.inf, above=0.0, infinite=True, fit=(1e-6, 1e12),
    )  # fmt: skip
    slope_residual: float = parameter(
        "share of the slopes that never wears", "", 0.0, low=0.0, high=1.0, fit=(0.0, 1.0),
        log=False,
    )  # fmt: skip
    bond: Bond | None = parameter("cohesion and tension beside the asperities", "", None, kind=Bond)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        require_heights(self.heights)
        asked: str | Resolution = self.resolution
        set_(self, "resolution", resolve(asked))
        check(self)
        if self.closure_only and self.plane is not None:
            raise ValueError(
                f"plane = {self.plane!r}: a joint with closure_only does not shear; leave plane out"
            )
        if self.slope_wear < math.inf and math.isinf(self.mating_length):
            raise ValueError(
                f"slope_wear = {self.slope_wear!r} J/m2 needs a finite mating_length (m): give it"
            )
        with np.errstate(all="ignore"):  # a result that is not finite is refused below
            if self.closure_range is None:
                set_(self, "closure_range", self._default_range())
            lengths = self.mating_length, self.asperity.yield_interference, self.closure_range
            set_(self, "resolution", resolve(asked, *lengths))
            self._require_numbers(self.closure_range)  # and check the virgin curve
        if self.mating_length < SHORTEST * self.closure_range:
            raise ValueError(
                f"mating_length = {self.mating_length!r} m is out of bounds: it must be >= "
                f"{SHORTEST} closure_range = {SHORTEST * self.closure_range:.4g} m, for asperities "
                "as short as that are lower than the closure; raise it, or lower closure_range"
            )

    def contacts(self, closure: ArrayLike, direction: tuple[float, float] | None = None) -> Any:
        """Asperities in touch per m2 at this closure (m), Eq. 11.

        With `direction` = (theta, phi) in rad: per m2 and steradian in that direction, Eq. 16.
        Raises ValueError for numbers that are not finite.
        """
        y = finite("closure", closure, "m")
        share = np.where(y > 0, 1.0, 0.0)
        if self.heights is not None:
            share = np.asarray(self.heights.cdf(np.maximum(self.heights.overlap + y, 0.0)))
        density = 1.0 if direction is None else self.orientation.density(*direction)
        return (self.asperity_density * share * density)[()]

    def crushed(self, closure: float) -> float:
        """As `Law.crushed` at this closure (m). Raises nothing."""
        if self.heights is None:
            return 0.0
        return float(self.contacts(closure) / self.asperity_density)

    def shown(self) -> Mapping[str, Any]:
        """As `Law.shown`: a resolution by its name, if it has one."""
        lengths = self.mating_length, self.asperity.yield_interference, self.closure_range
        names = {resolution: name for name, resolution in named(*lengths).items()}
        return {"resolution": names.get(self.resolution, self.resolution)}

    def strength_reduced(self, factor: float) -> Self:
        """As `Law.strength_reduced`: K F^2 and lam/F^2 keep the normal stiffness.

        The peak of shear stress is divided by F within 1 % for F from 0.7 to 2. A subclass with
        elements of its own defines the method for them. Raises ValueError for a factor that is not
        > 0, and NotImplementedError for such a subclass that does not define it.
        """
        factor = more_than("factor", factor, 0.0)
        known = all(isinstance(one, Asperities | Bonded) for one in self.tables.elements)
        if not known and type(self).strength_reduced is JointLaw.strength_reduced:
            Law.strength_reduced(self, factor)
        bond = self.bond
        if bond is not None:
            energy = bond.energy_I and bond.energy_I / factor**2  # stays above the elastic energy
            bond = replace(
                bond,
                tension=bond.tension / factor,
                energy_I=energy,
                shear_stiffness=bond.shear_stiffness * factor**2,
            )
        p = self.asperity
        asperity = replace(p, K=p.K * factor**2, lam=p.lam / factor**2)
        return replace(self, bond=bond, asperity=asperity)

    # -------------------------------------------------------------- accuracy

    def tradeoff(
        self,
        resolutions: Sequence[str | Resolution] | None = None,
        joints: int = 10_000,
        seconds: float = 0.2,
    ) -> Tradeoff:
        """What resolutions cost and how accurate they are, measured for this law on this machine.

        resolutions: those to measure; None takes a spread of 42 and the named ones. joints: of the
        batch that is timed; 0 times nothing. seconds: spent on each timing. Errors are those of the
        standard paths, as shares of each path's largest traction, and of the friction and dilation
        angle under slip, in degrees. Raises ValueError for an unknown resolution.
        """
        from ..accuracy.tradeoff import tradeoff  # loads scipy.interpolate, slow to import

        return tradeoff(self, resolutions, joints, seconds)

    def at_tolerance(self, tolerance: float, stress: tuple[float, float] | None = None) -> JointLaw:
        """This law at the resolution with the fewest sliders that is this accurate.

        tolerance: largest error of the traction on a path, as a share of the path's largest
        traction, > 0: 0.01 is one per cent. Held with a margin on the standard paths and on 128
        random ones, and under slip to three mating lengths, or 30 closure ranges, where friction is
        mobilised (`jointlaw.accuracy.suite`).
        stress: smallest and largest normal stress (Pa, > 0) of the scene. The tolerance then holds
        on paths whose largest normal stress is either or between them, and the law returned has the
        closure range of the larger. Without it, it holds on paths that reach half of the normal
        stress of the law's closure range or more, which is 20 MPa by default: a slab of 1 m presses
        with 0.03 MPa, where errors are up to 17 times the tolerance (docs/accuracy.md).

        Nothing is timed, so the answer is the same on every machine. Takes seconds to a minute,
        below 0.01 minutes, without the compiled kernel more.
        Small cycles need more depth cells (docs/limits.md). Raises ValueError where no resolution
        tried is that accurate.
        """
        from ..accuracy.tolerance import at_tolerance

        return at_tolerance(self, tolerance, stress)

    # ---------------------------------------------------------------- tables

    @cached_property
    def curve(self) -> VirginCurve:
        """Tabulated virgin curve of one asperity."""
        return virgin_curve(self.asperity.eta, self.heights)

    @cached_property
    def facets(self) -> Facets:
        """Quadrature nodes of the orientation density."""
        r = self.resolution
        return facets(self.orientation, r.u, r.phi, self.plane, self.closure_only)

    @cached_property
    def tables(self) -> LawTables:
        """As `Law.tables`: the asperities, and the bond if there is one."""
        asperities = facet_tables(
            self.facets,
            self.curve,
            self.asperity,
            self.asperity_density,
            closure_range=self.closure_range,
            cells=self.resolution.depth,
            mating_length=self.mating_length,
            slope_wear=self.slope_wear,
            slope_residual=self.slope_residual,
            lowest=self.resolution.lowest,
        )
        beside = () if self.bond is None else (Bonded(self.bond),)
        return LawTables(len(asperities.m), (Asperities(asperities), *beside))

    def _default_range(self) -> float:
        """The closure (m) at 20 MPa of elastic asperities: those that yield may not bear it."""
        p, r = self.asperity, NAMED["balanced"]  # whatever the law's resolution
        fixed = facets(self.orientation, r.u, r.phi, self.plane, self.closure_only)
        scale = fixed.scale(p, self.asperity_density)
        elastic = FirstLoading.of(self.curve, fixed.theta, scale, p)._replace(yielding=None)
        try:
            return float(closure_at(elastic.stress, np.array(DEFAULT_STRESS), elastic.farthest))
        except ValueError:
            self._require_numbers(1.0)  # most often the units are wrong
            raise

    def _require_numbers(self, closure_range: float) -> None:
        """Refuse parameters whose forces, within the closure range, no float can hold."""
        p = self.asperity
        scale = self.facets.scale(p, self.asperity_density)
        reach = largest_reach(self.curve, scale, self.facets.theta, p)
        weak = not float(np.max(scale)) * min(p.lam, 1.0) > UNDERFLOW
        if weak or not reach >= closure_range:
            raise ValueError(
                f"asperity.K = {p.K:g}, lam = {p.lam:g}, eta = {p.eta:g}, mu = {p.mu:g} with "
                f"asperity_density = {self.asperity_density:g} per m2 give forces that are too "
                f"{'small' if weak else 'large'} for floating point within closure_range = "
                f"{closure_range:g} m; check the units"
            )
