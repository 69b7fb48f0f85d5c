"""The joint law: parameters in, joints out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .discretisation.facets import Facets, facets
from .discretisation.first_loading import FirstLoading, facet_sum, yield_sum
from .discretisation.tables import VERSION, Tables, largest_reach, tables
from .discretisation.virgin_curve import VirginCurve, virgin_curve
from .joints.batch import JointBatch
from .joints.joint import Joint
from .joints.seat import seat
from .joints.time_step import largest_stiffness, stable_step
from .kernels.bond import hold
from .kernels.engine import step_states
from .kernels.unmated import unmated_start
from .parameters import keys, toml
from .parameters.asperity import Asperity
from .parameters.bond import Bond
from .parameters.fingerprint import fingerprint
from .parameters.heights import GammaHeights, HeightDistribution, Heights
from .parameters.orientation import Orientation
from .parameters.resolution import NAMED, Resolution, resolve
from .support.checks import Array, finite, more_than, number
from .support.files import replace_file
from .support.thresholds import UNDERFLOW

if TYPE_CHECKING:
    from .accuracy.tradeoff import Tradeoff

DEFAULT_STRESS = 20e6  # Pa; its closure is the default closure_range
SHORTEST = 0.1  # closure ranges: asperities of a smaller mating length are lower than the closure
FARTHEST = 1e150  # mating lengths of slip: beyond it squares of the distance overflow


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
        normal force stays exact. None takes the closure at 20 MPa without yielding, by the
        orientations of "balanced" whatever the resolution.
    resolution: "fast", "balanced", "fine", "reference" or a `Resolution`. A name becomes the
        `Resolution` that suits mating_length over closure_range (docs/accuracy.md); where
        `replace` changes these, give it the name again.
    plane: None for motion in 3-D, or the azimuth (rad) of the one plane in which the joint moves:
        vectors then have two components, closure and shear along the plane. The traction across
        the plane, which is zero only for c = 0 or on a symmetry axis, is dropped.
    closure_only: True for a joint that only opens and closes: vectors then have one component, the
        closure. Exact, whatever c, for all azimuths then share one motion.
    mating_length: distance (m) from the mated position over which slopes fade, and dilation and
        friction with them, >= 0.1 closure_range. Infinite by default: dilation never ends.
    slope_wear: work of friction (J/m2) that wears slopes down by a factor e, > 0; with a finite
        mating_length. Infinite (no wear) by default.
    slope_residual: share of the slopes that never wears, 0 to 1.
    bond: cohesion and tension beside the asperities, or None for a joint without.

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
    mating_length: float = math.inf
    slope_wear: float = math.inf
    slope_residual: float = 0.0
    bond: Bond | None = None

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        for name, kind in (("orientation", Orientation), ("asperity", Asperity)):
            if not isinstance(value := getattr(self, name), kind):
                raise ValueError(f"{name} = {value!r} must be of type {kind.__name__}")
        if not isinstance(self.heights, GammaHeights | Heights | None):
            raise ValueError(
                f"heights = {self.heights!r} must be GammaHeights, Heights or None; a histogram in "
                "Heights stands for any other distribution"
            )
        if not isinstance(self.bond, Bond | None):
            raise ValueError(f"bond = {self.bond!r} must be of type Bond, or None")
        set_(self, "asperity_density", more_than("asperity_density", self.asperity_density, 0.0))
        asked: str | Resolution = self.resolution
        set_(self, "resolution", resolve(asked))
        if self.plane is not None:
            set_(self, "plane", number("plane", self.plane))
        if not isinstance(self.closure_only, bool):
            raise ValueError(f"closure_only = {self.closure_only!r} must be True or False")
        if self.closure_only and self.plane is not None:
            raise ValueError(
                f"plane = {self.plane!r}: a joint with closure_only does not shear; leave plane out"
            )
        for name in ("mating_length", "slope_wear"):
            set_(self, name, more_than(name, getattr(self, name), 0.0, infinite=True))
        set_(self, "slope_residual", number("slope_residual", self.slope_residual))
        if not 0.0 <= self.slope_residual <= 1.0:
            raise ValueError(
                f"slope_residual = {self.slope_residual!r} is out of bounds: it is a share, 0 to 1"
            )
        if self.slope_wear < math.inf and math.isinf(self.mating_length):
            raise ValueError(
                f"slope_wear = {self.slope_wear!r} J/m2 needs a finite mating_length (m): give it"
            )
        with np.errstate(all="ignore"):  # a result that is not finite is refused below
            if self.closure_range is None:
                set_(self, "closure_range", self._default_range())
            set_(self, "closure_range", more_than("closure_range", self.closure_range, 0.0))
            lengths = self.mating_length, self.asperity.yield_interference, self.closure_range
            set_(self, "resolution", resolve(asked, *lengths))
            self._require_numbers(self.closure_range)  # and check the virgin curve
        if self.mating_length < SHORTEST * self.closure_range:
            raise ValueError(
                f"mating_length = {self.mating_length!r} m is out of bounds: it must be >= "
                f"{SHORTEST} closure_range = {SHORTEST * self.closure_range:.4g} m, for asperities "
                "as short as that are lower than the closure; raise it, or lower closure_range"
            )

    # ----------------------------------------------------------------- joints

    def joint(self, normal_stress: float = 0.0, mated: bool = True) -> Joint:
        """One joint of this law, unsheared, closed to this normal stress (Pa, >= 0).

        The stress is met to rounding: where asperities yield, by the joint's own cells. Its closure
        then differs a little from `closure(normal_stress)`, that of many cells. Without `mated`
        its faces have never met: it starts at first touch, 100 mating lengths from the mated
        position along axis 2 (`unmated_start`). Raises ValueError as `closure` does, for an unmated
        joint with an infinite mating length, and for one that is to be closed already.
        """
        return Joint(self, self.joints(1, normal_stress=normal_stress, mated=mated))

    def joints(
        self,
        n: int,
        ledger: bool = True,
        normal_stress: ArrayLike = 0.0,
        mated: bool | NDArray[np.bool_] = True,
    ) -> JointBatch:
        """A batch of n joints of this law, advanced together; they start as `joint` does.

        normal_stress: one for all or (n,), in Pa; mated: for all or (n,). Without `ledger`
        dissipated energy is not added up, which is faster.
        """
        batch = JointBatch(self, n, ledger)
        if not np.all(mated):
            if np.any(normal_stress):
                raise ValueError(
                    f"normal_stress = {normal_stress!r} with mated=False: an unmated joint starts "
                    "at first touch; close it by update, or by a laboratory test such as "
                    "direct_shear"
                )
            far = ~np.asarray(mated, bool)
            if far.shape not in ((), (n,)):
                raise ValueError(f"mated has shape {far.shape}: give one truth or ({n},)")
            batch.reset(np.flatnonzero(np.broadcast_to(far, n)), mated=False)
        if np.any(normal_stress):
            seat(batch, normal_stress)
        return batch

    def step(
        self, states: ArrayLike, d: ArrayLike, tangent: bool = True
    ) -> tuple[Array, Array, Array | None]:
        """One step as a pure function, for a host that keeps the states itself.

        states: (n, state_size), or (state_size,) for one joint; zeros are the virgin state.
        d: displacement increments in m, (n, dim) or (dim,).
        Returns the new states, F in Pa (n, dim) or (dim,), and C in Pa/m (n, dim, dim) or
        (dim, dim), None without `tangent`; what was given stays as it was. The algorithm and its
        equations: `jointlaw.kernels.reference.step`; it runs compiled, on all threads. Raises
        ValueError for a wrong shape or a number that is not finite.
        """
        old, move = finite("states", states, "numbers of state"), finite("d", d, "m")
        rows, dim, joints = self.state_size, self.dim, old.shape[:-1]
        if old.ndim not in (1, 2) or old.shape[-1] != rows or move.shape != (*joints, dim):
            raise ValueError(
                f"states have shape {old.shape} and d {move.shape}; expected (n, {rows}) and "
                f"(n, {dim}), or ({rows},) and ({dim},) for one joint"
            )
        new, F, C = step_states(self.tables, old.reshape(-1, rows), move.reshape(-1, dim), tangent)
        C = None if C is None else C.reshape(*joints, dim, dim)
        return new.reshape(*joints, rows), F.reshape(*joints, dim), C

    @property
    def dim(self) -> int:
        """Components of a displacement: 3, or 2 with a plane, or 1 with closure_only."""
        return self.tables.dim

    @property
    def unmated_start(self) -> Array:
        """`delta` (dim,) in m of a joint whose faces have never met, at first touch.

        Closure is counted from the mated position, where the highest asperities face the deepest
        hollows: this one is negative. Raises ValueError for an infinite mating length.
        """
        return unmated_start(self.tables)

    @property
    def state_size(self) -> int:
        """Numbers of state of one joint, as `step` takes them and a snapshot holds them."""
        return self.tables.rows

    # ----------------------------------------------------- virgin closure curve

    def normal_stress(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) of a joint closed from zero to `closure` (m), unsheared.

        With a yield_interference that of the first loading, of infinitely many depth cells: a
        joint's own few slip a little later. A bond makes it negative where the joint opens.
        """
        y = self._within_reach(closure)
        stress = self._first_loading.stress(y)
        if self.bond is not None:
            opening = hold(self.bond, y.reshape(1, -1), np.zeros(y.size))
            stress = stress + opening.F.reshape(y.shape)
        return stress[()]

    def closure(self, normal_stress: ArrayLike) -> Any:
        """Closure (m) at which the normal stress (Pa, >= 0) is reached: inverse of the above.

        Raises ValueError for a stress that yielding asperities never reach.
        """
        stress = finite("normal_stress", normal_stress, "Pa")
        if not (stress >= 0).all():
            raise ValueError(f"normal_stress = {normal_stress!r} is out of bounds: it must be >= 0")
        return self._first_loading.closure(stress)[()]

    def contacts(self, closure: ArrayLike, direction: tuple[float, float] | None = None) -> Any:
        """Asperities in touch per m2 at this closure (m), Eq. 11.

        With `direction` = (theta, phi) in rad: per m2 and steradian in that direction, Eq. 16.
        """
        y = finite("closure", closure, "m")
        share = np.where(y > 0, 1.0, 0.0)
        if self.heights is not None:
            share = np.asarray(self.heights.cdf(np.maximum(self.heights.overlap + y, 0.0)))
        density = 1.0 if direction is None else self.orientation.density(*direction)
        return (self.asperity_density * share * density)[()]

    # ------------------------------------------------- stiffness and time step

    def max_stiffness(self, closure: ArrayLike, shear: ArrayLike = 0.0) -> Any:
        """Upper bound of `|C|` (Pa/m) up to this closure (m) and this shear displacement (m, >= 0).

        The shear is the largest distance from the mated position, in any direction. Yielded and
        worn joints, and those of a broken bond, are less stiff.
        """
        y, way = self._within_reach(closure), finite("shear", shear, "m")
        if not (way >= 0).all():
            raise ValueError(f"shear = {shear!r} m is out of bounds: it must be >= 0")
        climbed = way / np.hypot(1.0, way / self.mating_length)
        rise = climbed[..., None] * np.linalg.norm(self.tables.m[1:], axis=0)
        self._within_reach(y + np.max(rise, axis=-1))
        bond = 0.0 if self.bond is None else self.bond.largest_stiffness
        return (largest_stiffness(self.tables, y, rise) + bond)[()]

    def critical_time_step(
        self, mass: ArrayLike, area: ArrayLike, closure: ArrayLike, shear: ArrayLike = 0.0
    ) -> Any:
        """Largest stable explicit step (s) of one translating mass on one joint.

        mass: reduced mass m1 m2/(m1 + m2) in kg; area: of the joint in m2; closure: the largest
        reached, in m; shear: the largest shear displacement reached, in m, in any direction;
        numbers or arrays of one shape. 2 sqrt(m/(K area)), infinite where nothing touches; a block
        code adds rotation. Shear presses one side of the asperities together: a step for closure
        alone is several times too long for a joint that was sheared far at constant closure.
        `JointBatch.critical_time_step` takes joints as they are now.

        Safe to 0.95 in lasting contact, and where friction takes from every impact. Impacts that
        lose nothing need 0.2 or less: they last but 2/share steps (docs/limits.md).
        """
        if not (finite("closure", closure, "m") >= 0).all():
            raise ValueError(f"closure = {closure!r} m is out of bounds: it must be >= 0")
        return stable_step(mass, area, self.max_stiffness(closure, shear))[()]

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
        angle under slip, in degrees.
        """
        from .accuracy.tradeoff import tradeoff  # loads scipy.interpolate, slow to import

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
        from .accuracy.tolerance import at_tolerance

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
    def tables(self) -> Tables:
        """Tables that the kernels read."""
        r = self.resolution
        return tables(
            self.facets, self.curve, self.asperity, self.asperity_density,
            self.closure_range, r.depth, self.mating_length, self.slope_wear, self.slope_residual,
            self.bond, r.lowest,
        )  # fmt: skip

    @cached_property
    def largest_reach(self) -> float:
        """Effective closure (m) up to which forces, energies and their squares stay finite."""
        reach = largest_reach(self.curve, self._scale, self.facets.theta, self.asperity)
        return min(reach, FARTHEST * self.mating_length)

    @cached_property
    def fingerprint(self) -> str:
        """Version of the discretisation, and a hash of the parameters that differ from default.

        States fit only joints of the law that wrote them.
        """
        return f"{VERSION}:{fingerprint(self)}"

    @cached_property
    def _scale(self) -> Array:
        """A of every facet (M,)."""
        return self.facets.scale(self.asperity, self.asperity_density)

    @cached_property
    def _first_loading(self) -> FirstLoading:
        """Closure without shear."""
        p, theta = self.asperity, self.facets.theta
        factor = facet_sum(theta, self._scale, p.lam, p.mu)
        return FirstLoading(self.curve, factor, yield_sum(theta, self._scale, p))

    def _default_range(self) -> float:
        """The closure (m) at 20 MPa of elastic asperities: those that yield may not bear it."""
        p, r = self.asperity, NAMED["balanced"]  # whatever the law's resolution
        fixed = facets(self.orientation, r.u, r.phi, self.plane, self.closure_only)
        elastic = facet_sum(fixed.theta, fixed.scale(p, self.asperity_density), p.lam, p.mu)
        try:
            return float(FirstLoading(self.curve, elastic).closure(np.array(DEFAULT_STRESS)))
        except ValueError:
            self._require_numbers(1.0)  # most often the units are wrong
            raise

    def _require_numbers(self, closure_range: float) -> None:
        """Refuse parameters whose forces, within the closure range, no float can hold."""
        p = self.asperity
        weak = not float(np.max(self._scale)) * min(p.lam, 1.0) > UNDERFLOW
        if weak or not self.largest_reach >= closure_range:
            raise ValueError(
                f"asperity.K = {p.K:g}, lam = {p.lam:g}, eta = {p.eta:g}, mu = {p.mu:g} with "
                f"asperity_density = {self.asperity_density:g} per m2 give forces that are too "
                f"{'small' if weak else 'large'} for floating point within closure_range = "
                f"{closure_range:g} m; check the units"
            )

    def _within_reach(self, closure: ArrayLike) -> Array:
        """Closures (m) that are finite and whose forces are."""
        y = finite("closure", closure, "m")
        if (y > self.largest_reach).any():
            raise ValueError(
                f"closure = {float(y.max())!r} m is out of bounds: it must be <= largest_reach = "
                f"{self.largest_reach:g} m, beyond which squares of forces overflow"
            )
        return y

    # ----------------------------------------------------------------- files

    def to_toml(self, path: str | Path | None = None) -> str:
        """The law as TOML text, also written to `path` if given (histograms then as CSV beside)."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        text = toml.law_text(values)
        if path is not None:
            replace_file(Path(path), text.encode())
        return text

    @classmethod
    def from_toml(cls, path: str | Path) -> JointLaw:
        """A law from a TOML file; the keys are the parameters above."""
        if "\n" in str(path):
            raise ValueError(
                "this is TOML text, not the path of a law file: use JointLaw.from_text"
            )
        return cls.from_dict(keys.read(Path(path), "law file"), str(path))

    @classmethod
    def from_text(cls, text: str) -> JointLaw:
        """A law from TOML text, as `to_toml` returns it."""
        return cls.from_dict(keys.parse(text, "TOML text"), "TOML text")

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str = "law") -> JointLaw:
        """A law from the mapping that such a file holds; `where` is named in error messages."""
        return toml.build_law(cls, data, where)

    def __getstate__(self) -> dict[str, Any]:
        names = {one.name for one in fields(self)}  # cached values are computed again when needed
        return {name: value for name, value in self.__dict__.items() if name in names}
