"""Two bonded spheres in LAMMPS, pulled apart: the joint is kept until the bond is broken."""

import numpy as np
import pytest
from lammps_host import HEAD, dumped, lammps, run, soft

import jointlaw as jl
from jointlaw.hosts.c.export import table_text

R, T, K = 1e-2, 1e5, 1e10  # m, Pa, Pa/m
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
pair_coeff * * bonded.jlaw
neighbor 0.002 bin
timestep 1e-7
group moving id 2
fix 1 moving move linear {speed} 0.0 0.0
dump 1 all custom 1 out type x fx id
dump_modify 1 sort id format float %.17g
run 600
"""
)


@pytest.fixture(scope="module")
def folder(plugin):
    (plugin / "bonded.jlaw").write_text(table_text(soft(bond=BOND)))
    return plugin


def test_pulled_apart(folder):
    """The force is that of the law at each opening: up to tension times area, then none."""
    run(folder, SCENE.format(apart=2 * R - 1e-9, opening=1e-4, speed=1.0))
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
    text = SCENE.format(apart=2 * R + 1e-6, opening=1e-4, speed=-1.0)
    back = "unfix 1\nfix 1 moving move linear 1.0 0.0 0.0\nrun 900\n"
    run(folder, text.replace("run 600\n", "run 60\n" + back))
    frames = dumped(folder / "out")
    opening, force = frames[:, 1, 1] - 2 * R, frames[:, 0, 2]
    assert (force[:61] < 0.0).any()
    assert opening[-1] > 1e-5
    assert (force <= 0.0).all()


def test_an_opening_that_is_too_small_is_told(folder):
    done = lammps(folder, SCENE.format(apart=2 * R, opening=3e-5, speed=1.0))
    assert done.returncode != 0
    assert "holds until the joint is 4" in done.stdout + done.stderr
