"""The kinds of joints that the code knows, one law each: every test that goes through them does so
by this list. And every declared parameter, off its default: no parameter is named here."""

import math
from contextlib import suppress
from dataclasses import dataclass, is_dataclass, replace
from functools import reduce
from itertools import chain

import numpy as np

import jointlaw as jl
from jointlaw.laws.law import Law
from jointlaw.parameters.declared import parameters_of
from jointlaw.parameters.toml import kinds_of


def make_law(
    a=3.0, b=0.5, c=0.1, K=2.0e8, lam=1.2, eta=0.5, mu=0.3, heights="population", damage=(), **more
) -> jl.JointLaw:
    """Smooth Westerly granite at the coarsest resolution, any parameter to be replaced."""
    if isinstance(heights, str):
        heights = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation=heights)
    defaults = {"asperity_density": 1e10, "closure_range": 1e-6, "resolution": "fast"}
    return jl.JointLaw(
        orientation=jl.Orientation(a, b, c),
        asperity=jl.Asperity(K=K, lam=lam, eta=eta, mu=mu, **dict(damage)),
        heights=heights,
        **(defaults | more),
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
    "closure only": make_law(closure_only=True, mating_length=2e-6),
    "bond": make_law(bond=jl.Bond(1e12, 1e12, 5e4, 1e5, 5e-3, 2e-2)),
    "coulomb": jl.CoulombLaw(1e12, 5e11, 0.6, 1e5, 5e4, 0.5, 2e4, 1e-6),
    "coulomb in a plane": jl.CoulombLaw(1e12, 5e11, 0.6, 1e5, plane=0.0),
}

# Sizes at which a parameter of this unit shows in joints that close by 1e-6 m
SIZES = {"": 0.3, "rad": 0.4, "m": 1e-6, "Pa": 3e4, "Pa/m": 3e11, "J/m2": 1e-2, "1/m2": 1e10}


def declared(kind, path=""):
    """Paths of all declared parameters of a kind of law, and of what it is made of."""
    for name, said in parameters_of(kind).items():
        inner = [one for one in kinds_of(said.kind).values() if is_dataclass(one)]
        yield from chain.from_iterable(declared(one, f"{path}{name}.") for one in inner)
        if not inner:
            yield f"{path}{name}", said


PARAMETERS = {
    f"{name}: {path}": (kind, path, said)
    for name, kind in Law.kinds.items()
    for path, said in dict(declared(kind)).items()
}


def with_value(part, path, value):
    """A law, or a part of it, with another value at a path of names."""
    name, _, rest = path.partition(".")
    now = getattr(part, name)
    return replace(part, **{name: with_value(now, rest, value) if rest else value})


def candidates(said, value):
    """Values that a parameter of this value may have instead."""
    if said.choices:
        return [one for one in said.choices if one != value]
    if said.kind in (bool, int):
        return [not value] if said.kind is bool else [value + 1]
    if isinstance(value, tuple):
        return [(tuple(2.0 * x + 1.0 for x in value[0]), value[1])]
    if value and math.isfinite(value):
        return [1.2 * value, 0.8 * value]
    size = SIZES[said.unit]
    return [size, *(size * 10.0**k for k in (-3, -2, -1, 1, 2, 3))]


def off_default(name):
    """A law with this parameter off its default and off what the law beside it has, and that law.

    A law of the list in which the parameter is at work already comes first.
    """
    kind, path, said = PARAMETERS[name]
    *above, last = path.split(".")
    found = []
    for base in (law for law in LAWS.values() if type(law) is kind):
        part = reduce(getattr, above, base)
        if last in getattr(part, "__dataclass_fields__", {}):
            now, default = getattr(part, last), part.__dataclass_fields__[last].default
            for value in candidates(said, now):
                with suppress(ValueError):
                    law = with_value(base, path, value)
                    found.append((now == default, len(found), law, base))
                    break
    assert found, f"no law of this file takes a value of {path}: add one above"
    *_, law, base = min(found, key=lambda one: one[:2])
    return law, base
