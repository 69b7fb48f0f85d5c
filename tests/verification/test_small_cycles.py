"""Small cycles: many depth cells against a closed form, and what the named resolutions miss."""

from dataclasses import replace

import numpy as np
import pytest
from builders import law
from scipy.integrate import trapezoid
from slow_bed import SlowBed

import jointlaw as jl

pytestmark = pytest.mark.slow

MU, LAM = 0.4, 1.2
CLOSURE, CYCLES, STEPS = 0.7, 4, 8  # of the closure range; that is measured; of a quarter cycle
LIMIT = MU * LAM * CLOSURE  # shear at which all slips
AMPLITUDES = 10.0 ** np.linspace(-3.0, 0.0, 25)


def loops(one, amplitude):
    """Loss (J/m2) and secant (Pa/m) of the fourth cycle of shear of each amplitude (n,) in m."""
    batch, way = one.joints(len(amplitude)), np.array([0.0, 1.0])
    batch.update(np.tile([CLOSURE * one.closure_range, 0.0], (len(amplitude), 1)), tangent=False)
    quarter = amplitude[:, None] / STEPS * way

    def sheared(sign, quarters):
        for _ in range(quarters * STEPS):
            F, _ = batch.update(sign * quarter, tangent=False)
        return F[:, 1]

    sheared(1.0, 1)
    for _ in range(CYCLES):
        before = batch.dissipated_energy + batch.stored_energy
        low, high = sheared(-1.0, 2), sheared(1.0, 2)
    loss = batch.dissipated_energy + batch.stored_energy - before
    return loss, (high - low) / (2.0 * amplitude)


def masing(normal, amplitude):
    """Loss and secant of a cycle whose branches are twice the first loading of Eq. 35 (Masing)."""
    x = amplitude / LIMIT
    end = MU * normal * (1.0 - np.clip(1.0 - x, 0.0, None) ** 1.5)
    area = MU * normal * (amplitude - LIMIT * 0.4 * (1.0 - np.clip(1.0 - x, 0.0, None) ** 2.5))
    return 8.0 * area - 4.0 * amplitude * end, end / amplitude


def test_cells_as_thin_as_the_cycle_keep_its_loss():
    """Hertz contacts of one orientation; docs/limits.md asks for more depth cells."""
    coarse, fine, finest = [], [], []
    for found, depth in ((coarse, 8), (fine, 100), (finest, 1000)):
        nodes = jl.Resolution(1, 3, depth)
        one = law(a=1e9, b=0.0, c=0.0, mu=MU, lam=LAM, plane=0.0, resolution=nodes)
        exact = masing(float(one.normal_stress(CLOSURE)), AMPLITUDES)
        found += [a / b - 1.0 for a, b in zip(loops(one, AMPLITUDES), exact, strict=True)]
    large = AMPLITUDES > 0.3
    assert np.abs(coarse[0][large]).max() < 0.1
    assert np.abs(coarse[0][~large]).max() > 0.5
    assert np.abs(fine[0][AMPLITUDES > 0.02]).max() < 0.1
    assert np.abs(finest[0]).max() < 0.25
    assert np.abs(finest[1]).max() < 1e-3


PAGE = {  # loss at amplitudes 0.1 and 0.32, shear kept after 100 openings by 0.01 and 0.1
    "balanced": ((1.20, 1.05), (0.848, 0.786)),
    "fine": ((1.11, 1.01), (0.952, 0.883)),
}


def test_named_resolutions_miss_what_the_page_says():
    """The rows of docs/limits.md, "Small cycles", against the slow bed."""
    one = replace(jl.presets.load("westerly-rough"), plane=0.0)
    R, exact = one.closure_range, []
    amplitudes = AMPLITUDES[[16, 20]] * R
    for amplitude in amplitudes:
        quarter = np.linspace(0.0, amplitude, 41)[1:]
        back = np.concatenate([quarter[::-1][1:], [0.0], -quarter])
        shear = np.concatenate([[0.0], quarter, np.tile([*back, *-back], CYCLES)])
        path = np.column_stack([np.full(len(shear), CLOSURE * R), shear, 0.0 * shear])
        F, _ = SlowBed(one, path, 6, 16, 300).follow()
        last = slice(-2 * len(back) - 1, None)
        exact.append(trapezoid(F[last, 1], shear[last]))
    for name, (ratios, kept) in PAGE.items():
        made = replace(one, resolution=name)
        # 300 springs, orientations and the trapezoids of 40 steps a quarter, each below 1 %
        np.testing.assert_allclose(loops(made, amplitudes)[0] / exact, ratios, rtol=2e-2)
        joints = made.joints(2)
        joints.update(np.tile([CLOSURE * R, 0.0], (2, 1)))
        locked, _ = joints.update(np.tile([0.0, 0.1 * R], (2, 1)))
        opening = CLOSURE * R * np.array([[0.01, 0.0], [0.1, 0.0]])
        for _ in range(100):
            joints.update(-opening, tangent=False)
            left, _ = joints.update(opening, tangent=False)
        np.testing.assert_allclose(left[:, 1] / locked[:, 1], kept, atol=1e-3)
