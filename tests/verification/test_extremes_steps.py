"""At the very point of contact, and apart, on laws of every kind."""

import numpy as np
import pytest
from extremes.laws import SCALE, build, name

pytestmark = pytest.mark.slow

LAWS = [
    {}, {"a": 1.0, "eta": 0.0}, {"a": 1e8}, {"mu": 0.0}, {"mu": 1e6, "lam": 0.1}, {"eta": 2.0},
    {"heights": "printed, population"}, {"heights": "alpha = -0.99, overlap 0"},
    {"mating_length": 0.3 * SCALE},
]  # fmt: skip


@pytest.mark.parametrize("changes", LAWS, ids=name)
def test_back_at_exactly_zero_closure_nothing_is_left(changes):
    """Closed and opened again to the very point of contact: F, C and energy are exactly zero, and
    closing again is the first closing, to the bit."""
    joint, d = build(**changes).joint(), np.array([SCALE, 0.0, 0.0])
    first = joint.update(d)[0].copy()
    for _ in range(3):
        F, C = joint.update(-d)
        assert not F.any()
        assert not C.any()
        assert joint.stored_energy == 0.0
        np.testing.assert_array_equal(joint.update(d)[0], first)


@pytest.mark.parametrize("changes", LAWS, ids=name)
def test_shear_without_normal_load(changes):
    """Apart, shear meets nothing. At zero closure faces that lean against it are touched at once;
    faces that lie flat are not."""
    law = build(**changes)
    joint = law.joint()
    apart = 1e3 * SCALE * float(np.max(np.abs(law.tables.asperities.m[1:])))
    joint.update([-apart, 0.0, 0.0])
    F, C = joint.update([0.0, 100.0 * SCALE, 50.0 * SCALE])
    assert not F.any()
    assert not C.any()
    assert joint.dissipated_energy == 0.0
    F = np.abs(law.joint().update([0.0, SCALE, 0.0])[0])
    whole = law.normal_stress(SCALE)
    assert F[1] > 1e-3 * whole if law.orientation.a < 10.0 else F[1] < 1e-6 * whole
