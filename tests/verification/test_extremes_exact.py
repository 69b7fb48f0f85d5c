"""Against the step of the theory written out with 50 digits, on one orientation and on few.

Source: docs/theory-incremental.md, "Few cells, exact virgin curve".
"""

import pytest
from extremes import FULL
from extremes.exact import CASES, gap
from extremes.laws import name

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("changes", CASES, ids=name)
def test_force_agrees_with_50_digits(changes, record):
    """1e-12 is asked. Chords of steps near 1e-5 of y lose five digits of sixteen, and their share
    of F is as small."""
    worst = max(gap(changes, seed) for seed in (range(6) if FULL else [6]))
    record("exact", *(changes[key] for key in ("a", "mu", "lam", "depth")), worst)
    assert worst < 1e-12
