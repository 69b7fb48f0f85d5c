"""Invariants after every step of every law; `run` lists violations."""

import numpy as np

from jointlaw.kernels import asperities
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.cells import evaluate_cells
from jointlaw.kernels.interlock import effective_closure, offset, planes
from jointlaw.kernels.plasticity import subtract_plastic

ROUNDING = 1e-12  # of the facet's normal force: G of a cell is a difference of such forces
# Of the largest traction: the rounding of y, 1e-16, over the smallest step with a chord, 1e-5 y
MAX_KERNEL_DIFFERENCE = 1e-11
MIN_TRACTION = 1e-60  # Pa; forces of sliders far below count as zero, as their squares underflow


def sliders_within_friction(batch):
    """Largest excess of |f_s| over mu f_n of any slider, over mu f_n of its elastic facet."""
    k = batch.law.tables.asperities
    now = kernel.state_parts(batch.law.tables, batch.snapshot().values.T)
    y = effective_closure(k, now.delta, now.slope_retention)
    elastic = evaluate_cells(k, y)
    cells = subtract_plastic(elastic, evaluate_cells(k, now.indentation) if k.yields else None)
    strength = asperities.friction_limit(k, planes(k, now.delta[1:], now.slope_retention).gamma)[
        :, 0
    ]
    size = np.hypot(now.q[0], now.q[1])
    excess = size - strength[:, None] * cells.G
    # the terms of a facet's y may cancel to rounding, where shear is normal to its azimuth
    terms = np.concatenate([now.delta[:1], offset(k, now.delta[1:])])
    max_y = np.abs(k.m).T @ np.abs(terms)
    scale = strength * k.curve.force(max_y)[0]
    scale = np.where(scale > 0, scale, np.inf)[:, None]
    touches = y + ROUNDING * max_y > (now.indentation if k.yields else 0)
    lifted = np.where(~touches[:, None] & (size > 0), np.inf, 0.0)
    return float(np.max(np.maximum(excess / scale, lifted), initial=0.0))


def path(rng, n, steps, size):
    """Increments (steps, n, 3) of all kinds and sizes, the first of them a closure.

    Also returns (steps, n) which joints return to zero closure exactly instead.
    """
    kinds = rng.integers(8, size=(steps, n))
    d = rng.normal(size=(steps, n, 3)) * size
    d *= 10.0 ** rng.uniform(-4.0, 0.5, (steps, n, 1))
    d[kinds == 1, 1:] = 0.0  # pure closure
    d[kinds == 2, 0] = 0.0  # pure shear
    d[kinds == 3] *= 1e-290 / size  # 1e-300 and around
    d[kinds == 4] *= 1e-10
    d[kinds == 5] *= 5e-324 / size  # the smallest number, or nothing
    d[kinds == 6] *= 1e4
    d[0] = [size, 0.0, 0.0]
    return d, kinds == 7


def run(law, size, seed, n=8, steps=32):
    """Violations of the invariants along random paths of n joints, each with its step."""
    joints = law.joints(n)
    violations = []
    dissipated, peak_stored, peak_force = np.zeros((3, n))
    paths = path(np.random.default_rng(seed), n, steps, size)
    for k, (d, returns) in enumerate(zip(*paths, strict=True)):
        d[returns] = -joints.delta[returns] * [1.0, 0.0, 0.0]
        before = joints.snapshot().values
        F, C = joints.update(d)
        dissipation = joints.dissipated_energy - dissipated
        stored = joints.stored_energy
        dissipated = dissipated + dissipation
        peak_stored = np.maximum(peak_stored, stored)
        peak_force = np.maximum(peak_force, np.abs(F).max(axis=1))
        if law.tables.yields:  # forces are small differences of the forces of elastic facets
            facets = law.tables.asperities
            now = kernel.state_parts(law.tables, joints.snapshot().values.T)
            force, _ = facets.curve.force(effective_closure(facets, now.delta, now.slope_retention))
            peak_force = np.maximum(peak_force, (1.0 + facets.mu) * (facets.area @ force))
        excess = sliders_within_friction(joints)
        _, F_numpy, _ = kernel.step(law.tables, before.T, d.T, False)
        difference = np.abs(F_numpy.T - F) / np.maximum(peak_force, MIN_TRACTION)[:, None]
        invariants = {
            "F is not finite": np.isfinite(F).all(),
            "C is not finite": np.isfinite(C).all(),
            f"dissipation {dissipation.min():.1e} of {peak_stored.max():.1e}": (
                dissipation >= 0.0
            ).all(),
            f"stored energy {stored.min():.1e}": (np.isfinite(stored) & (stored >= 0.0)).all(),
            f"a slider exceeds friction by {excess:.1e}": excess <= ROUNDING,
            "the state is not finite": np.isfinite(joints.snapshot().values).all(),
            f"the two kernels differ by {difference.max():.1e}": (
                difference.max() <= MAX_KERNEL_DIFFERENCE
            ),
        }
        violations += [f"step {k}: {name}" for name, holds in invariants.items() if not holds]
    return violations
