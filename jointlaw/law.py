"""The joint law: frozen parameters, and the tables that every joint of the law shares."""

from __future__ import annotations

import hashlib
import math
import sys
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .discretisation import nodes
from .discretisation.virgin_curve import Curve, virgin_curve
from .parameters import toml as _toml
from .parameters.asperity import Asperity
from .parameters.heights import GammaHeights, HeightDistribution, Heights
from .parameters.orientation import Facets, Orientation
from .parameters.resolution import Resolution, resolve
from .support.checks import Array, above, at_least, finite, frozen, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .accuracy.tradeoff import Tradeoff
    from .joints.batch import JointBatch
    from .joints.joint import Joint
    from .kernels.engine import Engine

_SMALLEST, _LARGEST = sys.float_info.min, sys.float_info.max
NOTHING = 1e-140  # m, and Pa/m: counts as zero, for powers and squares below it underflow
DEFAULT_STRESS = 20e6  # Pa; its closure is the default closure_range


class Tables(NamedTuple):
    """What a kernel reads: everything per facet (M facets, D depth cells), physical axes first.

    `m` (dim, M) maps closure and in-plane offset to the effective closure y of a facet, `s`, `t`
    (dim, M) are the in-facet directions, `area` is A = N w lam K c1^(1+eta), `depth` (M, D+1) the
    cell limits zeta with the virgin force and slope there (slope 0 at the first by definition).
    """

    curve: Curve
    n: Array
    m: Array
    s: Array
    t: Array
    c1: Array
    area: Array
    weight: Array
    depth: Array
    depth_force: Array
    depth_slope: Array
    lam: float
    mu: float
    critical_slip: float

    @property
    def dim(self) -> int:
        """Components of a displacement: 3, or 2 in one plane."""
        return len(self.m)

    @property
    def cells(self) -> int:
        """Depth cells per facet."""
        return int(self.depth.shape[1]) - 1

    @property
    def sliders(self) -> int:
        """Sliders per joint: one for each cell of each facet."""
        return len(self.c1) * self.cells

    @property
    def rows(self) -> int:
        """State numbers per joint: delta, offset, dissipated energy, and q of every slider."""
        return 2 * self.dim + 2 * self.sliders


@dataclass(frozen=True, kw_only=True)
class JointLaw:
    """A micromechanical, anisotropic, path-dependent law for a rough rock joint (Misra 1999).

    Parameters
    ----------
    orientation: density of asperity inclinations and azimuths.
    asperity: stiffness and friction of one asperity contact.
    heights: distribution of asperity heights, or None when all asperities touch at zero closure.
    asperity_density: N, asperities per m2, > 0.
    closure_range: largest closure (m) that the depth cells are placed for, > 0; beyond it the
        normal force stays exact. None takes the closure at 20 MPa.
    resolution: "fast", "balanced", "fine", "reference" or a `Resolution`.
    plane: None for motion in 3-D, or the azimuth (rad) of the one plane in which the joint moves:
        vectors then have two components, closure and shear along the plane. The traction across
        the plane, which is zero only for c = 0 or on a symmetry axis, is dropped.
    closure_only: True for a joint that only opens and closes: vectors then have one component, the
        closure. Exact, whatever c, for all azimuths then share one motion.
    critical_slip: D_c (m), > 0: sliding that renews the asperity contacts, so that friction and
        dilation settle. Infinite (off) by default.

    Raises ValueError when a parameter is out of bounds or the virgin curve is not convex.
    """

    orientation: Orientation
    asperity: Asperity
    heights: HeightDistribution | None = None
    asperity_density: float
    closure_range: float = field(default=None)  # type: ignore[assignment]
    resolution: Resolution = field(default="balanced")  # type: ignore[assignment]
    plane: float | None = None
    closure_only: bool = False
    critical_slip: float = math.inf

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        for name, kind in (("orientation", Orientation), ("asperity", Asperity)):
            if not isinstance(value := getattr(self, name), kind):
                raise ValueError(f"{name} = {value!r} must be of type {kind.__name__}")
        if not (self.heights is None or isinstance(self.heights, (GammaHeights, Heights))):
            raise ValueError(f"heights = {self.heights!r} must be GammaHeights, Heights or None")
        set_(self, "asperity_density", above("asperity_density", self.asperity_density, 0.0))
        set_(self, "resolution", resolve(self.resolution))
        if self.plane is not None:
            set_(self, "plane", number("plane", self.plane))
        if not isinstance(self.closure_only, bool):
            raise ValueError(f"closure_only = {self.closure_only!r} must be True or False")
        if self.closure_only and self.plane is not None:
            raise ValueError(
                f"plane = {self.plane!r}: a joint with closure_only does not shear; leave plane out"
            )
        set_(self, "critical_slip", above("critical_slip", self.critical_slip, 0.0, infinite=True))
        if self.critical_slip < NOTHING:
            raise ValueError(
                f"critical_slip = {self.critical_slip!r} m is out of bounds: it must be >= "
                f"{NOTHING:g}"
            )
        with np.errstate(all="ignore"):  # what is no number in the end is refused
            if self.closure_range is None:
                set_(self, "closure_range", 1.0)
                try:
                    set_(self, "closure_range", float(self.closure(DEFAULT_STRESS)))
                except ValueError:
                    self._require_numbers()  # the likely reason
                    raise
                for cached in ("tables", "_closure_factor"):
                    self.__dict__.pop(cached, None)
            set_(self, "closure_range", above("closure_range", self.closure_range, 0.0))
            self._require_numbers()  # and with it that the virgin curve is valid

    # ----------------------------------------------------------------- joints

    def joint(self) -> Joint:
        """One joint of this law, unloaded."""
        from .joints.joint import Joint

        return Joint(self)

    def joints(self, n: int, ledger: bool = True) -> JointBatch:
        """A batch of n unloaded joints of this law, advanced together.

        Without `ledger` dissipated energy is not added up, which is faster.
        """
        from .joints.batch import JointBatch

        return JointBatch(self, n, ledger)

    # ----------------------------------------------------- virgin closure curve

    def normal_stress(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) of a joint closed from zero to `closure` (m), unsheared."""
        return self._stress(self._within_reach(closure))[()]

    def closure(self, normal_stress: ArrayLike) -> Any:
        """Closure (m) at which the normal stress (Pa, >= 0) is reached: inverse of the above."""
        stress = finite("normal_stress", normal_stress, "Pa")
        if not (stress >= 0).all():
            raise ValueError(f"normal_stress = {normal_stress!r} is out of bounds: it must be >= 0")
        result = np.array([self._closure_at(float(value)) for value in stress.ravel()])
        return result.reshape(stress.shape)[()]

    def contacts(self, closure: ArrayLike, direction: tuple[float, float] | None = None) -> Any:
        """Asperities in touch per m2 at this closure (m), Eq. 11.

        With `direction` = (theta, phi) in rad: per m2 and steradian in that direction, Eq. 16.
        """
        y = finite("closure", closure, "m")
        if self.heights is None:
            share: Any = np.where(y > 0, 1.0, 0.0)
        else:
            share = np.asarray(self.heights.cdf(np.maximum(self.heights.overlap + y, 0.0)))
        density = 1.0 if direction is None else self.orientation.density(*direction)
        return (self.asperity_density * share * density)[()]

    # ------------------------------------------------- stiffness and time step

    def max_stiffness(self, closure: ArrayLike) -> Any:
        """Upper bound of `|C|` (Pa/m) while no facet's effective closure exceeds `closure` (m)."""
        k, p = self.tables, self.asperity
        _, slope = k.curve.force(self._within_reach(closure))
        per_facet = float(np.sum(k.area / k.c1))
        return ((max(1.0, 1.0 / p.lam) + p.mu) * per_facet * slope)[()]

    def critical_time_step(self, mass: float, area: float, closure: float) -> float:
        """Largest stable explicit step (s) of one translating mass on one joint.

        mass: reduced mass m1 m2/(m1 + m2) in kg; area: of the joint in m2; closure: the largest
        reached, in m. 2 sqrt(m/(K area)); a block code adds rotation.

        Safe to 0.95 in lasting contact, and where friction takes from every impact. Impacts that
        lose nothing need 0.2 or less: they last but 2/share steps (docs/sharp-bits.md).
        """
        mass, area = above("mass", mass, 0.0), above("area", area, 0.0)
        closure = at_least("closure", closure, 0.0)
        stiffness = float(self.max_stiffness(closure))
        return 2 * math.sqrt(mass / (stiffness * area)) if stiffness > 0 else math.inf

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
        standard paths within the closure range, as shares of each path's largest traction.
        """
        from .accuracy.tradeoff import tradeoff

        return tradeoff(self, resolutions, joints, seconds)

    def at_tolerance(self, tolerance: float) -> JointLaw:
        """This law at the resolution with the fewest sliders that is this accurate.

        tolerance: largest error of the traction on a path, as a share of the path's largest
        traction, > 0: 0.01 is one per cent. Held with a margin on the standard paths and on 128
        random ones within the law's closure range (`jointlaw.accuracy.suite`); nothing is timed, so
        the answer is the same on every machine. Takes seconds, at 0.001 minutes for steep
        facets, without the compiled kernel more. Raises ValueError where no resolution tried is
        that accurate.
        """
        from .accuracy.tolerance import at_tolerance

        return at_tolerance(self, tolerance)

    # ---------------------------------------------------------------- tables

    @cached_property
    def curve(self) -> Curve:
        """Tabulated virgin curve of one asperity."""
        return virgin_curve(self.asperity.eta, self.heights)

    @cached_property
    def facets(self) -> Facets:
        """Quadrature nodes of the orientation density."""
        r = self.resolution
        return self.orientation.facets(r.u, r.phi, self.plane, self.closure_only)

    @cached_property
    def tables(self) -> Tables:
        """Tables that the kernels read."""
        f, p = self.facets, self.asperity
        c1 = np.cos(f.theta)
        area = self.asperity_density * f.weight * p.lam * p.K * c1 ** (1 + p.eta)
        one_spring = p.eta == 0 and self.heights is None  # touches at once: all in the first cell
        slope, cells = np.tan(f.theta), 1 if one_spring else self.resolution.depth
        depth = nodes.depth_nodes(self.curve, self.closure_range, slope, cells)
        force, slope = self.curve.force(np.where(np.isfinite(depth), depth, 0.0))
        force[:, -1] = slope[:, -1] = np.inf
        slope[:, 0] = 0.0  # a spring that touches at once (eta = 0) belongs to the first cell
        slope = np.maximum.accumulate(slope, axis=1)  # but for the rounding of the table it rises
        return frozen(Tables(
            self.curve, f.n, f.n / c1, f.s, f.t, c1, area, f.weight, depth, force, slope,
            p.lam, p.mu, self.critical_slip,
        ))  # fmt: skip

    @cached_property
    def engines(self) -> dict[str, Engine]:
        """Kernels that advance this law's joints, by name; `engine.engine` fills it."""
        return {}

    @cached_property
    def largest_reach(self) -> float:
        """Effective closure (m) up to which forces, energies and their squares stay finite."""
        k, p = self.tables, self.asperity
        y = 10.0 ** np.arange(-300.0, 101.0)
        stiffest = float(np.max(k.area / k.c1)) * max(p.lam, 1 / p.lam, 1.0) * (1.0 + p.mu)
        with np.errstate(over="ignore", invalid="ignore"):
            force, slope = self.curve.force(y)
            worst = stiffest * (force + y * slope) + float(np.max(k.area)) * self.curve.energy(y)
        bad = ~(worst < 1e140)
        if bad[0]:
            return 0.0
        return float(y[int(np.argmax(bad)) - 1]) if bad.any() else float(y[-1])

    @cached_property
    def fingerprint(self) -> str:
        """Hash of all parameters: states fit only joints of the law that wrote them."""
        return hashlib.sha256(self.to_toml().encode()).hexdigest()

    def _require_numbers(self) -> None:
        """Refuse parameters whose forces, within the closure range, no float can hold."""
        weak = not float(np.max(self.tables.area)) * min(self.asperity.lam, 1.0) > NOTHING
        if weak or not self.largest_reach >= self.closure_range:
            p = self.asperity
            raise ValueError(
                f"asperity.K = {p.K:g}, lam = {p.lam:g}, eta = {p.eta:g}, mu = {p.mu:g} with "
                f"asperity_density = {self.asperity_density:g} per m2 give forces that are too "
                f"{'small' if weak else 'large'} for floating point within closure_range = "
                f"{self.closure_range:g} m; check the units"
            )

    @cached_property
    def _closure_factor(self) -> float:
        """F1/Phi under pure closure."""
        k = self.tables
        return facet_sum(self.facets.theta, k.area, k.lam, k.mu)

    def _within_reach(self, closure: ArrayLike) -> Array:
        """Closures (m) that are finite and whose forces are."""
        y = finite("closure", closure, "m")
        if (y > self.largest_reach).any():
            raise ValueError(
                f"closure = {float(y.max())!r} m is out of bounds: it must be <= largest_reach = "
                f"{self.largest_reach:g} m, beyond which squares of forces overflow"
            )
        return y

    def _stress(self, closure: Array) -> Array:
        """Normal stress (Pa) at closures (m), infinite where it overflows."""
        stress: Array = self._closure_factor * self.curve.force(closure)[0]
        return stress

    def _closure_at(self, stress: float) -> float:
        from scipy.optimize import brentq  # a third of the package's import time

        if stress < _SMALLEST:
            return 0.0

        def misfit(log_y: float) -> float:  # finite where the force is zero or overflows
            force = float(self._stress(np.array(math.exp(log_y))))
            return math.log(min(max(force, _SMALLEST), _LARGEST)) - math.log(stress)

        low = high = math.log(self.closure_range)
        with np.errstate(over="ignore"):
            while misfit(high) < 0.0:
                high += 1.0
                if high > 700.0:
                    raise ValueError(f"normal_stress = {stress!r} Pa is beyond any closure")
            while misfit(low) > 0.0:
                low -= 1.0
            if low == high:
                return self.closure_range
            return math.exp(brentq(misfit, low, high, xtol=1e-15, rtol=1e-15, maxiter=500))

    # ----------------------------------------------------------------- files

    def to_toml(self, path: str | Path | None = None) -> str:
        """The law as TOML text, also written to `path` if given (histograms then as CSV beside)."""
        return _toml.write_law(self, None if path is None else Path(path))

    @classmethod
    def from_toml(cls, source: str | Path) -> JointLaw:
        """A law from a TOML file or from TOML text; the keys are the parameters above."""
        return _toml.read_law(cls, source)

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str = "law") -> JointLaw:
        """A law from the mapping that such a file holds; `where` is named in error messages."""
        return _toml.build_law(cls, data, where)

    def __getstate__(self) -> dict[str, Any]:
        names = self.__dataclass_fields__
        return {name: value for name, value in self.__dict__.items() if name in names}


def facet_sum(theta: Array, area: Array, lam: float, mu: float) -> float:
    """Sum of area (cos theta + sin theta min(tan theta/lam, mu)): facets under pure closure."""
    shear = np.minimum(np.tan(theta) / lam, mu)
    return float(np.sum(area * (np.cos(theta) + np.sin(theta) * shear)))
