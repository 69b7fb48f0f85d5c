"""The asperities of a joint, an element: the readable version of their step.

Symbols and order are as in docs/theory-incremental.md. Arrays carry physical axes first and joints
last: facets (M, B), cells (M, D, B), sliders (2, M, D, B).

The orientations of asperity contacts are represented by M facets, each a bed of springs that
engage at different effective closures. A facet is divided into D cells. A cell has the normal
force of its springs, A G n, which depends on the effective closure alone, and one slider with
Coulomb friction, which carries the shear force of its springs. Only the sliders are history
variables: q (2 M D rows) is the shear force of a slider times lam, in the basis (s, t) of its
facet, which is the basis of Eq. 25 at the interlocked position.

A step evaluates the cells before and after the increment, loads the sliders by the increment of
shear in the facet (the trial state), returns trial forces beyond the Coulomb limit to it (return
mapping), and sums tractions over all facets. The stiffness of a cell changes with closure. Where it
increases, springs without force have engaged, so that a slider is loaded along the chord stiffness
of the step; where it decreases, springs disengage and release their part of the slider force. This
asymmetry makes every term of the dissipated energy non-negative, whatever the step.

Options add rows to the state. If asperities yield: the plastic indentation (M) of every facet and
the plastic work (1), see plasticity.py. If asperities degrade: the lost fraction of the slopes (1),
and what degrades them: the shear work (1), the largest contact stress (1), see degradation.py. If
the interlock decays, planes of facets rotate with slip, see interlock.py.
"""

import math
from copy import copy
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..discretisation.first_loading_response import DegradingFacets, FirstLoadingResponse
from ..discretisation.tables import FacetTables, max_effective_closure
from ..support.checks import Array
from ..support.thresholds import (
    MAX_FLOAT_FORCE,
    MIN_CHORD_STEP,
    MIN_DIVISOR,
    ROUNDING_TOLERANCE,
)
from .cells import Cells, evaluate_cells, reciprocal, slider_compliance
from .degradation import (
    AsperityState,
    climb,
    degrade_by_stress,
    degrade_sliders,
    degrade_slopes,
    slope_energy_rate,
)
from .element import Element, ElementResponse, Measures
from .float_sliders import (
    DOUBLE_TOLERANCES,
    FLOAT_TOLERANCES,
    FrictionTolerances,
    round_sliders,
)
from .interlock import (
    PlaneDerivatives,
    Planes,
    effective_closure,
    first_touch,
    plane_derivatives,
    planes,
    retention_derivatives,
)
from .plasticity import (
    normal_softening,
    plastic_softening,
    plastic_work,
    subtract_plastic,
    update_indentation,
)
from .stiffness import (
    curvature_stiffness,
    engagement_stiffness,
    largest_climb,
    stiffness_bound,
)

Flags = NDArray[np.bool_]
MAX_SLIP = 1e150  # mating lengths: squares of larger slips overflow


class Sliders(NamedTuple):
    """The sliders of a step: trial forces (2, M, D, B), all else (M, D, B)."""

    trial: Array  # q of the trial state
    size: Array  # |trial|
    strength: Array  # mu lam A gamma: the friction limit of q over G
    limit: Array  # strength G: the friction limit of q
    scale: Array  # limit over size if the slider slips, 1 else: return mapping
    chord: Array  # stiffness of G over the step, for springs that engaged on the way
    stiffens: Flags  # whether the stiffness of the cell has increased
    is_small: Flags  # whether y has hardly changed
    slips: Flags  # whether the slider is at its friction limit, but for rounding

    @property
    def direction(self) -> Array:
        """Direction of the trial force (2, M, D, B)."""
        size = self.size
        return np.divide(self.trial, size, out=np.zeros_like(self.trial), where=size > 0)

    @property
    def push(self) -> Array:
        """Derivative (2, M, D, B) of q by G: strength in a slider that slips, 0 in others."""
        return np.where(self.slips, self.strength * self.direction, 0.0)


class AsperityElement(Element):
    """Asperities that stick, slip and separate, with the options of the law.

    k: tables of the facets. `float_sliders` says whether a step rounds the forces of sliders to
    floats, for states that store them so (float_sliders.py).
    """

    native_name = "asperities"

    float_sliders = False
    tolerances = DOUBLE_TOLERANCES

    def __init__(self, k: FacetTables) -> None:
        self.k = k
        M = len(k.c1)
        self.rows = {"q": 2 * M * k.cells}
        if k.yields:
            self.rows |= {"indentation": M, "plastic_work": 1}
        if k.slopes_change:
            self.rows |= {"lost_slopes": 1}
        if k.degrades:
            self.rows |= {"shear_work": 1}
        if k.degrades_by_stress:
            self.rows |= {"peak_contact_stress": 1}
        self.closure_per_displacement = 1.0 + 2.0 * float(np.max(np.abs(k.m)))
        finite = max_effective_closure(k.curve, k.area, k.theta, k.asperity)
        self.max_effective_closure = min(finite, MAX_SLIP * k.mating_length)
        self.max_search_closure = self.first_loading.max_search_closure
        self.row_bounds = {
            "indentation": (0.0, self.max_effective_closure),
            "lost_slopes": (0.0, 1.0),
            "shear_work": (0.0, math.inf),
            "peak_contact_stress": (0.0, math.inf),
        }

    def with_float_sliders(self) -> Self:
        """The same element, whose steps round the forces of sliders to floats."""
        rounding = copy(self)
        rounding.float_sliders = True
        rounding.tolerances = FLOAT_TOLERANCES
        return rounding

    @cached_property
    def max_float_closure(self) -> float:
        """Effective closure (m), a power of ten, up to which slider forces fit into floats."""
        k = self.k
        y = 10.0 ** np.arange(-300.0, 101.0)
        with np.errstate(over="ignore", invalid="ignore"):
            force = k.mu * k.lam * float(np.sum(k.area / k.c1)) * k.curve.force(y)[0]
        fits = np.flatnonzero(force <= MAX_FLOAT_FORCE)  # the force increases with y
        return float(y[fits[-1]]) if fits.size else 0.0

    def numbers(self) -> dict[str, float]:
        """Scalars of `struct jlaw_law` that belong to asperities, by their names in C."""
        k = self.k
        engagement_factor, engagement_limit = engagement_stiffness(k)
        can_be_unmated = k.interlock_decays and k.dim > 1
        curvature = float(np.sum(curvature_stiffness(k))) if k.interlock_decays else 0.0
        return {
            "facets": len(k.c1),
            "cells": k.cells,
            "pieces": len(k.curve.S),
            "yields": int(k.yields),
            "interlock_decays": int(k.interlock_decays),
            "degrades": int(k.degrades),
            "degrades_by_stress": int(k.degrades_by_stress),
            "stiffness_ratio": 1.0 / k.lam,
            "mu": k.mu,
            "mating_length": k.mating_length,
            "slope_wear": k.slope_wear,
            "slope_residual": k.slope_residual,
            "degradation_stress": k.degradation_stress,
            "first_touch_closure": float(first_touch(k)[0]) if can_be_unmated else 0.0,
            "eta": k.curve.eta,
            "curve_scale": k.curve.scale,
            "curve_exponent": float(k.curve.exponent),
            "normal_stress_factor": self.first_loading.factor,
            "stiffness_factor": float(np.sum(k.area / k.c1)),
            "curvature_stiffness_factor": curvature,
            "engagement_stiffness_factor": engagement_factor,
            "engagement_stiffness_limit": engagement_limit,
        }

    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """As `Element.step`.

        1. If asperities degrade, slopes decrease by the shear work so far ("Asperity degradation").
           The joint moves by d. Every facet then has y = n . (closure, offset)/c1, before and
           after; the offset is the in-plane displacement, limited by the mating length ("Loss of
           interlock with slip").
        2. First-loading curve at y: Phi, Phi', and G, kappa = dG/dy of every cell ("Discretisation
           into cells").
        3. Sliders are loaded by the increment de in the plane of the facet at mid-step. Where kappa
           has increased, q += A/c1 chord de; where it has decreased, springs that disengage release
           their force, q = q kappa1/kappa0 + A/c1 kappa1 de.
        4. Return mapping to the Coulomb limit: |q| <= mu lam A gamma G (Eq. 5, 6).
           If asperities yield, Phi, G and kappa are less their values at the plastic indentation
           ("Yielding of asperities").
        5. Traction: F = sum of A Phi n + (1/lam) sum of q (Eq. 21), by the planes at the end.
        6. Dissipated energy, every term >= 0 ("Energy balance"). The work of the joint's own
           shear, at most this dissipation by friction, degrades slopes from the next step on.
        7. Tangent C = dF/dd ("The consistent tangent"), only with `tangent`.
        """
        k = self.k
        old = self.unpack(state)
        updated = self.unpack(new)
        q = old.q
        retention = old.slope_retention
        dissipated = np.zeros(d.shape[1])
        if k.slopes_change:
            updated.lost_slopes[:] = old.lost_slopes
        if k.degrades:
            updated.lost_slopes[:] = degrade_slopes(k, old)
            retention = updated.slope_retention
            q, dissipated = degrade(k, delta, old, retention, self.tolerances)
        after_delta = delta + d
        end_retention = retention
        if k.degrades_by_stress:
            updated.lost_slopes[:], updated.peak_contact_stress[:], retention_slope = (
                degrade_by_stress(k, after_delta, old, updated.lost_slopes)
            )
            end_retention = updated.slope_retention
        middle_retention = 0.5 * (retention + end_retention)
        middle_p = delta[1:] + 0.5 * d[1:]
        middle = planes(k, middle_p, middle_retention)
        end = planes(k, after_delta[1:], end_retention)

        before = evaluate_cells(k, effective_closure(k, delta, retention))
        after = evaluate_cells(k, effective_closure(k, after_delta, end_retention))
        increase = after.G - before.G
        indented0 = None
        indented1 = None
        if k.yields:
            updated.indentation[:] = update_indentation(k, old.indentation, after.y)
            indented0 = evaluate_cells(k, old.indentation)
            indented1 = evaluate_cells(k, updated.indentation)
            work = plastic_work(k, before.y, after.y, indented0, indented1)
            updated.plastic_work[:] = old.plastic_work + work
            increase = after.G - np.maximum(before.G, indented0.G)
            before = subtract_plastic(before, indented0)
            after = subtract_plastic(after, indented1)

        de = np.einsum("edmb,db->emb", middle.basis, d)[:, :, None]  # in the facet (2, M, 1, B)
        limit = friction_limit(k, end.gamma)
        sliders = load_sliders(k, before, increase, after, limit, q, de, self.tolerances)
        # squares of smaller forces underflow: such forces count as zero
        is_resolved = sliders.size**2 > MIN_DIVISOR
        updated.q[:] = np.where(is_resolved, sliders.scale, 0.0) * sliders.trial
        if self.float_sliders:
            updated.q[:] = round_sliders(old.q, updated.q, after_delta)
        F = sum_traction(k, end, after.force, updated.q)

        friction = friction_dissipation(k, before, after, q, sliders)
        dissipated = dissipated + friction
        if k.degrades:
            F0 = sum_traction(k, planes(k, delta[1:], retention), before.force, q)
            updated.shear_work[:] = old.shear_work + np.minimum(friction, shear_work(F0, F, d))
        if k.degrades_by_stress:
            ends = ((delta, before), (after_delta, after))
            rates = [np.sum(slope_energy_rate(k, delta_, cells), axis=0) for delta_, cells in ends]
            # >= 0, but for rounding, because opposite facets have the same weight
            normal_loss = np.maximum(0.5 * sum(rates) * (retention - end_retention), 0.0)
            dissipated = dissipated + normal_loss
        if k.yields:
            dissipated = dissipated + work
        if not tangent:
            return ElementResponse(F, dissipated, None)
        E = middle.basis
        if k.interlock_decays:  # the middle moves by half of the change of d
            derivative = plane_derivatives(k, middle_p, middle_retention).basis
            E = np.broadcast_to(E, (*E.shape[:3], d.shape[1])).copy()
            E[:, 1:] += 0.5 * np.einsum("edjmb,db->ejmb", derivative, d)
        C = tangent_of_fixed_planes(k, before, after, sliders, de, E, end)
        if indented0 is not None and indented1 is not None:
            C = C - plastic_softening(k, after, indented0, indented1, sliders.push, end)
        if k.interlock_decays:
            rotation = plane_derivatives(k, after_delta[1:], end_retention)
            C[:, 1:] += tangent_of_rotation(k, after, sliders, updated.q, end, rotation)
        if k.degrades_by_stress:
            # the same three parts for a change of the retention instead of d
            flattening = retention_derivatives(k, middle_p, middle_retention).basis
            E = 0.5 * np.einsum("edjmb,db->ejmb", flattening, d)
            climbing = end._replace(g=climb(k, after_delta)[None])
            rotation = retention_derivatives(k, after_delta[1:], end_retention)
            by_retention = tangent_of_fixed_planes(k, before, after, sliders, de, E, climbing)
            by_retention += tangent_of_rotation(k, after, sliders, updated.q, end, rotation)
            scale = (k.area * k.c1)[:, None]
            by_d = np.einsum("mb,jmb->jb", scale * after.slope, end.g)
            if indented0 is not None and indented1 is not None:
                by_retention -= plastic_softening(
                    k, after, indented0, indented1, sliders.push, climbing
                )
                by_d -= normal_softening(k, after, indented0, indented1, end)
            C = C + by_retention * (retention_slope * by_d)
        return ElementResponse(F, dissipated, C)

    def traction(self, delta: Array, state: Array) -> Array:
        """As `Element.traction`, before the degradation that the next step would begin with."""
        undegraded = state.copy()
        self.unpack(undegraded).shear_work[:] = 0.0
        return super().traction(delta, undegraded)

    def measures(self, delta: Array, state: Array) -> Measures:
        """As `Element.measures`: a facet slides where all its cells are at their friction limit."""
        k = self.k
        now = self.unpack(state)
        elastic = evaluate_cells(k, effective_closure(k, delta, now.slope_retention))
        indented = evaluate_cells(k, now.indentation) if k.yields else None
        cells = subtract_plastic(elastic, indented)
        limit = friction_limit(k, planes(k, delta[1:], now.slope_retention).gamma)
        q2 = now.q[0] ** 2 + now.q[1] ** 2
        slips = is_at_limit(np.sqrt(q2), limit, cells.G, elastic.force, self.tolerances)
        weight = (k.weight / k.weight.sum())[:, None]
        touches = cells.y > (now.indentation if k.yields else 0.0)
        sliding = np.sum(weight * (touches & np.all(slips, axis=1)), axis=0)
        total = np.where(cells.force > 0, cells.force, 1.0)
        slipping = np.sum(np.where(slips, cells.G, 0.0), axis=1) / total
        normal = k.curve.energy(cells.y)
        if k.yields:
            normal = normal - k.curve.energy(now.indentation)
            normal = normal - k.curve.force(now.indentation)[0] * (cells.y - now.indentation)
            normal = np.where(touches, np.maximum(normal, 0.0), 0.0)
        normal_energy = np.sum((k.area * k.c1)[:, None] * normal, axis=0)
        shear_energy = np.sum(slider_compliance(k) * q2 * reciprocal(cells.kappa), axis=(0, 1))
        return Measures(
            sliding,
            np.sum(weight * slipping, axis=0),
            np.sum(weight * ~touches, axis=0),
            normal_energy + shear_energy,
            np.max(cells.y, axis=0),
        )

    def normal_stress(self, closure: Array) -> Array:
        """As `Element.normal_stress`, in the limit of many cells: a joint's own cells slip later.

        Few cells differ only if asperities yield.
        """
        return self.first_loading.stress(closure)

    def stiffness(self, delta: Array, state: Array) -> Array:
        """As `Element.stiffness`, without plastic indentation, which lowers it."""
        retention = self.unpack(state).slope_retention
        return stiffness_bound(self.k, effective_closure(self.k, delta, retention))

    def largest_stiffness(self, closure: Array, shear: Array) -> Array:
        """As `Element.largest_stiffness`.

        Shear closes one of two opposite facets, which have the same weight, and opens the other.
        """
        level = closure[..., None] + 0.0 * self.k.c1
        climbed = closure[..., None] + largest_climb(self.k, shear)
        bounds = [stiffness_bound(self.k, np.moveaxis(y, -1, 0)) for y in (level, climbed)]
        return 0.5 * (bounds[0] + bounds[1])

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
        F = reduction
        if F == 1.0:
            return bound
        lam = self.k.lam
        mu = self.k.mu
        cos2 = np.cos(self.k.theta) ** 2
        sin2 = np.sin(self.k.theta) ** 2
        normal2 = cos2 + sin2 / F**2  # squares of the lengths
        tangent2 = sin2 + cos2 / F**2
        mixed2 = cos2 * sin2 * (1 / F**2 - 1) ** 2  # square of their product
        spread = np.sqrt((normal2 - tangent2 / lam) ** 2 + 4 * mixed2 / lam)
        elastic = 0.5 * (normal2 + tangent2 / lam + spread)
        largest = float((elastic + mu * normal2).max())
        return bound * (largest / (max(1.0, 1 / lam) + mu))

    @cached_property
    def first_loading(self) -> FirstLoadingResponse:
        """First closure without shear."""
        k = self.k
        response = FirstLoadingResponse.of(k.curve, k.theta, k.area, k.asperity)
        if not k.degrades_by_stress:
            return response
        lam_mu = (k.lam, k.mu)
        parameters = (k.degradation_stress, k.slope_residual)
        facets = DegradingFacets(k.theta, k.area, k.yield_depth, *lam_mu, *parameters)
        return response._replace(degradation=facets)

    def unpack(self, rows: Array) -> AsperityState:
        """Views of the parts of the rows (rows, B) of asperities, q as (2, M, D, B)."""
        k = self.k
        M = len(k.c1)
        q, options = np.split(rows, [2 * M * k.cells])
        none = options[:0]
        indentation, work = (options[:M], options[M]) if k.yields else (none, none)
        degradation = options[M + 1 :] if k.yields else options
        lost_slopes = degradation[0] if k.slopes_change else none
        shear_work = degradation[1] if k.degrades else none
        peak = degradation[-1] if k.degrades_by_stress else none
        return AsperityState(
            q.reshape(2, M, k.cells, -1), indentation, work, lost_slopes, shear_work, peak
        )


def shear_work(F0: Array, F: Array, d: Array) -> Array:
    """Size (B,) in J/m2 of the work of the shear stress, F0 before and F after the increment d.

    The mean of the sizes at both: where the shear stress reverses in the step, its own mean would
    vanish.
    """
    before, after = (np.abs(np.sum(stress[1:] * d[1:], axis=0)) for stress in (F0, F))
    mean: Array = 0.5 * (before + after)
    return mean


def degrade(
    k: FacetTables,
    delta: Array,
    old: AsperityState,
    slope_retention: Array,
    tolerances: FrictionTolerances = DOUBLE_TOLERANCES,
) -> tuple[Array, Array]:
    """Slider forces and dissipated energy after slopes decrease while the joint is at rest.

    The slope retention falls from `old.slope_retention` to `slope_retention` (B,) at the
    displacement `delta`, so facets lose effective closure. Returns the new slider forces q, of the
    shape of `old.q`, and the energy (B,) in J/m2 that normal springs and sliders lose.
    """
    indented = evaluate_cells(k, old.indentation) if k.yields else None
    before, after = (
        subtract_plastic(evaluate_cells(k, effective_closure(k, delta, retention)), indented)
        for retention in (old.slope_retention, slope_retention)
    )
    mean = 0.5 * (k.area * k.c1)[:, None] * (before.force + after.force)
    normal = np.sum(mean * (before.y - after.y), axis=0)
    limit = friction_limit(k, planes(k, delta[1:], slope_retention).gamma)
    q, dissipated = degrade_sliders(k, before, after, limit, old.q, tolerances.beyond)
    # >= 0, but for rounding, because opposite facets have the same weight
    return q, dissipated + np.maximum(normal, 0.0)


def load_sliders(
    k: FacetTables,
    before: Cells,
    increase: Array,
    after: Cells,
    strength: Array,
    q: Array,
    de: Array,
    tolerances: FrictionTolerances = DOUBLE_TOLERANCES,
) -> Sliders:
    """Trial forces of all sliders and their friction limits: steps 3 and 4 of `step`.

    increase: of G of every cell (M, D, B), before springs yield at the new y, which they do at
    once. strength: friction limit of q over G; de: increment of shear (2, M, 1, B).
    """
    kappa0 = before.kappa
    kappa1 = after.kappa
    dy = (after.y - before.y)[:, None]
    is_small = np.abs(dy) <= MIN_CHORD_STEP * np.abs(after.y)[:, None]
    if k.yields:  # plastic springs engage at one closure: the mean is wrong in that step
        is_small = is_small & ((kappa0 > 0) | (kappa1 == 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = np.where(is_small, 0.5 * (kappa0 + kappa1), increase / dy)
    chord = np.clip(chord, np.minimum(kappa0, kappa1), np.maximum(kappa0, kappa1))
    a = (k.area / k.c1)[:, None, None]
    stiffens = kappa1 > kappa0
    remaining = np.divide(kappa1, kappa0, out=np.zeros_like(kappa0), where=kappa0 > 0)
    trial = np.where(stiffens, q + a * chord * de, q * remaining + a * kappa1 * de)
    limit = strength * after.G
    size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
    is_beyond = size > (1 + tolerances.beyond) * limit
    scale = np.divide(limit, size, out=np.ones_like(size), where=is_beyond)
    force = k.curve.force(after.y)[0] if k.yields else after.force
    slips = is_at_limit(size, strength, after.G, force, tolerances)
    return Sliders(trial, size, strength, limit, scale, chord, stiffens, is_small, slips)


def friction_limit(k: FacetTables, gamma: Array) -> Array:
    """mu lam A gamma per facet (M, 1, B): the friction limit of q over G."""
    return k.mu * k.lam * k.area[:, None, None] * gamma[:, None]


def sum_traction(k: FacetTables, now: Planes, force: Array, q: Array) -> Array:
    """Traction F (dim, B) of the normal forces A Phi n, force = Phi (M, B), and the sliders q."""
    F = np.einsum("dmb,mb->db", now.n, k.area[:, None] * force)
    return F + np.einsum("edmb,emb->db", now.basis, q.sum(axis=2)) / k.lam


def is_at_limit(
    size: Array,
    strength: Array,
    G: Array,
    force: Array,
    tolerances: FrictionTolerances = DOUBLE_TOLERANCES,
) -> Flags:
    """Whether sliders whose |q| is `size` are at their friction limit, but for rounding.

    force: Phi (M, B) of the first-loading curve, whose rounding error G has.
    """
    tolerated = G * (1 - tolerances.below) - ROUNDING_TOLERANCE * force[:, None]
    return size >= strength * tolerated


def friction_dissipation(
    k: FacetTables, before: Cells, after: Cells, q: Array, sliders: Sliders
) -> Array:
    """Energy (B,) in J/m2 dissipated by slip, and by springs that disengage under shear.

    Where the stiffness increases, the force goes along the chord from q to its friction limit and
    slides there. Each term is >= 0 as written, because then kappa0 <= chord <= kappa1.
    """
    kappa0 = before.kappa
    chord = sliders.chord
    scale = sliders.scale
    q2 = q[0] ** 2 + q[1] ** 2
    trial2 = sliders.size**2
    r0 = reciprocal(kappa0)
    r1 = reciprocal(after.kappa)
    rc = reciprocal(chord)
    elastic = np.where(kappa0 > MIN_DIVISOR, q2 * (r0 - rc), 0.0)
    hardening = scale * (scale * trial2) * (rc - r1) + elastic
    hardening = np.where(chord > MIN_DIVISOR, hardening, 0.0)
    disengaged = (kappa0 - after.kappa) * r0 * (q2 * r0)
    dissipated = np.where(sliders.stiffens, hardening, disengaged)
    slip = trial2 * np.where(sliders.stiffens, rc, r1)
    dissipated = dissipated + 2 * scale * (1 - scale) * slip
    return np.sum(slider_compliance(k) * dissipated, axis=(0, 1))


def tangent_of_fixed_planes(
    k: FacetTables, before: Cells, after: Cells, sliders: Sliders, de: Array, E: Array, end: Planes
) -> Array:
    """Tangent C = dF/dd (dim, dim, B) for planes whose slopes do not change.

    J_q = beta (I - s s^T) E + v g^T per cell, summed; E (2, dim, M, B) is d(de)/dd.
    """
    trial = sliders.trial
    scale = sliders.scale
    chord = sliders.chord
    stiffens = sliders.stiffens
    slips = sliders.slips
    direction = sliders.direction
    y = after.y
    kappa = after.kappa
    a = (k.area / k.c1)[:, None, None]
    depth = k.cell_depth[:, :, None]
    inside = (y[:, None] > depth[:, :-1]) & (y[:, None] < depth[:, 1:])
    p = np.where(inside, k.curve.curvature(y)[:, None], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        chord_slope = np.where(sliders.is_small, p / 2, (kappa - chord) / (y - before.y)[:, None])
    # rounding must not decide: a facet that has not closed is not stiffer; q at its limit slips
    closes = ((y - before.y) > ROUNDING_TOLERANCE * np.abs(y))[:, None]
    v = np.where(stiffens & closes, a * chord_slope * de, p * reciprocal(kappa) * trial)
    beta = np.where(sliders.limit > 0, a * np.where(stiffens, chord, kappa), 0.0)
    v = np.where(slips, scale * (v - direction * np.sum(direction * v, axis=0)), v)
    v = v + np.where(slips, sliders.strength * kappa * direction, 0.0)
    beta = np.where(slips, scale * beta, beta)
    outer = np.where(slips, direction[:, None] * direction[None], 0.0)
    inner = np.sum(beta * (np.eye(2)[:, :, None, None, None] - outer), axis=3)  # (2, 2, M, B)
    along = end.n * (k.area[:, None] * after.slope)
    along = along + np.einsum("edmb,emb->dmb", end.basis, np.sum(v, axis=2)) / k.lam
    C = np.einsum("imb,jmb->ijb", along, np.broadcast_to(end.g, along.shape))
    return C + np.einsum("eimb,efmb,fjmb->ijb", end.basis, inner, E) / k.lam


def tangent_of_rotation(
    k: FacetTables,
    after: Cells,
    sliders: Sliders,
    q: Array,
    end: Planes,
    derivatives: PlaneDerivatives,
) -> Array:
    """Part (dim, dim - 1, B) of the tangent C that comes from the rotation of the facets' planes.

    The planes at the end of a step turn with the shear displacement while interlock decays: normal
    forces and slider forces turn with them, and the friction limit follows gamma. The columns
    are the shear displacements; closure turns no plane.
    """
    limited = np.sum(sliders.push * after.G, axis=2)  # derivative of q by log(gamma)
    by_gamma = np.einsum("eimb,emb->imb", end.basis, limited / end.gamma) / k.lam
    C = np.einsum("ijmb,mb->ijb", derivatives.n, k.area[:, None] * after.force)
    C = C + np.einsum("eijmb,emb->ijb", derivatives.basis, q.sum(axis=2)) / k.lam
    return C + np.einsum("imb,jmb->ijb", by_gamma, derivatives.gamma)
