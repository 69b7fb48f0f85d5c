"""The bond: strength, energies of fracture, no healing, no energy made, peak with friction."""

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad, trapezoid
from scipy.optimize import brentq
from work import work_of_step

import jointlaw as jl
from jointlaw.kernels.bond import Bonded

STIFFNESS, STRENGTH = (1e10, 5e9), (2e6, 3e6)  # Pa/m, Pa
BRITTLE = jl.Bond(*STIFFNESS, *STRENGTH)
DUCTILE = jl.Bond(*STIFFNESS, *STRENGTH, energy_I=1e3, energy_II=2e4)  # elastic 200 and 900 J/m2
MIXED = jl.Bond(*STIFFNESS, *STRENGTH, energy_II=1e4)
BONDS = {"brittle": BRITTLE, "ductile": DUCTILE, "brittle in opening": MIXED}
EXACT = 1e-10  # rounding of sums over a few hundred steps
WAYS = {"opening": (0, [-1.0, 0.0, 0.0]), "shear": (1, [0.0, 0.6, -0.8])}


def energies(bond):
    """Energies of fracture in opening and in shear."""
    given = bond.energy_I, bond.energy_II
    elastic = [0.5 * t**2 / k for k, t in zip(STIFFNESS, STRENGTH, strict=True)]
    return [e if g is None else g for g, e in zip(given, elastic, strict=True)]


def hold(bond, delta, old):
    """Damage (B,), traction and loss of a bond after a step to delta (3, B)."""
    new = np.empty((1, len(old)))
    share = Bonded(bond).step(np.zeros_like(delta), delta, old[None], new, False)
    return SimpleNamespace(damage=new[0], F=share.F, lost=share.lost)


def pull(bond, points, law):
    """Bond's part of the traction at the end of straight steps through points (n, 3)."""
    joint, plain = replace(law, bond=bond).joint(), law.joint()
    rows = [joint.update(d)[0] - plain.update(d)[0] for d in np.diff(points, axis=0)]
    return joint, plain, np.array(rows)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", BONDS)
def test_peak_and_area_of_one_mode(name, way, rough):
    """The asperities, a twin without a bond, are taken off: in opening they carry nothing."""
    bond, (mode, direction) = BONDS[name], WAYS[way]
    k, strength, energy = STIFFNESS[mode], STRENGTH[mode], energies(bond)[mode]
    begin, end = strength / k, 2.0 * energy / strength
    at = np.unique([*np.linspace(0.0, begin, 4), *np.linspace(begin, end, 200), 1.2 * end])
    joint, plain, parts = pull(bond, at[:, None] * direction, rough)
    along = parts @ direction
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


@pytest.mark.parametrize("angle", [0.2, 0.7, 1.3])
@pytest.mark.parametrize("name", BONDS)
def test_mixed_opening_and_shear(name, angle):
    """Damage begins on the ellipse; the energy is the integral of psi over the damage."""
    bond, u = BONDS[name], np.array([-np.sin(angle), np.cos(angle)])
    shares = np.abs(u) * STIFFNESS / np.array(STRENGTH)
    begin = 1.0 / np.hypot(*shares)  # a step that ends here is on the ellipse

    def after(length):
        return hold(bond, length * u[:, None], np.zeros(1)).damage[0]

    assert after((1.0 - 1e-9) * begin) == 0.0 < after((1.0 + 1e-9) * begin)
    ends = [2.0 * e / t for e, t in zip(energies(bond), STRENGTH, strict=True)]
    end = 1.0 / np.hypot(*(np.abs(u) / ends))
    steps, old, lost = np.linspace(begin, 1.001 * end, 4001), np.zeros(1), 0.0
    for length in steps:
        now = hold(bond, length * u[:, None], old)
        old, lost = now.damage, lost + float(now.lost[0])
    soft = [k / t - 1.0 / e for k, t, e in zip(STIFFNESS, STRENGTH, ends, strict=True)]

    def strength(d):
        """Length at which the ellipse of damage d is met."""
        axes = [k / t - d * s for k, t, s in zip(STIFFNESS, STRENGTH, soft, strict=True)]
        return brentq(lambda x: np.hypot(*(x * u * axes)) - 1.0, 0.0, 2.0 * end, xtol=1e-16)

    psi = 0.5 * np.sum(np.array(STIFFNESS) * u**2)
    integral = quad(lambda d: psi * strength(d) ** 2, 0.0, 1.0, epsabs=0.0, epsrel=1e-10)[0]
    assert old[0] == 1.0
    assert lost == pytest.approx(integral, rel=1e-5)  # second order of 4000 steps


def test_unloading_is_secant(rough):
    d = np.array([-0.3e-3, 1.1e-3, 0.4e-3])
    joint, _, (loaded, half, back) = pull(DUCTILE, [[0, 0, 0], d, d / 2, d], rough)
    assert 0.1 < joint.damage < 0.9
    np.testing.assert_allclose(half, loaded / 2, rtol=1e-12)
    np.testing.assert_allclose(back, loaded, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_no_energy_from_closed_cycles(seed):
    """2000 cycles of a random bond: along straight steps the work is at least what is stored."""
    rng = np.random.default_rng(seed)
    stiffness, strength = 10.0 ** rng.uniform(8, 11, 2), 10.0 ** rng.uniform(5, 7, 2)
    tough = np.where(rng.random(2) < 0.3, 1.0, 10.0 ** rng.uniform(0.0, 2.0, 2))
    bond = jl.Bond(*stiffness, *strength, *(tough * 0.5 * strength**2 / stiffness))
    size = (2.0 * tough * strength / stiffness).max() * 10.0 ** rng.uniform(-2.0, 2.0, 2000)
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
    """With a mating length, without one, and where faces meet anew in a batch."""
    bonded = replace(rough, bond=DUCTILE)
    for law in (bonded, replace(bonded, mating_length=math.inf)):
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


def test_bound_of_the_stiffness(rough):
    """No eigenvalue of the tangent is above the bound, softening or not."""
    bonded = replace(rough, bond=DUCTILE)
    batch = bonded.joints(200)
    rng = np.random.default_rng(5)
    for size in (1e-5, 1e-4, 1e-3, 1e-3):
        C = batch.update(size * rng.normal(size=(200, 3)))[1]
        values = np.linalg.eigvals(C).real.max(axis=1)
        assert (values <= batch.max_stiffness() * (1.0 + 1e-9)).all()
    assert (batch.damage > 0.0).mean() > 0.5
    assert (batch.stored_energy >= 0.0).all()
    closure = 1e-4
    assert bonded.max_stiffness(closure) == pytest.approx(
        rough.max_stiffness(closure) + max(STIFFNESS)
    )
    assert bonded.normal_stress(-1e-4) == pytest.approx(-1e6)


@pytest.fixture(scope="module")
def rough():
    """A joint in space that carries in shear as well, coarse."""
    return replace(
        jl.presets.load("jing-replica"), mating_length=1e-2, resolution=jl.Resolution(2, 4, 2)
    )
