"""The forward model: from parameter values to a law and its closure curve, and from a law back."""

import math
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy import optimize, special

from ..discretisation.facets import facets
from ..discretisation.first_loading_curve import exact_force
from ..discretisation.first_loading_response import (
    DegradingFacets,
    correct_for_yielding,
    sum_facets,
)
from ..laws.joint_law import MIN_MATING_LENGTH, JointLaw
from ..parameters.bond import MODES, Bond
from ..parameters.declared import parameters_of
from ..parameters.heights import GammaHeights, HeightDistribution
from ..parameters.orientation import Orientation
from ..parameters.resolution import resolve
from ..parameters.rock import ROCK
from ..support.checks import Array
from .priors import PARTS, Values

# Of shear tests without a closure test: heights of 0.2 mm (standard deviation), and the normal
# stiffness in first loading of joints in laboratories, 15 to 200 GPa/m (Bandis, Lumsden & Barton
# 1983), from which the density of the asperities follows: one per 1.1 mm x 1.1 mm
DEFAULT_BETA = 1e-4  # m
DEFAULT_STIFFNESS = 5e10  # Pa/m
DEFAULT_STIFFNESS_STRESS = 1e6  # Pa
STIFFNESS_STEP = 1e-4  # of the closure, of the slope of the first-loading curve
# Share of the slopes that no stress degrades: the waviness of a joint stays where its unevenness is
# sheared off. With none the strength envelope bends too evenly (docs/measure/fits.py sandstone)
DEFAULT_SLOPE_RESIDUAL = 0.3
INITIAL_STEPS = 30  # of a shear test; a fit doubles them while the results depend on them


@cache
def default_law() -> JointLaw:
    """The law of a fit without an initial law.

    Its mean inclination is 19 degrees, as of the rough granite of the paper.
    """
    return JointLaw(
        orientation=Orientation(a=3.0),
        asperity=ROCK,
        heights=GammaHeights(alpha=3.7, beta=1e-5, formation="individual"),
        asperity_density=1e6,
    )


@dataclass(frozen=True)
class Settings:
    """The fixed properties of a law.

    law: the values of its fixed parameters are used.
    resolution: of the law.
    closure_range: of the law, in m; None for its default.
    steps: steps of a whole shear test, see `ShearCurve.path`.
    """

    law: JointLaw = field(default_factory=default_law)
    resolution: Any = "balanced"
    closure_range: Any = None
    steps: int = INITIAL_STEPS


def fittable_parameters(part: Any) -> list[str]:
    """Names of the parameters of a law, or of a part of it, that can be fitted."""
    declared = parameters_of(part) if is_dataclass(part) else {}
    return [name for name, parameter in declared.items() if parameter.fit]


def parameters_of_law(law: JointLaw | None) -> tuple[dict[str, float], Settings]:
    """All parameters of a law that can be fitted, by name, and its settings.

    They include cohesion and tension of a law with a bond, and the heights of a law with heights.
    Raises ValueError for a law without asperities.
    """
    if not isinstance(law, JointLaw | None):
        raise ValueError(f"law: {type(law).__name__} cannot be fitted; give it a JointLaw")
    settings = Settings() if law is None else Settings(law, law.resolution, law.closure_range)
    parts = [getattr(settings.law, name) if name else settings.law for name in PARTS]
    values = {name: getattr(part, name) for part in parts for name in fittable_parameters(part)}
    return values, settings


def build_law(values: Values, settings: Settings, plane: float | None = None) -> JointLaw:
    """The law with these parameters.

    A mating length below the minimum of a law is raised to the minimum.

    Parameters
    ----------
    values: values of all parameters in SI units by name.
    settings: settings of the law.
    plane: azimuth in rad that motion is restricted to, or None.
    """
    base = settings.law
    options: dict[str, Any] = {"resolution": settings.resolution, "plane": plane}
    parts = {name: _with_values(getattr(base, name), values) for name in PARTS if name}
    interlocked = replace(
        base,
        **options,
        **parts,
        asperity_density=values["asperity_density"],
        closure_range=settings.closure_range,
        mating_length=math.inf,
        slope_wear=math.inf,
        slope_residual=0.0,
        degradation_stress=math.inf,
    )
    if math.isinf(values["mating_length"]):
        return interlocked
    min_mating_length = MIN_MATING_LENGTH * interlocked.closure_range
    return replace(
        interlocked,
        **options,
        slope_wear=values["slope_wear"],
        slope_residual=values["slope_residual"],
        degradation_stress=values["degradation_stress"],
        mating_length=max(values["mating_length"], min_mating_length),
    )


def density_for_stiffness(law: JointLaw, stiffness: float, normal_stress: float) -> float:
    """Density (1/m2) of asperities with which a law has a normal stiffness in first loading.

    The stress is proportional to the density, so the density follows from the closure at which
    d ln(stress)/d closure is the stiffness over the stress.

    Parameters
    ----------
    law: the law, whose density is replaced.
    stiffness: in Pa/m, > 0. normal_stress: in Pa, > 0, at which the law is to have it.

    Raises ValueError if no density has this stiffness.
    """
    target = math.log(stiffness / normal_stress)

    def excess(log_closure: float) -> float:
        closures = math.exp(log_closure) * np.array([1 - STIFFNESS_STEP, 1 + STIFFNESS_STEP])
        low, high = np.log(law.normal_stress(closures))
        return math.log((high - low) / (2 * STIFFNESS_STEP)) - log_closure - target

    shortest, longest = np.log([1e-9, 1e-2])
    if excess(shortest) * excess(longest) > 0:
        raise ValueError(
            f"no asperity_density has a normal stiffness of {stiffness:g} Pa/m at "
            f"{normal_stress:g} Pa with the heights of this law: give asperity_density"
        )
    closure = math.exp(optimize.brentq(excess, shortest, longest, xtol=1e-9))
    return float(law.asperity_density * normal_stress / law.normal_stress(closure))


def _with_values(part: Any, values: Values) -> Any:
    """A part of a law with these values of all its parameters that can be fitted.

    The fracture energies of a bond change with the square of the strength, as the elastic energy at
    the peak does, so that any strength is valid.
    """
    changes: dict[str, Any] = {name: values[name] for name in fittable_parameters(part)}
    for _, strength, energy in MODES if isinstance(part, Bond) else ():
        initial_energy = getattr(part, energy)
        ratio = values[strength] / (getattr(part, strength) or 1.0)
        changes[energy] = initial_energy * ratio**2 if initial_energy else None
    return replace(part, **changes) if changes else part


def log_stress(values: Values, closure: Array, settings: Settings) -> Array:
    """Logarithm of the normal stress (Pa) along a sequence of closures.

    In first loading this is `JointLaw.normal_stress`. In unloading the shear forces between the
    asperities are assumed to decrease in proportion to the normal forces; friction changes the
    result by a few per cent. No table of the law is made, because a fit needs a hundred sets of
    parameters at ten closures each.

    Parameters
    ----------
    values: values of all parameters by name.
    closure: closures in m, (n,), in their order; unloading and reloading are possible.
    settings: settings of the law.
    """
    law = settings.law
    resolution = resolve(settings.resolution)
    p = _with_values(law.asperity, values)
    heights = _with_values(law.heights, values)
    orientation = _with_values(law.orientation, values)
    nodes = facets(orientation, resolution.u, resolution.phi, closure_only=True)
    scale = nodes.scale(p, values["asperity_density"])
    force = _first_loading_force(closure, p.eta, heights)
    if math.isfinite(values["degradation_stress"]) and math.isfinite(values["mating_length"]):
        degrading = DegradingFacets(
            nodes.theta,
            scale,
            p.yield_interference / np.cos(nodes.theta),
            p.lam,
            p.mu,
            values["degradation_stress"],
            values["slope_residual"],
        )
        stress = _degraded_stress(degrading, closure, force, p.eta, heights)
    else:
        stress = sum_facets(nodes.theta, scale, p.lam, p.mu) * force
        yielding = correct_for_yielding(nodes.theta, scale, p)
        if yielding is not None:
            weight, yield_closure = yielding
            max_closure = np.maximum.accumulate(closure)[:, None]
            plastic_force = _first_loading_force(max_closure - yield_closure, p.eta, heights)
            stress = stress - np.minimum(plastic_force, force[:, None]) @ weight
    for element in law.tables.elements[1:]:  # elements other than the asperities
        stress = stress + element.normal_stress(np.maximum(closure, 0.0))
    return np.log(np.maximum(stress, 1e-300))


def _degraded_stress(
    degrading: DegradingFacets,
    closure: Array,
    force: Array,
    eta: float,
    heights: HeightDistribution | None,
) -> Array:
    """Normal stress (n,) in Pa at closures (n,) in m of facets that degrade by stress.

    force: first-loading curve (n,) at the closures. In unloading the ratio of the normal stress to
    the contact stress stays.
    """
    max_closure = np.maximum.accumulate(closure)
    max_force = np.maximum.accumulate(force)
    indented = np.zeros((len(closure), len(degrading.theta)))
    if np.isfinite(degrading.yield_depth).all():
        depth = max_closure[:, None] - degrading.yield_depth
        indented = _first_loading_force(depth, eta, heights)
    weight = degrading.scale * np.cos(degrading.theta)
    remaining = np.maximum(force[:, None] - indented, 0.0) @ weight
    largest = (max_force[:, None] - indented) @ weight
    share = np.divide(remaining, largest, out=np.ones_like(largest), where=largest > 0)
    return share * degrading.stress(max_force, indented)


def _first_loading_force(closure: Array, eta: float, heights: HeightDistribution | None) -> Array:
    """The first-loading curve Phi at closures (m) of any shape.

    For gamma heights of "individual" formation the integral int_0^y (y - r)^(1 + eta) dH(r) is a
    product of positive terms with Kummer's function, which is faster than the general curve.
    """
    y = np.maximum(closure, 1e-15)
    power = 1 + eta
    if (
        not isinstance(heights, GammaHeights)
        or heights.formation != "individual"
        or heights.overlap > 0
        or heights.alpha > 30  # beyond the range in which Kummer's function is accurate
        or y.max() > 300 * heights.beta  # likewise
    ):
        return exact_force(y.ravel(), eta, heights)[0].reshape(y.shape)
    x = y / heights.beta
    top = heights.alpha + 2 + power
    ratio = special.gammaln(1 + power) - special.gammaln(top) + power * math.log(heights.beta)
    kummer: Array = special.hyp1f1(1 + power, top, x)
    return kummer * np.exp(ratio + (top - 1) * np.log(x) - x)
