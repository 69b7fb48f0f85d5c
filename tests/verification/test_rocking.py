"""A rocking block under dashpots of 0.3 loses the velocity of Housner (1963) in each impact."""

import math

import numpy as np
import pytest
from scene_text import block, coulomb, lines

from dem_demo import Simulation, parse

WIDTH, HEIGHT = 0.4, 1.6  # m
SLENDERNESS = math.atan(WIDTH / HEIGHT)  # rad: angle at which the block stands on one corner
START = 0.5 * SLENDERNESS


def height_gained(angle):
    """Rise of the centroid at a rotation (rad) about a corner, per distance from the corner."""
    return math.cos(SLENDERNESS - angle) - math.cos(SLENDERNESS)


def velocity_ratios(dashpot, impacts):
    """Velocity after over velocity before each impact, from the largest rotations between them."""
    cosine, sine = math.cos(START), math.sin(START)
    corners = np.array([[-WIDTH, 0.0], [0.0, 0.0], [0.0, HEIGHT], [-WIDTH, HEIGHT]])
    turned = corners @ np.array([[cosine, -sine], [sine, cosine]])
    text = f"[laws.stone]\n{coulomb(1.5, 1e9, 1e9)}"
    text += block("base", box=[4.0, 1.0], at=[0.0, -0.5], fixed=True)
    text += block("block", corners=turned)
    text += "[run]\nend = 3.0\nsettle = false\nfraction = 0.1\nlaw_steps = 2\n"
    sim = Simulation(parse(text + lines(dashpot_normal=dashpot, dashpot_shear=dashpot)))
    drawn = sim.blocks.motion[2, 1]
    largest = [START]
    previous = 0.0
    while len(largest) <= impacts:
        sim.step()
        spin = sim.blocks.velocity[2, 1]
        angle = abs(sim.blocks.motion[2, 1] - drawn - START)
        if spin * previous < 0 and angle > 0.02 * SLENDERNESS:
            largest.append(angle)
        previous = spin
        assert sim.time < 3.0
    rises = [height_gained(angle) for angle in largest]
    return np.sqrt(np.divide(rises[1:], rises[:-1]))


def test_velocity_after_an_impact():
    by_hand = 1 - 1.5 * math.sin(SLENDERNESS) ** 2
    assert velocity_ratios(0.3, 3) == pytest.approx(by_hand, rel=0.01)
    assert (velocity_ratios(0.05, 1) > by_hand + 0.03).all()  # the default
