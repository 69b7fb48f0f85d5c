"""The exported input scripts run, and pictures.py draws what they wrote."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import subprocess

from lammps_host import dumped, run, thermo

import jointlaw as jl
from jointlaw.hosts.lammps.export import export_lammps


@pytest.fixture(scope="module")
def ran(plugin):
    """A folder in which all scripts have run, shortly."""
    law = jl.JointLaw.from_toml(plugin / "law.toml")
    export_lammps(law, plugin, "rock")  # another test may have exported another law here
    run(plugin, "in.spheres")
    run(plugin, "in.shear", steps=8000, slip=5)
    text = run(plugin, "in.slope", 2, s=0.5, width=1, steps=20)
    tower = run(plugin, "in.tower", steps=400, settle=200)
    (plugin / "log.tower").write_text(tower)
    return plugin, thermo(text)[-1]


def test_spheres_part(ran):
    frames = dumped(ran[0] / "spheres.dump")
    apart = frames[:, 1, 1] - frames[:, 0, 1]
    assert apart[0] < 0.02 < apart[-1]
    assert np.abs(frames[:, :, -2:]).max() > 0
    assert not frames[-1, :, -2:].any()


def test_slope_has_both_joint_sets(ran):
    table = ran[1]
    assert table["c_under[1]"][0] == 16 * 2 * 2
    assert table["c_between[1]"][-1] > 100


def test_pictures(ran):
    folder, _ = ran
    done = subprocess.run(
        [sys.executable, "pictures.py"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for name in ("tower", "shear", "slope", "spheres"):
        assert f"wrote {name}.png" in done.stdout
        assert (folder / f"{name}.png").stat().st_size > 10_000
    # a short test with a few thousand steps is not yet quasi-static
    away = float(done.stdout.split("shear stress: ")[1].split()[0])
    assert away < 0.02
