"""One orientation, normal to the joint: partial slip, oblique loading and full slip."""

import numpy as np
import pytest
from builders import law

import jointlaw as jl

FLAT = 1e9  # all contacts within 1e-9 rad of the joint normal
MU, LAM = 0.4, 1.2
RESOLUTIONS = ["fast", "balanced", "fine", "reference", jl.Resolution(1, 3, 1)]


def flat(resolution, **more):
    """A joint whose contacts all face its normal."""
    more = {"a": FLAT, "b": 0.0, "c": 0.0, "mu": MU, "lam": LAM} | more
    return law(resolution=resolution, **more).joint()


def error_of_equation_35(cells):
    """Largest error of F2/(mu F1) at closure 1, up to just past full slip."""
    joint = flat(jl.Resolution(1, 3, cells))
    joint.update([1.0, 0.0, 0.0])
    full, worst = MU * LAM, 0.0
    for x in np.append(np.linspace(0.005, 1.1, 220), 1.0 - 0.7 ** np.arange(10, 40)):
        F = joint.trial([0.0, x * full, 0.0], tangent=False)[0]
        exact = MU * F[0] * (1.0 - (1.0 - min(x, 1.0)) ** 1.5)
        worst = max(worst, abs(F[1] - exact) / (MU * F[0]))
    return worst


def test_equation_35_is_approached_with_the_cells():
    cells = np.array([4, 8, 16, 32, 64, 128, 256])
    errors = [error_of_equation_35(n) for n in cells]
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    # piecewise linear in slip: second order away from the singular end of Phi''
    assert slope > 1.5
    assert errors[-1] < 1e-4


@pytest.mark.parametrize("resolution", RESOLUTIONS, ids=str)
@pytest.mark.parametrize("formation", [None, "population", "individual"])
def test_oblique_loading_does_not_slip(resolution, formation):
    ratio = 0.99 * MU * LAM
    direction = np.array([1.0, ratio * np.cos(0.5), ratio * np.sin(0.5)])
    joint = flat(resolution, formation=formation)
    joint.update([-0.3, 0.0, 0.0])  # touch comes inside the first step
    joint.update([0.3, 0.0, 0.0])
    for step in (0.4, 1e-3, 2.0):
        F = joint.update(step * direction)[0]
        # exact at any number of cells; facets lean by 1e-9, their pairs cancel
        assert np.hypot(F[1], F[2]) == pytest.approx(ratio / LAM * F[0], rel=1e-10)
        assert joint.sliding == 0.0


@pytest.mark.parametrize("resolution", RESOLUTIONS, ids=str)
@pytest.mark.parametrize("formation", [None, "population", "individual"])
def test_full_slip_carries_mu_times_the_normal_force(resolution, formation):
    along = np.array([0.0, np.cos(2.3), np.sin(2.3)])
    joint = flat(resolution, formation=formation)
    joint.update([0.8, 0.0, 0.0])
    for d in (3.0 * along, -7.0 * along, 4.0 * along + [0.5, 0.0, 0.0], -2.0 * along):
        F = joint.update(d)[0]
        # every cell sits at its cap along one line: rounding
        sense = np.sign(d @ along)
        assert np.allclose(F[1:], sense * MU * F[0] * along[1:], rtol=0.0, atol=1e-12 * MU * F[0])
        assert joint.sliding == pytest.approx(1.0, abs=1e-12)
        assert joint.slipping == pytest.approx(1.0, abs=1e-12)
    joint.update([-0.4, 0.0, 0.0])  # slip is kept in proportion while the joint opens
    F = joint.F
    assert np.hypot(F[1], F[2]) == pytest.approx(MU * F[0], rel=1e-12)


@pytest.mark.parametrize("formation", [None, "population", "individual"])
def test_touch_inside_a_step_counts_from_the_touch_point(formation):
    ratio = 0.5 * MU * LAM
    joint = flat(jl.Resolution(1, 3, 3), formation=formation)
    joint.update([-1.0, 0.0, 0.0])
    F = joint.update([1.5, 1.5 * ratio, 0.0])[0]
    # no slip below mu lam, and only the last third of the step is in contact
    assert F[1] == pytest.approx(ratio / LAM * F[0], rel=1e-10)
