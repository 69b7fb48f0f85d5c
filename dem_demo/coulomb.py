"""Plain Coulomb friction with constant stiffness: the comparison law.

It has the interface of ``jointlaw.JointLaw(plane=...)``, so a scene changes law by changing a
table: two numbers in (closure, shear), two numbers out (normal and shear traction).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

STATE = ("delta", "F", "stored_energy", "dissipated_energy", "sliding", "separated")


@dataclass(frozen=True)
class CoulombLaw:
    """Parameters: stiffnesses per area (Pa/m), friction coefficient (may be infinite)."""

    normal_stiffness: float
    shear_stiffness: float
    friction: float

    def __post_init__(self) -> None:
        for name in ("normal_stiffness", "shear_stiffness"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value}: must be a finite number > 0 (Pa/m)")
        if not self.friction >= 0:
            raise ValueError(f"friction = {self.friction}: must be >= 0 (a coefficient, no angle)")

    def joints(self, n: int) -> CoulombJoints:
        """A batch of ``n`` unloaded joints."""
        return CoulombJoints(self, n)

    def normal_stress(self, closure):
        """Normal stress (Pa) at a closure (m)."""
        return self.normal_stiffness * np.maximum(closure, 0.0)

    def closure(self, normal_stress):
        """Closure (m) at a normal stress (Pa)."""
        return np.asarray(normal_stress, float) / self.normal_stiffness

    def max_stiffness(self, closure):
        """The larger stiffness (Pa/m), whatever the closure."""
        stiffest = max(self.normal_stiffness, self.shear_stiffness)
        return np.full(np.shape(closure), stiffest) if np.ndim(closure) else stiffest


class Measures(NamedTuple):
    """As in ``jointlaw``; one slider per joint, so partial slip is sliding."""

    sliding: np.ndarray
    slipping: np.ndarray
    separated: np.ndarray
    stored: np.ndarray
    reach: np.ndarray


class CoulombState:
    """A copy of a batch's state that can be written to a file."""

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        self.arrays = arrays

    def save(self, path) -> None:
        """Write the state as NPZ."""
        np.savez(path, **self.arrays)

    @classmethod
    def load(cls, path) -> CoulombState:
        """Read a state written by ``save``."""
        with np.load(path) as data:
            return cls({name: data[name] for name in STATE})


class CoulombJoints:
    """State of ``n`` joints; arrays as in ``jointlaw``: ``delta`` and ``F`` are (n, 2)."""

    def __init__(self, law: CoulombLaw, n: int) -> None:
        self.law = law
        self.delta = np.zeros((n, 2))
        self.F = np.zeros((n, 2))
        self.stored_energy = np.zeros(n)
        self.dissipated_energy = np.zeros(n)
        self.sliding = np.zeros(n)
        self.separated = np.ones(n)

    def measures(self) -> Measures:
        """Shares, stored energy and largest closure, as arrays (n,)."""
        shares = self.sliding, self.sliding, self.separated
        return Measures(*shares, self.stored_energy, self.delta[:, 0])

    def update(self, d, where=None, tangent=False):
        """Move by ``d`` (m, 2) and return the traction ``F`` (m, 2) and ``C`` or None."""
        new, C = self._evaluate(d, where, tangent)
        for name, value in new.items():
            if where is None:
                setattr(self, name, value)
            else:
                getattr(self, name)[where] = value
        return new["F"].copy(), C  # the host's own: `self.F` is state

    def trial(self, d, where=None, tangent=True):
        """The same, with the state left alone."""
        new, C = self._evaluate(d, where, tangent)
        return new["F"], C

    def _evaluate(self, d, where, tangent):
        law, here = self.law, slice(None) if where is None else where
        d = np.asarray(d, float)
        delta0, F0 = self.delta[here], self.F[here]
        if d.shape != delta0.shape:
            raise ValueError(f"d has shape {d.shape}: expected {delta0.shape}")
        if not np.isfinite(d).all():
            raise ValueError("d holds a value that is not finite: check the host's time step")
        delta = delta0 + d
        closure = delta[:, 0]
        touching = closure > 0
        # Only the part of the step made in contact winds up the shear spring.
        moved = np.where(d[:, 0] > 0, np.clip(closure / np.where(d[:, 0] > 0, d[:, 0], 1), 0, 1), 1)
        normal = law.normal_stiffness * np.where(touching, closure, 0.0)
        trial = F0[:, 1] + law.shear_stiffness * moved * d[:, 1]
        cap = np.where(touching, law.friction, 0.0)
        cap[touching] *= normal[touching]
        shear = np.clip(trial, -cap, cap)
        slip = np.where(touching, np.abs(trial - shear) / law.shear_stiffness, 0.0)
        # A joint that opens loses its shear spring: that energy is dissipated too.
        push = np.maximum(np.abs(F0[:, 1]), np.abs(shear)) + np.abs(shear)
        lost = np.where(touching, 0.5 * push * slip, 0.0)
        lost += np.where(touching, 0.0, F0[:, 1] ** 2 / (2 * law.shear_stiffness))
        sliding = (touching & (np.abs(trial) > cap)).astype(float)
        new = {
            "delta": delta,
            "F": np.stack([normal, shear], axis=1),
            "stored_energy": normal**2 / (2 * law.normal_stiffness)
            + shear**2 / (2 * law.shear_stiffness),
            "dissipated_energy": self.dissipated_energy[here] + lost,
            "sliding": sliding,
            "separated": (~touching).astype(float),
        }
        if not tangent:
            return new, None
        C = np.zeros((len(d), 2, 2))
        C[:, 0, 0] = np.where(touching, law.normal_stiffness, 0.0)
        C[:, 1, 1] = np.where(touching & (sliding == 0), law.shear_stiffness, 0.0)
        slides = sliding > 0
        C[slides, 1, 0] = law.friction * law.normal_stiffness * np.sign(shear[slides])
        return new, C

    def reset(self, index) -> None:
        """Make joints ``index`` virgin again."""
        for name in STATE:
            getattr(self, name)[index] = 1.0 if name == "separated" else 0.0

    def resize(self, n: int) -> None:
        """Grow or shrink to ``n`` joints; new ones are virgin."""
        old = len(self.delta)
        for name in STATE:
            value = getattr(self, name)
            fresh = np.zeros((n, *value.shape[1:]))
            fresh[: min(n, old)] = value[: min(n, old)]
            setattr(self, name, fresh)
        self.separated[old:] = 1.0

    def snapshot(self) -> CoulombState:
        """A copy of the state."""
        return CoulombState({name: getattr(self, name).copy() for name in STATE})

    def restore(self, state: CoulombState) -> None:
        """Back to a copied state."""
        for name in STATE:
            setattr(self, name, state.arrays[name].copy())
