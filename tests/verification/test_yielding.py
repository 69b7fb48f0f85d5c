"""Asperities that yield and wear: closed form in closure, and the slow bed in shear."""

import dataclasses
import warnings

import numpy as np
import pytest
from builders import increments, law, random_corners, slow_heights
from slow_bed import SlowBed, cap_quadrature, reach_of

import jointlaw as jl
from jointlaw.kernels import reference as kernel


@pytest.mark.parametrize("interference", [1e-12, 0.05, 0.3])
@pytest.mark.parametrize(
    ("formation", "eta"), [(None, 0.0), ("population", 0.5), ("individual", 1)]
)
def test_closure_has_a_closed_form(formation, eta, interference):
    one = law(formation=formation, eta=eta, mu=0.0, resolution=jl.Resolution(2, 4, 3),
              damage={"yield_interference": interference})  # fmt: skip
    joint, k = one.joint(), one.tables

    def phi(y):
        return k.curve.force(np.asarray(y, float))[0]

    deep, last, highest = interference / k.c1, 0.0, 0.0
    for target in np.random.default_rng(0).uniform(-0.2, 1.2, 40):
        F, C = joint.update([target - last, 0.0, 0.0])
        last, highest = target, max(highest, target)
        flat = np.maximum(highest - deep, 0.0)
        stress = np.sum(k.area * k.c1 * np.where(target > flat, phi(target) - phi(flat), 0.0))
        scale = np.sum(k.area * k.c1) * phi(highest)
        # rounding of Phi, of which small differences are taken
        assert abs(F[0] - stress) <= 1e-12 * scale
        assert abs(joint.plastic_work - np.sum(k.area * k.c1 * deep * phi(flat))) <= 1e-12 * scale
        assert joint.plastic_work <= joint.dissipated_energy
        if target < highest:  # unloading and reloading are elastic
            slope = k.curve.force(np.array(target))[1]
            assert C[0, 0] == pytest.approx(
                np.sum(k.area * k.c1 * np.where(target > flat, slope, 0.0)), rel=1e-12, abs=1e-300
            )
    assert joint.stored_energy >= 0.0


def test_first_loading_in_closed_form_is_that_of_many_cells():
    for mu in (0.0, 0.2, 0.8):
        one = law(formation="population", mu=mu, resolution=jl.Resolution(4, 3, 60),
                  damage={"yield_interference": 0.1})  # fmt: skip
        joint, last = one.joint(), 0.0
        for u in np.linspace(0.1, 1.2, 12):
            stress = joint.update([u - last, 0.0, 0.0])[0][0]
            last = u
            # sixty cells slip nearly as the springs do, one by one: 2e-4 at worst seen
            assert stress == pytest.approx(one.normal_stress(u), rel=1e-3)
            assert one.closure(one.normal_stress(u)) == pytest.approx(u, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("interference", "critical_slip"),
    [(0.3, np.inf), (0.1, np.inf), (0.05, np.inf), (0.1, 0.3)],
)
def test_tractions_agree_with_the_slow_bed(interference, critical_slip):
    n_paths, steps = (2, 30) if np.isinf(critical_slip) else (1, 200)
    seed = int(100 * interference)
    corners = random_corners(np.random.default_rng(seed), n_paths)
    d = increments(corners, steps)
    p = {"a": 3.0, "b": 0.5, "c": 0.1, "mu": 0.4, "formation": ["population", None][seed % 2]}
    # facets that were pressed flat touch all at once: a coarser bed misses more than `reference`
    n, w = cap_quadrature(p["a"], p["b"], p["c"], 24, 60)
    F, crushed = np.zeros_like(d), np.zeros(n_paths)
    for i in range(n_paths):
        bed = SlowBed(
            n, w, reach_of(corners[i], n), density=1.0, heights=slow_heights(p["formation"]),
            n_depth=60, K=1.0, lam=1.2, eta=0.5, mu=p["mu"], critical_slip=critical_slip,
            yield_interference=interference,
        )  # fmt: skip
        for k in range(d.shape[1]):
            F[i, k] = bed.update(d[i, k])
        crushed[i] = bed.crushed
    peak = np.linalg.norm(F, axis=2).max(axis=1)
    # on 20 paths of 0.05, of 0.1 and of 0.3 ranges: 2.7, 1.4 and 1.3 %, 0.41, 0.27 and 0.18 %
    for resolution, bound in (("fine", 3e-2), ("reference", 5e-3)):
        joints = law(**p, resolution=resolution, critical_slip=critical_slip,
                     damage={"yield_interference": interference}).joints(n_paths)  # fmt: skip
        G = np.array([joints.update(d[:, k], tangent=False)[0] for k in range(d.shape[1])])
        error = np.linalg.norm(np.moveaxis(G, 0, 1) - F, axis=2).max(axis=1) / peak
        assert error.max() < bound, (resolution, error)
        # the bed takes the mean squeeze of a step: first order in the step
        assert np.allclose(joints.plastic_work, crushed, rtol=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("damage", [{}, {"yield_interference": 0.1}])
def test_wear_agrees_with_the_slow_bed(damage):
    damage = damage | {"mu_residual": 0.15, "wear_slip": 0.5}
    corners = random_corners(np.random.default_rng(5), 2)
    d = increments(corners, 100)
    n, w = cap_quadrature(3.0, 0.5, 0.1, 16, 20)
    joints = law(resolution="reference", damage=damage).joints(2)
    for i in range(2):
        bed = SlowBed(n, w, reach_of(corners[i], n), density=1.0, n_depth=100, K=1.0, lam=1.2,
                      eta=0.5, mu=0.4, **damage)  # fmt: skip
        F = np.array([bed.update(step) for step in d[i]])
        G = np.array([joints.update(step[None], where=[i])[0][0] for step in d[i]])
        # as without wear: half a per cent elastic, two per cent where facets are pressed flat
        bound = 5e-3 if "yield_interference" not in damage else 2e-2
        assert np.linalg.norm(G - F, axis=1).max() < bound * np.linalg.norm(F, axis=1).max()
        assert joints.friction[i] == pytest.approx(bed.mu, abs=0.002)


def test_both_sides_of_an_asperity_are_flattened_where_the_offset_is_dragged():
    """Else a joint that slides back would meet springs that the other side has lost."""
    k = law(critical_slip=0.3, damage={"yield_interference": 0.1}).tables
    state = kernel.step(k, np.zeros((k.rows, 1)), np.array([[0.5], [0.8], [0.3]]), False)[0]
    depth = kernel.parts(k, state).depth[:, 0]
    turned = k.n * [[1.0], [-1.0], [-1.0]]
    opposite = np.argmax(turned.T @ k.n, axis=1)
    assert np.ptp(depth) > 0.1
    np.testing.assert_array_equal(depth, depth[opposite])


def test_a_joint_closed_beyond_its_highest_asperity_gives_a_warning():
    """99.99 % of the heights of this preset end at a closure of 17.1 mm."""
    stiff = jl.presets.load("jing-replica")
    asperity = dataclasses.replace(stiff.asperity, yield_interference=0.1 * stiff.closure_range)
    weak = dataclasses.replace(stiff, asperity=asperity)
    with pytest.warns(UserWarning, match="closure = 0.0176 m: 99.99 % .* law ends"):
        weak.joint(30e6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        weak.joint(10e6)
        stiff.joint(30e6)


def test_friction_falls_with_the_slip_of_the_asperities():
    """One linear spring at a closure of 1 slips by the shear and by what its extension mu lam y
    shrinks; mu = mu_r + (mu_0 - mu_r) exp(-slip/wear_slip)."""
    damage = {"mu_residual": 0.1, "wear_slip": 0.5}
    joint = law(
        a=1e9, b=0.0, c=0.0, eta=0.0, damage=damage, resolution=jl.Resolution(1, 3, 1)
    ).joint()
    joint.update([1.0, 0.0, 0.0])

    def sheared(steps):
        for _ in range(steps):
            F, _ = joint.update([0.0, 0.001, 0.0], tangent=False)
        return joint.friction, -0.5 * np.log((joint.friction - 0.1) / 0.3), F[1] / F[0]

    mu, slip, _ = sheared(600)  # all slips from 0.4 lam = 0.48 on
    mu_later, slip_later, ratio = sheared(500)
    # friction lags by a step of 1/500 of the wear slip
    assert slip_later - slip == pytest.approx(0.5 + 1.2 * (mu - mu_later), rel=5e-3)
    assert ratio == pytest.approx(mu_later, rel=5e-3)
