"""Two bonded spheres in LAMMPS, pulled apart: the joint is kept until the bond is broken."""

import numpy as np
import pytest
from lammps_host import HEAD, dumped, lammps, run, soft

import jointlaw as jl
from jointlaw.hosts.c.export import table_text

R, T, K = 1e-2, 1e5, 1e10  # m, Pa, Pa/m
LAWS = {
    "bonded": soft(bond=jl.Bond(K, K, T, 2 * T, energy_I=4 * T**2 / (2 * K))),
    "coulomb": jl.CoulombLaw(K, K / 2, friction=0.6, cohesion=T, tension=T, residual_cohesion=0.0),
}
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
    for name, law in LAWS.items():
        (plugin / f"{name}.jlaw").write_text(table_text(law))
    return plugin


def scene(apart, speed, opening=1e-4, law="bonded"):
    return SCENE.format(apart=apart, speed=speed, opening=opening, law=law)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("closed", [1e-9, -4e-18])
def test_pulled_apart(folder, law, closed):
    """The force is that of the law at each opening: up to tension times area, then none. Spheres
    that are drawn to touch do, whichever way the distance is rounded."""
    run(folder, scene(2 * R - closed, "1.0 0.0 0.0", law=law))
    frames = dumped(folder / "out")
    opening, force = frames[:, 1, 1] - 2 * R, frames[:, 0, 2]
    area, joint = np.pi * R * R, LAWS[law].joint()
    steps = np.diff(-opening, prepend=0.0)
    expected = [-area * joint.update([d, 0.0, 0.0])[0][0] for d in steps]
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
             "coulomb": (9e-6, "bears tension until the joint is 1e-05 m")}  # fmt: skip
    for law, (opening, words) in cases.items():
        done = lammps(folder, scene(2 * R, "1.0 0.0 0.0", opening, law))
        assert done.returncode != 0
        assert words in done.stdout + done.stderr
