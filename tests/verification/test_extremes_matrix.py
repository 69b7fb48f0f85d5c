"""Every extreme alone and every two together: what must hold does, after every step."""

import numpy as np
import pytest
from extremes.checks import sliders_within_friction
from extremes.laws import EXTREMES, SCALE, alone, build, name, pairs
from extremes.matrix import ends, examine


@pytest.mark.parametrize("changes", alone(), ids=name)
def test_alone(changes):
    assert not examine(changes, 1)


@pytest.mark.slow
@pytest.mark.parametrize("key", list(EXTREMES)[:-1])
def test_in_pairs(key):
    faults = {
        name(changes): found
        for seed, changes in enumerate(pairs())
        if next(iter(changes)) == key
        and not ends(changes)  # alone, and in the report, for they are slow to refuse
        and (found := examine(changes, seed, n=6, steps=10))
    }
    assert not faults


def test_the_checks_can_fail():
    """A joint that is pushed beyond friction by hand is caught."""
    law = build()
    joints = law.joints(2)
    joints.update(np.full((2, 3), 0.3 * SCALE))
    state = joints.snapshot()
    state.values[:, 6:] *= 10.0  # delta, offset and dissipated energy come first
    joints.restore(state)
    assert sliders_within_friction(joints, joints.law.asperity.mu) > 1e-3
