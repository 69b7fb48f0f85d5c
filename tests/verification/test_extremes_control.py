"""Normal control of every preset from 1 Pa to 10 GPa: it converges, or says why not."""

import numpy as np
import pytest
from extreme_laws import COMPILED

import jointlaw as jl

STRESSES = 10.0 ** np.arange(0, 11, 1 if COMPILED else 5)


def close(law, stress):
    """Largest miss of the normal stress, of the peak, in a closure test; or the reason."""
    joint = law.joint()
    try:
        record = jl.closure_test(joint, stress, steps=6)
    except jl.PathError as error:
        return None, str(error)
    levels = (np.arange(1, 7) / 6) ** (1 + law.asperity.eta) * stress
    asked = np.concatenate([[0.0], levels, levels[-2::-1], [0.0]])
    return float(np.max(np.abs(record.F1 - asked))) / stress, ""


def shear(law, stress, turns=(1.0, -1.0), steps=12):
    """The same in direct shear at constant stress, to one closure there and back."""
    joint = law.joint()
    far = np.array(turns) * float(law.closure(stress))
    try:
        record = jl.direct_shear(joint, far, normal=stress, steps=steps)
    except jl.PathError as error:
        return None, str(error)
    return float(np.max(np.abs(record.F1 - stress))) / stress, ""


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


def test_it_says_why_not(tmp_path, monkeypatch):
    """No closure gives 1e150 Pa: the error names the step, and the record ends before it."""
    monkeypatch.setenv("JOINTLAW_REPLAY_DIR", str(tmp_path))
    joint = jl.presets.load("westerly-smooth").joint()
    with pytest.raises(jl.PathError, match=r"closure test stopped after \d+ rows: ") as error:
        jl.closure_test(joint, 1e150, steps=3)
    assert np.isfinite(error.value.record.F1).all()
