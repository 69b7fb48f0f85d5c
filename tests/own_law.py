"""An element and a law from outside the package: clay in Coulomb's joint, in a plane."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import jointlaw as jl


class Clay(jl.Element):
    """A spring in shear that yields at a shear stress, beside other elements; in a plane."""

    dim = 2
    rows = {"clay": 1}  # noqa: RUF012

    def __init__(self, stiffness, strength):
        self.shear = stiffness
        self.strength = strength

    def step(self, delta, d, state, new, tangent):
        trial = state[0] + self.shear * d[1]
        new[0] = np.clip(trial, -self.strength, self.strength)
        lost = new[0] * (trial - new[0]) / self.shear
        C = np.zeros((2, *d.shape))
        C[1, 1] = np.where(np.abs(trial) < self.strength, self.shear, 0.0)
        return jl.ElementResponse(np.stack([0.0 * trial, new[0]]), lost, C)

    def stored_energy(self, delta, state):
        return 0.5 * state[0] ** 2 / self.shear

    def stiffness(self, delta, state):
        return np.full(delta.shape[1], self.shear)


@jl.declared
@dataclass(frozen=True, kw_only=True)
class ClayLaw(jl.CoulombLaw, kind="clay"):
    """Coulomb's joint with a layer of clay."""

    clay_stiffness: float = jl.parameter("in shear", "Pa/m", above=0.0)
    clay_strength: float = jl.parameter("in shear", "Pa", above=0.0)

    @cached_property
    def tables(self):
        own = super().tables
        return jl.LawTables(2, (*own.elements, Clay(self.clay_stiffness, self.clay_strength)))

    def strength_reduced(self, factor):
        stiffness = self.clay_stiffness * factor**2
        return replace(super().strength_reduced(factor), clay_stiffness=stiffness)


CLAY = ClayLaw(1e10, 5e9, 0.6, plane=0.0, clay_stiffness=1e9, clay_strength=2e3)
del jl.Law.kinds["clay"]  # the lists of kinds in messages stay those of the package
