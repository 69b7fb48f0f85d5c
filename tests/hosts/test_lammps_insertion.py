"""Spheres that LAMMPS inserts, removes or displaces have the joints of their own bodies."""

import re

import numpy as np
import pytest
from lammps_host import HEAD, LAWS, run, thermo
from test_lammps_bodies import AREA, BLOCK, POINTS
from test_lammps_identity import (
    CLOSURE,
    CLOSURES,
    NORMAL,
    OUTPUT,
    PAIR,
    SHEAR,
    SLIP,
    SLIPS,
    STEPS,
    R,
)

SPHERE = f"""A sphere for fix deposit

1 atoms

Coords

1 0 0 0

Types

1 1

Diameters

1 {2 * R}

Masses

1 {2600 * 4 / 3 * np.pi * R**3!r}
"""

# the second sphere evaporates in the first step, in which another one is deposited at its place;
# the new ID is the largest present one plus 1, which is the ID of the sphere that is gone
REPLACE = f"""unfix push
fix rest two move linear 0 0 0
molecule sphere sphere.mol
region second block 0 0.02 -0.01 0.01 -0.01 0.01
region place block {R - 0.5 * CLOSURE!r} {R - 0.5 * CLOSURE + 1e-12!r} 0 1e-12 0 1e-12
fix removal two evaporate {STEPS + 1} 1 second 4711
fix insertion two deposit 1 0 1 4711 region place mol sphere id max
run 30
"""


@pytest.mark.parametrize("processors", [1, 2])
def test_a_deposited_sphere_with_the_id_of_an_evaporated_one_is_unsheared(plugin, processors):
    (plugin / "sphere.mol").write_text(SPHERE)
    script = PAIR + OUTPUT + f"run {STEPS}\n" + REPLACE
    text = run(plugin, script, processors)
    sheared, replaced = (
        {name: column[-1] for name, column in table.items()} for table in thermo(text)
    )
    assert sheared[SHEAR] > 0.1 * sheared[NORMAL]
    assert replaced["c_joint[1]"] == 1
    assert replaced["c_joint[5]"] == 1  # the sheared joint ended under load
    assert replaced[SLIPS] < 1e-11  # the place of the new sphere is random within 1e-12 m
    expected = float(LAWS["worn"].normal_stress(replaced[CLOSURES]))
    assert replaced[NORMAL] == pytest.approx(expected, rel=1e-9)
    assert replaced[SHEAR] < 1e-6 * expected
    assert "1 joints under load were deleted" in text


DEPOSITED = (
    HEAD
    + """boundary f f f
{grid}neighbor 0.002 bin
region box block -0.03 0.03 -0.03 0.03 0 0.3
create_box 1 box
{small}plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping 0.3
pair_coeff * * rock.jlaw
molecule sphere sphere.mol
region source block -0.004 0.004 -0.004 0.004 0.1 0.101
fix weight all gravity 9.81 vector 0 0 -1
fix source all deposit 3 0 4000 4711 region source mol sphere &
    vx -0.1 0.1 vy -0.1 0.1 vz -6 -6 near 0.02
fix floor all wall/reflect zlo 0.01
fix sides all wall/reflect xlo -0.006 xhi 0.006 ylo -0.006 yhi 0.006
fix motion all nve/sphere
timestep 4e-6
compute joint all pair jointlaw
compute distances all pair/local dist
compute nearest all reduce min c_distances inputs local
thermo 10
thermo_style custom step atoms c_joint[1] c_nearest
run 14000
"""
)
SMALL = """create_atoms 1 single 0 0 0.295
set type 1 diameter 0.002 density 2600
group small type 1
fix rest small setforce 0 0 0
"""


@pytest.mark.parametrize(("small", "processors"), [("", 1), (SMALL, 2)])
def test_deposited_spheres_have_contacts(plugin, small, processors):
    """fix deposit into an empty box, and beside a smaller sphere: no sphere passes another."""
    (plugin / "sphere.mol").write_text(SPHERE)
    grid = "processors 2 1 1\n" if processors == 2 else ""
    text = run(plugin, DEPOSITED.format(small=small, grid=grid), processors)
    table = thermo(text)[0]
    assert float(re.search(r"master list distance cutoff = ([\d.]+)", text)[1]) == 0.023
    assert table["Atoms"][-1] == 3 + bool(small)
    assert table["c_joint[1]"].any()
    # the spheres bounce: at 6 m/s a contact closes by a small part of the radius
    assert table["c_nearest"].min() > 0.0195


@pytest.mark.parametrize("processors", [1, 2])
def test_a_displaced_base_shears_the_joints_of_a_plane(plugin, processors):
    """`displace_atoms` in plane mode is one step of each joint, without velocities, taken once."""
    more = f"""group base type 1
variable F1 equal fcm(block,z)/{AREA!r}
variable F2 equal fcm(block,x)/{AREA!r}
thermo_style custom step v_F1 v_F2 c_joint[1] c_joint[5]
thermo_modify format float %.15g
run 0
displace_atoms base move {SLIP!r} 0 0 units box
run 0
run 0
"""
    script = BLOCK.format(base=2, block=1, closure=CLOSURE, more=more)
    before, once, twice = thermo(run(plugin, script, processors))
    joint = LAWS["block"].joint()
    closed, _ = joint.update([CLOSURE, 0.0, 0.0])
    sheared, _ = joint.update([0.0, SLIP, 0.0])
    assert abs(sheared[1]) > 0.1 * sheared[0]
    for table, expected in ((before, closed), (once, sheared), (twice, sheared)):
        forces = [table["v_F1"][0], table["v_F2"][0]]
        np.testing.assert_allclose(forces, POINTS * expected[:2], atol=1e-9 * POINTS * sheared[0])
        assert table["c_joint[1]"][0] == POINTS
        assert table["c_joint[5]"][0] == 0
