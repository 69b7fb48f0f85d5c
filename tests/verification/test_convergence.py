"""Monotonic paths in steps of any size; error as a slope against the step."""

import numpy as np
import pytest
from builders import law

PATHS = {
    "closure, then shear": [[1.0, 0.0, 0.0], [0.0, 0.8, 0.3], [0.0, 0.7, 0.2]],
    "shear under opening": [[1.0, 0.0, 0.0], [-0.2, 0.6, 0.2], [-0.1, 0.4, 0.2]],
    "shear that turns": [[0.8, 0.2, 0.0], [0.1, 0.5, 0.4], [0.1, 0.0, 0.8]],
    "oblique closure": [[0.2, 0.4, 0.1], [0.6, 0.5, 0.5], [0.2, 0.3, 0.1]],
}


def end_forces(one, steps):
    """Tractions (paths, 3) after the legs of every path, each leg in equal steps."""
    joints = one.joints(len(PATHS))
    for leg in np.moveaxis(np.array(list(PATHS.values())), 1, 0):
        for _ in range(steps):
            F = joints.update(leg / steps, tangent=False)[0]
    return F


@pytest.mark.parametrize(("formation", "critical_slip"), [(None, np.inf), ("population", 0.4)])
def test_error_falls_in_proportion_to_the_step(formation, critical_slip):
    one = law(a=2.0, formation=formation, critical_slip=critical_slip, resolution="balanced")
    exact = 2.0 * end_forces(one, 1024) - end_forces(one, 512)
    steps = np.array([2, 4, 8, 16, 32, 64])
    forces = np.array([end_forces(one, n) for n in steps])
    errors = np.linalg.norm(forces - exact, axis=2) / np.linalg.norm(exact, axis=1)
    slopes = -np.polyfit(np.log(steps), np.log(errors + 1e-12), 1)[0]
    # first order, fitted from 2 steps a leg to 64; a path may do better
    assert np.min(slopes) > 0.8
    assert np.max(errors[-1]) < 0.01


@pytest.mark.parametrize("formation", [None, "population", "individual"])
def test_pure_closure_in_one_step_or_many(formation):
    one = law(formation=formation)
    many, single = one.joint(), one.joint()
    for _ in range(50):
        many.update([0.02, 0.0, 0.0])
    single.update([1.0, 0.0, 0.0])
    # seating is independent of the step: rounding
    assert np.allclose(many.F, single.F, rtol=1e-12, atol=1e-13)
    assert many.F[0] == pytest.approx(float(one.normal_stress(1.0)), rel=1e-12)
