"""Normal control of every preset from 1 Pa to 10 GPa: it converges, or says why not."""

import numpy as np
import pytest

import jointlaw as jl

pytestmark = pytest.mark.slow

# Of the normal stress: the control stops at 1e-11 of it, or where rounding of the closure, 4e-16 of
# it and stiffer than linear by 1 + eta, leaves less
MISS = 2e-11


@pytest.mark.parametrize("preset", jl.presets.names())
def test_normal_control_converges_from_1_pascal_to_10_gigapascal(preset):
    """Closing in six steps and opening again; shear to one closure, there and back."""
    law = jl.presets.load(preset)
    levels = (np.arange(1, 7) / 6) ** (1 + law.asperity.eta)
    asked = np.concatenate([[0.0], levels, levels[-2::-1], [0.0]])
    for stress in 10.0 ** np.arange(11):
        record = jl.closure_test(law.joint(), stress, steps=6)
        np.testing.assert_allclose(record.F1 / stress, asked, rtol=0, atol=MISS)
        far = float(law.closure(stress))
        record = jl.direct_shear(law.joint(), [far, -far], stress, steps=12)
        np.testing.assert_allclose(record.F1 / stress, 1.0, rtol=0, atol=MISS)
