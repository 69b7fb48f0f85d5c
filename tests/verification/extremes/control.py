"""Normal control of every preset from 1 Pa to 10 GPa: it converges, or says why not."""

import numpy as np

import jointlaw as jl
from extremes.laws import COMPILED
from jointlaw.laboratory.experiments import PathError

STRESSES = 10.0 ** np.arange(0, 11, 1 if COMPILED else 5)


def close(law, stress):
    """Largest miss of the normal stress, of the peak, in a closure test; or the reason."""
    joint = law.joint()
    try:
        record = jl.closure_test(joint, stress, steps=6)
    except PathError as error:
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
    except PathError as error:
        return None, str(error)
    return float(np.max(np.abs(record.F1 - stress))) / stress, ""
