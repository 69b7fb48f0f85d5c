"""Millions of small cycles: what repeats after shakedown, and what is forgotten on the way."""

import numpy as np
import pytest
from extremes import FULL
from extremes.drift import AMPLITUDES, LAWS, SHAKEDOWN, drift, forgetting, in_the_bed, sticky
from extremes.laws import COMPILED, SCALE

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("kind", LAWS)
def test_cycles_repeat_after_shakedown(kind, record):
    """1e-9 is asked; at full length over 1e6 cycles and down to 0.003. Cycles of 0.3 forget 7 %
    each, of 0.03 0.7 %."""
    amplitudes, shakedown, cycles = (AMPLITUDES[:3], 4000, 2000) if COMPILED else ((0.3,), 500, 300)
    if FULL:
        amplitudes, shakedown, cycles = AMPLITUDES, SHAKEDOWN, 1_000_000
    settled, force, loss = drift(LAWS[kind], cycles, amplitudes, shakedown)
    for row in zip(amplitudes, settled.tolist(), force, loss, strict=True):
        record("drift", *row)
    assert (settled < shakedown).all()
    assert (force < 1e-9).all()
    assert (loss < 1e-9).all()


@pytest.mark.parametrize(
    ("depth", "eta"),
    [(1, 0.0), (3, 0.0), (1, 1.0), (3, 1.0), *((n, 0.5) for n in (1, 2, 3, 10, 24))],
)
def test_small_normal_cycles_forget_locked_in_shear_at_a_known_rate(eta, depth, record):
    """A cell is one slider: unloading takes a share of all it holds, not of what touched last.

    With c = (zeta/y)^eta of the cell in which the closure y lies, that cell keeps kappa1/kappa0 =
    [(1 - amplitude)^eta - c]/(1 - c) of its part 1 - c each cycle; the cells above keep theirs.
    """
    amplitude, counts = 1e-2, (1, 10, 100, 1000, 10_000)
    nodes = sticky(depth, eta).tables.asperities.depth[0]
    zeta = nodes[nodes < SCALE * (1.0 - amplitude)].max() / SCALE
    c = zeta**eta if zeta > 0.0 else 0.0
    share = 1.0 - c if eta > 0.0 else 0.0  # at eta = 0 one spring holds all, and keeps it
    kept = ((1.0 - amplitude) ** eta - c) / (1.0 - c) if eta > 0.0 else 1.0
    expected = [1.0 - share + share * kept**n for n in counts]
    # F carries rounding of each of 300 products; the facets of a = 1e6 lean by 1e-6; and sliders of
    # a cell are at their caps together where the springs last touched alone would be
    left = forgetting(counts, depth, amplitude, eta)
    np.testing.assert_allclose(left, expected, atol=1e-5)
    if eta == 0.5:
        record("forgetting", depth, *left)


@pytest.mark.parametrize("eta", [0.5, 1.0])
def test_the_bed_of_many_springs_forgets_once(eta):
    """Springs that lose touch lose their shear, a share 1 - (1 - amplitude)^eta, and touch again
    unsheared: the next cycle finds nothing to lose."""
    amplitude = 0.03
    once, later = in_the_bed((1, 20), amplitude, eta)
    assert later == pytest.approx(once, abs=1e-12)
    # springs within 0.1/(mu lam) = 0.008 of touch slipped before, and held less
    assert 1.0 - 1.1 * (1.0 - (1.0 - amplitude) ** eta) < once < (1.0 - amplitude) ** eta + 0.01
    # one cell, over the same cycles, forgets twenty times as much; a cell as thin as the cycle none
    assert forgetting((20,), 1, amplitude, eta)[0] < 1.0 - 10.0 * (1.0 - once)
