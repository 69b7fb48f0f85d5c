"""Asperity degradation by stress: slopes over 1 + N/degradation_stress, N the largest contact
stress so far. Against the equation that defines it, energies of closed paths, and differences."""

from dataclasses import replace

import numpy as np
import pytest
from builders import law

import jointlaw as jl
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.degradation import climb, contact_stress

LENGTH = 3.0  # mating length in units of the closure range of `law`
STRESS = 0.5


def degrading(**parameters):
    """A law that degrades by stress, in one plane, with other parameters."""
    defaults = {"mating_length": LENGTH, "degradation_stress": STRESS, "plane": 0.0, "mu": 0.4}
    return law(**(defaults | parameters))


def parts(joint):
    """Parts of the state of a joint by name, and its contact stress in Pa."""
    k = joint.law.tables
    now = kernel.state_parts(k, joint.snapshot().values.T)
    facets = k.asperities
    x = climb(facets, now.delta)
    return now, contact_stress(facets, now.delta[0], x, now.slope_retention, now.indentation)


def test_slopes_belong_to_the_largest_contact_stress_after_any_step():
    """In steps of a hundredth of the closure range to the whole of it: the equation holds to
    rounding, whatever the step."""
    rng = np.random.default_rng(1)
    joint = degrading().joint()
    peak = 0.0
    rises = 0
    for count in range(200):
        d = rng.normal(size=2) * 10.0 ** rng.uniform(-2.0, 0.0)
        d[0] += 0.003 * count - joint.delta[0] - 0.4 * abs(joint.delta[1] + d[1])
        joint.update(d)
        now, contact = parts(joint)
        stress = float(contact.stress[0])
        rises += stress > peak
        peak = max(peak, stress)
        assert now.peak_contact_stress[0] == pytest.approx(peak, rel=1e-9)
        assert joint.slope_retention == pytest.approx(1 / (1 + peak / STRESS), rel=1e-12)
    assert rises > 5
    assert joint.slope_retention < 0.5


def test_without_friction_the_contact_stress_is_the_normal_stress():
    """So at a constant normal stress all slopes are divided by 1 + stress/degradation_stress."""
    joint = degrading(mu=0.0).joint()
    jl.direct_shear(joint, [0.3 * LENGTH], normal=0.4, steps=50)
    assert joint.F[0] == pytest.approx(0.4, rel=1e-9)
    assert joint.slope_retention == pytest.approx(1 / (1 + 0.4 / STRESS), rel=1e-6)


def test_a_zero_increment_changes_nothing():
    joint = degrading().joint()
    for d in ([0.4, 0.0], [0.05, 1.0], [0.1, 0.7], [-0.1, -0.5]):
        joint.update(d)
        before = joint.snapshot().values
        F = joint.F
        assert joint.update([0.0, 0.0])[0] == pytest.approx(F, rel=1e-12)
        np.testing.assert_allclose(joint.snapshot().values, before, rtol=1e-12, atol=0.0)


def test_slopes_stay_in_unloading_and_reloading():
    joint = degrading().joint()
    joint.update([0.6, 0.3])
    retention = joint.slope_retention
    for d in ([-0.5, 0.0], [0.2, 0.2], [-2.0, 0.0], [1.8, -0.1]):
        joint.update(d)
        assert joint.slope_retention == retention
    joint.update([0.5, 0.0])
    assert joint.slope_retention < retention


def test_the_step_converges_where_the_facets_have_climbed_far():
    """A joint sheared by three mating lengths at a low stress rests on asperities that have climbed
    six times their compression. Closed in one step or in many, its slopes and stress agree:
    slopes by the contact stress of the old slopes would lose contact in one step."""
    results = []
    for count in (1, 10, 1000):
        joint = degrading(degradation_stress=0.05, a=2.0).joint(0.001)
        jl.direct_shear(joint, [3 * LENGTH], normal=0.001, steps=400)
        for _ in range(count):
            joint.update([0.1 / count, 0.0])
        results.append([joint.F[0], joint.slope_retention])
    assert results[0] == pytest.approx(results[2], rel=0.02)
    assert results[1] == pytest.approx(results[2], rel=0.005)


def test_work_and_residual_act_together():
    """Retention s + (1 - s) exp(-W/slope_wear)/(1 + N/degradation_stress): W before the step."""
    one = degrading(slope_wear=0.3, slope_residual=0.25)
    joint = one.joint()
    joint.update([0.5, 0.0])
    for _ in range(40):
        work = parts(joint)[0].shear_work[0]
        joint.update([0.01, 0.05])
        now, _ = parts(joint)
        factor = np.exp(-work / 0.3) / (1 + now.peak_contact_stress[0] / STRESS)
        assert joint.slope_retention == pytest.approx(0.25 + 0.75 * factor, rel=1e-12)
    assert work > 0.05


def test_the_tangent_is_the_derivative_of_the_step():
    """Against differences of many sizes, one-sided too; with slip, climb, opening, and yielding."""
    rng = np.random.default_rng(4)
    worst = []
    rising = 0
    for case in range(8):
        damage = {"yield_interference": 0.2} if case % 2 else {}
        wear = {"slope_wear": 0.5, "slope_residual": 0.2} if case % 4 > 1 else {}
        one = degrading(plane=None if case > 3 else 0.0, damage=damage, c=0.1, **wear)
        joint = one.joint()
        joint.update([0.4, *([0.02] * (one.dim - 1))])
        for _ in range(12):
            d = 0.2 * rng.normal(size=one.dim)
            d[0] += 0.4 - joint.delta[0]
            bound = one.max_stiffness(np.abs(joint.delta).max() + 1.0, np.abs(joint.delta).max())
            _, C = joint.trial(d)
            errors = np.full(C.shape, np.inf)
            F = joint.trial(d, tangent=False)[0]
            for h in 10.0 ** np.arange(-7.0, -2.0):
                for j, e in enumerate(h * np.eye(one.dim)):
                    up = joint.trial(d + e, tangent=False)[0]
                    down = joint.trial(d - e, tangent=False)[0]
                    for slope in ((up - down) / (2 * h), (up - F) / h, (F - down) / h):
                        error = np.abs(slope - C[:, j]) / bound
                        errors[:, j] = np.minimum(errors[:, j], error)
            worst.append(errors.max())
            before = joint.slope_retention
            joint.update(d)
            rising += joint.slope_retention < before
    assert rising > 20
    assert np.median(worst) < 1e-8
    assert max(worst) < 1e-5


def closed_path_losses(seed, count, steps=200):
    """Work of `count` random closed paths of one random law less the stored energy at their ends.

    The law has a mating length and degradation by stress, half of the laws each degradation by
    work, yielding and a bond. Work is integrated by the trapezoid. Relative to the largest energy.
    """
    rng = np.random.default_rng(seed)
    parameters = {"degradation_stress": 10.0 ** rng.uniform(-1.5, 1.0)}
    parameters["mating_length"] = 10.0 ** rng.uniform(0.0, 1.0)
    if rng.random() < 0.5:
        parameters |= {"slope_wear": 10.0 ** rng.uniform(-1.5, 1.0)}
        parameters |= {"slope_residual": 0.5 * rng.random()}
    if rng.random() < 0.5:
        parameters["damage"] = {"yield_interference": 10.0 ** rng.uniform(-1.0, 0.0)}
    if rng.random() < 0.5:
        parameters["bond"] = jl.Bond(1.0, 0.5, 0.1, 0.2)
    one = law(
        a=rng.uniform(1.2, 6.0), b=0.0, mu=rng.uniform(0.0, 1.5), lam=rng.uniform(0.5, 1.5),
        plane=0.0 if rng.random() < 0.5 else None, **parameters,
    )  # fmt: skip
    corners = rng.normal(size=(count, 5, one.dim)) * 10.0 ** rng.uniform(-1.0, 0.3, (count, 1, 1))
    corners[..., 0] = rng.uniform(-0.2, 0.8, corners.shape[:2])
    corners[:, -1] = 0.0
    legs = np.diff(corners, axis=1, prepend=0.0)
    joints = one.joints(count)
    work = np.zeros(count)
    largest = np.zeros(count)
    before = np.zeros((count, one.dim))
    for leg in np.moveaxis(legs, 1, 0):
        for _ in range(steps):
            F, _ = joints.update(leg / steps, tangent=False)
            work += 0.5 * np.sum((before + F) * leg, axis=1) / steps
            before = F
            largest = np.maximum(largest, joints.stored_energy)
    return (work - joints.stored_energy) / np.maximum(largest, 1e-300)


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 40))]
)
def test_no_closed_path_returns_more_work_than_it_took(seed):
    """25 closed paths of a law, 1000 in all. The trapezoid errs in the second order of the step."""
    losses = closed_path_losses(seed, 25)
    assert losses.min() > -1e-3
    assert losses.max() > 0.0


def test_the_strength_envelope_bends():
    """Peak shear stress over normal stress falls with stress, without the parameter hardly."""
    ratios = {}
    for stress in (np.inf, 3.0):
        one = degrading(degradation_stress=stress, mating_length=20.0)
        peaks = [
            np.max(jl.direct_shear(one.joint(), [20.0], normal=normal, steps=150).F2) / normal
            for normal in (0.1, 1.0, 3.0)
        ]
        ratios[stress] = peaks[0] / peaks[2]
    assert ratios[3.0] > 1.15 * ratios[np.inf]


def test_the_parameter_needs_a_mating_length_and_survives_a_reduction():
    one = degrading()
    with pytest.raises(ValueError, match=r"degradation_stress = 0\.5 Pa needs a finite mating"):
        replace(one, mating_length=np.inf)
    assert one.strength_reduced(1.3).degradation_stress == STRESS
