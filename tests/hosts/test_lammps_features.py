"""Output, warnings, other styles beside this one, and what is done between runs."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from lammps_host import ENV, HEAD, dumped, run, soft, thermo

# 64 spheres of 0.02 m in a periodic box, in motion; `more` is what then happens
SCENE = (
    HEAD
    + """boundary p p p
processors * 1 1
lattice sc {apart}
region box block 0 4 0 4 0 4
create_box 2 box
create_atoms 1 box
set type 1 type/fraction 2 0.5 4711
set group all diameter 0.02 density 2600
velocity all create 1e20 4711 loop geom
plugin load ./jointlawplugin.so
{style}
neighbor 0.002 bin
timestep 2e-6
fix 1 all nve/sphere
compute joint all pair jointlaw
compute ke all ke
compute spin all erotate/sphere
thermo_style custom step pe c_ke c_spin c_joint[1] c_joint[2] c_joint[3] c_joint[4] c_joint[5] &
             c_joint[6] pxx pxy
thermo_modify format float %.15g
thermo 50
{more}
"""
)


def heap(style, more, apart=0.01999):
    """Its script; closed by 0.01 mm at first by default."""
    return SCENE.format(style=style, more=more, apart=apart)


STYLE = "pair_style jointlaw opening 1e-3\npair_coeff * * rock.jlaw"


def test_collisions_never_gain_energy(plugin):
    """Undamped: motion, stored and dissipated energy add up, and motion and stored only fall."""
    table = thermo(run(plugin, heap(style=STYLE, more="timestep 5e-7\nrun 6000", apart=0.0205)))[0]
    kept = table["PotEng"] + table["c_ke"] + table["c_spin"]
    whole = kept + table["c_joint[2]"] + table["c_joint[4]"]
    assert table["c_joint[2]"][-1] > 0.1 * whole[0]
    assert np.abs(whole - whole[0]).max() < 5e-3 * whole[0]
    assert np.diff(kept).max() < 1e-3 * kept[0]


def test_values_of_each_joint(plugin):
    """compute pair/local on one processor and on two, against the sums of compute pair."""
    more = """compute local all pair/local dist eng p1 p2 p3 p4 p5 p6 p7 p8
dump 1 all local 200 local index c_local[1] c_local[2] c_local[3] c_local[4] c_local[5] &
     c_local[6] c_local[7] c_local[8] c_local[9] c_local[10]
dump_modify 1 format float %.15g
run 200"""
    text = (heap(style=STYLE, more=more)).replace("create 1e20 4711 loop", "create 1e18 1 loop")
    for processors in (1, 2):
        table = thermo(run(plugin, text, processors))[0]
        frame = (plugin / "local").read_text().split("ITEM: ENTRIES")[-1].split("\n", 1)[1]
        rows = np.array([line.split() for line in frame.splitlines()], float)[:, 1:]
        joints = rows[rows[:, 9] > 0]
        assert len(joints) == table["c_joint[1]"][-1] > 20
        assert joints[:, 1].sum() == pytest.approx(table["PotEng"][-1], rel=1e-12)
        assert joints[:, 7].sum() == pytest.approx(table["PotEng"][-1], rel=1e-12)
        touching = joints[joints[:, 8] > 0]
        assert touching[:, 8].sum() <= table["c_joint[2]"][-1] * (1 + 1e-12)
        closed = 0.02 - joints[:, 0]
        assert np.abs(joints[:, 2] - closed).max() < 1e-12
        assert (joints[:, 6] <= 1).all()
        unsheared = np.array([float(soft().normal_stress(max(c, 0.0))) for c in closed])
        assert joints[:, 4].max() <= 3 * unsheared.max()


def test_the_virial_is_the_stress(plugin):
    """Two spheres pressed together along x: pressure times volume is force times distance."""
    script = (
        HEAD
        + """boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 1 box
create_atoms 1 single -0.00998 0 0
create_atoms 1 single 0.00998 0 0
set group all diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3
pair_coeff * * rock.jlaw
neighbor 0.002 bin
compute stress all pressure NULL pair
variable force equal fx[2]
thermo_style custom step c_stress[1] c_stress[2] v_force
thermo_modify format float %.15g
run 0
"""
    )
    table = thermo(run(plugin, script.replace("atom_modify map array", "atom_modify map yes")))[0]
    force = table["v_force"][0]
    assert force == pytest.approx(np.pi * 1e-4 * float(soft().normal_stress(4e-5)), rel=1e-12)
    assert table["c_stress[1]"][0] * 0.2**3 == pytest.approx(force * 0.01996, rel=1e-12)
    assert table["c_stress[2]"][0] == 0


def test_warnings_of_joints_given_up_and_of_the_step(plugin):
    """An opening of nothing gives sheared joints up; a step of 1 ms is too long. Both counted."""
    style = STYLE.replace("1e-3", "0")
    for processors in (1, 2):
        text = run(plugin, heap(style=style, more="run 1500", apart=0.0205), processors)
        given_up = thermo(text)[0]["c_joint[5]"][-1]
        told = [int(line.split("jointlaw: ")[1].split()[0]) for line in text.splitlines()
                if "joints under load were given up" in line]  # fmt: skip
        assert given_up > 0
        assert sum(told) == given_up
    more = "timestep 1e-3\nunfix 1\nfix 1 all nve/limit 1e-5\nrun 2"
    text = run(plugin, heap(style=STYLE, more=more))
    assert "is above the largest stable one" in text


def test_beside_another_style(plugin):
    """hybrid/overlay with granular: forces add up; NULL leaves a pair of types without joint."""
    alone = heap(style=STYLE, more="dump 1 all custom 1 alone id fx fy fz\nrun 0")
    granular = "pair_coeff * * granular hooke 1e5 0 tangential linear_history 1e4 0 0.5"
    style = f"pair_style hybrid/overlay granular jointlaw opening 1e-3\n{granular}\n"
    both = heap(style=style + "pair_coeff * * jointlaw rock.jlaw",
                       more="dump 1 all custom 1 both id fx fy fz\nrun 0")  # fmt: skip
    other = heap(style="pair_style granular\n" + granular.replace(" granular", "", 1),
                        more="dump 1 all custom 1 other id fx fy fz\nrun 0")  # fmt: skip
    other = (
        other.replace("compute joint", "#").replace(" c_joint[", "# c_joint[").replace("&\n", "")
    )
    some = STYLE.replace("* * rock", "1 1 rock") + "\npair_coeff 1 2 NULL\npair_coeff 2 2 NULL"
    for script in (alone, both):
        run(plugin, script.replace("dump 1", "dump_modify 1 sort id\ndump 1", 0))
    found = {}
    for name, script in {"alone": alone, "both": both, "other": other}.items():
        run(plugin, script.replace("run 0", "dump_modify 1 sort id format float %.15g\nrun 0"))
        found[name] = dumped(plugin / name)[-1]
    sum_of_both = found["alone"][:, 1:] + found["other"][:, 1:]
    assert np.allclose(found["both"][:, 1:], sum_of_both, rtol=1e-9, atol=1e-9)
    count = {s: thermo(run(plugin, heap(style=s, more="run 0")))[0]["c_joint[1]"][0]
             for s in (STYLE, some)}  # fmt: skip
    assert 0 < count[some] < 0.5 * count[STYLE]


CHANGES = {
    "deletion": "delete_atoms group gone compress no",
    "sort": "atom_modify sort 1 0.01",
    "triclinic box": "change_box all triclinic",
    "smaller box": "change_box all x scale 0.9999 remap units box",
    "balance": "balance 1.0 shift x 10 1.05",
    "unbroken": "",
}


@pytest.mark.parametrize("change", CHANGES)
def test_changes_between_runs(plugin, change):
    """Joints outlive what is done between two runs; deletion is told of and counted."""
    more = f"""group gone id 57:64
thermo 100
run 200
{CHANGES[change]}
run 100"""
    first, second = thermo(run(plugin, heap(style=STYLE, more=more), 2))
    same = 1e-12 if change in ("sort", "balance", "unbroken", "triclinic box") else 0.5
    for name in ("PotEng", "c_joint[1]", "c_joint[2]"):
        assert second[name][0] == pytest.approx(first[name][-1], rel=same), name
    if change == "deletion":
        assert second["c_joint[5]"][0] > 0
        assert second["c_joint[1]"][0] < first["c_joint[1]"][-1]


NUMBERED = {
    "reset_atoms id": "reset_atoms id with a fix jointlaw",
    "delete_atoms group gone\nrun 0": "give delete_atoms compress no",
}


@pytest.mark.parametrize("command", NUMBERED)
def test_numbering_anew_is_refused(plugin, command):
    """The joints know their partners by ID."""
    more = f"group gone id 1:8\nrun 10\n{command}"
    done = subprocess.run(
        [ENV / "bin/lmp", "-in", "/dev/stdin", "-log", "none"], cwd=plugin, text=True,
        input=heap(style=STYLE, more=more), capture_output=True,
    )  # fmt: skip
    assert done.returncode == 1
    assert NUMBERED[command] in done.stdout


def test_found_without_a_word(plugin):
    """LAMMPS_PLUGIN_PATH, which the entry point sets to the folder of `build.sh install`."""
    script = heap(style=STYLE, more="run 0").replace("plugin load ./jointlawplugin.so", "")
    (plugin / "in.found").write_text(script)
    env = {**os.environ, "LAMMPS_PLUGIN_PATH": str(plugin), "PYTHONPATH": ""}
    done = subprocess.run([ENV / "bin/lmp", "-in", "in.found"], cwd=plugin, env=env, text=True,
                          capture_output=True)  # fmt: skip
    assert done.returncode == 0, done.stdout
