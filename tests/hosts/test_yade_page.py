"""The script of docs/yade.md runs in YADE as printed: a sphere comes to rest on the joint."""

import math
from pathlib import Path

import pytest

import jointlaw as jl

PAGE = Path(__file__).parents[2] / "docs" / "yade.md"
ASK = """
import json
found = joints.contacts()
print("\\nRESULT " + json.dumps({"n": len(found["area"]), "force": float(
    found["area"][0] * found["traction"][0, 0])}), flush=True)
"""


def test_script_of_the_page(yade, tmp_path):
    jl.export_yade(jl.presets.load("jing-replica"), tmp_path, azimuths=3, steps=10)
    block = PAGE.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    found = yade(block + ASK, preamble=False)
    weight = 2600 * 4 / 3 * math.pi * 0.1**3 * 9.81
    assert found["n"] == 1
    # damped to rest within 10 000 steps: what is left of the bounce was 0.02 %
    assert found["force"] == pytest.approx(weight, rel=0.01)
    assert (tmp_path / "half.npz").exists()
