"""Small cycles: what repeats after shakedown, and what is forgotten on the way."""

import numpy as np
import pytest
from extremes.laws import SCALE, build

import jointlaw as jl

pytestmark = pytest.mark.slow

ONE = jl.Resolution(2, 3, 1)
LAWS = {
    "eta = 0": {"eta": 0.0},
    "eta = 0.5": {},
    "eta = 1": {"eta": 1.0},
    "population": {"heights": "printed, population"},
    "mating length": {"mating_length": 0.3 * SCALE},
}


def sticky(depth, eta=0.5):
    """A law of flat faces that hardly slip."""
    return build(resolution=jl.Resolution(1, 3, depth), a=1e6, mu=10.0, eta=eta)


def forgetting(counts, depth, amplitude, eta=0.5):
    """Share of a locked-in shear force that so many small normal cycles (amplitude of y) leave."""
    joint = sticky(depth, eta).joints(1)
    joint.update([[SCALE, 0.0, 0.0]])
    F = joint.update([[0.0, 0.1 * SCALE, 0.0]], tangent=False)[0]
    locked, d, left = F[0, 1], np.array([[amplitude * SCALE, 0.0, 0.0]]), []
    for more in np.diff(counts, prepend=0):
        for _ in range(more):
            joint.update(-d, tangent=False)
            F = joint.update(d, tangent=False)[0]
        left.append(F[0, 1] / locked)
    return left


@pytest.mark.parametrize("kind", LAWS)
def test_cycles_repeat_after_shakedown(kind):
    """Closed parallelograms in random directions. Those of 0.3 of the closure range forget 7 % each
    time. 1e-9 of the peak is asked."""
    joints, rng = build(resolution=ONE, **LAWS[kind]).joints(4), np.random.default_rng(1)
    u, v = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in rng.normal(size=(2, 4, 3)))
    joints.update(np.tile([0.7 * SCALE, 0.0, 0.0], (4, 1)))

    def turn(times):
        for _ in range(times):
            F = [joints.update(0.3 * SCALE * d, tangent=False)[0] for d in (u, v, -u, -v)]
        return np.array(F), joints.dissipated_energy

    _, before = turn(500)
    first, lost = turn(1)
    last, later = turn(300)
    peak, energy = np.abs(first).max(axis=(0, 2)), joints.stored_energy
    assert (np.abs(last - first).max(axis=(0, 2)) < 1e-9 * peak).all()
    assert (np.abs((later - lost) / 300 - (lost - before)) < 1e-9 * energy).all()


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
