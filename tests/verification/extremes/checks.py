"""What must hold after every step of every law: `run` names what does not."""

import numpy as np

from jointlaw.kernels import asperities
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.asperities import effective_closure
from jointlaw.kernels.mating import offset, planes

ROUNDING = 1e-12  # of the facet's normal force: a cell's G is a difference of numbers of that size
KERNELS = (
    1e-11  # of the largest traction: rounding of y, 1e-16, over a step of MIN_CHORD_STEP y, 1e-5
)
NOTHING = 1e-60  # Pa; far below, forces of sliders count as none: their squares underflow


def sliders_within_friction(batch):
    """Largest excess of |f_s| over mu f_n of any slider, as a share of mu f_n of its facet.

    f_n of the facet without what yielding took.
    """
    k = batch.law.tables.asperities
    now = kernel.parts(batch.law.tables, batch.snapshot().values.T)
    y = effective_closure(k, now.delta, now.slopes)
    virgin = asperities.cells(k, y)
    cells = asperities.flattened(virgin, asperities.cells(k, now.depth) if k.yields else None)
    strength = asperities.strength(k, planes(k, now.delta[1:], now.slopes).gamma)[:, 0]
    size = np.hypot(now.q[0], now.q[1])
    excess = size - strength[:, None] * cells.G
    # the terms of a facet's y may cancel, where shear is at a right angle to it: y is rounding then
    terms = np.concatenate([now.delta[:1], offset(k, now.delta[1:])])
    reach = np.abs(k.m).T @ np.abs(terms)
    whole = strength * k.curve.force(reach)[0]
    whole = np.where(whole > 0, whole, np.inf)[:, None]
    touches = y + ROUNDING * reach > (now.depth if k.yields else 0)
    lifted = np.where(~touches[:, None] & (size > 0), np.inf, 0.0)
    return float(np.max(np.maximum(excess / whole, lifted), initial=0.0))


def path(rng, n, steps, size):
    """Increments (steps, n, 3) of all kinds and sizes, the first a closure; and where instead
    (steps, n) to return to zero closure exactly, the very point of contact."""
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
    """All faults along random paths of n joints, each with its step."""
    joints = law.joints(n)
    found = []
    lost, peak, forces = np.zeros((3, n))
    paths = path(np.random.default_rng(seed), n, steps, size)
    for k, (d, home) in enumerate(zip(*paths, strict=True)):
        d[home] = -joints.delta[home] * [1.0, 0.0, 0.0]
        before = joints.snapshot().values
        F, C = joints.update(d)
        gained = joints.dissipated_energy - lost
        stored = joints.stored_energy
        lost = lost + gained
        peak = np.maximum(peak, stored)
        forces = np.maximum(forces, np.abs(F).max(axis=1))
        if law.tables.yields:  # a small difference of those that would be borne by elastic facets
            facets = law.tables.asperities
            now = kernel.parts(law.tables, joints.snapshot().values.T)
            force, _ = facets.curve.force(effective_closure(facets, now.delta, now.slopes))
            forces = np.maximum(forces, (1.0 + facets.mu) * (facets.area @ force))
        excess = sliders_within_friction(joints)
        _, slow, _ = kernel.step(law.tables, before.T, d.T, False)
        gap = np.max(np.abs(slow.T - F) / np.maximum(forces, NOTHING)[:, None])
        holds = {
            "F is not finite": np.isfinite(F).all(),
            "C is not finite": np.isfinite(C).all(),
            f"dissipation {gained.min():.1e} of {peak.max():.1e}": (gained >= 0.0).all(),
            f"stored energy {stored.min():.1e}": (np.isfinite(stored) & (stored >= 0.0)).all(),
            f"a slider exceeds friction by {excess:.1e}": excess <= ROUNDING,
            "the state is not finite": np.isfinite(joints.snapshot().values).all(),
            f"the two kernels differ by {gap:.1e}": gap <= KERNELS,
        }
        found += [f"step {k}: {fault}" for fault, held in holds.items() if not held]
    return found
