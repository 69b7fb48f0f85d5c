"""The scene `shake`: slip per cycle against Newmark's sliding block, and none below yield."""

from dataclasses import replace

import newmark as shake
import numpy as np
import pytest
from extremes import FULL

import jointlaw as jl
from dem_demo import Simulation, coulomb_law, run
from dem_demo.scene import turn

CYCLES, LAST = (shake.CYCLES, shake.LAST) if FULL else (5, 2)
# (size, resolution): size is the largest acceleration over that at which Newmark's block slides
NAMES = "balanced", "fine", "reference"
ABOVE, BELOW = [(1.5, "balanced")], [(0.5, "balanced")]
if FULL:
    ABOVE = [(size, name) for size in (1.2, 1.5, 2.0) for name in NAMES]
    BELOW = [(size, name) for size in (0.5, 0.9) for name in NAMES]


def measured(given):
    """Slip per cycle (m) of a scene."""
    return shake.per_cycle(*shake.slip(given), CYCLES, LAST)


def predicted(block, given):
    """Newmark's."""
    return shake.per_cycle(*block.slip(shake.sine(given)), CYCLES, LAST)


@pytest.fixture(scope="module")
def block():
    return shake.Newmark.of(shake.scene(1.0).laws["joint"])


def test_scene_is_what_the_quadrature_takes_it_for():
    given = shake.scene(2.0)
    base, slab = given.blocks
    side = base.corners[1] - base.corners[0]
    assert np.arctan2(-side[1], side[0]) == pytest.approx(shake.DIP)
    height = np.linalg.norm(slab.corners[3] - slab.corners[0])
    assert slab.density * height == pytest.approx(shake.LOAD)
    # drawn to touch: the closure under its weight is 1e-4 m
    gap = (turn(shake.DIP) @ (slab.centroid - base.centroid))[1] - 0.5 - 0.5 * height
    assert abs(gap) < 2e-5
    assert shake.sine(given).times[-1] * shake.FREQUENCY == pytest.approx(shake.CYCLES + 2)


def test_plain_friction_slides_as_newmark_says():
    """Springs of 2e8 Pa/m: they come back by less than 1e-4 m, the same in every cycle."""
    given = shake.scene(3.0, CYCLES)
    given = replace(given, laws={"joint": coulomb_law(2e8, 1.6e8, 0.6)})
    plain = shake.Newmark([0.0, 1e6], [0.6, 0.6])
    assert plain.yields_at() == pytest.approx(9.81 * np.tan(np.arctan(0.6) - shake.DIP))
    assert measured(given) == pytest.approx(predicted(plain, given), rel=2e-3)


@pytest.mark.parametrize(("size", "resolution"), ABOVE)
def test_joint_slides_as_newmark_says(block, record, size, resolution):
    """Its critical slip, over which friction follows the stress, is 7 % of the slip per cycle at
    1.5, and a third of it at 1.2."""
    given = shake.scene(size * block.yields_at(), CYCLES, resolution=resolution)
    found, expected = measured(given), predicted(block, given)
    record("shake", size, resolution, found)
    record("shake", size, "Newmark", expected)
    assert found == pytest.approx(expected, rel=0.1 if size > 1.2 else 0.2)


@pytest.mark.parametrize(("size", "resolution"), [*BELOW, (0.5, jl.Resolution(2, 4, 24))])
def test_no_creep_below_yield(block, record, size, resolution):
    """Coarse cells forget shear as the normal stress goes up and down, and the slab makes up."""
    above = predicted(block, shake.scene(1.5 * block.yields_at(), CYCLES))
    given = shake.scene(size * block.yields_at(), CYCLES, resolution=resolution)
    found = measured(given)
    assert predicted(block, given) == 0.0
    if isinstance(resolution, str):
        record("shake", size, resolution, found)
        record("shake", size, "Newmark", 0.0)
    assert abs(found) < (1e-5 if isinstance(resolution, str) else 1e-6) * above


def test_summary_holds_the_slip_per_cycle():
    given = shake.scene(4.0, 2)
    record, summary = run(Simulation(given), until=1.01)
    (slips,) = summary["slip_per_cycle_m"].values()
    assert len(slips) == 4  # it rises, twice all of it, it falls
    assert slips[0] < slips[1] < slips[2]
    slid = record.column("slab: slid_m")
    assert sum(slips) == pytest.approx(slid[-1] - slid[0], rel=1e-3)  # the base rests from 1 s on
