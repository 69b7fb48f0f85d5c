"""What must not matter: the frame, the order of the blocks; what must be kept: momentum."""

import numpy as np
import pytest

from dem_demo import Simulation, parse

LAW = """
[laws.rock]
asperity_density = 1e4
mating_length = 2e-3
orientation = { a = 4.0, b = 0.0, c = 0.0 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
"""
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
        text.append(
            f'[[block]]\nname = "{name}"\nbox = {size}\nangle = {angle + turned}\n'
            f"at = [{c * x - s * y}, {s * x + c * y}]\nfixed = {str(name == 'base').lower()}"
        )
    text.append("[run]\nend = 1.0\nseat = false\nstep = 1e-4")
    return Simulation(parse("\n".join(text)))


def motion(sim, order, turned=0.0):
    """Places and angles after 0.12 s, by name, turned back."""
    for _ in range(1200):
        sim.step()
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
