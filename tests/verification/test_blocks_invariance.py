"""What must not matter: the frame, the order of the blocks; what must be kept: momentum."""

from dataclasses import replace

import numpy as np
import pytest
from running import steps
from scene_text import ROCK, block

from dem_demo import Simulation, load, parse

LAW = "[laws.rock]\n" + ROCK.replace("a = 3.0", "a = 4.0")
PILE = {
    "base": ([4.0, 1.0], [0.0, -0.5], 0.0),
    "left": ([1.0, 0.5], [-0.5, 0.25], 0.0),
    "right": ([1.0, 0.5], [0.52, 0.25], 0.0),
    "top": ([1.2, 0.4], [0.0, 0.705], 0.5),
}


def pile(order, turned=0.0):
    """Three blocks on a base; the top one is dropped; everything turned by `turned` degrees."""
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    text = [f"gravity = [{9.81 * s}, {-9.81 * c}]", LAW]
    for name in order:
        size, (x, y), angle = PILE[name]
        where = [c * x - s * y, s * x + c * y]
        text.append(block(name, box=size, angle=angle + turned, at=where, fixed=name == "base"))
    text.append("[run]\nend = 1.0\nseat = false\nstep = 1e-4")
    return Simulation(parse("\n".join(text)))


def motion(sim, order, turned=0.0):
    """Places and angles after 0.12 s, by name, turned back."""
    steps(sim, 1200)
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    x, y, angle = sim.blocks.motion[:3]
    back = np.array([c * x + s * y, c * y - s * x, angle])
    return np.array([back[:, order.index(name)] for name in PILE])


@pytest.fixture(scope="module")
def reference():
    order = list(PILE)
    return motion(pile(order), order)


def test_turning_the_scene_by_37_degrees(reference):
    order = list(PILE)
    turned = motion(pile(order, 37.0), order, 37.0)
    assert turned == pytest.approx(reference, abs=1e-11)


def test_rounding_of_the_drawing_does_not_choose_between_equal_corners():
    """Corners of the scene slope moved by a last digit or two: where joints cross, corners of four
    blocks meet, and which is over which edge is a tie. Coordinates of 20 m are known to 4e-15 m."""
    scene, rng = load("slope"), np.random.default_rng(1)

    def start(digits):
        def moved(corners):
            return corners * (1 + 2e-16 * rng.integers(-digits, digits + 1, corners.shape))

        blocks = tuple(replace(block, corners=moved(block.corners)) for block in scene.blocks)
        sim = Simulation(replace(scene, blocks=blocks))
        return sim.blocks.motion[:3], list(zip(sim.contacts.corner, sim.contacts.edge, strict=True))

    place, contacts = start(0)
    other, also = start(2)
    assert also == contacts
    assert other == pytest.approx(place, abs=1e-12)
