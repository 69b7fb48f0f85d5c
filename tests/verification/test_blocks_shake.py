"""The scene `shake`: slip per cycle against Newmark's sliding block, and none below yield."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl
from dem_demo import Simulation, coulomb_law, run
from dem_demo.scene import turn

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
import shake

CYCLES, LAST = 5, 2


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


def test_joint_slides_as_newmark_says(block):
    """Its critical slip, over which friction follows the stress, is 7 % of the slip per cycle."""
    given = shake.scene(1.5 * block.yields_at(), CYCLES)
    assert measured(given) == pytest.approx(predicted(block, given), rel=0.1)


@pytest.mark.parametrize(
    ("resolution", "most"),
    [
        ("balanced", 1e-5),
        (jl.Resolution(2, 4, 24), 1e-6),
    ],
)
def test_no_creep_below_yield(block, resolution, most):
    """Coarse cells forget shear as the normal stress goes up and down, and the slab makes up."""
    above = predicted(block, shake.scene(1.5 * block.yields_at(), CYCLES))
    given = shake.scene(0.5 * block.yields_at(), CYCLES, resolution=resolution)
    assert predicted(block, given) == 0.0
    assert abs(measured(given)) < most * above


def test_summary_holds_the_slip_per_cycle():
    given = shake.scene(4.0, 2)
    record, summary = run(Simulation(given), until=1.01)
    (slips,) = summary["slip_per_cycle_m"].values()
    assert len(slips) == 4  # it rises, twice all of it, it falls
    assert slips[0] < slips[1] < slips[2]
    slid = record.column("slab: slid_m")
    assert sum(slips) == pytest.approx(slid[-1] - slid[0], rel=1e-3)  # the base rests from 1 s on
