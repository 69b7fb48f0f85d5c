"""A joint in LAMMPS keeps to its law and its two bodies, moves as they do, and takes no step in the
setup of a run."""

import re

import numpy as np
import pytest
from lammps_host import HEAD, LAWS, dumped, run, thermo

R = 0.01
AREA = np.pi * R**2
CLOSURE = 1e-4
SPEED = 0.4
DT = 1e-6
STEPS = 200
SLIP = SPEED * DT * STEPS
ROTATION = SLIP / (2 * R)  # rad, of the normal while the second sphere slides
TANGENTIAL = ROTATION**2  # relative: part of the motion along the normal, an upper bound

# two spheres, each in the domain of one of two processes; the second slides along y
PAIR = (
    HEAD
    + f"""boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 2 box
create_atoms 1 single {0.5 * CLOSURE - R!r} 0 0
create_atoms 1 single {R - 0.5 * CLOSURE!r} 0 0
set group all diameter {2 * R} density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3
pair_coeff 1 1 worn.jlaw
pair_coeff 1 2 block.jlaw
pair_coeff 2 2 NULL
neighbor 0.002 bin
timestep {DT}
group one id 1
group two id 2
fix hold one move linear 0 0 0
fix push two move linear 0 {SPEED} 0
"""
)
OUTPUT = """compute joint all pair jointlaw
compute each all pair/local p1 p2 p3 p4
compute sums all reduce sum c_each[1] c_each[2] c_each[3] c_each[4] inputs local
thermo_style custom step c_sums[1] c_sums[2] c_sums[3] c_sums[4] c_joint[1] c_joint[5]
thermo_modify format float %.17g
"""
CLOSURES, SLIPS, NORMAL, SHEAR = (f"c_sums[{k}]" for k in (1, 2, 3, 4))


def last_rows(text):
    """The last row of thermo output of each run, as a dict."""
    return [{name: column[-1] for name, column in table.items()} for table in thermo(text)]


@pytest.mark.parametrize("processors", [1, 2])
def test_another_type_has_a_joint_of_its_own_law(plugin, processors):
    """`set type`: the sheared joint ends under load; a virgin joint of the other law begins."""
    change = f"run {STEPS}\nset atom 2 type 2\nrun 0\nrun 20\nset atom 1 type 2\nrun 0\n"
    text = run(plugin, PAIR + OUTPUT + change, processors)
    sheared, changed, displaced, none = last_rows(text)
    assert sheared[SLIPS] == pytest.approx(SLIP, rel=TANGENTIAL)
    assert sheared[SHEAR] > 0.1 * sheared[NORMAL]
    expected = float(LAWS["block"].normal_stress(changed[CLOSURES]))
    assert changed[NORMAL] == pytest.approx(expected, rel=1e-9)
    assert changed[SHEAR] < 1e-9 * changed[NORMAL]
    assert displaced[SLIPS] == pytest.approx(SLIP / 10, rel=2 * TANGENTIAL)
    assert [row["c_joint[1]"] for row in (sheared, changed, none)] == [1, 1, 0]
    assert [row["c_joint[5]"] for row in (sheared, changed, none)] == [0, 1, 2]
    assert len(re.findall(r"1 joints under load were deleted .* another law", text)) == 2


@pytest.mark.parametrize("processors", [1, 2])
def test_an_atom_with_a_used_id_has_a_virgin_joint(plugin, processors):
    """An atom is deleted and another one created with its ID, at its place."""
    replace = f"""run {STEPS}
delete_atoms group two compress no
create_atoms 1 single {R - 0.5 * CLOSURE!r} {SLIP!r} 0
set atom 2 diameter {2 * R} density 2600
run 0
"""
    sheared, replaced = last_rows(run(plugin, PAIR + OUTPUT + replace, processors))
    assert sheared[SHEAR] > 0.1 * sheared[NORMAL]
    assert replaced[SLIPS] == 0.0
    assert replaced["c_joint[1]"] == 1
    expected = float(LAWS["worn"].normal_stress(replaced[CLOSURES]))
    assert replaced[NORMAL] == pytest.approx(expected, rel=1e-9)
    assert replaced[SHEAR] < 1e-9 * expected


@pytest.mark.parametrize("processors", [1, 2])
def test_a_setup_takes_no_step(plugin, processors):
    """Two runs, and a restart between them, give the bits of one run, with degrading asperities.

    The forces on the atoms are the stresses that `compute pair/local` prints.
    """
    dump = """dump 1 all custom 10 {} fx fy fz tqx tqy tqz id
dump_modify 1 sort id format float %.17g
"""
    half = f"run {STEPS // 2}\n"
    restart = (
        HEAD
        + "read_restart held\n"
        + PAIR[PAIR.index("plugin") : PAIR.index("group one")].replace("timestep", "#")
        + f"timestep {DT}\nfix hold one move linear 0 0 0\nfix push two move linear 0 {SPEED} 0\n"
    )
    run(plugin, PAIR + OUTPUT + dump.format("whole") + half + "run 0\n" + half, processors)
    run(plugin, PAIR + OUTPUT + dump.format("once") + f"run {STEPS}\n", processors)
    run(plugin, PAIR + half + "write_restart held\n", processors)
    text = run(plugin, restart + OUTPUT + dump.format("rest") + half, processors)
    once, whole, rest = (dumped(plugin / name) for name in ("once", "whole", "rest"))
    np.testing.assert_array_equal(whole, once)
    np.testing.assert_array_equal(rest, once[STEPS // 20 :])
    (row,) = last_rows(text)
    force = AREA * np.hypot(row[NORMAL], row[SHEAR])
    assert np.linalg.norm(rest[-1, 0, :3]) == pytest.approx(force, rel=1e-14)


@pytest.mark.parametrize("processors", [1, 2])
def test_atoms_displaced_between_runs_shear_their_joint(plugin, processors):
    """`displace_atoms` is one step of the joint, without velocities."""
    displace = f"run 0\ndisplace_atoms two move 0 {SLIP!r} 0 units box\nrun 0\nrun 0\n"
    *_, once, twice = last_rows(run(plugin, PAIR + OUTPUT + displace, processors))
    joint = LAWS["worn"].joint()
    joint.update([CLOSURE, 0.0, 0.0])
    F, _ = joint.update([once[CLOSURES] - CLOSURE, once[SLIPS], 0.0])
    assert once[SLIPS] == pytest.approx(SLIP, rel=TANGENTIAL)
    np.testing.assert_allclose([once[NORMAL], once[SHEAR]], F[:2], rtol=1e-9)
    assert once == twice


SHEARED_BOX = (
    HEAD
    + """boundary p p p
region box prism -0.04 0.04 -0.04 0.04 -0.04 0.04 0 0 0
create_box 1 box
create_atoms 1 single 0 {0} 0
create_atoms 1 single 0 {1} 0
set group all diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3
pair_coeff 1 1 rock.jlaw
neighbor 0.002 bin
timestep 1e-5
fix hold all move linear 0 0 0
fix shear all deform 1 xy erate 0.1 remap {2}
"""
)


@pytest.mark.parametrize("processors", [1, 2])
@pytest.mark.parametrize("remap", ["x", "v", "none"])
def test_a_sheared_box_shears_the_joint_over_its_border(plugin, remap, processors):
    """`fix deform`, whichever way it maps atoms: slip over the border, from positions."""
    high = 0.03 + 0.5 * CLOSURE
    low = high + 2 * R - CLOSURE - 0.08
    script = SHEARED_BOX.format(repr(high), repr(low), remap)
    (row,) = last_rows(run(plugin, script + OUTPUT + "run 100\n", processors))
    slip = 0.08 * 0.1 * 1e-5 * 99  # of the image; the box moves after the forces of a step
    assert row["c_joint[1]"] == 1
    assert row[SLIPS] == pytest.approx(slip, rel=(slip / (2 * R)) ** 2)
    assert row[SHEAR] > 0.05 * row[NORMAL]


TURN = """unfix hold
unfix push
timestep 0.005
run 0
fix turn all move rotate 0.003 0.002 -0.001 {} 1.0
run 200
"""


@pytest.mark.parametrize("axis", ["1 0 0", "0 0 1", "1 1 1", "-1 2 0.5"])
def test_a_pair_that_rotates_rigidly_keeps_its_traction(plugin, axis):
    """One turn in 200 steps about any axis: neither slip, nor drift of the axes of the joint."""
    dump = "dump 1 two custom 200 out fx fy fz id\ndump_modify 1 format float %.17g\n"
    pair = PAIR.replace(
        "worn", "rock"
    )  # degradation of the last slip would follow in the next step
    run(plugin, pair + OUTPUT + dump + f"run {STEPS}\n" + TURN.format(axis))
    _, sheared, turned = dumped(plugin / "out")[:, 0, :3]
    assert np.abs(sheared[1]) > 0.1 * np.abs(sheared[0])
    # rounding of positions, 2e-18 m a step, over 200 steps, against a slip of 8e-5 m
    np.testing.assert_allclose(turned, sheared, rtol=0, atol=1e-9 * np.abs(sheared).max())
