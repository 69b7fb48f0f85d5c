"""Coulomb's joint: closed forms, tiny steps in plain numbers, energy of every step, tangent."""

import math

import numpy as np
import pytest
from test_tangent import STEPS, descent_slope, v_curve
from work import work_of_step

import jointlaw as jl
from jointlaw.kernels import reference

KN, KS, MU, C, T = 1e10, 4e9, 0.6, 1e6, 4e5  # Pa/m, Pa
BRITTLE = {"residual_friction": 0.4, "residual_cohesion": 0.3e6}
WEAKENS = BRITTLE | {"weakening": 1e-3}
KINDS = {"ductile": {}, "brittle": BRITTLE, "weakens": WEAKENS, "no tension": {"tension": 0.0}}
ROUNDING = 1e-11  # of sums over some hundred steps


def coulomb(plane=0.0, **more):
    given = {"normal_stiffness": KN, "shear_stiffness": KS, "friction": MU}
    return jl.CoulombLaw(**given | {"cohesion": C, "tension": T, "plane": plane} | more)


def spaces(dim, way):
    """The law's plane, and the shear `way` along a direction of that plane or of space."""
    return (0.0, [way]) if dim == 2 else (None, [0.6 * way, -0.8 * way])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("steps", [1, 7, 200])
def test_direct_shear_at_constant_normal_stress(kind, dim, steps):
    """Peak, slope of weakening and residual, in steps of any size."""
    stress, way = 3e6, 2e-3
    peak, rest = C + MU * stress, C + MU * stress
    if kind in ("brittle", "weakens"):
        rest = 0.3e6 + 0.4 * stress
    length = KINDS[kind].get("weakening", 0.0)
    for end in (0.999 * peak / KS, 1.001 * peak / KS, peak / KS + 0.4e-3, way):
        plane, along = spaces(dim, end)
        law = coulomb(plane, **KINDS[kind])
        joint = law.joint(stress)
        for _ in range(steps):
            F = joint.update([0.0, *np.divide(along, steps)])[0]
        beyond = end - peak / KS
        shown = reference.measures(law.tables, joint.snapshot().values.T)
        assert shown.sliding == (beyond > 0.0)
        fallen = (beyond > 0.0) * (min(beyond / length, 1.0) if length else 1.0)
        q = min(KS * end, peak) - fallen * (peak - rest)
        np.testing.assert_allclose(F, [stress, *np.multiply(along, q / end)], rtol=ROUNDING)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("given", "bears"), [(0.0, 0.0), (T, T), (1e9, C / MU)])
@pytest.mark.parametrize("share", [0.0, 0.8])
def test_tension_is_cut_and_faces_close_again_at_mate(given, bears, share, dim):
    """Under the shear stress `share` of C the joint tears where C + mu sigma no longer holds it."""
    plane, along = spaces(dim, share * C / KS)
    joint = coulomb(plane, tension=given).joint(1.0)
    bears = min(bears, (1.0 - share) * C / MU)
    joint.update([-0.9999999 * bears / KN - joint.delta[0], *along])
    assert joint.F[0] == pytest.approx(-bears, rel=1e-6)
    assert joint.damage == 0.0
    torn = joint.stored_energy
    joint.update([-1e-4, *np.zeros(dim - 1)])
    assert not joint.F.any()
    assert joint.damage == 1.0
    assert joint.dissipated_energy == pytest.approx(torn, rel=1e-6)
    joint.update([-joint.delta[0] - 1e-9, *along])
    assert not joint.F.any()
    joint.update([1e-9 + 1e-4, *np.zeros(dim - 1)])
    np.testing.assert_allclose(joint.F, [1e6, *np.zeros(dim - 1)], rtol=1e-9)


def test_faces_that_part_or_never_met_have_no_cohesion():
    """Friction alone, also where slip leaves the cohesion as it is, or a residual one is given."""
    for more in ({}, {"residual_cohesion": 0.5 * C, "weakening": 1e-3}):
        law = coulomb(**more)
        joints = law.joints(4, mated=[True, True, True, False])
        joints.unbond([1])
        joints.update([[-1e-3, 0.0], *3 * [[0.0, 0.0]]])
        joints.update([[1e-3 + 1e-4, 0.0], *3 * [[1e-4, 0.0]]])
        F, _ = joints.update([[0.0, 1e-2]] * 4)
        assert F[[0, 1, 3], 1] == pytest.approx(MU * 1e6)
        assert F[2, 1] == pytest.approx(MU * 1e6 + (0.5 if more else 1.0) * C)
        assert joints.damage.tolist() == [1.0] * 4


def test_shear_counts_from_touch():
    """Faces that were apart meet in mid-step, in one step or in ten."""
    law = coulomb(cohesion=9e6, tension=0.0)
    for steps in (1, 10):
        joint = law.joint()
        joint.update([-1e-3, 0.0])
        for _ in range(steps):
            F = joint.update(np.array([3e-3, 1.5e-3]) / steps)[0]
        np.testing.assert_allclose(F, [2e-3 * KN, 1e-3 * KS], rtol=1e-12)
        assert joint.dissipated_energy == 0.0


def test_shear_stress_turns_into_the_direction_of_motion():
    """At constant strength S the angle between them falls by tan(a/2) = exp(-ks s/S) tan(a0/2)."""
    law, stress, way = coulomb(None), 2e6, 5e-4
    strength, errors = C + MU * stress, []
    for steps in (100, 200, 400):
        joint = law.joint(stress)
        joint.update([0.0, 1e-2, 0.0])
        for _ in range(steps):
            F = joint.update([0.0, 0.0, way / steps])[0]
        angle = 2.0 * math.atan(math.exp(-KS * way / strength))
        assert np.hypot(*F[1:]) == pytest.approx(strength, rel=ROUNDING)
        errors.append(abs(math.atan2(F[1], F[2]) - angle))
    assert errors[-1] < 1e-3
    assert np.diff(np.log2(errors)) == pytest.approx(-1.0, abs=0.05)


def tiny_steps(law, legs, n):
    """Coulomb's words in plain numbers, n steps a leg: yields F, w and what was lost after each."""
    u, q, w, work, old = 0.0, np.zeros(len(legs[0]) - 1), 0.0, 0.0, np.zeros(len(legs[0]))
    for leg in legs:
        d = np.asarray(leg) / n
        for _ in range(n):
            u, q = u + d[0], q + law.shear_stiffness * d[1:]
            sigma, size = law.normal_stiffness * u, math.sqrt(q @ q)

            def strength(w, sigma=sigma):
                intact = law.cohesion + law.friction * sigma
                weak = law.residual_cohesion + law.residual_friction * sigma
                return intact + w * (weak - intact) if w < 2 else law.residual_friction * sigma

            if sigma < (0.0 if w else -min(law.tension, law.cohesion / law.friction)):
                w, q, sigma = 2.0, 0.0 * q, 0.0
            elif size > strength(w):
                if sigma < 0.0:
                    w, q, sigma = 2.0, 0.0 * q, 0.0
                elif w == 2.0:
                    q = q * (strength(w) / size)
                else:
                    slip = (size - strength(w)) / law.shear_stiffness
                    w = min(1.0, w + slip / law.weakening) if law.weakening else 1.0
                    q = q * (strength(w) / size)
            F = np.array([sigma, *q])
            work, old = work + 0.5 * (F + old) @ d, F
        stored = 0.5 * sigma**2 / law.normal_stiffness + 0.5 * q @ q / law.shear_stiffness
        yield F, w, work - stored


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", ["brittle", "weakens"])
@pytest.mark.parametrize("seed", range(3))
def test_tiny_steps_in_plain_numbers(kind, dim, seed):
    rng = np.random.default_rng([seed, dim])
    law = coulomb(*([None] if dim == 3 else [0.0]), **KINDS[kind])
    legs = (
        rng.normal(size=(6, dim)) * [2e-4, *[6e-4] * (dim - 1)] + [[2e-4] + [0.0] * (dim - 1)] * 6
    )
    legs[3, 0] = -4e-4
    joint = law.joint()
    for leg, (F, w, lost) in zip(legs, tiny_steps(law, legs, 4000), strict=True):
        for _ in range(500):
            joint.update(leg / 500, tangent=False)
        scale = max(C, np.abs(F).max())
        np.testing.assert_allclose(joint.F, F, atol=2e-3 * scale)  # first order of either
        assert joint.damage == pytest.approx(min(w, 1.0), abs=2e-3)
        assert joint.dissipated_energy == pytest.approx(lost, rel=2e-3, abs=1e-6)


def energy_scale(one, delta, d):
    """Elastic energy (B,) that no rounding can exceed."""
    size = np.sum(np.abs(delta) + np.abs(d), axis=0)
    return max(one.normal * (1.0 + one.friction), one.shear) * size**2 + one.cohesion * size


def random_law(rng, dim):
    """A law whose strengths are met by displacements of about one, some of them zero."""
    kn, ks = 10.0 ** rng.uniform(-1.0, 1.0, 2)
    friction, cohesion, tension = rng.uniform(0.1, 1.0, 3) * (rng.random(3) < 0.7) * [1, ks, kn]
    left = rng.choice([0.0, 0.5, 1.0], 2) * [friction, cohesion]
    weakening = rng.uniform(0.1, 3.0) * rng.integers(2)
    plane = None if dim == 3 else 0.0
    return jl.CoulombLaw(kn, ks, friction, cohesion, tension, *left, weakening, plane)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(8))
def test_energy_of_closed_cycles(seed, dim):
    """Random large steps and back: no loss is negative, and each step's is its work less what is
    stored more; in space, where the shear stress turns, the work is at least that which is stored.
    A step by nothing changes nothing.
    """
    rng, n = np.random.default_rng([seed, dim]), 60
    law = random_law(rng, dim)
    (one,) = law.tables.elements
    corners = rng.normal(size=(7, dim, n)) * 10.0 ** rng.uniform(-1.0, 0.7, n)
    corners[0] = corners[-1] = 0.0
    corners[4, 0] = corners[3, 0]
    state, total, closest = np.zeros((dim, n)), np.zeros(n), 0.0
    for delta, d in zip(corners, np.diff(corners, axis=0), strict=False):
        new, scale = state.copy(), energy_scale(one, delta, d)
        F, lost, tangent = one.step(delta, d, state, new, True)
        assert (lost >= 0.0).all()
        gained = one.stored(delta + d, new) - one.stored(delta, state)
        work = work_of_step(one, delta, d, state, 1e-14 * scale)
        assert (work >= gained - 1e-10 * scale).all()
        if dim == 2:
            assert (np.abs(work - gained - lost) <= 1e-10 * scale).all()
        size = np.linalg.norm(np.moveaxis(tangent, -1, 0), 2, axis=(1, 2))
        bound = one.stiffness(delta + d, new)
        weakens = (new[-1] > state[-1]) & (new[-1] < 1.0)  # by its own slope
        if weakens.any():
            fall = one.strength(0.0 * F[0], F[0]) - one.strength(0.0 * F[0] + 1.0, F[0])
            steep = np.hypot(1.0, one.friction * one.normal / one.shear)
            bound = bound + weakens * steep * fall / one.weakening
        assert (size <= bound * (1.0 + 1e-12)).all()
        closest = max(closest, np.divide(size, bound, out=0.0 * size, where=bound > 0.0).max())

        again = new.copy()
        still = one.step(delta + d, 0.0 * d, new, again, False)
        np.testing.assert_array_equal([*again, *still.F, still.lost], [*new, *F, 0.0 * lost])
        state, total = new, total + work
    assert (total >= one.stored(corners[-1], state) - 1e-9 * scale).all()
    assert closest > 0.999  # a bound, but not an empty one
    assert (state[-1] > 0.0).mean() > 0.5
    assert (total > 0.1 * one.cohesion**2 / one.shear).any()


# how the law differs from `unit`, steps that lead to the state, the step whose tangent is checked
TANGENTS = {
    "stick": ({}, [[0.5, 0.0, 0.0]], [0.1, 0.1, 0.05]),
    "tension": ({}, [[0.1, 0.0, 0.0]], [-0.14, 0.05, 0.02]),
    "slide": ({}, [[0.5, 0.0, 0.0], [0.0, 1.5, 0.3]], [-0.1, 0.2, 0.4]),
    "weakens": ({"weakening": 3.0}, [[0.5, 0.0, 0.0], [0.0, 1.5, 0.3]], [-0.1, 0.2, 0.4]),
    "falls": ({"weakening": 0.1}, [[0.5, 0.0, 0.0]], [0.1, 1.3, 0.4]),
    "drops": ({}, [[0.5, 0.0, 0.0]], [0.1, 1.3, 0.4]),
    "touches and slides": ({}, [[-0.5, 0.0, 0.0]], [0.6, 1.3, 0.4]),
}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("state", TANGENTS)
def test_tangent(state, dim):
    more, path, d = TANGENTS[state]
    unit = jl.CoulombLaw(1.0, 0.5, 0.6, 0.1, 0.05, 0.4, 0.03, **more, plane=[0.0, None][dim - 2])
    copies = unit.joints(2 * dim * len(STEPS))
    for step in path:
        copies.update(np.tile(step[:dim], (len(copies), 1)), tangent=False)
    errors = v_curve(copies, np.array(d[:dim]))
    assert errors.min() < 1e-8
    if dim == 3 and state not in ("stick", "tension"):  # q turns, all else is quadratic at most
        assert descent_slope(errors) == pytest.approx(2.0, abs=0.1)
