"""Closure in steps of any size."""

import numpy as np
import pytest
from builders import law


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
