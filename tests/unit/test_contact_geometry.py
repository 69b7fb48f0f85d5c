"""Contacts of blocks: what energy and forces need of their geometry, against finite differences."""

import numpy as np
import pytest

from dem_demo.contact.geometry import Contacts, Outlines
from dem_demo.scene import Block

BASE = Block("base", np.array([[-1.0, -0.5], [1.0, -0.5], [1.0, 0.0], [-1.0, 0.0]]), 2600.0)
TOP = Block("top", np.array([[0.0, 0.0], [0.6, 0.0], [0.6, 0.4], [0.0, 0.4]]), 2600.0)
STEP = 1e-6  # m and rad: central differences of smooth lengths of 0.1 to 1 m leave 1e-8


def contacts(place, turn, speed=(0.0, 0.0, 0.0), base_speed=(0.0, 0.0, 0.0)):
    """The lower corners of the top block on the base, its centroid at a place, turned (rad)."""
    motion = np.zeros((6, 2))
    motion[:, 0] = [*BASE.centroid, 0.0, *base_speed]
    motion[:, 1] = [*place, turn, *speed]
    outlines = Outlines([BASE, TOP], corner_length=0.05, soft=0.01)
    corner, edge = np.array([4, 5]), np.array([2, 2])  # of the top, on the upper edge of the base
    return Contacts(outlines, corner, edge, motion)


# flat, in the smooth ends of both blocks, turned by what raises an edge in part
@pytest.mark.parametrize("x", [0.2, 0.704, 0.9])
@pytest.mark.parametrize("turn", [0.01, 0.05, -0.06, 0.08])
def test_pull_and_twist_are_derivatives_of_the_length(x, turn):
    place = np.array([x, 0.2])
    now = contacts(place, turn)
    assert now.length.max() > 0.01
    for way in (0, 1):
        nudge = STEP * np.eye(2)[way]
        slope = contacts(place + nudge, turn).length - contacts(place - nudge, turn).length
        along = (now.pull.conj() * (1, 1j)[way]).real
        np.testing.assert_allclose(slope / (2 * STEP), along, atol=1e-6)
    slope = contacts(place, turn + STEP).length - contacts(place, turn - STEP).length
    carried = (now.pull.conj() * 1j * (now.at - complex(*place))).real
    np.testing.assert_allclose(slope / (2 * STEP), carried + now.twist, atol=1e-6)


def test_opening_and_sliding_are_rates_at_the_contact():
    """Of the top against the base, whose upper edge is along x: the corner's own velocity."""
    place, speed, dt = np.array([0.2, 0.2]), np.array([0.3, -0.1, 0.7]), 1e-6
    now = contacts(place, 0.05, speed)
    later = contacts(place + dt * speed[:2], 0.05 + dt * speed[2])
    rate = (later.at - now.at) / dt
    np.testing.assert_allclose(now.opening, rate.imag, atol=1e-5)
    np.testing.assert_allclose(now.sliding, rate.real, atol=1e-5)
    np.testing.assert_allclose(now.opening, -(later.closure - now.closure) / dt, atol=1e-5)


def test_two_blocks_that_turn_as_one_neither_open_nor_slide():
    place, spin = np.array([0.2, 0.2]), 0.7
    arm = place - BASE.centroid
    now = contacts(place, 0.05, (-spin * arm[1], spin * arm[0], spin), (0.0, 0.0, spin))
    np.testing.assert_allclose([now.opening, now.sliding], 0.0, atol=1e-15)  # rounding
