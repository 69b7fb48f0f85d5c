"""Scenes in space of the package, each with its number, and the commands for blocks in space."""

import csv
import json
import re
from dataclasses import replace
from math import cos, radians, sin

import meshio
import numpy as np
import pytest
from scene_text import block, coulomb

import jointlaw as jl
from dem_demo.cli import main
from dem_demo.dynamics.relaxation import Verdict
from dem_demo.space import Statics, load
from dem_demo.space.strength import factor_of_safety

ANGLES = {"plane-oblique-down": 0.0, "plane-oblique": 45.0, "plane-oblique-strike": 90.0}


@pytest.mark.parametrize("name", [*ANGLES])
def test_a_slab_has_the_strength_of_its_joint_in_the_direction_of_sliding(name):
    """Factor of safety beside direct shear of the law alone, at an angle from axis 2.

    2 %: the search loads the joint in one step, and in the scene its strength is divided.
    """
    statics = Statics(load(name))
    law = statics.scene.laws["joint"]
    weight, area = statics.mass[1] * 9.81, statics.points.area.sum()
    dip = radians(42.0)
    test = jl.direct_shear(
        law.joint(), to=4e-3, normal=weight * cos(dip) / area, azimuth=radians(ANGLES[name])
    )
    by_hand = test.shear_stress.max() / (weight * sin(dip) / area)
    factor = factor_of_safety(statics, tolerance=0.002)
    assert factor == pytest.approx(by_hand, rel=0.02)
    assert (factor > 1) == (name != "plane-oblique-strike")


@pytest.mark.parametrize(("name", "factor"), [("wedge", 1.14), ("wedge-across", 0.963)])
def test_the_rough_direction_decides_about_the_wedge(name, factor, tmp_path, capsys):
    """Along the line of intersection it stands, across it falls."""
    is_stable = name == "wedge"
    assert main(["check", name]) == 0
    verdict = "in equilibrium" if is_stable else "without equilibrium"
    assert f"initial state: {verdict}" in capsys.readouterr().out
    words = ["strength-reduction", name, "--out", str(tmp_path), "--json"]
    assert main(words) == 0
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert row["factor_of_safety"] == pytest.approx(factor, rel=0.01)
    assert [one["block"] for one in row["initiating_blocks"]] == ["slope 4"]
    assert [one["block"] for one in row["unstable"]] == ["slope 4"] * (not is_stable)
    assert json.loads((tmp_path / "strength.json").read_text())["rows"] == [row]


@pytest.mark.parametrize(("share", "stable"), [(0.16, True), (0.173, False)])
def test_a_wall_overturns_at_the_ratio_of_thickness_to_height(share, stable):
    """0.3/1.8 = 0.1667 of its weight across it; the shipped variants have 0.1 and 0.2."""
    scene = load("wall-3d")
    pushed = replace(scene, seismic=np.array([0.0, share, 0.0]))
    result = Statics(pushed).solve()
    assert (result.verdict is Verdict.EQUILIBRIUM) == stable
    assert result.unstable.sum() == (0 if stable else 27)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "factor"), [("slope-3d", 1.21), ("slope-3d-across", 1.10)])
def test_a_slope_of_three_sets(name, factor):
    """199 free blocks: stable at 4 % less strength than at the factor, not at 4 % more."""
    scene = load(name)
    statics = Statics(scene)
    assert statics.is_free.sum() == 199
    result = statics.solve()
    assert result.verdict is Verdict.EQUILIBRIUM
    assert result.unbalanced_ratio < 1e-8
    assert statics.displacements(scene.weakened(0.96 * factor)) is not None
    assert statics.displacements(scene.weakened(1.04 * factor)) is None


def test_a_run_writes_tables_and_vtk_files(tmp_path, capsys):
    """The files hold the blocks with their displacements, and contacts with their tractions."""
    assert main(["wall-3d", "--vtk", "--no-pictures", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "27 free blocks, 66 contacts, 264 contact points" in printed
    assert "no [run] with an end: the run ends with the static equilibrium" in printed
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["equilibrium"] == "in equilibrium"
    assert (summary["free_blocks"], summary["contact_points"]) == (27, 264)
    with (tmp_path / "blocks.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 28
    assert rows[1]["block"] == "row 1 brick 1"
    result = Statics(load("wall-3d")).solve()
    displaced = [[float(row[f"displacement_{axis}_m"]) for axis in "xyz"] for row in rows]
    assert np.array(displaced) == pytest.approx(result.displacement, abs=1e-18)
    blocks = meshio.read(tmp_path / "vtk" / "blocks.vtu")
    assert sum(len(cells.data) for cells in blocks.cells) == 28
    displacement = np.concatenate(blocks.cell_data["displacement_m"])
    assert displacement == pytest.approx(result.displacement, abs=1e-15)
    contacts = meshio.read(tmp_path / "vtk" / "contacts.vtu")
    assert len(contacts.points) == 264
    assert contacts.point_data["normal_stress_Pa"].max() == pytest.approx(
        summary["max_normal_stress_Pa"]
    )
    weight = 27 * 0.6 * 0.3 * 0.3 * 2000.0 * 9.81
    area = np.concatenate(contacts.cell_data["area_m2"])
    on_ground = np.concatenate(contacts.cell_data["block_a"]) == 0
    stress = contacts.point_data["normal_stress_Pa"].reshape(-1, 4).mean(axis=1)
    assert (area * stress)[on_ground].sum() == pytest.approx(weight, rel=1e-6)


@pytest.mark.parametrize(
    "words",
    [
        ["compare", "wedge"],
        ["ablate", "wedge"],
        ["plane-oblique", "--until", "1"],
        ["strength-reduction", "wedge", "--until", "1"],
    ],
)
def test_commands_of_the_plane_are_refused(words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    assert re.search("in the plane only|blocks do not move here", capsys.readouterr().err)


@pytest.mark.parametrize(
    ("name", "until", "state", "fall"),
    [
        ("wedge", 0.2, "stable", 0.0),
        ("wedge-across", 0.5, "displacing", 0.277),
        pytest.param("wedge-across", 1.0, "failed", 1.2, marks=pytest.mark.slow),
    ],
)
def test_wedges_in_motion(name, until, state, fall, tmp_path, capsys):
    """Along the line of intersection the wedge does not move, across it falls 1.2 m in a second.

    All files of the run tell the same story; the balance of energy holds. The longest run draws its
    pictures too.
    """
    pictures = [] if until == 1.0 else ["--no-pictures"]
    words = [name, "--vtk", *pictures, "--until", str(until), "--out", str(tmp_path)]
    assert main(words) == 0
    falls = name == "wedge-across"
    assert ("1 block has no static equilibrium and will move" in capsys.readouterr().out) == falls
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["rocks"][0]["state"] == state
    assert summary["model_time_s"] == pytest.approx(until, abs=1e-3)
    assert summary["max_energy_error"] < 1e-3
    with (tmp_path / "blocks.csv").open(newline="") as file:
        wedge = next(row for row in csv.DictReader(file) if row["block"] == "slope 4")
    path = np.array([float(wedge[f"displacement_{axis}_m"]) for axis in "xyz"])
    assert np.linalg.norm(path) == pytest.approx(fall, rel=0.05, abs=1e-9)
    with (tmp_path / "history.csv").open(newline="") as file:
        history = [*csv.DictReader(file)]
    frame = len(history) - 1
    assert frame - round(until / 0.05) in (0, 1)  # every 0.05 s, and the end
    assert float(history[-1]["friction_J"]) == pytest.approx(summary["energy_J"]["friction"])
    last = meshio.read(tmp_path / "vtk" / f"blocks_{frame:04d}.vtu")
    is_wedge = np.concatenate(last.cell_data["block"]) == 3
    displacement = np.concatenate(last.cell_data["displacement_m"])[is_wedge]
    assert displacement == pytest.approx(path[None], abs=1e-12)
    contacts = meshio.read(tmp_path / "vtk" / f"contacts_{frame:04d}.vtu")
    assert set(np.concatenate(contacts.cell_data["block_b"])) == {3.0}
    if falls:  # down the line of intersection, which plunges to the south
        plunge = np.arctan(np.tan(radians(40.0)) * cos(radians(30.0)))
        assert path / np.linalg.norm(path) == pytest.approx(
            [0.0, -np.cos(plunge), -np.sin(plunge)],
            abs=1e-3 / until,  # it dilates at first
        )


def test_check_lists_blocks_that_touch_nothing_and_blocks_that_tip_over_an_edge(tmp_path, capsys):
    """A prism beside the point above its edge, and another one in the air."""
    edge = [[x, 0.0, 0.5] for x in (-0.5, 0.5)]
    top = [[x, y, 1.2] for x in (-0.5, 0.5) for y in (-0.6, 0.7)]
    text = "[laws.joint]\n" + coulomb(0.6) + block("base", box=[4, 4, 1], fixed=True)
    text += block("high", box=[1, 1, 1], at=[0, 0, 5])
    (tmp_path / "prism.toml").write_text(text + block("prism", corners=edge + top))
    assert main(["check", str(tmp_path / "prism.toml")]) == 0
    printed = capsys.readouterr().out
    assert "touch nothing, so that nothing supports them: high (0.00, 0.00, 5.00)\n" in printed
    assert "2 blocks have no static equilibrium: high (0.00, 0.00, 5.00), prism" in printed
