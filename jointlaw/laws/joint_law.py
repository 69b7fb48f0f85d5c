"""The law of a rough joint: parameters in, joints out."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..discretisation.facets import Facets, facets
from ..discretisation.first_loading_curve import FirstLoadingCurve, first_loading_curve
from ..discretisation.first_loading_response import FirstLoadingResponse, find_closure
from ..discretisation.tables import facet_tables, max_effective_closure
from ..kernels.asperities import AsperityElement
from ..kernels.bond import BondElement
from ..kernels.element import Element
from ..kernels.reference import LawTables
from ..parameters.asperity import Asperity
from ..parameters.bond import Bond
from ..parameters.declared import check, declared, parameter
from ..parameters.heights import KINDS, HeightDistribution, require_heights
from ..parameters.orientation import Orientation
from ..parameters.resolution import Resolution, named_resolutions, resolve
from ..support.checks import finite, more_than
from ..support.thresholds import UNDERFLOW
from .law import DEFAULT_STRESS, Law

if TYPE_CHECKING:
    from ..accuracy.tradeoff import Tradeoff

# In closure ranges: asperities of a smaller mating length are lower than the closure
MIN_MATING_LENGTH = 0.1


class JammingWarning(UserWarning):
    """Facets of a law are so steep that they jam, and a joint that opens may bear tension."""


@declared
@dataclass(frozen=True, kw_only=True)
class JointLaw(Law, kind="joint"):
    """A micromechanical, anisotropic, path-dependent law for a rough rock joint (Misra 1999).

    Raises ValueError when a parameter is out of bounds or the first-loading curve is not convex.

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
        "when all asperities touch at zero closure",
        "",
        None,
        kind=KINDS,
    )
    asperity_density: float = parameter(
        "N, asperities per area", "1/m2", above=0.0, fit=(1e-3, 1e18)
    )
    closure_range: float = parameter(
        "largest closure for which the cells are placed; beyond it the normal force stays exact. "
        "None: the closure at 20 MPa without yielding, with the orientations of "
        '"balanced" whatever the resolution',
        "m",
        None,
        above=0.0,
    )
    resolution: Resolution = parameter(
        '"fast", "balanced", "fine", "reference" or a `Resolution`. A name becomes the '
        "`Resolution` for the ratio of mating_length to closure_range (docs/accuracy.md); where "
        "`replace` changes these, give it the name again",
        "",
        "balanced",
        kind=Resolution,
    )
    plane: float | None = parameter(
        "None for motion in 3-D, or the azimuth of the one plane in which the joint moves: vectors "
        "then have two components, closure and shear along the plane. The traction across the "
        "plane, which is zero only for c = 0 or on a symmetry axis, is not computed",
        "rad",
        None,
    )
    closure_only: bool = parameter(
        "True for a joint that only opens and closes: vectors then have one component, the "
        "closure. Exact for any c, because all azimuths then have the same motion",
        "",
        False,
        kind=bool,
    )
    mating_length: float = parameter(
        "slip from the interlocked (mated) position over which dilation, and friction with it, "
        "decay; >= 0.1 closure_range. Infinite: dilation never ends",
        "m",
        math.inf,
        above=0.0,
        infinite=True,
        fit=(1e-12, 1e3),
    )
    slope_wear: float = parameter(
        "asperity degradation: work of shear that decreases slopes by a factor e; with a finite "
        "mating_length. Infinite: no degradation",
        "J/m2",
        math.inf,
        above=0.0,
        infinite=True,
        fit=(1e-6, 1e12),
    )
    slope_residual: float = parameter(
        "fraction of the slopes that never degrades",
        "",
        0.0,
        low=0.0,
        high=1.0,
        fit=(0.0, 1.0),
        log=False,
    )
    degradation_stress: float = parameter(
        "asperity degradation by stress: the largest contact stress so far, of the normal forces "
        "of the asperities, that halves the slopes; with a finite mating_length. Infinite: none",
        "Pa",
        math.inf,
        above=0.0,
        infinite=True,
        fit=(1e-3, 1e15),
    )
    bond: Bond | None = parameter(
        "cohesion and tensile strength in parallel with the asperities", "", None, kind=Bond
    )

    def __post_init__(self) -> None:
        set_value = object.__setattr__
        require_heights(self.heights)
        requested: str | Resolution = self.resolution
        set_value(self, "resolution", resolve(requested))
        check(self)
        if self.closure_only and self.plane is not None:
            raise ValueError(
                f"plane = {self.plane!r}: a joint with closure_only does not shear; leave plane out"
            )
        for name, unit in (("slope_wear", "J/m2"), ("degradation_stress", "Pa")):
            value = getattr(self, name)
            if value < math.inf and math.isinf(self.mating_length):
                raise ValueError(
                    f"{name} = {value!r} {unit} needs a finite mating_length (m): give it"
                )
        with np.errstate(all="ignore"):  # a result that is not finite is refused below
            if self.closure_range is None:
                set_value(self, "closure_range", self._default_closure_range())
            lengths = self.mating_length, self.asperity.yield_interference, self.closure_range
            set_value(self, "resolution", resolve(requested, *lengths))
            self._require_finite_forces(self.closure_range)  # and a convex first-loading curve
        shortest = MIN_MATING_LENGTH * self.closure_range
        if self.mating_length < shortest:
            raise ValueError(
                f"mating_length = {self.mating_length!r} m is out of bounds: it must be >= "
                f"{MIN_MATING_LENGTH} closure_range = {shortest:.4g} m, because shorter asperities "
                "are lower than the closure; raise it, or lower closure_range"
            )

        self._warn_if_it_jams()

    def _warn_if_it_jams(self) -> None:
        """Warn of facets so steep that the joint may bear tension after shear, without a bond."""
        friction_angle = math.degrees(math.atan(self.asperity.mu))
        steepest = 90.0 / self.orientation.a
        if self.closure_only or self.bond is not None or friction_angle + steepest <= 90.0:
            return
        warnings.warn(
            f"asperity.mu = {self.asperity.mu:g} with orientation.a = {self.orientation.a:g}: "
            f"atan(mu) + 90/a = {friction_angle + steepest:.4g} degrees is more than 90, so that "
            "sheared facets jam, and a joint that opens may bear tension without a bond "
            "(docs/limits.md). Lower mu or raise a unless this is intended",
            JammingWarning,
            stacklevel=4,
        )

    def contacts(self, closure: ArrayLike, direction: tuple[float, float] | None = None) -> Any:
        """Asperities in contact per m2 at this closure (m), Eq. 11.

        With `direction` = (theta, phi) in rad: per m2 and steradian in that direction, Eq. 16.
        Raises ValueError for numbers that are not finite.
        """
        y = finite("closure", closure, "m")
        fraction = np.where(y > 0, 1.0, 0.0)
        if self.heights is not None:
            fraction = np.asarray(self.heights.cdf(np.maximum(self.heights.overlap + y, 0.0)))
        density = 1.0 if direction is None else self.orientation.density(*direction)
        return (self.asperity_density * fraction * density)[()]

    def contact_fraction(self, closure: float) -> float:
        """As `Law.contact_fraction`, at a closure (m). Raises ValueError as `contacts` does."""
        if self.heights is None:
            return 0.0
        return float(self.contacts(closure) / self.asperity_density)

    def toml_values(self) -> Mapping[str, Any]:
        """As `Law.toml_values`: a resolution by its name, if it has one."""
        lengths = self.mating_length, self.asperity.yield_interference, self.closure_range
        names = {resolution: name for name, resolution in named_resolutions(*lengths).items()}
        return {"resolution": names.get(self.resolution, self.resolution)}

    def strength_reduced(self, factor: float) -> Self:
        """As `Law.strength_reduced`: K F^2 and lam/F^2 keep the normal stiffness.

        The peak of shear stress is divided by F within 1 % for F from 0.7 to 2. A subclass with
        elements of its own defines the method for them. Raises ValueError unless the factor is
        > 0, and NotImplementedError for such a subclass without the method.
        """
        factor = more_than("factor", factor, 0.0)
        elements = self.tables.elements
        is_complete = all(isinstance(one, AsperityElement | BondElement) for one in elements)
        if not is_complete and type(self).strength_reduced is JointLaw.strength_reduced:
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
        """Cost and accuracy of resolutions, measured for this law on this machine.

        resolutions: None for 42 of them and all with a name. joints: number of joints of the timed
        batch; 0 measures no times. seconds: for each timing. Errors are measured on the standard
        paths, relative to the largest traction of each path, and for the friction and dilation
        angle in slip, in degrees. Raises ValueError for an unknown resolution.
        """
        from ..accuracy.tradeoff import tradeoff  # loads scipy.interpolate, slow to import

        return tradeoff(self, resolutions, joints, seconds)

    def at_tolerance(self, tolerance: float, stress: tuple[float, float] | None = None) -> JointLaw:
        """This law at the resolution with the fewest sliders that has this accuracy.

        tolerance: largest error of the traction on a path, relative to the largest traction of the
        path, > 0: 0.01 is one per cent. It is met with a margin on the standard paths, on 128
        random paths, on 32 paths of open joints that their slopes press, sheared to seven closure
        ranges, and in slip to three mating lengths, or 30 closure ranges, where friction is
        mobilised (`jointlaw.accuracy.suite`).
        stress: smallest and largest normal stress (Pa, > 0) of the scene. The tolerance then holds
        on paths whose largest normal stress is within these bounds, and the returned law has the
        closure range of the larger one. Without `stress` it holds on paths that reach half of the
        normal stress at the law's closure range or more, by default 20 MPa: a slab of 1 m presses
        with 0.03 MPa, where errors are up to 17 times the tolerance (docs/accuracy.md).

        No time is measured, so the result is the same on every machine. It takes seconds to a
        minute, below a tolerance of 0.01 minutes, and longer without the compiled kernel. Small
        cycles need more cells (docs/limits.md). Raises ValueError where no resolution that was
        tried is accurate enough.
        """
        from ..accuracy.tolerance import at_tolerance

        return at_tolerance(self, tolerance, stress)

    # ---------------------------------------------------------------- tables

    @cached_property
    def curve(self) -> FirstLoadingCurve:
        """Tabulated first-loading curve of one asperity."""
        return first_loading_curve(self.asperity.eta, self.heights)

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
            degradation_stress=self.degradation_stress,
            lowest=self.resolution.lowest,
        )
        elements: list[Element] = [AsperityElement(asperities)]
        if self.bond is not None:
            elements.append(BondElement(self.bond))
        return LawTables(len(asperities.m), tuple(elements))

    def _default_closure_range(self) -> float:
        """Closure (m) at a normal stress of 20 MPa, from the elastic response of the asperities.

        Yielding is left out, because asperities that yield may not bear this stress at all; the
        resolution of the law has no influence. Raises ValueError for parameters whose forces
        overflow.
        """
        p = self.asperity
        r = resolve("balanced")  # whatever the law's resolution
        nodes = facets(self.orientation, r.u, r.phi, self.plane, self.closure_only)
        scale = nodes.scale(p, self.asperity_density)
        response = FirstLoadingResponse.of(self.curve, nodes.theta, scale, p)
        elastic = response._replace(plastic_correction=None)
        stress = np.array(DEFAULT_STRESS)
        try:
            return float(find_closure(elastic.stress, stress, elastic.max_search_closure))
        except ValueError:
            self._require_finite_forces(1.0)  # most often the units are wrong
            raise

    def _require_finite_forces(self, closure_range: float) -> None:
        """Refuse parameters whose forces overflow or underflow within the closure range."""
        p = self.asperity
        scale = self.facets.scale(p, self.asperity_density)
        largest = max_effective_closure(self.curve, scale, self.facets.theta, p)
        is_too_small = not float(np.max(scale)) * min(p.lam, 1.0) > UNDERFLOW
        if is_too_small or not largest >= closure_range:
            raise ValueError(
                f"asperity.K = {p.K:g}, lam = {p.lam:g}, eta = {p.eta:g}, mu = {p.mu:g} with "
                f"asperity_density = {self.asperity_density:g} per m2 give forces that are too "
                f"{'small' if is_too_small else 'large'} for floating point within closure_range = "
                f"{closure_range:g} m; check the units"
            )
