"""Dashpots and drives of the blocks: what they do to one block on a base."""

import numpy as np
import pytest
from test_blocks_tilt import BLOCK

from dem_demo import Simulation, parse
from dem_demo.dynamics.forces import forces

WORDS = {"gravity": [0.0, -9.81], "drawn": 0.0, "base": [0.0, -0.5], "top": [0.0, 0.25]}


def test_dashpots_never_pull():
    """A block that flies up at 1 m/s from its seat: nothing holds it but its weight."""
    text = BLOCK.format(**WORDS, driven=0.0).replace("end =", "dashpot_normal = 0.3\nend =")
    sim = Simulation(parse(text))
    sim.blocks.motion[4, 1] = 1.0
    sim.tracker.place(sim.blocks.motion)
    velocity = sim.blocks.drives.velocity(0.0, sim.dt)
    force = forces(sim.scene, sim.blocks, sim.contacts, sim.joints, velocity, sim.dt)
    assert force[1, 1, 1] < 0.0  # they brake
    assert force[0, 1, 1] >= sim.blocks.gravity[1, 1] * (1 + 1e-9)


def test_critical_damping_is_that_of_the_block_on_all_its_joints():
    """2 sqrt(K m), shared by the two ends of the face."""
    sim = Simulation(parse(BLOCK.format(**WORDS, driven=0.0)))
    stiffness = np.full(sim.joints.n, 1e8)
    critical = 2 * np.sqrt(stiffness.sum() * sim.blocks.inertia[1, 0])
    assert sim.joints.n == 2
    assert sim.blocks.damping(sim.contacts, stiffness).sum() == pytest.approx(critical)


def test_a_drive_goes_back_once_its_block_has_slid():
    """The base turns from 25 to 32 degrees against gravity, but for the block: from 26.6 on, that
    is from 1.6 of the drive's 7 degrees, it slides, and the base goes back."""
    back = 'back = { block = "top", slid = 1e-3, by = 3.0, rate = 50.0 }\n[watch]'
    down = (9.81 * np.array([-np.sin(np.radians(25)), -np.cos(np.radians(25))])).tolist()
    words = BLOCK.format(**{**WORDS, "gravity": down}, driven=7.0)
    sim, turned = Simulation(parse(words.replace("[watch]", back))), []
    while sim.time < 0.6:
        sim.step()
        turned.append(np.degrees(sim.blocks.motion[2, 0]))
    assert 1.6 < max(turned) < 6.5
    assert turned[-1] < max(turned) - 1.5  # on its way back
