"""The recipes of docs/recipes.md work as printed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pages import blocks

import dem_demo.cli
import jointlaw as jl

PAGE = "docs/recipes.md"
HEIGHTS, HOST = blocks(PAGE, "python")


def run(code):
    space = {}
    exec(compile(code, PAGE, "exec"), space)
    return space


def test_height_distribution(capsys):
    space = run(HEIGHTS)
    law, heights = space["law"], space["EvenHeights"](10e-6)
    # Phi = int_0^y (y - s)^(3/2) ds / depth, and the same class through scipy
    same = jl.Heights("uniform", 0.0, parameters={"scale": 10e-6}, formation="individual")
    y = np.array([1e-6, 5e-6, 9e-6])
    expected = replace(law, heights=same).normal_stress(y)
    np.testing.assert_allclose(law.normal_stress(y), expected, rtol=1e-9)  # of the tabulated curve
    ratio = law.normal_stress(4e-6) / law.normal_stress(2e-6)
    assert ratio == pytest.approx(2.0**2.5, rel=1e-9)
    assert hash(heights) == hash(law.heights)
    assert law == replace(law, heights=heights)
    assert "MPa" in capsys.readouterr().out


def test_host():
    run("import numpy as np\nimport jointlaw as jl\n" + HOST)
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
