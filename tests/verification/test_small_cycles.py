"""Small cycles: the exact bed against a closed form and the slow bed; what coarse cells miss."""

from dataclasses import replace

import numpy as np
import pytest
from builders import law
from scipy.integrate import trapezoid
from slow_bed import SlowBed, cap_quadrature, reach_of

import jointlaw as jl
from jointlaw.accuracy import cycles as small
from jointlaw.accuracy.cycles import AMPLITUDES, CLOSURE, OPENINGS, cycles, exact_cycles

pytest.importorskip("numba")  # the same numbers without it, in minutes

MU, LAM = 0.4, 1.2
LIMIT = MU * LAM * CLOSURE  # shear at which all slips


def flat(depth=1):
    """Hertzian contacts that all face the joint normal."""
    return law(
        a=1e9, b=0.0, c=0.0, mu=MU, lam=LAM, plane=0.0, resolution=jl.Resolution(1, 3, depth)
    )


def masing(normal, amplitude):
    """Loss and secant of a cycle whose branches are twice the first loading of Eq. 35 (Masing)."""
    x = amplitude / LIMIT
    end = MU * normal * (1.0 - np.clip(1.0 - x, 0.0, None) ** 1.5)
    area = MU * normal * (amplitude - LIMIT * 0.4 * (1.0 - np.clip(1.0 - x, 0.0, None) ** 2.5))
    return 8.0 * area - 4.0 * amplitude * end, end / amplitude


def test_exact_bed_has_the_loops_of_masing():
    one = flat()
    found = exact_cycles(one)
    loss, secant = masing(float(one.normal_stress(CLOSURE)), AMPLITUDES)
    # each cell is 1.15 times as thick as its neighbour, and elastic until all of it slides
    np.testing.assert_allclose(found.loss, loss, rtol=1e-2)
    np.testing.assert_allclose(found.secant, secant, rtol=1e-3)
    # damping of small cycles grows with their amplitude: 2/(3 pi) of x/4 in the limit, as 1 - T/Kx
    small_ones = AMPLITUDES < 0.01
    x = AMPLITUDES[small_ones] / LIMIT
    np.testing.assert_allclose(found.damping[small_ones], x / (6 * np.pi), rtol=3e-2)


def slow(one, path, n_u, n_phi, springs, **more):
    """Work and shear stress (steps,) of the slow bed along a path in one plane."""
    p = one.asperity
    normals, weights = cap_quadrature(one.orientation.a, 0.5, 0.1, n_u, n_phi)
    whole = np.column_stack([path, np.zeros(len(path))])
    bed = SlowBed(
        normals, weights, reach_of(whole, normals), K=p.K, lam=p.lam, eta=p.eta, mu=p.mu,
        density=1.0, n_depth=springs, **more,
    )  # fmt: skip
    return np.array([bed.update(d)[:2] for d in np.diff(whole, axis=0, prepend=0.0)])


@pytest.mark.parametrize("critical_slip", [np.inf, 0.1])
def test_exact_bed_agrees_with_the_slow_bed(critical_slip):
    one = law(plane=0.0, critical_slip=critical_slip)
    found, steps = exact_cycles(one), 40
    for i in (16, 20):  # amplitudes 0.1 and 0.32
        quarter = np.linspace(0.0, AMPLITUDES[i], steps + 1)[1:]
        back = np.concatenate([quarter[::-1][1:], [0.0], -quarter])
        loop = np.concatenate([back, -back])
        shear = np.concatenate([[0.0], quarter, np.tile(loop, small.CYCLES)])
        path = np.column_stack([np.full(len(shear), CLOSURE), shear])
        F = slow(one, path, 6, 16, 300, critical_slip=critical_slip)
        last = slice(-len(loop) - 1, None)
        loss = trapezoid(F[last, 1], shear[last])
        top, low = F[-1, 1], F[-1 - len(loop) // 2, 1]
        # 300 springs, orientations and the trapezoids of 40 steps a quarter, each below 1 %
        assert found.loss[i] == pytest.approx(loss, rel=2e-2)
        assert found.secant[i] == pytest.approx((top - low) / (2 * AMPLITUDES[i]), rel=1e-2)


def test_exact_bed_forgets_as_much_as_the_slow_bed():
    one = law(plane=0.0)
    found = exact_cycles(one).kept
    for k, opening in enumerate(OPENINGS):
        less = CLOSURE * (1.0 - opening)
        path = np.array(
            [[CLOSURE, 0.0], [CLOSURE, small.LOCKED], *[[less, 0.1], [CLOSURE, 0.1]] * 3]
        )
        F = slow(one, path, 6, 16, 1500)[:, 1]
        assert F[-1] == pytest.approx(F[-3], rel=1e-6)  # springs forget once
        # the thinnest of the slow bed's springs; orientations
        assert found[k] == pytest.approx(F[-1] / F[1], abs=2e-3)


def test_cells_as_thin_as_the_cycle_keep_its_loss():
    coarse, fine, finest = [
        cycles(flat(n), 1.0).missed(exact_cycles(flat()))[0] for n in (8, 100, 1000)
    ]
    large = AMPLITUDES > 0.3
    assert coarse[large].max() < 0.1
    assert coarse[~large].max() > 0.5  # what this page of tests is about
    assert fine[AMPLITUDES > 0.02].max() < 0.1
    assert finest.max() < 0.25


def test_loss_is_kept_at_amplitudes_between(monkeypatch):
    monkeypatch.setattr("jointlaw.accuracy.tolerance.EXCURSIONS", 4)  # for the time it takes
    one = law(a=6.0, b=0.0, c=0.0, plane=0.0, resolution="balanced")
    made = one.at_tolerance(0.05, loss=0.25)
    assert made.tables.sliders > 10 * one.tables.sliders
    assert replace(made, resolution=one.resolution) == one
    monkeypatch.setattr(small, "AMPLITUDES", 10.0 ** np.linspace(-2.95, 0.0, 37))
    small._exact.cache_clear()
    # between the amplitudes that were looked at, cells begin to slip a little earlier or later
    assert cycles(made, 1.0).missed(exact_cycles(one))[0].max() < 0.35
    small._exact.cache_clear()


def test_a_loss_that_cannot_be_kept_is_refused_with_the_best(monkeypatch):
    monkeypatch.setattr("jointlaw.accuracy.tolerance.EXCURSIONS", 4)
    monkeypatch.setattr("jointlaw.accuracy.tolerance._LARGEST", 1)
    with pytest.raises(ValueError, match=r"loss = 0\.04 cannot .* Resolution\(u=.*by 0\.\d"):
        law(a=6.0, b=0.0, c=0.0, plane=0.0).at_tolerance(0.05, loss=0.04)


def test_bad_losses_are_named():
    one = law(plane=0.0)
    for value in (0.0, -0.25, float("nan")):
        with pytest.raises(ValueError, match="loss"):
            one.at_tolerance(0.05, loss=value)
    with pytest.raises(ValueError, match=r"loss = 0\.25: a joint with closure_only does not shear"):
        law(closure_only=True).at_tolerance(0.05, loss=0.25)
