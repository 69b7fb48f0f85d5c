"""F is continuous, with the law's own stiffness bound."""

import numpy as np
import pytest
from extremes.checks import path
from extremes.laws import SCALE, build, name
from extremes.matrix import LAWS


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


@pytest.mark.parametrize("changes", LAWS, ids=name)
def test_force_is_lipschitz(changes, record):
    slope = steepest(changes)
    record("slope / bound", slope, name(changes))
    assert slope <= 1.0
