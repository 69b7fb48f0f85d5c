"""Every extreme alone and every two together: what must hold does, after every step."""

import numpy as np
import pytest
from extremes import FULL
from extremes.checks import sliders_within_friction
from extremes.laws import EXTREMES, SCALE, alone, build, name, pairs
from extremes.matrix import ends, examine


@pytest.mark.parametrize("changes", alone(), ids=name)
def test_alone(changes, record):
    faults = examine(changes, 1)
    record("alone", not faults)
    assert not faults


@pytest.mark.slow
@pytest.mark.parametrize("key", list(EXTREMES)[:-1])
def test_in_pairs(key, record):
    n, steps = (8, 32) if FULL else (6, 10)
    found = {
        name(changes): examine(changes, seed, n, steps)
        for seed, changes in enumerate(pairs())
        # laws that are refused are slow to refuse
        if next(iter(changes)) == key and (FULL or not ends(changes))
    }
    held, refused = (sum(faults == kind for faults in found.values()) for kind in ([], None))
    record("pairs", held, refused, len(found))
    assert held + refused == len(found), found


def test_the_checks_can_fail():
    """A joint that is pushed beyond friction by hand is caught."""
    law = build()
    joints = law.joints(2)
    joints.update(np.full((2, 3), 0.3 * SCALE))
    state = joints.snapshot()
    state.values[:, 4:] *= 10.0  # delta and dissipated energy come first
    joints.restore(state)
    assert sliders_within_friction(joints) > 1e-3
