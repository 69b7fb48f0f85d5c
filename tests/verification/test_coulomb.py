"""Joints with tensile strength. Coulomb's joint: closed forms, an independent model in small steps,
energy of every step, tangent. The bond: strength, fracture energies, no healing, no energy created,
peak with friction."""

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
from jointlaw.kernels.bond import BondElement

KN = 1e10  # Pa/m
KS = 4e9  # Pa/m
MU = 0.6
COHESION = 1e6  # Pa
TENSION = 4e5  # Pa
BRITTLE = {"residual_friction": 0.4, "residual_cohesion": 0.3e6}
SOFTENS = BRITTLE | {"weakening": 1e-3}
KINDS = {"ductile": {}, "brittle": BRITTLE, "softens": SOFTENS, "no tension": {"tension": 0.0}}
ROUNDING = 1e-11  # of sums over some hundred steps


def coulomb(plane=0.0, **more):
    """Coulomb's law of this module, with changes."""
    stiffness = {"normal_stiffness": KN, "shear_stiffness": KS}
    strength = {"friction": MU, "cohesion": COHESION, "tension": TENSION}
    return jl.CoulombLaw(**stiffness | strength | {"plane": plane} | more)


def plane_and_shear(dim, slip):
    """`plane` of a law in 2 or 3 dimensions, and the components of a slip."""
    return (0.0, [slip]) if dim == 2 else (None, [0.6 * slip, -0.8 * slip])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("steps", [1, 7, 200])
def test_direct_shear_at_constant_normal_stress(kind, dim, steps):
    """Peak, slope of softening and residual, in steps of any size."""
    stress = 3e6
    peak = COHESION + MU * stress
    residual = 0.3e6 + 0.4 * stress if kind in ("brittle", "softens") else peak
    length = KINDS[kind].get("weakening", 0.0)
    for end in (0.999 * peak / KS, 1.001 * peak / KS, peak / KS + 0.4e-3, 2e-3):
        plane, shear = plane_and_shear(dim, end)
        law = coulomb(plane, **KINDS[kind])
        joint = law.joint(stress)
        for _ in range(steps):
            F = joint.update([0.0, *np.divide(shear, steps)])[0]
        slip = end - peak / KS
        measures = reference.measures(law.tables, joint.snapshot().values.T)
        assert measures.sliding == (slip > 0.0)
        softening = (slip > 0.0) * (min(slip / length, 1.0) if length else 1.0)
        q = min(KS * end, peak) - softening * (peak - residual)
        np.testing.assert_allclose(F, [stress, *np.multiply(shear, q / end)], rtol=ROUNDING)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("tension", "strength"), [(0.0, 0.0), (TENSION, TENSION), (1e9, COHESION / MU)]
)
@pytest.mark.parametrize("fraction", [0.0, 0.8])
def test_tension_breaks_the_joint_which_then_closes_at_zero(tension, strength, fraction, dim):
    """Under a shear stress (fraction of the cohesion) it breaks where C + mu sigma is less."""
    plane, shear = plane_and_shear(dim, fraction * COHESION / KS)
    joint = coulomb(plane, tension=tension).joint(1.0)
    strength = min(strength, (1.0 - fraction) * COHESION / MU)
    joint.update([-0.9999999 * strength / KN - joint.delta[0], *shear])
    assert joint.F[0] == pytest.approx(-strength, rel=1e-6)
    assert joint.damage == 0.0
    stored = joint.stored_energy
    joint.update([-1e-4, *np.zeros(dim - 1)])
    assert not joint.F.any()
    assert joint.damage == 1.0
    assert joint.dissipated_energy == pytest.approx(stored, rel=1e-6)
    joint.update([-joint.delta[0] - 1e-9, *shear])
    assert not joint.F.any()
    joint.update([1e-9 + 1e-4, *np.zeros(dim - 1)])
    np.testing.assert_allclose(joint.F, [1e6, *np.zeros(dim - 1)], rtol=1e-9)


def test_separated_and_unmated_faces_have_no_cohesion():
    """Friction alone, also where slip does not reduce the cohesion, or with a residual cohesion."""
    for softening in ({}, {"residual_cohesion": 0.5 * COHESION, "weakening": 1e-3}):
        law = coulomb(**softening)
        joints = law.joints(4, mated=[True, True, True, False])
        joints.break_bond([1])
        joints.update([[-1e-3, 0.0], *3 * [[0.0, 0.0]]])
        joints.update([[1e-3 + 1e-4, 0.0], *3 * [[1e-4, 0.0]]])
        F, _ = joints.update([[0.0, 1e-2]] * 4)
        assert F[[0, 1, 3], 1] == pytest.approx(MU * 1e6)
        assert F[2, 1] == pytest.approx(MU * 1e6 + (0.5 if softening else 1.0) * COHESION)
        assert joints.damage.tolist() == [1.0] * 4


def coulomb_model(law, legs, n):
    """Independent model, n small steps a leg: F, weakening w and dissipation after each leg."""
    u = 0.0
    q = np.zeros(len(legs[0]) - 1)
    w = 0.0
    work = 0.0
    old_F = np.zeros(len(legs[0]))
    for leg in legs:
        d = np.asarray(leg) / n
        for _ in range(n):
            u = u + d[0]
            q = q + law.shear_stiffness * d[1:]
            sigma = law.normal_stiffness * u
            size = math.sqrt(q @ q)

            def strength(w, sigma=sigma):
                intact = law.cohesion + law.friction * sigma
                residual = law.residual_cohesion + law.residual_friction * sigma
                return intact + w * (residual - intact) if w < 2 else law.residual_friction * sigma

            tensile_strength = 0.0 if w else min(law.tension, law.cohesion / law.friction)
            slides = size > strength(w)
            if sigma < -tensile_strength or (slides and sigma < 0.0):  # separated
                w = 2.0
                q = 0.0 * q
                sigma = 0.0
            elif slides:
                if w < 2.0:
                    slip = (size - strength(w)) / law.shear_stiffness
                    w = min(1.0, w + slip / law.weakening) if law.weakening else 1.0
                q = q * (strength(w) / size)
            F = np.array([sigma, *q])
            work = work + 0.5 * (F + old_F) @ d
            old_F = F
        stored = 0.5 * sigma**2 / law.normal_stiffness + 0.5 * q @ q / law.shear_stiffness
        yield F, w, work - stored


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", ["brittle", "softens"])
@pytest.mark.parametrize("seed", range(3))
def test_the_law_agrees_with_an_independent_model(kind, dim, seed):
    rng = np.random.default_rng([seed, dim])
    law = coulomb(*([None] if dim == 3 else [0.0]), **KINDS[kind])
    no_shear = [0.0] * (dim - 1)
    legs = rng.normal(size=(6, dim)) * [2e-4, *[6e-4] * (dim - 1)] + [[2e-4, *no_shear]] * 6
    legs[3, 0] = -4e-4
    joint = law.joint()
    for leg, (F, w, dissipation) in zip(legs, coulomb_model(law, legs, 2000), strict=True):
        for _ in range(500):
            joint.update(leg / 500, tangent=False)
        scale = max(COHESION, np.abs(F).max())
        np.testing.assert_allclose(joint.F, F, atol=2e-3 * scale)  # first order of either
        assert joint.damage == pytest.approx(min(w, 1.0), abs=2e-3)
        assert joint.dissipated_energy == pytest.approx(dissipation, rel=2e-3, abs=1e-6)


def random_law(rng, dim):
    """A law whose strengths are reached at displacements of about one, some of them zero."""
    kn, ks = 10.0 ** rng.uniform(-1.0, 1.0, 2)
    friction, cohesion, tension = rng.uniform(0.1, 1.0, 3) * (rng.random(3) < 0.7) * [1, ks, kn]
    residual = rng.choice([0.0, 0.5, 1.0], 2) * [friction, cohesion]
    weakening = rng.uniform(0.1, 3.0) * rng.integers(2)
    plane = None if dim == 3 else 0.0
    return jl.CoulombLaw(kn, ks, friction, cohesion, tension, *residual, weakening, plane)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8))]
)
def test_energy_of_closed_cycles(seed, dim):
    """Random large steps and back: no dissipation is negative, and each equals the work less the
    increase of the stored energy; in space, where the shear stress rotates, the work is at least
    this increase. A zero increment changes nothing.
    """
    n = 60
    rng = np.random.default_rng([seed, dim])
    law = random_law(rng, dim)
    (element,) = law.tables.elements
    corners = rng.normal(size=(7, dim, n)) * 10.0 ** rng.uniform(-1.0, 0.7, n)
    corners[0] = corners[-1] = 0.0
    corners[4, 0] = corners[3, 0]
    state = np.zeros((dim, n))
    total_work = np.zeros(n)
    largest_ratio = 0.0
    for delta, d in zip(corners, np.diff(corners, axis=0), strict=False):
        new = state.copy()
        size = np.sum(np.abs(delta) + np.abs(d), axis=0)
        # elastic energy that no rounding can exceed
        stiffness = max(element.normal * (1.0 + element.friction), element.shear)
        scale = stiffness * size**2 + element.cohesion * size
        F, dissipation, tangent = element.step(delta, d, state, new, True)
        assert (dissipation >= 0.0).all()
        gained = element.stored_energy(delta + d, new) - element.stored_energy(delta, state)
        work = work_of_step(element, delta, d, state, 1e-14 * scale)
        assert (work >= gained - 1e-10 * scale).all()
        if dim == 2:
            assert (np.abs(work - gained - dissipation) <= 1e-10 * scale).all()
        bound = stiffness_bound(element, delta + d, state, new, F)
        tangent_size = np.linalg.norm(np.moveaxis(tangent, -1, 0), 2, axis=(1, 2))
        assert (tangent_size <= bound * (1.0 + 1e-12)).all()
        ratios = np.divide(tangent_size, bound, out=0.0 * bound, where=bound > 0.0)
        largest_ratio = max(largest_ratio, ratios.max())

        repeated = new.copy()
        zero_step = element.step(delta + d, 0.0 * d, new, repeated, False)
        np.testing.assert_array_equal(repeated, new)
        np.testing.assert_array_equal(zero_step.F, F)
        np.testing.assert_array_equal(zero_step.dissipated, 0.0 * dissipation)
        state = new
        total_work = total_work + work
    assert (total_work >= element.stored_energy(corners[-1], state) - 1e-9 * scale).all()
    assert largest_ratio > 0.999  # the bound is reached
    assert (state[-1] > 0.0).mean() > 0.5
    assert (total_work > 0.1 * element.cohesion**2 / element.shear).any()


def stiffness_bound(element, delta, old, new, F):
    """Bound (n,) of |C| after a step: the stiffness, plus the slope of softening if it softens."""
    bound = element.stiffness(delta, new)
    softens = (new[-1] > old[-1]) & (new[-1] < 1.0)
    if not softens.any():
        return bound
    zeros = 0.0 * F[0]
    drop = element.strength(zeros, F[0]) - element.strength(zeros + 1.0, F[0])
    direction = np.hypot(1.0, element.friction * element.normal / element.shear)
    return bound + softens * direction * drop / element.weakening


# how the law differs from `unit`, steps that lead to the state, the step whose tangent is checked
TANGENTS = {
    "stick": ({}, [[0.5, 0.0, 0.0]], [0.1, 0.1, 0.05]),
    "tension": ({}, [[0.1, 0.0, 0.0]], [-0.14, 0.05, 0.02]),
    "slide": ({}, [[0.5, 0.0, 0.0], [0.0, 1.5, 0.3]], [-0.1, 0.2, 0.4]),
    "softens": ({"weakening": 3.0}, [[0.5, 0.0, 0.0], [0.0, 1.5, 0.3]], [-0.1, 0.2, 0.4]),
    "softens to the residual": ({"weakening": 0.1}, [[0.5, 0.0, 0.0]], [0.1, 1.3, 0.4]),
    "brittle": ({}, [[0.5, 0.0, 0.0]], [0.1, 1.3, 0.4]),
    "touches and slides": ({}, [[-0.5, 0.0, 0.0]], [0.6, 1.3, 0.4]),
}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("state", TANGENTS)
def test_tangent_is_the_derivative_of_the_step(state, dim):
    softening, path, d = TANGENTS[state]
    unit = jl.CoulombLaw(
        1.0, 0.5, 0.6, 0.1, 0.05, 0.4, 0.03, **softening, plane=[0.0, None][dim - 2]
    )
    copies = unit.joints(2 * dim * len(STEPS))
    for step in path:
        copies.update(np.tile(step[:dim], (len(copies), 1)), tangent=False)
    errors = v_curve(copies, np.array(d[:dim]))
    assert errors.min() < 1e-8
    if dim == 3 and state not in (
        "stick",
        "tension",
    ):  # q rotates, the other parts are quadratic at most
        assert descent_slope(errors) == pytest.approx(2.0, abs=0.1)


STIFFNESS = (1e10, 5e9)  # Pa/m, in opening and in shear
STRENGTH = (2e6, 3e6)  # Pa
DUCTILE = jl.Bond(*STIFFNESS, *STRENGTH, energy_I=1e3, energy_II=2e4)  # elastic 200 and 900 J/m2
BONDS = {
    "brittle": jl.Bond(*STIFFNESS, *STRENGTH),
    "ductile": DUCTILE,
    "brittle in opening": jl.Bond(*STIFFNESS, *STRENGTH, energy_II=1e4),
}
BOND_ROUNDING = 1e-10  # of sums over a few hundred steps
MODES = {"opening": (0, [-1.0, 0.0, 0.0]), "shear": (1, [0.0, 0.6, -0.8])}


@pytest.fixture(scope="module")
def rough():
    """A coarse joint in space whose asperities have shear strength."""
    return replace(
        jl.presets.load("jing-replica"), mating_length=1e-2, resolution=jl.Resolution(2, 4, 2)
    )


def fracture_energies(bond):
    """Fracture energies in opening and in shear; by default the elastic energy at the peak."""
    energies = bond.energy_I, bond.energy_II
    elastic = [0.5 * t**2 / k for k, t in zip(STIFFNESS, STRENGTH, strict=True)]
    return [e if energy is None else energy for energy, e in zip(energies, elastic, strict=True)]


def damage_and_dissipation(bond, delta, old):
    """Damage and dissipation (B,) of a bond of the old damage after a step to delta (3, B)."""
    new = np.empty((1, len(old)))
    step = BondElement(bond).step(np.zeros_like(delta), delta, old[None], new, False)
    return new[0], step.dissipated


@pytest.mark.parametrize("direction", MODES)
@pytest.mark.parametrize("name", BONDS)
def test_peak_and_area_of_one_mode(name, direction, rough):
    """The traction of the asperities, of a joint without a bond, is subtracted: none in opening."""
    bond = BONDS[name]
    mode, unit = MODES[direction]
    strength = STRENGTH[mode]
    energy = fracture_energies(bond)[mode]
    peak = strength / STIFFNESS[mode]  # displacements
    end = 2.0 * energy / strength
    u = np.unique([*np.linspace(0.0, peak, 4), *np.linspace(peak, end, 200), 1.2 * end])
    joint = replace(rough, bond=bond).joint()
    unbonded = rough.joint()
    steps = np.diff(u)[:, None] * unit
    traction = np.array([joint.update(d)[0] - unbonded.update(d)[0] for d in steps]) @ unit
    assert traction.max() == pytest.approx(strength, rel=BOND_ROUNDING)
    area = trapezoid([0.0, *traction], u)
    if end > peak * (1.0 + BOND_ROUNDING):  # a polygon whose corners are among the points
        assert area == pytest.approx(energy, rel=BOND_ROUNDING)
        after_peak = traction[np.searchsorted(u, peak) :]
        assert after_peak.min() == pytest.approx(0.0, abs=BOND_ROUNDING * strength)
    dissipation = joint.dissipated_energy - unbonded.dissipated_energy
    assert dissipation == pytest.approx(energy, rel=BOND_ROUNDING)
    assert joint.damage == 1.0
    if mode == 0:
        assert not unbonded.F.any()
        half = replace(rough, bond=bond).normal_stress(-0.5 * peak)
        assert half == pytest.approx(-0.5 * strength, rel=BOND_ROUNDING)


MIXED_ANGLES = np.array([0.2, 0.7, 1.3])


@pytest.mark.parametrize("name", BONDS)
def test_mixed_opening_and_shear(name):
    """Damage starts on the ellipse; the energy is the integral of psi over the damage."""
    bond = BONDS[name]
    directions = np.array([-np.sin(MIXED_ANGLES), np.cos(MIXED_ANGLES)])
    paths = [mixed_path(bond, u) for u in directions.T]
    damage = np.zeros(len(paths))
    dissipation = np.zeros(len(paths))
    for lengths in np.linspace(*np.transpose([path[:2] for path in paths]), 4001):
        damage, lost = damage_and_dissipation(bond, lengths * directions, damage)
        dissipation += lost
    np.testing.assert_array_equal(damage, 1.0)
    energies = [energy for *_, energy in paths]
    np.testing.assert_allclose(dissipation, energies, rtol=1e-5)  # second order of 4000 steps


def mixed_path(bond, u):
    """Lengths along a direction u (2,) where damage starts and beyond its end, and the energy
    (J/m2) in between."""
    utilisation = np.abs(u) * STIFFNESS / np.array(STRENGTH)
    start = 1.0 / np.hypot(*utilisation)  # a step that ends here is on the ellipse

    def damage_after(length):
        return damage_and_dissipation(bond, length * u[:, None], np.zeros(1))[0]

    assert damage_after((1.0 - 1e-9) * start) == 0.0 < damage_after((1.0 + 1e-9) * start)
    ends = [2.0 * e / t for e, t in zip(fracture_energies(bond), STRENGTH, strict=True)]
    end = 1.0 / np.hypot(*(np.abs(u) / ends))
    soft = [k / t - 1.0 / e for k, t, e in zip(STIFFNESS, STRENGTH, ends, strict=True)]

    def strength(d):
        """Length at which the ellipse of damage d is reached."""
        axes = [k / t - d * s for k, t, s in zip(STIFFNESS, STRENGTH, soft, strict=True)]
        return brentq(lambda x: np.hypot(*(x * u * axes)) - 1.0, 0.0, 2.0 * end, xtol=1e-16)

    psi = 0.5 * np.sum(np.array(STIFFNESS) * u**2)
    energy = quad(lambda d: psi * strength(d) ** 2, 0.0, 1.0, epsabs=0.0, epsrel=1e-10)[0]
    return start, 1.001 * end, energy


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_closed_cycles_of_a_bond_create_no_energy(seed):
    """2000 cycles of a random bond: along straight steps the work is at least the stored energy."""
    rng = np.random.default_rng(seed)
    bond = random_bond(rng)
    size = 10.0 ** rng.uniform(-2.0, 2.0, 2000) / bond.limits[1].min()  # of the broken bond
    corners = rng.normal(size=(5, 3, 2000)) * size
    corners[0] = corners[-1] = 0.0
    element = BondElement(bond)
    intact = np.zeros((1, 2000))
    damage = intact
    work = 0.0
    scale = 0.0
    for start, end in pairwise(corners):
        new = damage.copy()
        scale = np.maximum(scale, element.stored_energy(end, intact))
        assert (element.step(start, end - start, damage, new, False).dissipated >= 0.0).all()
        assert (new >= damage).all()  # no healing
        work = work + work_of_step(element, start, end - start, damage, 1e-14 * scale)
        damage = new
        assert (work >= element.stored_energy(end, damage) - 1e-10 * scale).all()
    assert (damage > 0.0).mean() > 0.5


@pytest.mark.parametrize("name", ["westerly-rough", "jing-replica"])
@pytest.mark.parametrize("toughness", [1.0, pytest.param(30.0, marks=pytest.mark.slow)])
def test_peak_and_residual_of_bond_and_friction(name, toughness):
    """At constant normal stress dilation puts the bond in tension and loads the asperities."""
    unbonded = replace(jl.presets.load(name), plane=0.0)
    # no step of 0.1 closure ranges ends where the bond breaks: rounding would decide
    length = 0.31 * unbonded.closure_range
    T = 1e6  # Pa, tension
    c = 3e6  # Pa, cohesion
    energies = 0.5 * toughness * np.array([T, c]) * length
    bond = jl.Bond(T / length, c / length, T, c, *energies)
    slip = 40.0 * unbonded.closure_range
    for stress in (0.3e6, 1e6, 3e6, 10e6, 30e6) if toughness > 1.0 else (0.3e6, 3e6, 30e6):
        friction, bonded = (
            jl.direct_shear(law.joint(), slip, stress, steps=400).shear_stress
            for law in (unbonded, replace(unbonded, bond=bond))
        )
        tan_phi = friction.max() / stress
        peak = bonded.max()
        assert friction.max() <= peak <= stress * tan_phi + np.hypot(c, T * tan_phi)
        assert bonded[-1] == pytest.approx(friction[-1], rel=1e-6)
        if stress <= 1e6:
            assert peak > friction.max() + 0.5 * c


def test_an_unmated_joint_starts_without_interlock_and_without_bond(rough):
    """With a mating length, without one, and as a new contact of a pool; Coulomb's joint has no
    cohesion then."""
    bonded = replace(rough, bond=DUCTILE)
    for law in (bonded, replace(bonded, mating_length=math.inf), coulomb(None)):
        joint = law.joint(mated=False)
        F, _ = joint.update([-1e-3, 1e-4, 0.0])
        assert joint.damage == 1.0
        assert not F.any()
        pool = jl.JointPool(law)
        pool.add(["first"])
        pool.add(["second"], mated=False)
        unmated = law.joint(mated=False).snapshot().values[0]
        np.testing.assert_array_equal(unmated[:3], law.unmated_start)
        np.testing.assert_array_equal(pool.snapshot().values, [np.zeros_like(unmated), unmated])
        pool.batch.reset(pool.places[:1], mated=False)
        np.testing.assert_array_equal(pool.snapshot().values, [unmated, unmated])
