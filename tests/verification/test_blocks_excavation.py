"""Rock that is taken away in stages: what it bore goes bit by bit, and the rest answers."""

import numpy as np
import pytest
from running import until
from scene_text import block, coulomb

from dem_demo import Simulation, load
from dem_demo.scene import parse

BOXES = [block(f"{i}", box=[1, 1], at=[0, i - 1.0], fixed=i == 0) for i in range(4)]
TOWER = f"[laws.j]\n{coulomb()}{''.join(BOXES)}[run]\nend = 1.0\n"
UNDER = "[[excavate]]\ncorners = [[-1, -0.4], [1, -0.4], [0, 0.5]]\nover = {over}\n{at}\n"


def tower(over, at=""):
    return parse(TOWER + UNDER.format(over=over, at=at))


def test_a_block_falls_as_its_support_goes():
    """Two blocks on one that is taken away: after t the force on them is t/T of their weight, so
    they have fallen by g t^3/(6 T), and at T by g T^2/6."""
    over = 0.1
    sim = Simulation(tower(over))
    start = sim.blocks.motion[1].copy()
    for time in (0.5 * over, over):
        until(sim, time)
        fallen = start - sim.blocks.motion[1]
        assert fallen[2:] == pytest.approx(9.81 * sim.time**3 / (6 * over), rel=0.02)
        assert abs(sim.ledger.error) < 1e-3
    assert sim.begun == 0.0
    assert sim.blocks.gone.tolist() == [False, True, False, False]
    assert abs(fallen[1]) < 1e-15
    assert sim.tracker.between(2, 3).any()
    assert not sim.tracker.between(1, 2).any()


def test_a_stage_waits_for_its_time_or_for_rest():
    """A block dropped by 1 mm first comes to rest; a time of its own is kept."""
    text = tower(0.01, "at = 0.02").text
    sim = Simulation(parse(text))
    until(sim, 0.03)
    assert sim.begun == pytest.approx(0.02, abs=2e-3)
    rest = text.replace("at = 0.02", "").replace("at = [0, 2.0]", "at = [0, 2.001]")
    sim = Simulation(parse(rest.replace("[run]", "[run]\nseat = false\n")))
    until(sim, 0.02)
    assert np.isinf(sim.begun)
    until(sim, 1.0)
    assert np.isfinite(sim.begun)


def test_a_resumed_excavation_goes_on_bit_for_bit():
    one = Simulation(tower(0.1))
    until(one, 0.05)
    other = Simulation(one.scene, saved=one.state())
    for sim in (one, other):
        until(sim, 0.12)
    assert np.array_equal(one.blocks.motion, other.blocks.motion)
    assert np.array_equal(one.ledger.energy, other.ledger.energy)
    assert other.blocks.mobile[:, 0].tolist() == [False, False, True, True]


def test_rock_is_cut_along_what_is_taken_away():
    """The blocks of the stages cover their corners, in one rock or in two."""
    scene = load("tunnel")
    areas = [sum(scene.blocks[i].section.area for i in stage["blocks"]) for stage in scene.stages]
    assert areas == pytest.approx([6 * 2 + (6 + 4.2) / 2 * 1.6 + 4.2 / 2 * 0.8, 18.0], rel=0.02)
    assert sum(block.section.area for block in scene.blocks) == pytest.approx(24 * 20, rel=0.01)
    left = scene.excavated
    assert sorted(left.gone) == sorted([i for stage in scene.stages for i in stage["blocks"]])
    assert not left.stages


def test_an_empty_excavation_is_refused():
    with pytest.raises(ValueError, match=r"excavate\[1\].corners: no block is left there"):
        parse(TOWER + 2 * UNDER.format(over=0.1, at=""))


@pytest.mark.slow
def test_the_blocks_of_a_tunnel_that_are_named_loose_are_those_that_fall():
    scene = load("tunnel")
    sim, named = Simulation(scene), Simulation(scene.excavated).loose
    assert not sim.loose.any()
    drawn = sim.blocks.motion[:2].copy()
    until(sim, 1.0)
    moved = np.hypot(*(sim.blocks.motion[:2] - drawn)) * ~sim.blocks.gone
    assert named.any()
    assert (moved[named] > 0.02).all()
    assert (moved[~named] < 2e-3).all()
