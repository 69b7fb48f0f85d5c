"""The forward model: parameters by name to a law and to its closure curve, and a law to them."""

import math
from dataclasses import dataclass, is_dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from ..discretisation.facets import facets
from ..discretisation.first_loading import facet_sum, yield_sum
from ..discretisation.virgin_curve import exact_force
from ..laws.joint_law import SHORTEST, JointLaw
from ..parameters.bond import MODES, Bond
from ..parameters.declared import parameters_of
from ..parameters.heights import GammaHeights, HeightDistribution
from ..parameters.orientation import Orientation
from ..parameters.resolution import resolve
from ..parameters.rock import ROCK
from ..support.checks import Array
from .priors import PARTS, Values

# Without a law to begin with. The mean inclination is 19 degrees, as of the paper's rough granite
DEFAULT = JointLaw(
    orientation=Orientation(a=3.0),
    asperity=ROCK,
    heights=GammaHeights(alpha=3.7, beta=1e-5, formation="individual"),
    asperity_density=1e6,
)
STEPS = 30  # that shear a joint to begin with; a fit halves them while that matters


@dataclass(frozen=True)
class Settings:
    """What of a law is decided rather than fitted."""

    law: JointLaw = DEFAULT  # whatever is not fitted is kept
    resolution: Any = "balanced"
    closure_range: Any = None  # m
    steps: int = STEPS  # that shear a joint the whole way, see `ShearCurve.path`


def found_in(part: Any) -> list[str]:
    """Names of the parameters of a law, or of a part of it, that a fit may find."""
    declared = parameters_of(part) if is_dataclass(part) else {}
    return [name for name, said in declared.items() if said.fit]


def parameters(law: JointLaw | None) -> tuple[dict[str, float], Settings]:
    """Parameters of a law by name, those that a fit may find, and its settings.

    Of a law with a bond its cohesion and tension too, of one with heights theirs. Raises ValueError
    for a law without asperities.
    """
    if not isinstance(law, JointLaw | None):
        raise ValueError(f"law: {type(law).__name__} cannot be fitted; give it a JointLaw")
    settings = Settings() if law is None else Settings(law, law.resolution, law.closure_range)
    parts = [getattr(settings.law, name) if name else settings.law for name in PARTS]
    return {name: getattr(part, name) for part in parts for name in found_in(part)}, settings


def build(values: Values, settings: Settings, plane: float | None = None) -> JointLaw:
    """The law of these parameters; `plane` restricts it to motion at that azimuth (rad).

    A mating length shorter than a law can have is raised to the shortest.
    """
    base = settings.law
    asked: dict[str, Any] = {"resolution": settings.resolution, "plane": plane}
    mated = replace(
        base, **asked, **{name: _filled(getattr(base, name), values) for name in PARTS if name},
        asperity_density=values["asperity_density"], closure_range=settings.closure_range,
        mating_length=math.inf, slope_wear=math.inf, slope_residual=0.0,
    )  # fmt: skip
    if math.isinf(values["mating_length"]):
        return mated
    return replace(
        mated, **asked, slope_wear=values["slope_wear"], slope_residual=values["slope_residual"],
        mating_length=max(values["mating_length"], SHORTEST * mated.closure_range),
    )  # fmt: skip


def _filled(part: Any, values: Values) -> Any:
    """A part of a law with these values of all that a fit may find in it.

    An energy of fracture that was given grows with the square of its strength, as the elastic
    energy at the peak does: hence no strength is out of bounds.
    """
    changed: dict[str, Any] = {name: values[name] for name in found_in(part)}
    for _, strength, energy in MODES if isinstance(part, Bond) else ():
        whole, growth = getattr(part, energy), values[strength] / (getattr(part, strength) or 1.0)
        changed[energy] = whole * growth**2 if whole else None
    return replace(part, **changed) if changed else part


def log_stress(values: Values, closure: Array, settings: Settings) -> Array:
    """Logarithm of the normal stress (Pa) along closures (m, n) that may fall and grow again.

    As `JointLaw.normal_stress` while they grow; after that shear forces between the asperities
    are taken to fall with the normal ones, which a joint's friction changes by a few per cent.
    Without the table of a law: a fit asks for a hundred sets of parameters at ten closures each.
    """
    law, r = settings.law, resolve(settings.resolution)
    p, heights = _filled(law.asperity, values), _filled(law.heights, values)
    nodes = facets(_filled(law.orientation, values), r.u, r.phi, closure_only=True)
    scale = nodes.scale(p, values["asperity_density"])
    force = _force(closure, p.eta, heights)
    stress = facet_sum(nodes.theta, scale, p.lam, p.mu) * force
    if (yielding := yield_sum(nodes.theta, scale, p)) is not None:
        share, depth = yielding
        flat = _force(np.maximum.accumulate(closure)[:, None] - depth, p.eta, heights)
        stress = stress - np.minimum(flat, force[:, None]) @ share
    for element in law.tables.elements[1:]:  # what stands beside the asperities
        stress = stress + element.normal_stress(np.maximum(closure, 0.0))
    return np.log(np.maximum(stress, 1e-300))


def _force(closure: Array, eta: float, heights: HeightDistribution | None) -> Array:
    """The virgin curve Phi at closures (m) of any shape, a hundred times in a fit.

    Asperities of gamma heights that each feel the closure since they touched have a closed form,
    int_0^y (y - r)^(1 + eta) dH(r), by Kummer's function; a product of positive terms.
    """
    y, power = np.maximum(closure, 1e-15), 1 + eta
    if (
        not isinstance(heights, GammaHeights)
        or heights.formation != "individual"
        or heights.overlap > 0
        or heights.alpha > 30  # beyond what Kummer's function can, as is the next
        or y.max() > 300 * heights.beta
    ):
        return exact_force(y.ravel(), eta, heights)[0].reshape(y.shape)
    x, top = y / heights.beta, heights.alpha + 2 + power
    ratio = special.gammaln(1 + power) - special.gammaln(top) + power * math.log(heights.beta)
    kummer: Array = special.hyp1f1(1 + power, top, x)
    return kummer * np.exp(ratio + (top - 1) * np.log(x) - x)
