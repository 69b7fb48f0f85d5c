"""The law knows no units: lengths in any unit, forces in any unit, the same joint."""

import pytest
from extremes.laws import name
from extremes.matrix import COMPARED, kept_digits
from extremes.units import DECIMAL, compare

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("changes", COMPARED, ids=name)
def test_results_scale(changes, record):
    """1e-12 is asked. Far from mate a joint is sheared by a whole closure while y moves by 1e-5 of
    itself. There the chord (G1 - G0)/(y1 - y0) keeps 11 digits, as a quotient and as the mean
    slope alike, and so does the loss of that step."""
    force, _, stored, lost = compare(changes, *DECIMAL)
    record("units, F", force, name(changes))
    record("units, energy", max(stored, lost), name(changes))
    grazing = "mating_length" in changes or "wears over" in changes
    kept = kept_digits(changes)  # the chord of what is left of G loses digits, too
    assert max(force, stored) < (1e-12 if kept == 1.0 else 1e-11 / kept)
    assert lost < (1e-11 / kept if grazing or kept < 1.0 else 1e-12)
