"""in.tower as exported: energy balance in thermo, and the same on one processor and on two."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from lammps_host import dumped, run, thermo

import jointlaw as jl
from jointlaw.hosts.lammps.export import export_lammps


@pytest.fixture(scope="module")
def tower(plugin):
    """Thermo and dumps of a short, hard shake, on one processor and on two."""
    export_lammps(replace(jl.presets.load("jing-replica"), resolution="fast"), plugin, "tower")
    found = []
    for processors in (1, 2):
        text = run(plugin, "in.tower", processors, steps=4000, settle=1000, peak=4.0)
        found.append((thermo(text)[-1], dumped(plugin / "tower.dump")))
    return found


def test_the_balance_of_energy(tower):
    """Work of the base and of weight against what is kept and lost: 0.5 %."""
    table, _ = tower[0]
    fed = np.abs(table["v_work"]).max() + np.abs(table["v_fallen"]).max()
    assert np.abs(table["v_balance"]).max() < 5e-3 * fed
    assert table["c_joint[2]"][-1] > 0.2 * fed  # it has slipped
    assert np.abs(table["v_top"]).max() > 1e-5


def test_one_processor_and_two(tower):
    one, two = (  # LAMMPS numbers atoms by processor, so bodies are compared, by their centres
        np.array([dump[:, dump[0, :, 1] == body, 2:].mean(axis=1) for body in range(1, 6)])
        for _, dump in tower
    )
    assert np.ptp(one, axis=1).max() > 1e-5
    assert np.abs(one - two).max() < 1e-10  # m, up to the end
