"""Joints that hold tension. Coulomb's: closed forms, tiny steps in plain numbers, energy of every
step, tangent. The bond: strength, energies of fracture, no healing, no energy made, peak with
friction."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from c_host import random_bond
from scipy.integrate import quad, trapezoid
from scipy.optimize import brentq
from test_tangent import STEPS, descent_slope, v_curve
from work import work_of_step

import jointlaw as jl
from jointlaw.kernels import reference
from jointlaw.kernels.bond import Bonded

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
        new, size = state.copy(), np.sum(np.abs(delta) + np.abs(d), axis=0)
        # elastic energy that no rounding can exceed
        scale = max(one.normal * (1.0 + one.friction), one.shear) * size**2 + one.cohesion * size
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


STIFFNESS, STRENGTH = (1e10, 5e9), (2e6, 3e6)  # Pa/m, Pa
DUCTILE = jl.Bond(*STIFFNESS, *STRENGTH, energy_I=1e3, energy_II=2e4)  # elastic 200 and 900 J/m2
BONDS = {
    "brittle": jl.Bond(*STIFFNESS, *STRENGTH),
    "ductile": DUCTILE,
    "brittle in opening": jl.Bond(*STIFFNESS, *STRENGTH, energy_II=1e4),
}
EXACT = 1e-10  # rounding of sums over a few hundred steps
WAYS = {"opening": (0, [-1.0, 0.0, 0.0]), "shear": (1, [0.0, 0.6, -0.8])}


@pytest.fixture(scope="module")
def rough():
    """A joint in space that carries in shear as well, coarse."""
    return replace(
        jl.presets.load("jing-replica"), mating_length=1e-2, resolution=jl.Resolution(2, 4, 2)
    )


def energies(bond):
    """Energies of fracture in opening and in shear."""
    given = bond.energy_I, bond.energy_II
    elastic = [0.5 * t**2 / k for k, t in zip(STIFFNESS, STRENGTH, strict=True)]
    return [e if g is None else g for g, e in zip(given, elastic, strict=True)]


def hold(bond, delta, old):
    """Damage and loss (B,) of a bond after a step to delta (3, B)."""
    new = np.empty((1, len(old)))
    return new[0], Bonded(bond).step(np.zeros_like(delta), delta, old[None], new, False).lost


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", BONDS)
def test_peak_and_area_of_one_mode(name, way, rough):
    """The asperities, a twin without a bond, are taken off: in opening they carry nothing."""
    bond, (mode, direction) = BONDS[name], WAYS[way]
    k, strength, energy = STIFFNESS[mode], STRENGTH[mode], energies(bond)[mode]
    begin, end = strength / k, 2.0 * energy / strength
    at = np.unique([*np.linspace(0.0, begin, 4), *np.linspace(begin, end, 200), 1.2 * end])
    joint, plain = replace(rough, bond=bond).joint(), rough.joint()
    steps = np.diff(at)[:, None] * direction
    along = np.array([joint.update(d)[0] - plain.update(d)[0] for d in steps]) @ direction
    assert along.max() == pytest.approx(strength, rel=EXACT)
    area = trapezoid([0.0, *along], at)
    if end > begin * (1.0 + EXACT):  # the traction is a polygon whose corners are among the points
        assert area == pytest.approx(energy, rel=EXACT)
        assert along[np.searchsorted(at, begin) :].min() == pytest.approx(0.0, abs=EXACT * strength)
    lost = joint.dissipated_energy - plain.dissipated_energy
    assert lost == pytest.approx(energy, rel=EXACT)
    assert joint.damage == 1.0
    if mode == 0:
        assert not plain.F.any()
        half = replace(rough, bond=bond).normal_stress(-0.5 * begin)
        assert half == pytest.approx(-0.5 * strength, rel=EXACT)


@pytest.mark.parametrize("angle", [0.2, 0.7, 1.3])
@pytest.mark.parametrize("name", BONDS)
def test_mixed_opening_and_shear(name, angle):
    """Damage begins on the ellipse; the energy is the integral of psi over the damage."""
    bond, u = BONDS[name], np.array([-np.sin(angle), np.cos(angle)])
    shares = np.abs(u) * STIFFNESS / np.array(STRENGTH)
    begin = 1.0 / np.hypot(*shares)  # a step that ends here is on the ellipse

    def after(length):
        return hold(bond, length * u[:, None], np.zeros(1))[0]

    assert after((1.0 - 1e-9) * begin) == 0.0 < after((1.0 + 1e-9) * begin)
    ends = [2.0 * e / t for e, t in zip(energies(bond), STRENGTH, strict=True)]
    end = 1.0 / np.hypot(*(np.abs(u) / ends))
    steps, old, lost = np.linspace(begin, 1.001 * end, 4001), np.zeros(1), 0.0
    for length in steps:
        old, more = hold(bond, length * u[:, None], old)
        lost = lost + float(more[0])
    soft = [k / t - 1.0 / e for k, t, e in zip(STIFFNESS, STRENGTH, ends, strict=True)]

    def strength(d):
        """Length at which the ellipse of damage d is met."""
        axes = [k / t - d * s for k, t, s in zip(STIFFNESS, STRENGTH, soft, strict=True)]
        return brentq(lambda x: np.hypot(*(x * u * axes)) - 1.0, 0.0, 2.0 * end, xtol=1e-16)

    psi = 0.5 * np.sum(np.array(STIFFNESS) * u**2)
    integral = quad(lambda d: psi * strength(d) ** 2, 0.0, 1.0, epsabs=0.0, epsrel=1e-10)[0]
    assert old[0] == 1.0
    assert lost == pytest.approx(integral, rel=1e-5)  # second order of 4000 steps


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_no_energy_from_closed_cycles(seed):
    """2000 cycles of a random bond: along straight steps the work is at least what is stored."""
    rng = np.random.default_rng(seed)
    bond = random_bond(rng)
    size = 10.0 ** rng.uniform(-2.0, 2.0, 2000) / bond.limits[1].min()  # of where it is broken
    corners = rng.normal(size=(5, 3, 2000)) * size
    corners[0] = corners[-1] = 0.0
    one, damage, work, scale = Bonded(bond), np.zeros((1, 2000)), 0.0, 0.0
    for at, end in pairwise(corners):
        new, scale = damage.copy(), np.maximum(scale, one.stored(end, np.zeros((1, 2000))))
        assert (one.step(at, end - at, damage, new, False).lost >= 0.0).all()
        assert (new >= damage).all()  # nothing heals
        work = work + work_of_step(one, at, end - at, damage, 1e-14 * scale)
        damage = new
        assert (work >= one.stored(end, damage) - 1e-10 * scale).all()
    assert (damage > 0.0).mean() > 0.5


@pytest.mark.parametrize("name", ["westerly-rough", "jing-replica"])
@pytest.mark.parametrize("tough", [1.0, 30.0])
def test_peak_with_friction_and_residual(name, tough):
    """At constant normal stress: dilation puts the bond in tension and presses the asperities."""
    plain = replace(jl.presets.load(name), plane=0.0)
    # no step of 0.1 closure ranges ends where the bond breaks: rounding would decide
    T, c, length = 1e6, 3e6, 0.31 * plain.closure_range
    bond = jl.Bond(T / length, c / length, T, c, tough * T * length / 2, tough * c * length / 2)
    way = 40.0 * plain.closure_range
    for stress in (0.3e6, 1e6, 3e6, 10e6, 30e6):
        one, two = (
            jl.direct_shear(law.joint(), way, stress, steps=400)
            for law in (plain, replace(plain, bond=bond))
        )
        slope = one.shear_stress.max() / stress
        peak = two.shear_stress.max()
        assert one.shear_stress.max() <= peak <= stress * slope + np.hypot(c, T * slope)
        assert two.shear_stress[-1] == pytest.approx(one.shear_stress[-1], rel=1e-6)
        if stress <= 1e6:
            assert peak > one.shear_stress.max() + 0.5 * c


def test_an_unmated_joint_starts_far_from_mate_and_has_no_bond(rough):
    """With a mating length, without one, and where faces meet anew in a batch; and so has Coulomb's
    joint no cohesion."""
    bonded = replace(rough, bond=DUCTILE)
    for law in (bonded, replace(bonded, mating_length=math.inf), coulomb(None)):
        joint = law.joint(mated=False)
        opened = joint.update([-1e-3, 1e-4, 0.0])[0]
        assert joint.damage == 1.0
        assert not opened.any()
        pool = jl.JointPool(law)
        pool.add(["first"])
        pool.add(["second"], mated=False)
        one = law.joint(mated=False).snapshot().values[0]
        np.testing.assert_array_equal(one[:3], law.unmated_start)
        np.testing.assert_array_equal(pool.snapshot().values, [np.zeros_like(one), one])
        pool.batch.reset(pool.places[:1], mated=False)
        np.testing.assert_array_equal(pool.snapshot().values, [one, one])
