"""Small cycles: many depth cells against a closed form, and what the named resolutions miss."""

import numpy as np
import pytest
from builders import law

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
    """Hertz contacts of one orientation; sharp-bits.md asks for more depth cells."""
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
