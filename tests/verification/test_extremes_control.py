"""Normal control of every preset from 1 Pa to 10 GPa: it converges, or says why not."""

import numpy as np
import pytest
from extremes.control import STRESSES, close, shear

import jointlaw as jl
from jointlaw.laboratory.experiments import PathError

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("preset", jl.presets.names())
@pytest.mark.parametrize("test", [close, shear])
def test_normal_control_converges_from_1_pascal_to_10_gigapascal(preset, test):
    law = jl.presets.load(preset)
    for stress in STRESSES:
        miss, reason = test(law, stress)
        # the control stops at 1e-11 of the normal stress, or where rounding of the closure, 4e-16
        # of it and stiffer than linear by 1 + eta, leaves less
        assert miss is not None, f"{preset} at {stress:g} Pa: {reason}"
        assert miss < 2e-11


def test_it_says_why_not():
    """No closure gives 1e150 Pa: the error names the step, and the record ends before it."""
    joint = jl.presets.load("westerly-smooth").joint()
    with pytest.raises(PathError, match=r"closure test stopped after \d+ rows: ") as error:
        jl.closure_test(joint, 1e150, steps=3)
    assert np.isfinite(error.value.record.F1).all()
