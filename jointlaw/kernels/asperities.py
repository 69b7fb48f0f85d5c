"""The asperities of a joint, an element: the readable text of their step.

Symbols and order are those of docs/theory-incremental.md. Arrays carry physical axes first and
joints last: facets (M, B), cells (M, D, B), sliders (2, M, D, B). Rows of their state are q (2 M
D), the shear force of a slider times lam, in the basis (s, t) of its facet: that of Eq. 25 where
the joint is mated. With asperities that yield follow flattened depth (M) | plastic work (1); with
wear, the share of the slopes that is gone (1) | work that wears them (1).
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..discretisation.first_loading import FirstLoading
from ..discretisation.tables import FacetTables, largest_reach
from ..support.checks import Array
from ..support.thresholds import (
    FRICTION_TOLERANCE,
    MIN_CHORD_STEP,
    MIN_DIVISOR,
    ROUNDING_TOLERANCE,
    UNDERFLOW,
)
from .cells import Cells, cells, compliance, reciprocal
from .element import Element, ElementResponse, Measures
from .mating import Planes, Turning, first_touch, offset, planes, turning
from .stiffness import bend_of, joining, rises, stiffness_of
from .wear import lowered, worn_share
from .yielding import flatten, flattened, plastic_work, softening

Flags = NDArray[np.bool_]
FARTHEST = 1e150  # mating lengths of slip: beyond it squares of the distance overflow


class State(NamedTuple):
    """The parts of the asperities' rows (rows, B) of a state, as views."""

    q: Array
    depth: Array  # flattened depth of every facet (M, B), no rows where asperities do not yield
    plastic: Array  # (B,) or no rows
    worn: Array  # share of the slopes that is gone (B,), or no rows
    work: Array  # of shear, which wears them (B,), or no rows

    @property
    def slopes(self) -> Array:
        """Share of the slopes that is left (B,)."""
        return 1 - self.worn if self.worn.size else np.ones(self.q.shape[-1])


class Sliders(NamedTuple):
    """The sliders of a step: trial forces (2, M, D, B), the rest (M, D, B)."""

    trial: Array  # q before the friction limit
    size: Array  # |trial|
    strength: Array  # mu lam A gamma: the friction limit of q over G
    cap: Array  # strength G: the friction limit of q
    share: Array  # cap over size where the slider slips, 1 elsewhere
    chord: Array  # of G over the step: stiffness of springs that were added on the way
    grows: Flags  # whether the stiffness of the cell has grown
    near: Flags  # whether y has hardly changed
    slips: Flags  # whether the slider is at its friction limit, but for rounding

    @property
    def unit(self) -> Array:
        """Direction of the trial force (2, M, D, B)."""
        size = self.size
        return np.divide(self.trial, size, out=np.zeros_like(self.trial), where=size > 0)

    @property
    def push(self) -> Array:
        """Derivative (2, M, D, B) of q by G: strength along a slider that slips, 0 elsewhere."""
        return np.where(self.slips, self.strength * self.unit, 0.0)


class Asperities(Element):
    """Asperities that stick, slip and part; with mating, yielding and wear where the law has it."""

    native_name = "asperities"

    def __init__(self, k: FacetTables) -> None:
        self.k, M = k, len(k.c1)
        self.rows = {"q": 2 * M * k.cells}
        self.rows |= {"depth": M, "plastic": 1} if k.yields else {}
        self.rows |= {"worn": 1, "work": 1} if k.wears else {}
        self.stretch = 1.0 + 2.0 * float(np.max(np.abs(k.m)))
        reach = largest_reach(k.curve, k.area, k.theta, k.asperity)
        self.reach = min(reach, FARTHEST * k.mating_length)
        self.farthest = self.first_loading.farthest

    def numbers(self) -> dict[str, float]:
        k, (more, most) = self.k, joining(self.k)
        return {
            "facets": len(k.c1),
            "cells": k.cells,
            "pieces": len(k.curve.S),
            "yields": int(k.yields),
            "interlock_decays": int(k.fades),
            "degrades": int(k.wears),
            "stiffness_ratio": 1.0 / k.lam,
            "mu": k.mu,
            "mating_length": k.mating_length,
            "slope_wear": k.slope_wear,
            "slope_residual": k.slope_residual,
            "first_touch_closure": float(first_touch(k)[0]) if k.fades and k.dim > 1 else 0.0,
            "eta": k.curve.eta,
            "curve_scale": k.curve.scale,
            "curve_exponent": float(k.curve.rise),
            "normal_stress_factor": self.first_loading.factor,
            "stiffness_factor": float(np.sum(k.area / k.c1)),
            "curvature_stiffness_factor": float(np.sum(bend_of(k))) if k.fades else 0.0,
            "engagement_stiffness_factor": more,
            "engagement_stiffness_limit": most,
        }

    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """As `Element.step`.

        1. Where slopes wear they have, by the work of shear so far ("Wear"). The joint moves by d.
           Every facet then has y = n . (closure, offset)/c1, before and after; the offset is the
           displacement in the plane, less than the mating length ("Mating").
        2. Virgin curve at y: Phi, Phi', and the share G, kappa = dG/dy of every depth cell ("Few
           cells, exact virgin curve").
        3. Sliders are loaded by the increment de of the facet's plane at mid-step. Where kappa
           grew, q += A/c1 chord de; where it fell, the springs that part take their force along,
           q = q kappa1/kappa0 + A/c1 kappa1 de.
        4. Coulomb friction: |q| <= mu lam A gamma G (Eq. 5, 6).
           Where asperities yield, Phi, G and kappa are less their values at the flattened depth
           ("Yielding").
        5. Traction: F = sum of A Phi n + (1/lam) sum of q (Eq. 21), by the planes at the end.
        6. Dissipated energy, every term >= 0 ("No step creates energy"). What of friction is work
           of the joint's own shear wears slopes from the next step on.
        7. Tangent C = dF/dd ("The tangent"), not without `tangent`.
        """
        k, old, new_ = self.k, parts(self.k, state), parts(self.k, new)
        q, lost, slopes = old.q, np.zeros(d.shape[1]), old.slopes
        if k.wears:
            new_.worn[:] = worn_share(k, old.worn, old.work)
            slopes = new_.slopes
            q, lost = wear(k, delta, old, slopes)
        moved = delta + d
        middle = planes(k, delta[1:] + 0.5 * d[1:], slopes)
        end = planes(k, moved[1:], slopes)

        before = cells(k, effective_closure(k, delta, slopes))
        after = cells(k, effective_closure(k, moved, slopes))
        gained, flat0, flat1 = after.G - before.G, None, None
        if k.yields:
            new_.depth[:] = flatten(k, old.depth, after.y)
            flat0, flat1 = cells(k, old.depth), cells(k, new_.depth)
            crushed = plastic_work(k, before.y, after.y, flat0, flat1)
            new_.plastic[:] = old.plastic + crushed
            gained = after.G - np.maximum(before.G, flat0.G)
            before, after = flattened(before, flat0), flattened(after, flat1)

        de = np.einsum("edmb,db->emb", middle.basis, d)[:, :, None]  # in the facet (2, M, 1, B)
        sliders = load(k, before, gained, after, strength(k, end.gamma), q, de)
        resolved = (
            sliders.size**2 > MIN_DIVISOR
        )  # squares of smaller forces underflow: they count as zero
        new_.q[:] = np.where(resolved, sliders.share, 0.0) * sliders.trial
        F = resultant(k, end, after.force, new_.q)

        rubbed = friction_loss(k, before, after, q, sliders)
        lost = lost + rubbed
        if k.wears:
            F0 = resultant(k, planes(k, delta[1:], slopes), before.force, q)
            new_.work[:] = old.work + np.minimum(rubbed, shear_work(F0, F, d))
        if k.yields:
            lost = lost + crushed
        if not tangent:
            return ElementResponse(F, lost, None)
        E = middle.basis
        if k.fades:  # the middle moves by half of what d changes by
            turned = turning(k, delta[1:] + 0.5 * d[1:], slopes).basis
            E = np.broadcast_to(E, (*E.shape[:3], d.shape[1])).copy()
            E[:, 1:] += 0.5 * np.einsum("edjmb,db->ejmb", turned, d)
        C = stiffness(k, before, after, sliders, de, E, end)
        if flat0 is not None and flat1 is not None:
            C = C - softening(k, after, flat0, flat1, sliders.push, end)
        if k.fades:
            C[:, 1:] += bending(k, after, sliders, new_.q, end, turning(k, moved[1:], slopes))
        return ElementResponse(F, lost, C)

    def traction(self, delta: Array, state: Array) -> Array:
        """As `Element.traction`: slopes that are to wear in the next step have not yet."""
        held = state.copy()
        parts(self.k, held).work[:] = 0.0
        return super().traction(delta, held)

    def measures(self, delta: Array, state: Array) -> Measures:
        k, now = self.k, parts(self.k, state)
        virgin = cells(k, effective_closure(k, delta, now.slopes))
        held = flattened(virgin, cells(k, now.depth) if k.yields else None)
        limit = strength(k, planes(k, delta[1:], now.slopes).gamma)
        q2 = now.q[0] ** 2 + now.q[1] ** 2
        capped = at_limit(np.sqrt(q2), limit, held.G, virgin.force)
        weight = (k.weight / k.weight.sum())[:, None]
        touches = held.y > (now.depth if k.yields else 0.0)
        sliding = np.sum(weight * (touches & np.all(capped, axis=1)), axis=0)
        total = np.where(held.force > 0, held.force, 1.0)
        slipping = np.sum(np.where(capped, held.G, 0.0), axis=1) / total
        normal = k.curve.energy(held.y)
        if k.yields:
            normal = normal - k.curve.energy(now.depth)
            normal = normal - k.curve.force(now.depth)[0] * (held.y - now.depth)
            normal = np.where(touches, np.maximum(normal, 0.0), 0.0)
        stored = np.sum((k.area * k.c1)[:, None] * normal, axis=0)
        return Measures(
            sliding,
            np.sum(weight * slipping, axis=0),
            np.sum(weight * ~touches, axis=0),
            stored + np.sum(compliance(k) * q2 * reciprocal(held.kappa), axis=(0, 1)),
            np.max(held.y, axis=0),
        )

    def normal_stress(self, closure: Array) -> Array:
        """As `Element.normal_stress`, of infinitely many depth cells: a joint's own slip later."""
        return self.first_loading.stress(closure)

    def stiffness(self, delta: Array, state: Array) -> Array:
        """As `Element.stiffness`; yielded asperities are less stiff."""
        return stiffness_of(self.k, effective_closure(self.k, delta, parts(self.k, state).slopes))

    def largest_stiffness(self, closure: Array, shear: Array) -> Array:
        # shear closes one of two opposite facets, which are alike, and opens the other
        closed = (closure[..., None] + 0.0 * self.k.c1, closure[..., None] + rises(self.k, shear))
        level, risen = (stiffness_of(self.k, np.moveaxis(y, -1, 0)) for y in closed)
        return 0.5 * (level + risen)

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """As `Element.shear_stiffness`: the secant normal stiffness over lam."""
        return stress / float(delta[0, 0]) / self.k.lam if len(delta) > 1 else 0.0

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """As `Element.first_loading_stiffness`.

        In a strength reduction F a facet at inclination theta has the normal (cos, sin/F) and the
        tangent (-sin, cos/F), so its elastic stiffness is the largest eigenvalue of a 2 x 2 matrix.
        Friction adds at most mu times the square of the length of the normal.
        """
        bound = self.largest_stiffness(closure, np.zeros(()))
        F, lam, mu, theta = reduction, self.k.lam, self.k.mu, self.k.theta
        if F == 1.0:
            return bound
        normal = np.cos(theta) ** 2 + np.sin(theta) ** 2 / F**2  # squares of the lengths
        tangent = np.sin(theta) ** 2 + np.cos(theta) ** 2 / F**2
        mixed = (np.cos(theta) * np.sin(theta) * (1 / F**2 - 1)) ** 2  # square of their product
        spread = np.sqrt((normal - tangent / lam) ** 2 + 4 * mixed / lam)
        elastic = 0.5 * (normal + tangent / lam + spread)
        largest = float((elastic + mu * normal).max())
        return bound * (largest / (max(1.0, 1 / lam) + mu))

    @cached_property
    def first_loading(self) -> FirstLoading:
        """First closure without shear."""
        return FirstLoading.of(self.k.curve, self.k.theta, self.k.area, self.k.asperity)


def parts(k: FacetTables, state: Array) -> State:
    """Views of the parts of the asperities' rows, q as (2, M, D, B)."""
    M = len(k.c1)
    q, rest = np.split(state, [2 * M * k.cells])
    depth, plastic = (rest[:M], rest[M]) if k.yields else (rest[:0], rest[:0])
    worn, work = rest[-2:] if k.wears else (rest[:0], rest[:0])
    return State(q.reshape(2, M, k.cells, -1), depth, plastic, worn, work)


def shear_work(F0: Array, F: Array, d: Array) -> Array:
    """Size (B,) of the work in J/m2 of the shear stress, from F0 to F, in the increment d."""
    return np.abs(0.5 * np.sum((F0[1:] + F[1:]) * d[1:], axis=0))


def effective_closure(k: FacetTables, delta: Array, slopes: Array) -> Array:
    """Effective closure y = n . (closure, offset)/c1 of every facet (M, B)."""
    y = k.m[0][:, None] * delta[0]
    for row, o in zip(k.m[1:], offset(k, delta[1:]), strict=True):
        y = y + row[:, None] * (slopes * o if k.wears else o)
    return np.where(np.abs(y) < UNDERFLOW, 0.0, y)


def wear(k: FacetTables, delta: Array, old: State, slopes: Array) -> tuple[Array, Array]:
    """q (2, M, D, B) and lost energy (B,) after slopes have fallen to the share `slopes` (B,)."""
    flat = cells(k, old.depth) if k.yields else None
    was, now = (
        flattened(cells(k, effective_closure(k, delta, share)), flat)
        for share in (old.slopes, slopes)
    )
    mean = 0.5 * (k.area * k.c1)[:, None] * (was.force + now.force)
    normal = np.sum(mean * (was.y - now.y), axis=0)
    limit = strength(k, planes(k, delta[1:], slopes).gamma)
    q, lost = lowered(k, was, now, limit, old.q)
    return q, lost + np.maximum(normal, 0.0)  # >= 0 by the pairs of facets, but for rounding


def load(
    k: FacetTables, before: Cells, gained: Array, after: Cells, strength: Array, q: Array, de: Array
) -> Sliders:
    """Trial forces of all sliders and their friction limits: steps 3 and 4 of `step`.

    gained: what G of every cell grows by, before springs yield at the new y, which they do at once.
    """
    kappa0, kappa1 = before.kappa, after.kappa
    dy = (after.y - before.y)[:, None]
    near = np.abs(dy) <= MIN_CHORD_STEP * np.abs(after.y)[:, None]
    if k.yields:  # all flattened springs touch at one closure: the mean is wrong in that step
        near = near & ((kappa0 > 0) | (kappa1 == 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = np.where(near, 0.5 * (kappa0 + kappa1), gained / dy)
    chord = np.clip(chord, np.minimum(kappa0, kappa1), np.maximum(kappa0, kappa1))
    a = (k.area / k.c1)[:, None, None]
    grows = kappa1 > kappa0
    kept = np.divide(kappa1, kappa0, out=np.zeros_like(kappa0), where=kappa0 > 0)
    trial = np.where(grows, q + a * chord * de, q * kept + a * kappa1 * de)
    cap = strength * after.G
    size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
    share = np.divide(cap, size, out=np.ones_like(size), where=size > cap)
    force = k.curve.force(after.y)[0] if k.yields else after.force
    slips = at_limit(size, strength, after.G, force)
    return Sliders(trial, size, strength, cap, share, chord, grows, near, slips)


def strength(k: FacetTables, gamma: Array) -> Array:
    """mu lam A gamma per facet (M, 1, B): the friction limit of q over G."""
    return k.mu * k.lam * k.area[:, None, None] * gamma[:, None]


def resultant(k: FacetTables, now: Planes, force: Array, q: Array) -> Array:
    """Traction F (dim, B) of the normal forces A Phi n, force = Phi (M, B), and the sliders q."""
    F = np.einsum("dmb,mb->db", now.n, k.area[:, None] * force)
    return F + np.einsum("edmb,emb->db", now.basis, q.sum(axis=2)) / k.lam


def at_limit(size: Array, strength: Array, G: Array, force: Array) -> Flags:
    """Whether sliders whose |q| is `size` are at their friction limit, but for rounding.

    force: Phi (M, B) of the virgin curve, whose rounding G has.
    """
    return size >= strength * (G * (1 - FRICTION_TOLERANCE) - ROUNDING_TOLERANCE * force[:, None])


def friction_loss(k: FacetTables, before: Cells, after: Cells, q: Array, sliders: Sliders) -> Array:
    """Energy (B,) in J/m2 that sliders, and springs that part under shear, lose in a step.

    Where the stiffness grows, the force goes along the chord from q to its friction limit and
    slides there. Each term is >= 0 as written, for kappa0 <= chord <= kappa1 then.
    """
    kappa0, chord, share = before.kappa, sliders.chord, sliders.share
    q2, trial2 = q[0] ** 2 + q[1] ** 2, sliders.size**2
    r0, r1, rc = reciprocal(kappa0), reciprocal(after.kappa), reciprocal(chord)
    hardening = share * (share * trial2) * (rc - r1) + np.where(
        kappa0 > MIN_DIVISOR, q2 * (r0 - rc), 0.0
    )
    softening = (kappa0 - after.kappa) * r0 * (q2 * r0)
    lost = np.where(sliders.grows, np.where(chord > MIN_DIVISOR, hardening, 0.0), softening)
    lost = lost + 2 * share * (1 - share) * (trial2 * np.where(sliders.grows, rc, r1))
    return np.sum(compliance(k) * lost, axis=(0, 1))


def stiffness(
    k: FacetTables, before: Cells, after: Cells, sliders: Sliders, de: Array, E: Array, end: Planes
) -> Array:
    """Tangent C = dF/dd (dim, dim, B) of planes that keep their slopes.

    J_q = beta (I - s s^T) E + v g^T per cell, summed; E (2, dim, M, B) is d(de)/dd.
    """
    trial, share, chord, grows = sliders.trial, sliders.share, sliders.chord, sliders.grows
    y, kappa = after.y, after.kappa
    a = (k.area / k.c1)[:, None, None]
    depth = k.depth[:, :, None]
    inside = (y[:, None] > depth[:, :-1]) & (y[:, None] < depth[:, 1:])
    p = np.where(inside, k.curve.curvature(y)[:, None], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        chord_slope = np.where(sliders.near, p / 2, (kappa - chord) / (y - before.y)[:, None])
    # rounding must not decide: a facet that did not close has not grown; q at its limit slips
    stiffer = grows & ((y - before.y) > ROUNDING_TOLERANCE * np.abs(y))[:, None]
    v = np.where(stiffer, a * chord_slope * de, p * reciprocal(kappa) * trial)
    beta = np.where(sliders.cap > 0, a * np.where(grows, chord, kappa), 0.0)
    slips, unit = sliders.slips, sliders.unit
    v = np.where(slips, share * (v - unit * np.sum(unit * v, axis=0)), v)
    v = v + np.where(slips, sliders.strength * kappa * unit, 0.0)
    beta = np.where(slips, share * beta, beta)
    outer = np.where(slips, unit[:, None] * unit[None], 0.0)
    inner = np.sum(beta * (np.eye(2)[:, :, None, None, None] - outer), axis=3)  # (2, 2, M, B)
    along = end.n * (k.area[:, None] * after.slope)
    along = along + np.einsum("edmb,emb->dmb", end.basis, np.sum(v, axis=2)) / k.lam
    C = np.einsum("imb,jmb->ijb", along, np.broadcast_to(end.g, along.shape))
    return C + np.einsum("eimb,efmb,fjmb->ijb", end.basis, inner, E) / k.lam


def bending(
    k: FacetTables, after: Cells, sliders: Sliders, q: Array, end: Planes, turned: Turning
) -> Array:
    """Part (dim, dim - 1, B) of the tangent by which the planes at the end turn and flatten."""
    limited = np.sum(sliders.push * after.G, axis=2)  # of q by log(gamma)
    by_gamma = np.einsum("eimb,emb->imb", end.basis, limited / end.gamma) / k.lam
    C = np.einsum("ijmb,mb->ijb", turned.n, k.area[:, None] * after.force)
    C = C + np.einsum("eijmb,emb->ijb", turned.basis, q.sum(axis=2)) / k.lam
    return C + np.einsum("imb,jmb->ijb", by_gamma, turned.gamma)
