"""Contacts of two blocks against finite differences of their own geometry."""

import numpy as np
import pytest

from dem_demo.contact.geometry import Contacts, Outlines
from dem_demo.scene import Block

BASE = Block("base", np.array([[-1.0, -0.5], [1.0, -0.5], [1.0, 0.0], [-1.0, 0.0]]), 2600.0)
TOP = Block("top", np.array([[0.0, 0.0], [0.6, 0.0], [0.6, 0.4], [0.0, 0.4]]), 2600.0)
STILL, STEP = np.zeros((3, 2)), 1e-6  # m, rad, s


def contacts(place, velocity=STILL):
    """The lower corners of the top on the upper edge of the base; place (3, 2): x, y, turn."""
    outlines = Outlines([BASE, TOP], corner_length=0.05, soft=0.01)
    corner, edge = np.array([4, 5]), np.array([2, 2])
    return Contacts(outlines, corner, edge, np.concatenate([place, velocity]))


def places(x, turn):
    """Base and top, whose centroid is 0.2 m above the base."""
    return np.array([[0.0, x], [-0.25, 0.2], [0.0, turn]])


# flat, next to the end of the base, beyond it; turned by what raises an edge in part
@pytest.mark.parametrize("x", [0.2, 0.704, 0.9])
@pytest.mark.parametrize("turn", [0.01, 0.05, -0.06, 0.08])
def test_a_changing_length_pushes_by_the_derivative_of_its_energy(x, turn):
    place, energy = places(x, turn), np.array([1.0, 2.0])  # J/m per length
    now, none = contacts(place), np.zeros(2)
    assert now.length.max() > 0.01
    forces = now.assemble(np.concatenate([place, STILL]), none, none, energy)
    for block in (0, 1):
        for way in (0, 1, 2):
            nudge = np.zeros((3, 2))
            nudge[way, block] = STEP
            gain = energy @ (contacts(place + nudge).length - contacts(place - nudge).length)
            # central differences of smooth lengths of 0.1 to 1 m: 1e-8, and their rounding
            assert forces[block, way] == pytest.approx(-gain / (2 * STEP), abs=1e-6)


def test_opening_and_sliding_are_rates_at_the_contact():
    place, velocity = places(0.2, 0.05), np.array([[0.0, 0.3], [0.0, -0.1], [0.0, 0.7]])
    now, later = contacts(place, velocity), contacts(place + STEP * velocity)
    rate = (later.at - now.at) / STEP  # of the corner of the top, while the base is at rest
    np.testing.assert_allclose(now.opening, rate.imag, atol=1e-5)
    np.testing.assert_allclose(now.sliding, rate.real, atol=1e-5)
    np.testing.assert_allclose(now.opening, (now.closure - later.closure) / STEP, atol=1e-5)


def test_two_blocks_that_turn_as_one_neither_open_nor_slide():
    place, spin = places(0.2, 0.05), 0.7
    now = contacts(place, spin * np.array([-place[1], place[0], [1.0, 1.0]]))
    np.testing.assert_allclose([now.opening, now.sliding], 0.0, atol=1e-15)  # rounding
