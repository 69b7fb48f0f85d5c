"""The forward model: parameters by name to a law and to its closure curve, and a law to them."""

import math
from dataclasses import dataclass, is_dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import special

from ..discretisation.facets import facets
from ..discretisation.first_loading import facet_sum, yield_sum
from ..discretisation.virgin_curve import exact_force
from ..laws.joint_law import SHORTEST, JointLaw
from ..parameters.asperity import Asperity
from ..parameters.bond import MODES, Bond
from ..parameters.declared import parameters_of
from ..parameters.heights import GammaHeights, HeightDistribution
from ..parameters.orientation import Orientation
from ..parameters.resolution import SLIP, resolve
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
    plane: float | None = None  # of the law to be found; every shear curve has its own
    steps: int = STEPS  # that shear a joint the whole way, see `ShearCurve.sheared`


def fitted(law: JointLaw) -> dict[str, Any]:
    """The parts of a law that hold parameters which a fit may find, by name; "" is the law."""
    parts = {part: getattr(law, part) if part else law for part in PARTS}
    return {part: value for part, value in parts.items() if is_dataclass(value)}


def parameters(law: JointLaw | None) -> tuple[dict[str, float], Settings]:
    """Parameters of a law by name, those that a fit may find, and its settings.

    Of a law with a bond its cohesion and tension too, of one with heights theirs. Raises ValueError
    for a law without asperities.
    """
    settings = Settings()
    if law is not None:
        if not isinstance(law, JointLaw):
            raise ValueError(f"law: {type(law).__name__} cannot be fitted; give it a JointLaw")
        settings = Settings(law, law.resolution, law.closure_range, law.plane)
    values = {
        name: getattr(part, name)
        for part in fitted(settings.law).values()
        for name, said in parameters_of(part).items()
        if said.fit
    }
    return values, settings


def build(values: Values, settings: Settings, plane: float | None = None) -> JointLaw:
    """The law of these parameters; `plane` restricts it to motion at that azimuth (rad).

    A mating length shorter than a law can have is raised to the shortest.
    """
    base, own = settings.law, dict[str, Any]()
    for part, held in fitted(base).items():
        found = {name: values[name] for name, said in parameters_of(held).items() if said.fit}
        if isinstance(held, Bond):
            found = _strengths(values, held)
        own |= {part: replace(held, **found)} if part else found
    slopes = {name: own.pop(name) for name in ("mating_length", "slope_wear", "slope_residual")}
    asked = {"resolution": settings.resolution, "plane": plane}
    mated = replace(
        base, **own, **asked, closure_range=settings.closure_range,
        mating_length=math.inf, slope_wear=math.inf, slope_residual=0.0,
    )  # fmt: skip
    if math.isinf(slopes["mating_length"]):
        return mated
    shortest = SHORTEST * mated.closure_range
    slopes["mating_length"] = max(slopes["mating_length"], shortest)
    return replace(mated, **asked, **slopes)


def build_for_shear(values: Values, settings: Settings, azimuth: float) -> JointLaw:
    """The law that a shear curve along this azimuth (rad) is compared with.

    At least at SLIP: a parameter would take up the error of few nodes, degrees of friction, and
    its interval would not show it.
    """
    resolution = max(resolve(settings.resolution), SLIP, key=lambda r: r.sliders)
    return build(values, replace(settings, resolution=resolution), plane=azimuth)


def log_stress(values: Values, closure: Array, settings: Settings) -> Array:
    """Logarithm of the normal stress (Pa) along closures (m, n) that may fall and grow again.

    As `JointLaw.normal_stress` while they grow; after that shear forces between the asperities
    are taken to fall with the normal ones, which a joint's friction changes by a few per cent.
    Without the table of a law: a fit asks for a hundred sets of parameters at ten closures each.
    """
    heights, eta = _heights(values, settings), values["eta"]
    force = _force(closure, eta, heights)
    if values["yield_interference"] < math.inf:
        force = force - _yielded(values, closure, force, settings)
    names = ("a", "b", "c", "lam", "eta", "mu")
    factor = _facet_factor(*(values[name] for name in names), settings.resolution)
    scale = values["asperity_density"] * values["lam"] * values["K"] * factor
    stress = math.log(scale) + np.log(np.maximum(force, 1e-300))
    for element in settings.law.tables.elements[1:]:  # what stands beside the asperities
        beside = element.normal_stress(np.maximum(closure, 0.0))
        stress = np.where(beside > 0.0, np.log(np.exp(stress) + beside), stress)
    return stress


def _yielded(values: Values, closure: Array, force: Array, settings: Settings) -> Array:
    """The part (n,) that yielding takes from Phi along closures (n,), as a mean of the facets."""
    r, p = resolve(settings.resolution), _asperity(values)
    nodes = facets(Orientation(values["a"], values["b"], 0.0), r.u, r.phi, closure_only=True)
    scale = nodes.weight * np.cos(nodes.theta) ** (1 + p.eta)
    share, depth = yield_sum(nodes.theta, scale, p) or (np.zeros(1), np.zeros(1))
    flat = np.maximum(np.maximum.accumulate(closure)[:, None] - depth, 0.0)
    lost = _force(flat.ravel(), p.eta, _heights(values, settings))
    taken: Array = np.minimum(lost.reshape(flat.shape), force[:, None]) @ share
    return taken / facet_sum(nodes.theta, scale, p.lam, p.mu)


def _force(closure: Array, eta: float, heights: HeightDistribution | None) -> Array:
    """The virgin curve Phi at closures (m, n), a hundred times in a fit.

    Asperities of gamma heights that each feel the closure since they touched have a closed form,
    int_0^y (y - r)^(1 + eta) dH(r), by Kummer's function; a product of positive terms.
    """
    y, power = np.maximum(closure, 1e-15), 1 + eta
    if not isinstance(heights, GammaHeights):
        return exact_force(y, eta, heights)[0]
    far = heights.alpha > 30 or y.max() > 300 * heights.beta  # beyond what Kummer's function can
    if far or heights.formation != "individual" or heights.overlap > 0:
        return exact_force(y, eta, heights)[0]
    x, top = y / heights.beta, heights.alpha + 2 + power
    ratio = special.gammaln(1 + power) - special.gammaln(top) + power * math.log(heights.beta)
    kummer = special.hyp1f1(1 + power, top, x)
    result: Array = kummer * np.exp(ratio + (top - 1) * np.log(x) - x)
    return result


def _asperity(v: Values) -> Asperity:
    return Asperity(v["K"], v["lam"], v["eta"], v["mu"], v["yield_interference"])


def _strengths(v: Values, given: Bond) -> dict[str, Any]:
    """Strengths, and energies: one that was given grows with the square of its strength.

    The elastic energy at the peak does so too, hence no strength is out of bounds.
    """
    changed: dict[str, Any] = {}
    for _, strength, energy in MODES:
        whole, growth = getattr(given, energy), v[strength] / (getattr(given, strength) or 1.0)
        changed |= {strength: v[strength], energy: whole * growth**2 if whole else None}
    return changed


def _heights(v: Values, settings: Settings) -> HeightDistribution | None:
    held = fitted(settings.law).get("heights")
    if held is None:
        return settings.law.heights
    return replace(held, **{n: v[n] for n, said in parameters_of(held).items() if said.fit})


@lru_cache(maxsize=256)
def _facet_factor(
    a: float, b: float, c: float, lam: float, eta: float, mu: float, resolution: Any
) -> float:
    """F1/(N lam K Phi) under pure closure, summed over the facets as `JointLaw` does."""
    r = resolve(resolution)
    nodes = facets(Orientation(a, b, c), r.u, r.phi)
    return facet_sum(nodes.theta, nodes.weight * np.cos(nodes.theta) ** (1 + eta), lam, mu)
