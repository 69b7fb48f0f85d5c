"""VTK files of a run hold what its tables hold."""

import csv

import meshio
import numpy as np

from dem_demo.cli import main


def test_blocks_and_joints_of_the_last_frame(tmp_path):
    assert main(["slope", "--until", "0.04", "--no-pictures", "--vtk", "--out", str(tmp_path)]) == 0
    with (tmp_path / "joints.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    last = [row for row in rows if row["time_s"] == rows[-1]["time_s"]]
    joints = meshio.read(sorted((tmp_path / "vtk").glob("joints_*.vtu"))[-1])
    assert len(joints.cells[0].data) == len(last)
    for name in ("closure_m", "shear_m", "normal_stress_Pa", "shear_stress_Pa", "sliding"):
        mine = joints.cell_data[name][0]
        np.testing.assert_allclose(mine, [float(row[name]) for row in last], rtol=1e-12)
    assert set(joints.cell_data["state"][0]) <= {0, 1, 2, 3}

    with (tmp_path / "blocks.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    last = [row for row in rows if row["time_s"] == rows[-1]["time_s"]]
    blocks = meshio.read(sorted((tmp_path / "vtk").glob("blocks_*.vtu"))[-1])
    speed = np.concatenate(blocks.cell_data["velocity_m/s"])
    number = np.concatenate(blocks.cell_data["block"]).astype(int)
    expected = [[float(last[k]["vx_m/s"]), float(last[k]["vy_m/s"]), 0.0] for k in number]
    np.testing.assert_allclose(speed, expected, rtol=1e-12)
    assert sorted(number) == list(range(len(last)))
