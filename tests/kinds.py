"""One law of each kind of joint, over which tests iterate. Every declared parameter with a value
other than its default, without naming a parameter here."""

import math
from contextlib import suppress
from dataclasses import dataclass, is_dataclass, replace
from functools import cached_property, reduce
from itertools import chain

import numpy as np

import jointlaw as jl
from jointlaw.kernels.coulomb import CoulombElement
from jointlaw.laws.law import Law
from jointlaw.parameters.declared import parameters_of
from jointlaw.parameters.toml import kinds_of


def make_law(
    a=3.0, b=0.5, c=0.1, K=2.0e8, lam=1.2, eta=0.5, mu=0.3, heights="population", damage=(), **more
) -> jl.JointLaw:
    """Smooth Westerly granite at the coarsest resolution, with changed parameters."""
    if isinstance(heights, str):
        heights = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation=heights)
    defaults = {"asperity_density": 1e10, "closure_range": 1e-6, "resolution": "fast"}
    return jl.JointLaw(
        orientation=jl.Orientation(a, b, c),
        asperity=jl.Asperity(K=K, lam=lam, eta=eta, mu=mu, **dict(damage)),
        heights=heights,
        **(defaults | more),
    )


# A joint in a plane as fits give them: heights of tens of micrometres, a mating length
FITTED = jl.JointLaw(
    orientation=jl.Orientation(4.0),
    asperity=jl.Asperity(K=2e10, lam=1.2, eta=0.5, mu=0.6),
    heights=jl.GammaHeights(3.0, 20e-6, formation="individual"),
    asperity_density=1e6,
    plane=0.0,
    mating_length=2e-3,
)


@dataclass(frozen=True)
class ExponentialHeights:
    """Heights of a class that is not part of the package, so that no law file can name it."""

    scale: float  # m
    overlap: float = 0.0  # m
    formation: str = "individual"

    def pdf(self, r):
        density = np.exp(-np.maximum(r, 0.0) / self.scale) / self.scale
        return np.where(np.asarray(r) < 0.0, 0.0, density)

    def cdf(self, r):
        return -np.expm1(-np.maximum(r, 0.0) / self.scale)

    def breakpoints(self):
        return self.scale * np.array([0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 40.0])


@jl.declared
@dataclass(frozen=True, kw_only=True)
class FilledLaw(jl.JointLaw, kind="filled"):
    """A cemented rough joint beside a filling, Coulomb's joint: two elements of C with damage."""

    filling_stiffness: float = jl.parameter("in closure", "Pa/m", above=0.0)
    filling_friction: float = jl.parameter("coefficient", low=0.0)
    filling_cohesion: float = jl.parameter("c", "Pa", low=0.0)

    @cached_property
    def tables(self):
        kn = self.filling_stiffness
        c = self.filling_cohesion
        filling = jl.CoulombLaw(kn, 0.5 * kn, self.filling_friction, c, 0.5 * c, weakening=1e-6)
        rough = super().tables
        return jl.LawTables(rough.dim, (*rough.elements, CoulombElement(filling, rough.dim)))

    def strength_reduced(self, factor):
        raise NotImplementedError


del jl.Law.kinds["filled"]  # the lists of kinds stay those of the package
HISTOGRAM = jl.Heights(([1, 3, 2], [0.0, 2e-6, 5e-6, 8e-6]), overlap=2e-6)
LAWS = {
    "population": make_law(),
    "individual": make_law(heights="individual", lam=0.7),
    "histogram": make_law(heights=HISTOGRAM),
    "no heights": make_law(heights=None, a=1.0, b=-1.0, c=0.5),
    "linear": make_law(heights=None, eta=0.0, a=1.0, mu=0.0),
    "plane": make_law(plane=0.4),
    "mating length": make_law(mating_length=2e-6, plane=math.pi),
    "yielding": make_law(mating_length=2e-6, damage={"yield_interference": 2e-7}),
    "wear": make_law(plane=0.4, mating_length=2e-6, slope_wear=100.0, slope_residual=0.1),
    "degradation stress": make_law(mating_length=2e-6, degradation_stress=5e8),
    "degradation by work and stress": make_law(
        plane=0.0,
        mating_length=2e-6,
        slope_wear=100.0,
        slope_residual=0.2,
        degradation_stress=2e8,
        damage={"yield_interference": 2e-7},
    ),
    "closure only": make_law(closure_only=True, mating_length=2e-6),
    "bond": make_law(bond=jl.Bond(1e12, 1e12, 5e4, 1e5, 5e-3, 2e-2)),
    "coulomb": jl.CoulombLaw(1e12, 5e11, 0.6, 1e5, 5e4, 0.5, 2e4, 1e-6),
    "coulomb in a plane": jl.CoulombLaw(1e12, 5e11, 0.6, 1e5, plane=0.0),
    "bond and filling": FilledLaw(
        **make_law(bond=jl.Bond(1e12, 1e12, 5e4, 1e5), mating_length=2e-6).__getstate__(),
        filling_stiffness=1e11,
        filling_friction=0.2,
        filling_cohesion=1e4,  # tension fails at the opening of the bond's
    ),
}

# Values of a parameter, by unit, that change joints which close by 1e-6 m
SIZES = {"": 0.3, "rad": 0.4, "m": 1e-6, "Pa": 3e4, "Pa/m": 3e11, "J/m2": 1e-2, "1/m2": 1e10}


def declared(kind, path=""):
    """Paths and declarations of all parameters of a kind of law, and of its parts."""
    for name, parameter in parameters_of(kind).items():
        parts = [part for part in kinds_of(parameter.kind).values() if is_dataclass(part)]
        yield from chain.from_iterable(declared(part, f"{path}{name}.") for part in parts)
        if not parts:
            yield f"{path}{name}", parameter


PARAMETERS = {
    f"{name}: {path}": (kind, path, parameter)
    for name, kind in Law.kinds.items()
    for path, parameter in dict(declared(kind)).items()
}


def with_value(part, path, value):
    """A law, or a part of it, with another value at a path of names."""
    name, _, rest = path.partition(".")
    inner = getattr(part, name)
    return replace(part, **{name: with_value(inner, rest, value) if rest else value})


def candidates(parameter, value):
    """Values that a parameter of this value may have instead."""
    if parameter.choices:
        return [choice for choice in parameter.choices if choice != value]
    if parameter.kind in (bool, int):
        return [not value] if parameter.kind is bool else [value + 1]
    if isinstance(value, tuple):
        return [(tuple(2.0 * x + 1.0 for x in value[0]), value[1])]
    if value and math.isfinite(value):
        return [1.2 * value, 0.8 * value]
    size = SIZES[parameter.unit]
    return [size, *(size * 10.0**k for k in (-3, -2, -1, 1, 2, 3))]


def off_default(name):
    """A law with a value of a parameter other than its default, and the unchanged law.

    A law of the list whose value is not the default comes first.
    """
    kind, path, parameter = PARAMETERS[name]
    *parents, last = path.split(".")
    variants = []
    for base in (law for law in LAWS.values() if type(law) is kind):
        part = reduce(getattr, parents, base)
        if last in getattr(part, "__dataclass_fields__", {}):
            old_value = getattr(part, last)
            default = part.__dataclass_fields__[last].default
            for value in candidates(parameter, old_value):
                with suppress(ValueError):
                    law = with_value(base, path, value)
                    variants.append((old_value == default, len(variants), law, base))
                    break
    assert variants, f"no law of this file takes a value of {path}: add one above"
    *_, law, base = min(variants, key=lambda variant: variant[:2])
    return law, base
