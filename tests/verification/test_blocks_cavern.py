"""The scene `cavern`: forces over level lines and the roof wedge, against sums made by hand."""

import numpy as np
import pytest
from running import steps, until

from dem_demo import Simulation, load
from dem_demo.output.monitors import friction_angle

pytestmark = pytest.mark.slow
HALF = np.arctan(1.25 / 2.0)  # rad: of the wedge at its apex, 32 degrees


def wedge(scene):
    return next(i for i, block in enumerate(scene.blocks) if block.name == "wedge")


def carried(sim, upper):
    """Vertical force (N) of the other moving blocks, but for the walls, on `upper` (blocks,)."""
    wall = np.array([bool(block.held) for block in sim.scene.blocks])
    c, (stress, shear) = sim.contacts, sim.joints.traction.T
    across = (upper[c.a] != upper[c.b]) & ~wall[c.a] & ~wall[c.b]
    area = sim.ledger.area * across
    return c.assemble(sim.blocks.motion, area * stress, -area * shear)[upper, 1].sum()


def test_the_rock_around_a_cavern_carries_its_own_weight():
    """Between smooth walls what lies above a level line rests on what is below, pillars and all.

    0.5 % leaves room for corners that turn at the walls; a wall that bore weight would miss it.
    """
    sim = Simulation(load("cavern"))
    assert not sim.loose.any()
    steps(sim, 300)
    height, weight = sim.blocks.motion[1], -sim.blocks.gravity[:, 1]
    rock = np.array([not (block.fixed or block.held) for block in sim.scene.blocks])
    assert 140 <= rock.sum() <= 160
    for level in np.arange(-2.0, 9.5, 1.0):  # on the beds; the opening reaches from 0 to 4 m
        upper = rock & (height > level)
        assert carried(sim, upper) == pytest.approx(weight[upper].sum(), rel=5e-3), level


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
        sim, n = Simulation(scene), wedge(scene)
        start = sim.blocks.motion[1, n]
        thrust = 2e5 * 2.0 / np.cos(phi - HALF)  # N, on a side, by the horizontal stress
        bears = 2 * thrust * np.sin(phi - HALF) + sim.blocks.gravity[n, 1]
        until(sim, time)
        fallen[name] = bears, start - sim.blocks.motion[1, n]
    (left, hangs), (lacking, falls) = fallen.values()
    assert left > 0 > lacking
    assert abs(hangs) < 1e-8
    assert falls > 0.95 * 0.5 * 9.81 * time**2
