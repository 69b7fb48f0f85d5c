"""Coulomb's joint in a step: docs/theory-incremental.md, "Coulomb joint".

The joint has one spring in closure and one in shear. Its history variables are the shear stress q
and the softening w, the condition of the joint:

    w = 0         intact: cohesion c, friction mu, tensile strength
    0 < w <= 1    has slipped: c and mu on the way to their residual values; no tensile strength
    w = 2         has separated: residual friction only, also after the faces touch again

Two events may happen within a step, and both are treated where they happen, not at its end, so
that the result does not depend on the number of steps:

- An intact joint fails under tension. Its elastic domain is convex, so a straight step leaves it at
  one point; there all stored energy is dissipated, and the traction is zero from there on.
- Faces separate or touch, at closure zero. Only the part of the shear increment while they touch
  loads the spring in shear; q is zero before that part, or released after it.

Slip is return mapping of the trial shear stress to the strength. As w grows by the slip over the
weakening length, the strength at the end of the step decreases with the trial stress itself, in
closed form. At a constant normal stress the post-peak line is exact in steps of any size.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..support.checks import Array
from ..support.thresholds import (
    FRICTION_TOLERANCE,
    INFINITE_FRICTION,
    MAX_STRENGTH,
    ROUNDING_TOLERANCE,
    SEPARATED_STATE,
)
from .element import Element, ElementResponse, Measures


class SlipResult(NamedTuple):
    """The shear of B joints at the end of the part of a step in which faces touch."""

    q: Array  # (dim - 1, B) in Pa
    w: Array  # (B,)
    dissipated: Array  # (B,) in J/m2, >= 0
    slips: NDArray[np.bool_]  # (B,)
    trial: Array  # q before return mapping (dim - 1, B)
    strength: Array  # (B,) to which q is mapped


class CoulombElement(Element):
    """A spring in closure and a spring in shear, which slips where |q| is the strength.

    The strength is c + mu sigma, sigma the normal stress, from cohesion and friction of the intact
    joint (w = 0) to the residual values (w = 1). After separation (w = 2) c is zero. Rows of the
    state: shear stress q (dim - 1) in Pa, w. parameters: with the attributes of `jl.CoulombLaw`; a
    residual value None keeps the value.
    """

    native_name = "coulomb"
    damage_row = "softening"
    separated_damage = SEPARATED_STATE

    def __init__(self, parameters: Any, dim: int) -> None:
        p = parameters
        self.dim = dim
        self.rows = {"shear_stress": dim - 1, "softening": 1}
        self.row_bounds = {
            "shear_stress": (-MAX_STRENGTH, MAX_STRENGTH),
            "softening": (0.0, SEPARATED_STATE),
        }
        self.normal = p.normal_stiffness
        self.shear = p.shear_stiffness
        self.friction = min(p.friction, INFINITE_FRICTION)
        self.cohesion = p.cohesion
        self.weakening = p.weakening
        self.residual_friction = self.friction
        if p.residual_friction is not None:
            self.residual_friction = min(p.residual_friction, INFINITE_FRICTION)
        self.residual_cohesion = self.cohesion
        if p.residual_cohesion is not None:
            self.residual_cohesion = p.residual_cohesion
        # beyond the apex cohesion/friction the shear strength is zero
        apex = self.cohesion / self.friction if self.friction > 0.0 else np.inf
        self.tension = min(p.tension, apex)
        self.tensile_strength = self.tension
        self.tensile_opening = self.tension / self.normal
        self.tensile_stiffness = self.normal
        largest = max(self.normal * (1.0 + self.friction), self.shear, 1.0)
        self.max_effective_closure = MAX_STRENGTH / largest
        self.max_search_closure = self.max_effective_closure

    def numbers(self) -> dict[str, float]:
        return {
            "coulomb_normal_stiffness": self.normal,
            "coulomb_shear_stiffness": self.shear,
            "coulomb_friction": self.friction,
            "coulomb_cohesion": self.cohesion,
            "coulomb_tension": self.tension,
            "coulomb_residual_friction": self.residual_friction,
            "coulomb_residual_cohesion": self.residual_cohesion,
            "coulomb_weakening_length": self.weakening,
        }

    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """As `Element.step`; the normal stress sigma = kn u, u the closure, is linear in the step.

        1. An intact joint bears sigma >= -tension with |q| <= c + mu sigma. A straight step leaves
           this convex set once. If it leaves it under tension the joint fails: w = 2, q = sigma =
           0, and the energy that both springs stored is dissipated.
        2. All that follows applies while faces touch: from u = 0 on, with q = 0, if they were
           separated; up to u = 0 if they separate. Under tension only an intact joint touches.
        3. In that part q grows by ks d_s, with return mapping to the strength (`slip`).
        4. On separation the energy that q stored is dissipated, and q = 0, w = 2.
        5. Tangent of the branch in which the step ends, at a fixed instant of contact (`tangent`).
        """
        q = state[:-1]
        w = state[-1]
        sigma0 = self.normal * delta[0]
        sigma1 = self.normal * (delta[0] + d[0])
        change = sigma1 - sigma0
        size = np.where(change == 0.0, 1.0, np.abs(change))

        is_intact = w == 0.0
        exceeds_tension = sigma1 < -self.tension * (1.0 + ROUNDING_TOLERANCE)
        to_cutoff = np.clip((sigma0 + self.tension) / size, 0.0, 1.0)
        part = np.where(exceeds_tension, to_cutoff, 1.0)
        end = np.where(exceeds_tension, -self.tension, sigma1)
        dq = self.shear * d[1:] * part
        strength0 = self.strength(0.0 * w, sigma0)
        leaves, fraction = leave_strength(q, dq, strength0, self.strength(0.0 * w, end) - strength0)
        sigma_at_limit = sigma0 + fraction * (end - sigma0)
        fails = is_intact & np.where(leaves, sigma_at_limit < 0.0, exceeds_tension)
        released = 0.5 * sigma_at_limit * sigma_at_limit / self.normal
        released = released + 0.5 * squared_norm(q + fraction * dq) / self.shear

        stays_intact = is_intact & ~leaves & ~exceeds_tension
        starts_apart = fails | (~is_intact & (delta[0] < 0.0))
        touches = stays_intact | (sigma1 >= 0.0)
        separates = ~touches & ~starts_apart
        part = np.where(separates, sigma0, size)
        part = np.where(starts_apart, np.maximum(sigma1, 0.0), part) / size
        start = np.where(starts_apart, 0.0, sigma0)
        end = np.where(touches, sigma1, 0.0)
        dq = self.shear * d[1:] * part
        w_start = np.where(starts_apart, SEPARATED_STATE, w)
        result = self.slip(np.where(starts_apart, 0.0, q), w_start, dq, start, end)

        dissipated = np.where(fails, released, 0.0) + result.dissipated
        shear_energy = 0.5 * squared_norm(result.q) / self.shear
        dissipated = dissipated + np.where(separates, shear_energy, 0.0)
        new[:-1] = np.where(touches, result.q, 0.0)
        new[-1] = np.where(touches, result.w, SEPARATED_STATE)
        F = np.concatenate([end[None], new[:-1]])
        C = None
        if tangent:
            C = np.where(touches, self.tangent(w_start, end, self.shear * part, result), 0.0)
        return ElementResponse(F, dissipated, C)

    def slip(self, q: Array, w: Array, dq: Array, start: Array, end: Array) -> SlipResult:
        """Shear by dq while the normal stress goes from `start` to `end`.

        1. Strength at the old w, k(sigma) = c + mu sigma. Beyond it w grows by the displacement
           (|q*| - k)/ks over the weakening length, up to 1, q* = q + dq. At constant sigma this is
           the slip, however many steps it takes.
        2. Return mapping of q to the strength h at the new w, in the direction of q*.
        3. Dissipated is the stored energy where slip begins, plus the work of h, less the stored
           energy at the end: 2 ks dissipated = k^2 + 2 (integral of h d|q*|) - h^2. Along a line h
           is quadratic in |q*| while the joint weakens (Simpson's rule), then linear (trapezoid).
        """
        strength0 = self.strength(w, start)
        strength1 = self.strength(w, end)
        rise = strength1 - strength0
        trial = q + dq
        slips, onset = leave_strength(q, dq, strength0, rise)
        size = np.sqrt(squared_norm(trial))
        weakening_stress = self.shear * self.weakening  # |q*| - k at which w has grown from 0 to 1
        excess = np.where(slips, size - strength1, 0.0)
        if weakening_stress > 0.0:
            w_reached = w + excess / weakening_stress
        else:
            w_reached = np.where(slips, 1.0, w)
        w1 = np.maximum(w, np.minimum(w_reached, 1.0))
        h1 = self.strength(w1, end)

        residual_from = strength0 + weakening_stress * np.maximum(1.0 - w, 0.0)
        becomes_residual, full = leave_strength(q, dq, residual_from, rise)
        full = np.where(slips & becomes_residual, np.maximum(full, onset), 1.0)  # where w becomes 1
        h_onset = self.strength(w, start + onset * (end - start))
        sigma_middle = start + 0.5 * (onset + full) * (end - start)
        h_middle = self.strength(0.5 * (w + w1), sigma_middle)
        h_full = self.strength(w1, start + full * (end - start))
        size_full = np.where(full < 1.0, np.sqrt(squared_norm(q + full * dq)), size)
        work = (size_full - h_onset) * (h_onset + 4.0 * h_middle + h_full) / 6.0
        work = work + (size - size_full) * (0.5 * (h_full + h1))
        dissipated = np.maximum(0.5 * (h_onset * h_onset - h1 * h1) + work, 0.0) / self.shear
        scale = np.divide(h1, size, out=np.ones_like(size), where=slips)
        return SlipResult(scale * trial, w1, np.where(slips, dissipated, 0.0), slips, trial, h1)

    def tangent(self, w: Array, sigma: Array, ks: Array, result: SlipResult) -> Array:
        """Tangent (dim, dim, B) in Pa/m of joints that touch; w (B,) before the slip.

        C_nn = kn; C_ss = ks, in the step of a first contact only its part after contact. In slip
        C_ss = ks h/|q*| (1 - n n), C_sn = mu kn n, and while the joint weakens, with the decrease f
        of the strength from w = 0 to 1 over the length L, C_ss -= (f/L) n n, C_sn += (f/L)
        (mu kn/ks) n, with mu at the old w.
        """
        size = np.sqrt(squared_norm(result.trial))
        n = np.divide(result.trial, size, out=np.zeros_like(result.trial), where=size > 0.0)
        stick = np.where(result.strength > 0.0, ks, 0.0)
        along = np.where(result.slips, 0.0, stick)
        across = np.divide(ks * result.strength, size, out=stick.copy(), where=result.slips)
        coupling = np.where(result.slips, self.normal * self.friction_at(result.w), 0.0)
        if self.weakening > 0.0:
            fall = self.strength(np.zeros_like(w), sigma) - self.strength(np.ones_like(w), sigma)
            slope = np.where(result.slips & (result.w < 1.0), fall / self.weakening, 0.0)
            along = along - slope
            coupling = coupling + slope * (self.normal * self.friction_at(w) / self.shear)
        C = np.zeros((self.dim, self.dim, len(w)))
        C[0, 0] = self.normal
        C[1:, 0] = coupling * n
        C[1:, 1:] = across * np.eye(self.dim - 1)[:, :, None] + (along - across) * n[:, None] * n
        return C

    def strength(self, w: Array, sigma: Array) -> Array:
        """Shear strength (B,) in Pa at this w and this normal stress."""
        c = self.cohesion + (self.residual_cohesion - self.cohesion) * w
        c = np.where(w > 1.0, 0.0, c)
        return np.maximum(c + self.friction_at(w) * sigma, 0.0)

    def friction_at(self, w: Array) -> Array:
        """Coefficient of friction (B,) at this w."""
        return self.friction + (self.residual_friction - self.friction) * np.minimum(w, 1.0)

    def stiffness(self, delta: Array, state: Array) -> Array:
        """As `Element.stiffness`.

        A joint that weakens may exceed the bound, because its shear stress decreases: by (f/L)
        sqrt(1 + (mu kn/ks)^2), with the decrease f of the strength over the weakening length L.
        Softening needs no smaller time step.
        """
        w = state[-1] if self.weakening > 0.0 else np.ones_like(state[-1])
        mu = self.friction_at(w)
        in_slip = self.normal * np.hypot(1.0, np.where(mu < INFINITE_FRICTION, mu, 0.0))
        bound = np.maximum(in_slip, self.shear)
        return np.where((state[-1] > 0.0) & (delta[0] < 0.0), 0.0, bound)

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """As `Element.first_loading_stiffness`: the norm of the tangent in slip."""
        never_slips = self.friction >= INFINITE_FRICTION
        mu = 0.0 if never_slips else self.friction
        in_slip = self.normal * np.hypot(1.0, mu / reduction)
        return np.full(closure.shape, np.maximum(in_slip, self.shear / reduction**2))

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """As `Element.shear_stiffness`, of a joint that sticks."""
        return self.shear if len(delta) > 1 else 0.0

    def measures(self, delta: Array, state: Array) -> Measures:
        q = state[:-1]
        w = state[-1]
        u = delta[0]
        is_separated = (w > 0.0) & (u < 0.0)
        strength = self.strength(w, self.normal * u)
        is_at_limit = np.sqrt(squared_norm(q)) >= strength * (1.0 - FRICTION_TOLERANCE)
        sliding = (~is_separated & is_at_limit).astype(float)
        compression = np.where(is_separated, 0.0, u)
        stored_energy = 0.5 * self.normal * compression * compression
        stored_energy = stored_energy + 0.5 * squared_norm(q) / self.shear
        return Measures(sliding, sliding, is_separated.astype(float), stored_energy, u)


def squared_norm(q: Array) -> Array:
    """q . q (B,) of vectors (dim - 1, B)."""
    return np.sum(q * q, axis=0)


def leave_strength(
    q: Array, dq: Array, strength: Array, rise: Array
) -> tuple[NDArray[np.bool_], Array]:
    """Whether |q + t dq| exceeds strength + t rise at t = 1, and from which t (B,) on, else 1.

    |q| <= strength at t = 0, and |q + t dq| is convex in t, so it exceeds the line from one t on:
    the root of A t^2 + 2 B t = C, computed without cancellation.
    """
    leaves = np.sqrt(squared_norm(q + dq)) > (strength + rise) * (1.0 + ROUNDING_TOLERANCE)
    strength, rise = np.where(leaves, [strength, rise], 0.0)  # squares of the others may overflow
    A = squared_norm(dq) - rise * rise
    B = np.sum(q * dq, axis=0) - strength * rise
    C = np.maximum(strength * strength - squared_norm(q), 0.0)
    root = np.sqrt(np.maximum(B * B + A * C, 0.0))
    numerator = np.where(B > 0.0, C, root - B)
    denominator = np.where(B > 0.0, B + root, A)
    t = np.divide(numerator, denominator, out=np.zeros_like(A), where=leaves & (denominator > 0.0))
    return leaves, np.where(leaves, np.minimum(t, 1.0), 1.0)
