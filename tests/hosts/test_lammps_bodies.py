"""Bodies of points in LAMMPS: points handed on, two joint sets, in.tower."""

from dataclasses import replace

import numpy as np
import pytest
from lammps_host import HEAD, LAWS, run, thermo

import jointlaw as jl
from jointlaw.hosts.lammps.export import export_lammps

SPACING = 0.05
AREA = 0.0025
COLUMNS = 4
ROWS = 4
LAYERS = 2
POINTS = COLUMNS * ROWS

# a block of points on a base, the joint z = 0; `more` is what then happens
BLOCK = (
    HEAD
    + """boundary f f f
processors * 1 1
region box block -0.6 0.8 -0.1 0.3 -0.1 0.3 units box
create_box 2 box
lattice sc 0.05 origin 0.5 0.5 0.5
region base block -0.5 0.7 0 0.2 -0.05 0 units box
region block block 0 0.2 0 0.2 0 0.1 units box
create_atoms 1 region base
create_atoms 2 region block
set group all diameter 0.05 density $(2600*6/PI)
fix bodies all property/atom mol ghost yes
set type 1 mol {base}
set type 2 mol {block}
group block type 2
plugin load ./jointlawplugin.so
pair_style jointlaw opening 0.01 area 0.0025 plane 0 0 1 closure0 {closure!r}
pair_coeff * * block.jlaw
neighbor 0.01 bin
neigh_modify exclude molecule/intra all
timestep 2.5e-5
compute joint all pair jointlaw
compute ke all ke
{more}
"""
)


def test_points_hand_their_state_on(plugin):
    """Slip over nearly two spacings, over the border of two processors, with a tilt of the base.

    The block's 16 points own the joints (lower molecule ID); the base slides below them, tilted by
    theta, so that each column of points sees its own closure, linear in time.
    """
    law = LAWS["block"]
    closure = 5e-5
    theta = 1e-5
    speed = 0.9
    dt = 2.5e-5
    steps = 4000
    more = f"""group base type 1
displace_atoms base rotate 0 0 -0.025 0 1 0 {float(np.degrees(theta))!r} units box
fix move base move linear {speed} 0 0 units box
variable F1 equal fcm(block,z)/{AREA!r}
variable F2 equal fcm(block,x)/{AREA!r}
thermo_style custom step v_F1 v_F2 c_joint[1] c_joint[2] c_joint[3] c_joint[4] c_joint[5]
thermo_modify format float %.15g
thermo 50
run {steps}"""
    script = BLOCK.format(base=2, block=1, closure=closure, more=more)
    one, two = (thermo(run(plugin, script, n))[0] for n in (1, 2))
    expected = np.zeros((steps + 1, 2))
    x = SPACING * (np.arange(COLUMNS) + 0.5)
    for column in x:
        joint = law.joint()
        for n in range(steps + 1):
            deep = closure - np.tan(theta) * (column - speed * n * dt)
            slip = speed * dt if n else 0.0
            F, _ = joint.update([deep - joint.delta[0], slip, 0.0])
            expected[n] += ROWS * F[:2]
    for table in (one, two):
        for name, column in (("v_F1", 0), ("v_F2", 1)):
            away = np.abs(table[name] - expected[:: steps // (len(table[name]) - 1), column])
            assert away.max() < 1e-7 * np.abs(expected).max()  # theta**2, and rounding of places
        assert (table["c_joint[1]"] == POINTS).all()
        assert (table["c_joint[5]"] == 0).all()


def test_two_joint_sets(plugin):
    """A block in a corner: hybrid/overlay of two jointlaw with different normals and closures."""
    law = LAWS["block"]
    deep = 3e-5
    wide = 5e-5
    sides = ROWS * LAYERS
    one = "jointlaw opening 0.01 area 0.0025 plane {} closure0 {!r}"
    more = f"""region wall block -0.05 0 0 0.2 0 0.1 units box
create_atoms 1 region wall
set type 1 diameter 0.05 density 2600
set type 1 mol 1
uncompute joint
pair_style hybrid/overlay {one.format("0 0 1", deep)} {one.format("1 0 0", wide)}
pair_coeff * * jointlaw 1 block.jlaw
pair_coeff * * jointlaw 2 block.jlaw
compute floor all pair jointlaw 1
compute wall all pair jointlaw 2
variable F1 equal fcm(block,z)
variable F2 equal fcm(block,x)
thermo_style custom step v_F1 v_F2 c_floor[1] c_wall[1]
thermo_modify format float %.15g
run 0"""
    script = BLOCK.format(base=1, block=2, closure=deep, more=more)
    table = thermo(run(plugin, script, 2))[0]
    assert (table["c_floor[1]"][0], table["c_wall[1]"][0]) == (POINTS, sides)
    for force, joints, closure in (("v_F1", POINTS, deep), ("v_F2", sides, wide)):
        expected = joints * AREA * float(law.normal_stress(closure))
        assert table[force][0] == pytest.approx(expected, rel=1e-9), force


def test_tower(plugin):
    """in.tower as exported, with a short and hard shake, on one processor and on two."""
    law = replace(jl.presets.load("jing-replica"), resolution="fast")
    export_lammps(law, plugin, "tower")
    assert jl.JointLaw.from_toml(plugin / "law.toml") == law
    shake = {"steps": 4000, "settle": 1000, "peak": 4.0}
    one, two = (thermo(run(plugin, "in.tower", n, **shake))[-1] for n in (1, 2))
    fed = np.abs(one["v_work"]).max() + np.abs(one["v_fallen"]).max()
    assert np.abs(one["v_balance"]).max() < 5e-3 * fed  # against what is kept and lost
    assert one["c_joint[2]"][-1] > 0.2 * fed  # it has slipped
    for place in ("v_top", "v_rise"):
        assert np.abs(one[place] - two[place]).max() < 1e-10  # m, up to the end
