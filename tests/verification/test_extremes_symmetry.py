"""A quarter turn exchanges the axes of a joint, and c for -c: also at the extremes."""

import pytest
from extremes.laws import name
from extremes.matrix import COMPARED, kept_digits
from extremes.symmetry import asymmetry

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("changes", COMPARED, ids=name)
def test_a_quarter_turn_exchanges_the_axes_and_the_sign_of_c(changes, record):
    """Cosines of the azimuths are good to 1e-16, and chords lose five digits: 1e-11 at worst."""
    gap = asymmetry(changes)
    record("quarter turn", gap, name(changes))
    assert gap < 1e-11 / kept_digits(changes)
