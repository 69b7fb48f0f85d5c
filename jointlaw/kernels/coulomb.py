"""Coulomb's joint in a step: docs/theory-incremental.md, "Coulomb's joint"."""

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


class Slid(NamedTuple):
    """The shear of B joints at the end of the part of a step in which faces touch."""

    q: Array  # (dim - 1, B) in Pa
    w: Array  # (B,)
    lost: Array  # (B,) in J/m2, >= 0
    slides: NDArray[np.bool_]  # (B,)
    trial: Array  # q before it is cut (dim - 1, B)
    cap: Array  # the strength (B,) that q is cut to


class Coulomb(Element):
    """A spring in closure and a spring in shear, which slides where |q| is the strength.

    The strength is c + mu sigma, sigma the normal stress, from cohesion and friction of the intact
    joint (w = 0) to the residual ones (w = 1). Once faces have parted (w = 2) c is zero. Rows of
    the state: shear stress q (dim - 1) in Pa, w. Of p it takes the parameters of `jl.CoulombLaw`; a
    residual value None keeps the value.
    """

    native_name = "coulomb"
    parted = SEPARATED_STATE

    def __init__(self, p: Any, dim: int) -> None:
        self.dim, self.rows = dim, {"shear": dim - 1, "damage": 1}
        self.normal, self.shear = p.normal_stiffness, p.shear_stiffness
        self.friction = min(p.friction, INFINITE_FRICTION)
        self.cohesion, self.weakening = p.cohesion, p.weakening
        left = p.residual_friction, p.residual_cohesion
        self.residual_friction = (
            self.friction if left[0] is None else min(left[0], INFINITE_FRICTION)
        )
        self.residual_cohesion = self.cohesion if left[1] is None else left[1]
        # beyond cohesion/friction there is no strength in shear
        apex = self.cohesion / self.friction if self.friction > 0.0 else np.inf
        self.tension = min(p.tension, apex)
        self.tensile_strength = self.tension
        self.tensile_opening = self.tension / self.normal
        self.tensile_stiffness = self.normal
        self.reach = MAX_STRENGTH / max(self.normal * (1.0 + self.friction), self.shear, 1.0)
        self.farthest = self.reach

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
        """As `Element.step`; the normal stress sigma = kn u, u the closure, goes straight.

        1. An intact joint bears sigma >= -tension with |q| <= c + mu sigma. A straight step leaves
           this set once, for it is convex. One that leaves it under tension tears the joint: w = 2,
           q = sigma = 0, and what both springs stored is lost.
        2. What follows counts while faces touch: from u = 0 on, with q = 0, where they were apart;
           up to u = 0 where they part. Under tension only an intact joint counts as touching.
        3. In that part q grows by ks d_s and is cut to the strength (`slide`).
        4. Where faces part, what q stored is lost, and q = 0, w = 2.
        5. Tangent of the branch where the step ends, with the moment of touch held (`tangent`).
        """
        q, w = state[:-1], state[-1]
        before, after = self.normal * delta[0], self.normal * (delta[0] + d[0])
        change = after - before
        moved = np.where(change == 0.0, 1.0, np.abs(change))

        intact = w == 0.0
        pulled = after < -self.tension * (1.0 + ROUNDING_TOLERANCE)
        until = np.where(pulled, np.clip((before + self.tension) / moved, 0.0, 1.0), 1.0)
        end = np.where(pulled, -self.tension, after)
        dq = self.shear * d[1:] * until
        cap = self.strength(0.0 * w, before)
        leaves, at = leaving(q, dq, cap, self.strength(0.0 * w, end) - cap)
        sigma = before + at * (end - before)
        tears = intact & np.where(leaves, sigma < 0.0, pulled)
        torn = 0.5 * sigma * sigma / self.normal + 0.5 * squared(q + at * dq) / self.shear

        held = intact & ~leaves & ~pulled
        apart = tears | (~intact & (delta[0] < 0.0))
        touches = held | (after >= 0.0)
        parts = ~touches & ~apart
        share = np.where(apart, np.maximum(after, 0.0), np.where(parts, before, moved)) / moved
        start, end = np.where(apart, 0.0, before), np.where(touches, after, 0.0)
        dq = self.shear * d[1:] * share
        slid = self.slide(
            np.where(apart, 0.0, q), np.where(apart, SEPARATED_STATE, w), dq, start, end
        )

        lost = np.where(tears, torn, 0.0) + slid.lost
        lost = lost + np.where(parts, 0.5 * squared(slid.q) / self.shear, 0.0)
        new[:-1] = np.where(touches, slid.q, 0.0)
        new[-1] = np.where(touches, slid.w, SEPARATED_STATE)
        F, C = np.concatenate([end[None], new[:-1]]), None
        if tangent:
            C = self.tangent(np.where(apart, SEPARATED_STATE, w), end, self.shear * share, slid)
            C = np.where(touches, C, 0.0)
        return ElementResponse(F, lost, C)

    def slide(self, q: Array, w: Array, dq: Array, start: Array, end: Array) -> Slid:
        """Shear by dq while the normal stress goes from `start` to `end`.

        1. Strength at the old w, k(sigma) = c + mu sigma. Beyond it w grows by the displacement
           (|q*| - k)/ks over the weakening length, up to 1, q* = q + dq. At constant sigma this is
           the shear displacement, however many steps it takes.
        2. q is cut to the strength h at the new w, in its own direction.
        3. Lost is what is stored where sliding begins, plus the work of h, less what is stored at
           the end: 2 ks lost = k^2 + 2 (integral of h d|q*|) - h^2. Along a line h is quadratic in
           |q*| while the joint weakens (Simpson's rule) and linear after (trapezoid).
        """
        first, trial = self.strength(w, start), q + dq
        cap = self.strength(w, end)
        slides, at = leaving(q, dq, first, cap - first)
        size = np.sqrt(squared(trial))
        way = self.shear * self.weakening  # of |q*| - k, from w = 0 to 1
        beyond = np.where(slides, size - cap, 0.0)
        far = w + beyond / way if way > 0.0 else np.where(slides, 1.0, w)
        now = np.maximum(w, np.minimum(far, 1.0))
        hold = self.strength(now, end)

        ends, done = leaving(q, dq, first + way * np.maximum(1.0 - w, 0.0), cap - first)
        done = np.where(slides & ends, np.maximum(done, at), 1.0)  # where w becomes 1
        begin = self.strength(w, start + at * (end - start))
        middle = self.strength(0.5 * (w + now), start + 0.5 * (at + done) * (end - start))
        weak = self.strength(now, start + done * (end - start))
        reached = np.where(done < 1.0, np.sqrt(squared(q + done * dq)), size)
        area = (reached - begin) * (begin + 4.0 * middle + weak) / 6.0
        area = area + (size - reached) * (0.5 * (weak + hold))
        lost = np.maximum(0.5 * (begin * begin - hold * hold) + area, 0.0) / self.shear
        scale = np.divide(hold, size, out=np.ones_like(size), where=slides)
        return Slid(scale * trial, now, np.where(slides, lost, 0.0), slides, trial, hold)

    def tangent(self, w: Array, sigma: Array, ks: Array, slid: Slid) -> Array:
        """Tangent (dim, dim, B) in Pa/m of joints that touch; w is that before the slide.

        C_nn = kn; C_ss = ks, less in the step in which faces touch, by the part of it before touch.
        Where it slides C_ss = ks h/|q*| (1 - n n), C_sn = mu kn n, and while it weakens, f the fall
        of the strength from w = 0 to 1, over the length L, C_ss -= (f/L) n n, C_sn += (f/L)
        (mu kn/ks) n, with mu at the old w.
        """
        size = np.sqrt(squared(slid.trial))
        n = np.divide(slid.trial, size, out=np.zeros_like(slid.trial), where=size > 0.0)
        along = np.where(slid.cap > 0.0, ks, 0.0)
        across = np.where(slid.slides, 0.0, along)
        turn = np.divide(ks * slid.cap, size, out=along.copy(), where=slid.slides)
        push = np.where(slid.slides, self.normal * self.friction_at(slid.w), 0.0)
        if self.weakening > 0.0:
            fall = self.strength(np.zeros_like(w), sigma) - self.strength(np.ones_like(w), sigma)
            slope = np.where(slid.slides & (slid.w < 1.0), fall / self.weakening, 0.0)
            across = across - slope
            push = push + slope * (self.normal * self.friction_at(w) / self.shear)
        C = np.zeros((self.dim, self.dim, len(w)))
        C[0, 0] = self.normal
        C[1:, 0] = push * n
        C[1:, 1:] = turn * np.eye(self.dim - 1)[:, :, None] + (across - turn) * n[:, None] * n
        return C

    def strength(self, w: Array, sigma: Array) -> Array:
        """Strength in shear (B,) in Pa at this w and this normal stress."""
        c = self.cohesion + (self.residual_cohesion - self.cohesion) * w
        c = np.where(w > 1.0, 0.0, c)
        return np.maximum(c + self.friction_at(w) * sigma, 0.0)

    def friction_at(self, w: Array) -> Array:
        """Coefficient of friction (B,) at this w."""
        return self.friction + (self.residual_friction - self.friction) * np.minimum(w, 1.0)

    def stiffness(self, delta: Array, state: Array) -> Array:
        """Upper bound (B,) of `|C|` in Pa/m; a joint that weakens may exceed it, for its shear
        stress falls: by (f/L) sqrt(1 + (mu kn/ks)^2), f the fall of the strength over the weakening
        length L. A falling stress asks for no smaller time step.
        """
        w = state[-1] if self.weakening > 0.0 else np.ones_like(state[-1])
        mu = self.friction_at(w)
        slides = self.normal * np.hypot(1.0, np.where(mu < INFINITE_FRICTION, mu, 0.0))
        bound = np.maximum(slides, self.shear)
        return np.where((state[-1] > 0.0) & (delta[0] < 0.0), 0.0, bound)

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """As `Element.first_loading_stiffness`: the norm of a tangent with friction, over F."""
        mu = (
            self.friction if self.friction < INFINITE_FRICTION else 0.0
        )  # a joint that never slides
        slides = self.normal * np.hypot(1.0, mu / reduction)
        return np.full(closure.shape, np.maximum(slides, self.shear / reduction**2))

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """As `Element.shear_stiffness`, of a joint that sticks."""
        return self.shear if len(delta) > 1 else 0.0

    def measures(self, delta: Array, state: Array) -> Measures:
        q, w, u = state[:-1], state[-1], delta[0]
        apart = (w > 0.0) & (u < 0.0)
        cap = self.strength(w, self.normal * u)
        sliding = (~apart & (np.sqrt(squared(q)) >= cap * (1.0 - FRICTION_TOLERANCE))).astype(float)
        held = np.where(apart, 0.0, u)
        stored = 0.5 * self.normal * held * held + 0.5 * squared(q) / self.shear
        return Measures(sliding, sliding, apart.astype(float), stored, u)


def squared(q: Array) -> Array:
    """q . q (B,) of vectors (dim - 1, B)."""
    return np.sum(q * q, axis=0)


def leaving(q: Array, dq: Array, cap: Array, rise: Array) -> tuple[NDArray[np.bool_], Array]:
    """Whether |q + t dq| is above cap + t rise at t = 1, and since which t (B,); 1 if it is not.

    |q| <= cap at t = 0, and |q + t dq| is convex in t: it grows beyond once. The root of
    A t^2 + 2 B t = C, free of cancellation.
    """
    leaves = np.sqrt(squared(q + dq)) > (cap + rise) * (1.0 + ROUNDING_TOLERANCE)
    cap, rise = np.where(leaves, [cap, rise], 0.0)  # squares of the others may overflow
    A = squared(dq) - rise * rise
    B = np.sum(q * dq, axis=0) - cap * rise
    C = np.maximum(cap * cap - squared(q), 0.0)
    root = np.sqrt(np.maximum(B * B + A * C, 0.0))
    top, bottom = np.where(B > 0.0, C, root - B), np.where(B > 0.0, B + root, A)
    at = np.divide(top, bottom, out=np.zeros_like(A), where=leaves & (bottom > 0.0))
    return leaves, np.where(leaves, np.minimum(at, 1.0), 1.0)
