"""Figures of the paper and of this law that were computed before the package existed."""

import numpy as np
import pytest
from builders import law
from scipy.optimize import bisect

import jointlaw as jl

STEP = 0.0025
FRICTION = {  # F2/F1 at delta_2 = 1, 2, 4, closure 1, linear, mu = 0.6, K_n = K_s
    2.0: (0.7157, 1.0739, 1.3032),
    3.0: (0.6393, 0.8097, 0.9463),
    6.0: (0.6179, 0.6482, 0.6959),
}
NORMAL = {3.0: (0.887, 0.820, 0.845)}  # F1/F1(0), printed to three digits


@pytest.mark.parametrize("a", FRICTION)
def test_shear_at_fixed_closure(a):
    """Incremental law, closed in one step, then sheared in steps of 0.0025."""
    joint = law(a=a, b=0.0, c=0.0, lam=1.0, eta=0.0, mu=0.6, plane=0.0,
                resolution=jl.Resolution(60, 60, 1)).joint()  # fmt: skip
    first = joint.update([1.0, 0.0], tangent=False)[0][0]
    friction, normal = [], []
    for k in range(1, round(4.0 / STEP) + 1):
        F = joint.update([0.0, STEP], tangent=False)[0]
        if k * STEP in (1.0, 2.0, 4.0):
            friction.append(F[1] / F[0])
            normal.append(F[0] / first)
    # printed to four digits; step and 60 x 60 orientations leave less than 1e-4
    assert friction == pytest.approx(FRICTION[a], abs=2e-4)
    if a in NORMAL:
        assert normal == pytest.approx(NORMAL[a], abs=6e-4)  # half a unit of the third digit


@pytest.mark.parametrize("a", [2.0, 3.0, 6.0])
def test_first_separation(a):
    """Contacts part first at delta_2/delta_1 = cot(pi/(2a)), at the rim of the cap."""
    rule = jl.Resolution(200, 200, 1)
    joint = law(a=a, b=0.0, c=0.0, eta=0.0, plane=0.0, resolution=rule).joint()
    joint.update([1.0, 0.0], tangent=False)
    start = joint.snapshot()

    def parted(d2):
        joint.restore(start)
        joint.update([0.0, d2], tangent=False)
        return 1.0 if joint.separated > 0.0 else -1.0

    exact = 1.0 / np.tan(np.pi / (2.0 * a))
    # the outermost node lies 4e-5 in u and half an azimuth, 3e-5, inside the rim
    assert bisect(parted, 0.5 * exact, 2.0 * exact, xtol=1e-7) == pytest.approx(exact, rel=1e-4)
