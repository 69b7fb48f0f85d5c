"""Two bonded spheres in LAMMPS, pulled apart: the joint is kept until the bond is broken."""

import numpy as np
import pytest
from lammps_host import HEAD, dumped, lammps, run, soft

import jointlaw as jl
from jointlaw.hosts.c.export import table_text

R, T, K = 1e-2, 1e5, 1e10  # m, Pa, Pa/m
COULOMB = jl.CoulombLaw(K, K / 2, friction=0.6, cohesion=1e4, tension=1e4, residual_cohesion=0.0)
BOND = jl.Bond(K, K, T, 2 * T, energy_I=4 * T**2 / (2 * K))
SCENE = (
    HEAD
    + """boundary f f f
region box block -0.2 0.225 -0.2 0.2 -0.2 0.2
create_box 1 box
create_atoms 1 single 0.0 0.0 0.0
create_atoms 1 single {apart!r} 0.0 0.0
set type 1 diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening {opening} damping 0.5
pair_coeff * * {law}.jlaw
neighbor 0.002 bin
timestep 1e-7
group moving id 2
fix 1 moving move linear {speed}
dump 1 all custom 1 out type x fx id y fy
dump_modify 1 sort id format float %.17g
run 600
"""
)


@pytest.fixture(scope="module")
def folder(plugin):
    for name, law in (("bonded", soft(bond=BOND)), ("coulomb", COULOMB)):
        (plugin / f"{name}.jlaw").write_text(table_text(law))
    return plugin


def scene(apart, speed, opening=1e-4, law="bonded"):
    return SCENE.format(apart=apart, speed=speed, opening=opening, law=law)


def test_coulomb_is_one_word(folder):
    """Pulled apart: kn u up to the tension; sheared: ks s up to c + mu sigma, then mu sigma.

    As it is sheared by 6 um, the normal turns by 3e-4, and closure changes by 1e-3 of it.
    """
    area, kn, ks = np.pi * R * R, COULOMB.normal_stiffness, COULOMB.shear_stiffness
    run(folder, scene(2 * R - 1e-9, "0.1 0.0 0.0", law="coulomb"))
    frames = dumped(folder / "out")
    opening, force = frames[:, 1, 1] - 2 * R, frames[:, 0, 2]
    expected = np.where(opening < COULOMB.tension / kn, kn * area * opening, 0.0)
    np.testing.assert_allclose(force, expected, atol=1e-9 * T * area)
    assert 9e3 * area < force.max() > 1e3 * abs(force[-1])
    run(folder, scene(2 * R - 1e-6, "0.0 0.1 0.0", law="coulomb"))
    frames = dumped(folder / "out")
    slip, normal = frames[:, 1, 4], -frames[:, 0, 2]
    sticks = ks * area * slip < COULOMB.cohesion * area + 0.6 * normal
    expected = np.where(sticks, ks * area * slip, 0.6 * normal)
    np.testing.assert_allclose(frames[:, 0, 5], expected, atol=2e-3 * expected.max())
    np.testing.assert_allclose(normal, kn * area * 1e-6, rtol=2e-3)
    assert sticks.sum() == pytest.approx(1.6e4 / ks / 1e-8, abs=3)


def test_pulled_apart(folder):
    """The force is that of the law at each opening: up to tension times area, then none."""
    run(folder, scene(2 * R - 1e-9, "1.0 0.0 0.0"))
    frames = dumped(folder / "out")
    opening, force = frames[:, 1, 1] - 2 * R, frames[:, 0, 2]
    law, area = soft(bond=BOND), np.pi * R * R
    joint, expected = law.joint(), []
    for d in np.diff(-opening, prepend=0.0):
        expected.append(-joint.update([d, 0.0, 0.0])[0][0] * area)
    np.testing.assert_allclose(force, expected, atol=1e-6 * T * area)
    assert force.max() == pytest.approx(T * area, rel=0.01)
    assert not force[opening > 4.1e-5].any()


def test_spheres_that_meet_have_no_bond(folder):
    """They touch in the run, and part again by themselves: nothing holds them."""
    text = scene(2 * R + 1e-6, "-1.0 0.0 0.0")
    back = "unfix 1\nfix 1 moving move linear 1.0 0.0 0.0\nrun 900\n"
    run(folder, text.replace("run 600\n", "run 60\n" + back))
    frames = dumped(folder / "out")
    opening, force = frames[:, 1, 1] - 2 * R, frames[:, 0, 2]
    assert (force[:61] < 0.0).any()
    assert opening[-1] > 1e-5
    assert (force <= 0.0).all()


def test_an_opening_that_is_too_small_is_told(folder):
    cases = {"bonded": (3e-5, "holds until the joint is 4"),
             "coulomb": (9e-7, "bears tension until the joint is 1e-06 m")}  # fmt: skip
    for law, (opening, words) in cases.items():
        done = lammps(folder, scene(2 * R, "1.0 0.0 0.0", opening, law))
        assert done.returncode != 0
        assert words in done.stdout + done.stderr
