"""F is continuous, with the law's own stiffness bound, and converges as steps are divided."""

import pytest
from extremes.continuity import refinement, steepest
from extremes.laws import name
from extremes.matrix import COMPARED, LAWS


@pytest.mark.parametrize("changes", LAWS, ids=name)
def test_force_is_lipschitz(changes, record):
    slope = steepest(changes)
    record("slope / bound", slope, name(changes))
    assert slope <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("changes", COMPARED, ids=name)
def test_smaller_steps_converge(changes, record):
    """First order in the step: two halvings or three leave less than half of the first change."""
    gaps = refinement(changes)
    record("halving 16 to 128 steps", gaps[-1], name(changes))
    assert gaps[-1] < max(0.5 * gaps[0], 1e-10)
    assert gaps[-1] < 0.02
