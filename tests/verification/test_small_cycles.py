"""Small cycles: many depth cells against a closed form, what the named resolutions miss, what
repeats after shakedown, and what is forgotten on the way."""

from dataclasses import replace

import numpy as np
import pytest
from builders import law
from extremes.laws import SCALE, build
from scipy.integrate import trapezoid
from slow_bed import SlowBed

import jointlaw as jl

pytestmark = pytest.mark.slow

MU, LAM = 0.4, 1.2
CLOSURE, CYCLES, STEPS = 0.7, 4, 8  # of the closure range; that is measured; of a quarter cycle
LIMIT = MU * LAM * CLOSURE  # shear at which all slips
AMPLITUDES = 10.0 ** np.linspace(-3.0, 0.0, 25)


def loops(one, amplitude):
    """Loss (J/m2) and secant (Pa/m) of the fourth cycle of shear of each amplitude (n,) in m."""
    batch, way = one.joints(len(amplitude)), np.array([0.0, 1.0])
    batch.update(np.tile([CLOSURE * one.closure_range, 0.0], (len(amplitude), 1)), tangent=False)
    quarter = amplitude[:, None] / STEPS * way

    def sheared(sign, quarters):
        for _ in range(quarters * STEPS):
            F, _ = batch.update(sign * quarter, tangent=False)
        return F[:, 1]

    sheared(1.0, 1)
    for _ in range(CYCLES):
        before = batch.dissipated_energy + batch.stored_energy
        low, high = sheared(-1.0, 2), sheared(1.0, 2)
    loss = batch.dissipated_energy + batch.stored_energy - before
    return loss, (high - low) / (2.0 * amplitude)


def masing(normal, amplitude):
    """Loss and secant of a cycle whose branches are twice the first loading of Eq. 35 (Masing)."""
    x = amplitude / LIMIT
    end = MU * normal * (1.0 - np.clip(1.0 - x, 0.0, None) ** 1.5)
    area = MU * normal * (amplitude - LIMIT * 0.4 * (1.0 - np.clip(1.0 - x, 0.0, None) ** 2.5))
    return 8.0 * area - 4.0 * amplitude * end, end / amplitude


def test_cells_as_thin_as_the_cycle_keep_its_loss():
    """Hertz contacts of one orientation; docs/limits.md asks for more depth cells."""
    coarse, fine, finest = [], [], []
    for found, depth in ((coarse, 8), (fine, 100), (finest, 1000)):
        nodes = jl.Resolution(1, 3, depth)
        one = law(a=1e9, b=0.0, c=0.0, mu=MU, lam=LAM, plane=0.0, resolution=nodes)
        exact = masing(float(one.normal_stress(CLOSURE)), AMPLITUDES)
        found += [a / b - 1.0 for a, b in zip(loops(one, AMPLITUDES), exact, strict=True)]
    large = AMPLITUDES > 0.3
    assert np.abs(coarse[0][large]).max() < 0.1
    assert np.abs(coarse[0][~large]).max() > 0.5
    assert np.abs(fine[0][AMPLITUDES > 0.02]).max() < 0.1
    assert np.abs(finest[0]).max() < 0.25
    assert np.abs(finest[1]).max() < 1e-3


PAGE = {  # loss at amplitudes 0.1 and 0.32, shear kept after 100 openings by 0.01 and 0.1
    "balanced": ((1.20, 1.05), (0.848, 0.786)),
    "fine": ((1.11, 1.01), (0.952, 0.883)),
}


def test_named_resolutions_miss_what_the_page_says():
    """The figures of docs/limits.md, "Small cycles", against the slow bed."""
    one = replace(jl.presets.load("westerly-rough"), plane=0.0)
    R, exact = one.closure_range, []
    amplitudes = AMPLITUDES[[16, 20]] * R
    for amplitude in amplitudes:
        quarter = np.linspace(0.0, amplitude, 41)[1:]
        back = np.concatenate([quarter[::-1][1:], [0.0], -quarter])
        shear = np.concatenate([[0.0], quarter, np.tile([*back, *-back], CYCLES)])
        path = np.column_stack([np.full(len(shear), CLOSURE * R), shear, 0.0 * shear])
        F, _ = SlowBed(one, path, 6, 16, 300).follow()
        last = slice(-2 * len(back) - 1, None)
        exact.append(trapezoid(F[last, 1], shear[last]))
    for name, (ratios, kept) in PAGE.items():
        made = replace(one, resolution=name)
        # 300 springs, orientations and the trapezoids of 40 steps a quarter, each below 1 %
        np.testing.assert_allclose(loops(made, amplitudes)[0] / exact, ratios, rtol=2e-2)
        joints = made.joints(2)
        joints.update(np.tile([CLOSURE * R, 0.0], (2, 1)))
        locked, _ = joints.update(np.tile([0.0, 0.1 * R], (2, 1)))
        opening = CLOSURE * R * np.array([[0.01, 0.0], [0.1, 0.0]])
        for _ in range(100):
            joints.update(-opening, tangent=False)
            left, _ = joints.update(opening, tangent=False)
        np.testing.assert_allclose(left[:, 1] / locked[:, 1], kept, atol=1e-3)


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
    joints, rng = (
        build(resolution=jl.Resolution(2, 3, 1), **LAWS[kind]).joints(4),
        np.random.default_rng(1),
    )
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
