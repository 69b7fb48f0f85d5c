"""The recipes of docs/recipes.md work as printed."""

import json
from pathlib import Path

import numpy as np
from pages import blocks

import dem_demo.cli
import jointlaw as jl

PAGE = "docs/recipes.md"
(HOST,) = blocks(PAGE, "python")


def run(code):
    space = {}
    exec(compile(code, PAGE, "exec"), space)
    return space


def test_host():
    run(HOST)
    law, folder = jl.presets.load("linear-a3"), Path("joint-for-my-host")
    closure, stress, stiffness = np.loadtxt(folder / "joint.txt").T
    np.testing.assert_allclose(stress, law.normal_stress(closure), rtol=1e-9)  # 18 digits in text
    assert (stiffness[1:] > 0).all()
    assert json.loads((folder / "summary.json").read_text())["rows"] == len(closure)


def test_scene():
    Path("block.toml").write_text(blocks(PAGE, "toml")[0])
    assert dem_demo.cli.main(["check", "block.toml"]) == 0
    assert dem_demo.cli.main(["block.toml", "--out", "out", "--no-pictures"]) == 0
    summary = json.loads(Path("out/summary.json").read_text())
    (slip,) = summary["slip"]
    # 25 degrees are below the friction of these asperities, atan(0.4) + 30 = 52 degrees at most
    assert slip["slip_angle"] is None
    assert summary["largest_energy_error"] < 1e-3  # as docs/scenes.md says of rest
