"""The energy ledger closes: 1e-4 of the energy turned over without impacts, 0.5 % with them."""

import numpy as np
import pytest
from running import steps, until
from scene_text import ROCK, coulomb, on_base

from dem_demo import Simulation, parse

REPLICA = ROCK.replace("a = 3.0", "a = 4.0")
COULOMB = coulomb(0.6, 1e9, 8e8)


def one_block(law, dip=0.0, at=None, run=""):
    """A block 1.0 by 0.5 m over a fixed base."""
    return parse(on_base(law, [1.0, 0.5], dip, (6.0, 1.0), at) + f"fraction = 0.3\n{run}")


@pytest.mark.parametrize("law", [COULOMB, REPLICA], ids=["coulomb", "joint"])
def test_sliding_block(law):
    """A dip of 48 degrees, more than either joint holds: friction eats most of the work.

    The first 0.02 s wind the joints up; the ledger must close to 1e-4 over the whole slide.
    """
    sim = Simulation(one_block(law, 48.0, at=(-1.0, 0.25)))
    lost = [0.0, *steps(sim, 1100, lambda: sim.ledger.value["friction"])]
    assert sim.blocks.motion[0, 1] > -0.9
    assert np.diff(lost).min() >= -1e-9 * lost[-1]
    assert lost[-1] > 0.3 * sim.ledger.value["turned"]
    assert abs(sim.ledger.error) < 1e-4


def test_linear_joint_conserves_to_round_off():
    """Half-step kinetic energy: a linear spring without dashpots loses nothing at all.

    A block that is let go on its base bounces 3 um deep.
    """
    run = "dashpot_normal = 0.0\ndashpot_shear = 0.0\nseat = false"
    sim = Simulation(one_block(COULOMB.replace("0.6", "inf"), run=run))
    steps(sim, 1000)
    # Joules, of 0.1 that come and go: places are known to 5e-17 m, times a weight of 13 kN.
    assert sim.ledger.total == pytest.approx(sim.ledger.start, abs=2e-11)


@pytest.mark.slow
def test_a_shrinking_joint_gives_its_energy_back():
    """A block pushed over the end of its base, without friction: the joint shrinks under load, and
    the drive that holds the block back gains what the joint and the sinking block lose."""
    law = coulomb(0.0, 1e9, 8e8)
    scene = parse(
        on_base(law, [1.0, 0.5], base=(1.0, 0.5), held=["turn"], end=1.6)
        + """\
dashpot_normal = 0.0
dashpot_shear = 0.0
[[drive]]
block = "block"
motion = "x"
times = [0.0, 1.5]
values = [0.0, 0.3]
"""
    )
    sim = Simulation(scene)
    stored = sim.ledger.value["stored"]
    until(sim, scene.run.end)
    assert sim.contacts.length.sum() == pytest.approx(0.7, abs=1e-9)
    v = sim.ledger.value
    assert v["friction"] == v["dashpots"] == v["dropped"] == 0
    gain = v["stored"] + v["potential"] - stored
    # It hangs on the shorter joint: at constant load stored energy and closure grow as 1/length.
    assert gain == pytest.approx(stored * (1 / 0.7 - 1) * (1 - 2), rel=0.05)
    assert v["work"] == pytest.approx(gain, rel=0.05)
    assert abs(sim.ledger.error) < 1e-4
