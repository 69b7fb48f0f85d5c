"""Energy, output, damping, walls, hybrid styles, and changes between runs."""

import re
from pathlib import Path

import numpy as np
import pytest
from lammps_host import HEAD, LAWS, dumped, run, thermo
from lattice import lattice_contacts

import jointlaw as jl

PAGE = Path(__file__).parents[2] / "docs" / "particles.md"
R = 0.01
AREA = np.pi * R**2
MASS = 2600 * 4 / 3 * np.pi * R**3
STYLE = "pair_style jointlaw opening 1e-3\npair_coeff * * rock.jlaw"
MOTION = """neighbor 0.002 bin
timestep 2e-6
compute joint all pair jointlaw
compute ke all ke
compute spin all erotate/sphere
thermo_style custom step pe c_ke c_spin c_joint[1] c_joint[2] c_joint[3] c_joint[4] c_joint[5] &
             c_joint[6]
thermo_modify format float %.15g
thermo 50
"""

# 64 spheres of 0.02 m in a periodic box, in motion; `more` is what then happens
SCENE = (
    HEAD
    + """boundary p p p
processors * 1 1
lattice sc {spacing}
region box block 0 4 0 4 0 4
create_box 2 box
create_atoms 1 box
set type 1 type/fraction 2 0.5 4711
set group all diameter 0.02 density 2600
velocity all create {heat} 4711 loop geom
plugin load ./jointlawplugin.so
{style}
fix 1 all nve/sphere
"""
    + MOTION
)


def heap(more, style=STYLE, spacing=0.01999, heat=1e20):
    """Its script; closed by 0.01 mm at first by default."""
    return SCENE.format(style=style, spacing=spacing, heat=heat) + more


@pytest.mark.parametrize("processors", [1, 4])
def test_values_of_each_joint(plugin, processors):
    """compute pair/local against the sums of compute pair, beside the IDs of its two atoms."""
    more = """compute local all pair/local dist eng p1 p5 p6 p7 p8
compute who all property/local patom1 patom2
dump 1 all local 200 local index c_local[*] c_who[*]
dump_modify 1 format float %.15g
dump 2 all custom 200 places x y z id
dump_modify 2 sort id format float %.17g
run 200"""
    table = thermo(run(plugin, heap(more, heat=1e18), processors))[0]
    frame = (plugin / "local").read_text().split("ITEM: ENTRIES")[-1].split("\n", 1)[1]
    rows = np.array([line.split() for line in frame.splitlines()], float)[:, 1:]
    distance, energy, closure, sliding, stored, lost, _, *who = rows[rows[:, 6] > 0].T
    first, second = (dumped(plugin / "places")[-1, ids.astype(int) - 1, :3] for ids in who)
    box = 4 * 0.01999
    distances = np.linalg.norm(first - second - box * np.round((first - second) / box), axis=1)
    assert np.abs(closure - (2 * R - distances)).max() < 1e-12
    assert len(distance) == table["c_joint[1]"][-1] > 20
    for one in (energy, stored):
        assert one.sum() == pytest.approx(table["PotEng"][-1], rel=1e-12)
    assert 0 < lost.sum() <= table["c_joint[2]"][-1] * (1 + 1e-12)  # [2] knows ended joints too
    assert np.abs(closure - (2 * R - distance)).max() < 1e-12
    assert (sliding <= 1).all()


# two spheres along x, closed by 0.04 mm, that come on at 0.3 m/s
PRESSED = (
    HEAD
    + """boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 1 box
create_atoms 1 single -0.00998 0 0
create_atoms 1 single 0.00998 0 0
set group all diameter 0.02 density 2600
"""
)
READ = """plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping {damping}
pair_coeff * * rock.jlaw
neighbor 0.002 bin
timestep 4e-7
fix 1 all nve/sphere
compute stress all pressure NULL pair
variable force equal fx[2]
variable apart equal x[2]-x[1]
thermo_style custom step c_stress[1] c_stress[2] v_force v_apart
thermo_modify format float %.15g
"""


def test_the_time_step_is_that_of_python(plugin):
    """64 spheres, each with six joints: never longer than `jl.stable_time_step`.

    A little shorter: the plug-in takes the Frobenius norm of the tangent where it is larger.
    """
    law = LAWS["rock"]
    spacing = 0.01999
    first, second = lattice_contacts(4)
    arm = np.full((len(first), 2), 0.5 * spacing)
    dt = jl.stable_time_step(
        first,
        second,
        np.full(64, MASS),
        AREA,
        law.max_stiffness(2 * R - spacing),
        np.full(64, 0.4 * MASS * R * R),
        arm,
    )
    table = thermo(run(plugin, heap("run 0\n", heat=1e-30)))[0]
    assert table["c_joint[1]"][-1] == len(first)
    assert 0.93 * dt < table["c_joint[6]"][-1] <= dt


def test_damping_of_now_and_the_virial(plugin):
    """The dashpot has the present velocity and word: no force at rest, none without `damping`."""
    steps = """set atom 2 vx -0.3
run 5
write_restart damped
velocity all set 0 0 0
run 0
set atom 2 vx -0.3
run 0
pair_style jointlaw opening 1e-3
pair_coeff * * rock.jlaw
run 0
clear
"""
    restart = HEAD + "read_restart damped\n" + READ.format(damping=0) + "run 0\n"
    tables = thermo(run(plugin, PRESSED + READ.format(damping=0.5) + steps + restart))
    _, still, moving, without, restarted = tables
    closure = 2 * R - still["v_apart"][0]
    expected = AREA * float(LAWS["rock"].normal_stress(closure))
    for table in (still, without, restarted):
        assert table["v_force"][0] == pytest.approx(expected, rel=1e-9)
    assert still["c_stress[1]"][0] * 0.2**3 == pytest.approx(expected * (2 * R - closure), rel=1e-9)
    assert abs(still["c_stress[2]"][0]) < 1e-12  # Pa
    joint = LAWS["rock"].joint()
    joint.update([closure, 0.0, 0.0])
    _, C = joint.update([0.0, 0.0, 0.0])
    push = 2 * 0.5 * np.sqrt(AREA * C[0, 0] * MASS / 2) * 0.3
    # the stiffness is interpolated in a table of 32 stresses an octave
    assert moving["v_force"][0] - expected == pytest.approx(push, rel=1e-4)


def test_walls_of_frozen_spheres(plugin):
    """The lines of the page: four spheres fall on a floor of spheres that overlap.

    Before they touch, the style names the time step of a joint under 1 MPa.
    """
    page = PAGE.read_text(encoding="utf-8")
    lines = re.search(r"```\n(group wall.*?)```", page, re.DOTALL)[1]
    start = f"""boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 2 box
lattice sc 0.015 origin 0.5 0.5 0.5
region floor block -0.06 0.06 -0.06 0.06 -0.015 0 units box
region above block -0.04 0.04 -0.04 0.04 0 0.02 units box
create_atoms 2 region floor
lattice sc 0.04 origin 0.5 0.5 0.3125
create_atoms 1 region above
set group all diameter 0.02 density 2600
plugin load ./jointlawplugin.so
{STYLE.replace("opening", "damping 0.2 opening")}
{lines}
velocity rock set 0 0 -0.5 units box
"""
    more = """variable high equal 9.81*mass(rock)*xcm(rock,z)
variable whole equal pe+c_ke+c_spin+v_high+c_joint[2]+c_joint[3]+c_joint[4]
thermo_style custom step pe c_ke v_whole c_joint[1] c_joint[2] c_joint[3] c_joint[6]
run 2000"""
    text = run(plugin, HEAD + start + MOTION + more, 2)
    table = thermo(text)[0]
    law = LAWS["rock"]
    assert "there is no contact yet" in text
    step = law.critical_time_step(MASS / 7, AREA, law.closure(1e6))
    assert table["c_joint[6]"][0] == pytest.approx(step, rel=1e-9)
    assert table["c_joint[1]"][0] == 0 < table["c_joint[1]"].max() <= 16  # none within the wall
    assert min(table["c_joint[2]"][-1], table["c_joint[3]"][-1]) > 0.01 * table["c_ke"][0]
    assert np.ptp(table["v_whole"]) < 5e-3 * table["c_ke"][0]


def test_changes_between_runs(plugin):
    """Joints persist through changes between runs; warnings of deletion and of a long time step."""
    changes = ("", "atom_modify sort 1 0.01", "balance 1.0 shift x 10 1.05",
               "change_box all triclinic", "delete_atoms group gone compress no")  # fmt: skip
    more = "group gone id 57:64\nrun 200\n" + "".join(f"{one}\nrun 100\n" for one in changes)
    text = run(plugin, heap(more + "timestep 1e-3\nrun 0"), 2)
    *tables, before, after, _ = thermo(text)
    for change, first, second in zip(changes, tables, [*tables[1:], before], strict=False):
        for name in ("PotEng", "c_joint[1]", "c_joint[2]"):
            assert second[name][0] == pytest.approx(first[name][-1], rel=1e-12), (change, name)
    assert after["c_joint[1]"][0] < before["c_joint[1]"][-1]
    counts = re.findall(r"jointlaw: (\d+) joints under load were deleted", text)
    assert sum(map(int, counts)) == after["c_joint[5]"][-1] > 0
    assert "is above the largest stable one" in text


POURED = (
    HEAD
    + """boundary f f f
processors 2 1 1
neighbor 0.002 bin
region box block -0.03 0.03 -0.03 0.03 0 0.3
create_box 2 box
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping 0.3
pair_coeff * * rock.jlaw
fix weight all gravity 9.81 vector 0 0 -1
region source block -0.006 0.006 -0.006 0.006 0.05 0.24
fix source all pour 6 2 4711 region source diam one 0.02 dens 2600 2600 vol 0.4 50 vel 0 0 0 0 -6
fix floor all wall/reflect zlo 0.01
fix sides all wall/reflect xlo -0.006 xhi 0.006 ylo -0.006 yhi 0.006
fix motion all nve/sphere
timestep 4e-6
compute joint all pair jointlaw
compute distances all pair/local dist
compute nearest all reduce min c_distances inputs local
thermo 100
thermo_style custom step atoms c_joint[1] c_nearest
{small}run 18000
"""
)
SMALL = """create_atoms 1 single 0 0 0.295
set type 1 diameter 0.002 density 2600
group small type 1
fix rest small setforce 0 0 0
"""


@pytest.mark.parametrize(("small", "processors"), [("", 1), (SMALL, 2)])
def test_poured_spheres_have_contacts(plugin, small, processors):
    """fix pour into an empty box, and into a box with smaller spheres: no sphere passes another."""
    script = POURED.format(small=small).replace(
        "processors 2 1 1\n" if processors == 1 else "\0", ""
    )
    text = run(plugin, script, processors)
    table = thermo(text)[0]
    assert float(re.search(r"master list distance cutoff = ([\d.]+)", text)[1]) == 0.023
    assert table["Atoms"][-1] == 6 + bool(small)
    assert table["c_joint[1]"].any()
    # the spheres bounce: at 6 m/s a contact closes by a small part of the radius
    assert table["c_nearest"].min() > 0.0195


GROWING = (
    HEAD
    + """boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 1 box
create_atoms 1 single -0.012 0 0
create_atoms 1 single 0.012 0 0
set type 1 diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 {keyword}
pair_coeff * * rock.jlaw
neighbor 0.001 bin
variable diameter equal 0.02+0.0041*step/100
fix growth all adapt 1 atom diameter v_diameter
fix hold all move linear 0 0 0
timestep 1e-7
compute force all reduce max fx
compute joint all pair jointlaw
thermo_style custom step c_force c_joint[1]
thermo_modify format float %.17g
run 100
"""
)


@pytest.mark.parametrize("processors", [1, 2])
def test_spheres_that_grow(plugin, processors):
    """fix adapt: with `max_radius` they touch; without it the run stops with the remedy."""
    script = GROWING.format(keyword="max_radius 0.01205")
    table = thermo(run(plugin, script.replace("sphere\n", "sphere 1\n", 1), processors))[0]
    radius = 0.5 * (0.02 + 0.0041 * np.array([0.99, 1.0]))
    expected = [np.pi * r**2 * float(LAWS["rock"].normal_stress(2 * r - 0.024)) for r in radius]
    assert expected[0] * (1 - 1e-9) < table["c_force"][-1] < expected[1] * (1 + 1e-9)
    script = GROWING.format(keyword="")
    text = run(plugin, script.replace("sphere\n", "sphere 1\n", 1), processors, code=1)
    assert re.search(
        r"has radius 0.01\d+ m at step 1, but .* give pair_style .* max_radius R", text
    )
