"""F is continuous, with the law's own stiffness bound, and converges as steps are divided."""

import numpy as np
import pytest
from extremes.checks import path
from extremes.laws import COMPILED, SCALE, build, name
from extremes.matrix import COMPARED, LAWS


def steepest(changes, seed=5, n=8, steps=24):
    """Largest |F(d + e) - F(d)| / |e| over the stiffness bound, for |e| of 1e-9 to 0.1 of |d|."""
    law = build(**changes)
    joints, rng, worst = law.joints(n), np.random.default_rng(seed), 0.0
    for d in path(rng, n, steps, SCALE)[0]:
        size = np.abs(d).max(axis=1, keepdims=True) * 10.0 ** rng.uniform(-9.0, -1.0, (n, 1))
        e = rng.normal(size=(n, 3)) * size
        before = joints.snapshot()
        G = joints.update(d + e, tangent=False)[0]
        reach = joints.measures().reach
        joints.restore(before)
        F = joints.update(d, tangent=False)[0]
        reach = np.maximum(reach, joints.measures().reach)
        # F is a sum of forces of all facets: its rounding is that of the stiffness times the reach
        bound = law.max_stiffness(reach) * (
            np.linalg.norm(e, axis=1) + 1e-14 * (np.abs(reach) + np.linalg.norm(d, axis=1))
        )
        change = np.linalg.norm(G - F, axis=1)
        worst = max(worst, np.max(change / np.where(bound > 0, bound, 1.0)))
    return worst


COUNTS = (16, 32, 64, 128, 256) if COMPILED else (16, 32, 64, 128)


def refinement(changes, counts=COUNTS, n=8):
    """Largest change of F along one closing, shearing, opening path when its steps are halved."""
    rng = np.random.default_rng(7)
    law = build(**changes)
    legs = rng.normal(size=(4, n, 3)) * SCALE * 0.3
    legs[0] = [SCALE, 0.0, 0.0]
    ends, peak = [], np.zeros(n)
    for count in counts:
        joints, at = law.joints(n), []
        for leg in legs:
            for _ in range(count):
                F = joints.update(leg / count, tangent=False)[0]
            at.append(F)
            peak = np.maximum(peak, np.abs(F).max(axis=1))
        ends.append(np.array(at))
    gaps = np.abs(np.diff(ends, axis=0)).max(axis=(1, 3))  # (halvings, n)
    return np.max(gaps / np.where(peak > 0, peak, 1.0), axis=1)


@pytest.mark.parametrize("changes", LAWS, ids=name)
def test_force_is_lipschitz(changes, record):
    slope = steepest(changes)
    record("slope / bound", slope, name(changes))
    assert slope <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("changes", COMPARED, ids=name)
def test_smaller_steps_converge(changes, record):
    """First order in the step: two halvings or three leave less than half of the first change."""
    gaps = refinement(changes)
    record("halving 16 to 128 steps", gaps[-1], name(changes))
    assert gaps[-1] < max(0.5 * gaps[0], 1e-10)
    assert gaps[-1] < 0.02
