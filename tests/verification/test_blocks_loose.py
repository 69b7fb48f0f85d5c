"""Blocks that cannot be held: who is named, and that all others start in balance; around a
cavern too."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from running import until
from scene_text import coulomb, dipping, on_base

from dem_demo import Simulation, load
from dem_demo.cli import main
from dem_demo.output.monitors import friction_angle
from dem_demo.scene import parse

BLOCK = (
    on_base(coulomb(np.tan(np.radians(35.0))), [3.0, 1.5], 25.0, end=0.02)
    + """\
record = 0.01
[[block]]
name = "stuck to its face"
corners = [[1.5, 0.2], [2.0, 0.4], [2.0, 1.0], [1.5, 1.2]]
"""
)


def unbalanced(sim):
    """Unbalanced forces (n,) at step 0, as shares of the weights."""
    force = np.hypot(*(sim.ledger.forces[0] * sim.blocks.free)[:, :2].T)
    return force / np.hypot(*sim.blocks.gravity[:, :2].T).clip(1e-300)


def names(sim):
    return [sim.scene.blocks[i].name for i in np.flatnonzero(sim.loose)]


def test_a_loose_block_leaves_the_one_that_it_touches_in_balance():
    sim = Simulation(parse(BLOCK))
    assert names(sim) == ["stuck to its face"]
    lacking = unbalanced(sim)
    assert lacking[1] < 1e-9
    assert lacking[2] == pytest.approx(1.0, abs=0.01)  # nothing holds it
    again = Simulation(sim.scene, saved=sim.state())
    assert (again.loose == sim.loose).all()


def test_a_weakened_block_in_water_starts_in_balance():
    text = on_base(coulomb(0.7), [3.0, 1.5], load=[2e4, 0.0])
    sim = Simulation(
        replace(parse(text + "[water]\ntable = [[-9, 0.5], [9, 0.6]]\n"), reduction=1.3)
    )
    assert sim.blocks.loads[1, 1] > 1e4  # N, uplift
    assert unbalanced(sim)[1] < 1e-9


def test_a_block_that_slides_lacks_what_friction_does_not_hold():
    """At 40 degrees: sin - cos tan 35, of its weight."""
    steep = np.radians(40.0)
    sim = Simulation(replace(parse(BLOCK), gravity=tuple(dipping(40.0))))
    lacking = np.sin(steep) - np.cos(steep) * np.tan(np.radians(35.0))
    assert names(sim) == ["block", "stuck to its face"]
    assert unbalanced(sim)[1] == pytest.approx(lacking, rel=0.03)


def test_the_run_names_loose_blocks_and_says_how_each_block_moved(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(BLOCK)
    out = tmp_path / "out"
    assert main([str(tmp_path / "scene.toml"), "--out", str(out), "--no-pictures"]) == 0
    said = capsys.readouterr().out
    assert "1 blocks cannot be held" in said
    assert "stuck to its face (1.73, 0.70)" in said
    assert "blocks: " in said  # a verdict without a [[rock]]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["started_in_equilibrium"] is False
    assert [block["block"] for block in summary["loose"]] == ["stuck to its face"]
    rows = list(csv.DictReader((out / "blocks.csv").read_text().splitlines()))
    assert [row["block"] for row in rows] == ["base", "block", "stuck to its face"]
    assert [row["loose_at_start"] for row in rows] == ["0", "0", "1"]
    fell = float(rows[2]["displacement_m"])
    assert fell == pytest.approx(0.5 * 9.81 * 0.02**2, rel=0.1)
    assert float(rows[2]["speed_m/s"]) == pytest.approx(9.81 * 0.02, rel=0.1)
    assert float(rows[1]["displacement_m"]) < 1e-6


def test_strength_reduction_with_and_without_loose_blocks(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(BLOCK)
    out = tmp_path / "out"
    words = [str(tmp_path / "scene.toml"), "--out", str(out), "--until", "0.3"]
    assert main(["strength-reduction", *words]) == 0
    (row,) = json.loads((out / "strength.json").read_text())["rows"]
    assert [block["block"] for block in row["loose"]] == ["stuck to its face"]
    assert row["factor_of_safety"] is None
    assert row["factor_without"] == pytest.approx(
        np.tan(np.radians(35)) / np.tan(np.radians(25)), rel=0.01
    )
    assert [block["block"] for block in row["first"]] == ["block"]
    said = capsys.readouterr().out
    assert said.index("cannot be held") < said.index("factor of safety without")


HALF = np.arctan(1.25 / 2.0)  # rad: of the wedge at its apex, 32 degrees


@pytest.mark.slow
def test_a_roof_wedge_falls_where_its_joints_are_smoother_than_it_is_steep():
    """A force N on a side pushes a wedge of half angle A down by N (sin A - tan phi cos A): where
    phi is below A it falls, and the sooner the higher the horizontal stress. Above A each side
    bears N (tan phi cos A - sin A): more than half the weight, with 200 kPa over 2 m of height.
    (Brady and Brown 2004, 9.5.)

    The wedge that hangs is in balance to rounding; the other falls no slower than a loose block.
    """
    fallen, time = {}, 0.2
    for name, law in (("cavern", "rough"), ("cavern-smooth", "smooth")):
        scene = load(name)
        phi = np.radians(friction_angle(scene.laws[law], 2e5))
        sim = Simulation(scene)
        n = [block.name for block in scene.blocks].index("wedge")
        assert (unbalanced(sim) < 1e-6)[~sim.loose].all()
        start = sim.blocks.motion[1, n]
        thrust = 2e5 * 2.0 / np.cos(phi - HALF)  # N, on a side, by the horizontal stress
        bears = 2 * thrust * np.sin(phi - HALF) + sim.blocks.gravity[n, 1]
        until(sim, time)
        fallen[name] = bears, start - sim.blocks.motion[1, n]
    (left, hangs), (lacking, falls) = fallen.values()
    assert left > 0 > lacking
    assert abs(hangs) < 1e-8
    assert falls > 0.95 * 0.5 * 9.81 * time**2
