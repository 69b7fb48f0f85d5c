"""The energy ledger closes: 1e-4 of the energy turned over without impacts, 0.5 % with them; in one
block, in irregular blocks thrown together, where a corner is forced over another."""

import numpy as np
import pytest
from running import steps, until
from scene_text import ROCK, block, coulomb, on_base

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


SHAPES = [
    [[-0.9, 0.5], [-0.3, 0.4], [-0.1, 0.8], [-0.6, 1.1]],
    [[0.1, 0.35], [0.8, 0.6], [0.3, 1.0]],
    [[-0.8, 1.4], [-0.4, 1.2], [0.0, 1.3], [0.1, 1.6], [-0.5, 1.75]],
    [[0.4, 1.3], [0.9, 1.2], [1.0, 1.5], [0.7, 1.8], [0.3, 1.7]],
    [[-0.4, 2.1], [0.3, 2.0], [0.4, 2.5], [-0.3, 2.6]],
]


def heap():
    """Five irregular blocks, 3 to 5 corners each, dropped into a trough."""
    text = f"[laws.rock]\n{coulomb(0.6, 1e9, 8e8)}"
    for name, size, at in (("floor", [4.0, 0.4], [0.0, -0.2]), ("left", [0.4, 3.0], [-1.3, 1.5]),
                           ("right", [0.4, 3.0], [1.3, 1.5])):  # fmt: skip
        text += block(name, box=size, at=at, fixed=True)
    for i, corners in enumerate(SHAPES):
        text += block(f"{i}", corners=corners, spin=0.5 * i - 1)
    return parse(f"""{text}
[run]
end = 1.0
seat = false
step = 1e-4
law_steps = 8
max_overlap = 0.1
corner_length = 0.05
dashpot_normal = 0.0
dashpot_shear = 0.0
""")


@pytest.mark.slow
def test_tumbling_heap():
    """Corners meet edges, corners and sides of all tilts at 3 to 5 m/s: the books close within the
    0.5 % of an impact, and nothing dissipated comes back."""
    sim = Simulation(heap())
    gone, most, twice, potential = [], 0, 0, []
    for _ in range(6000):
        sim.step()
        c, v = sim.contacts, sim.ledger.value
        most = max(most, int((sim.joints.traction[:, 0] > 0).sum()))
        twice += len(set(zip(c.corner.tolist(), c.edge.tolist(), strict=True))) < len(c.corner)
        gone.append([v["friction"], v["dropped"]])
        potential.append(v["potential"])
    assert most >= 3
    assert twice <= 2  # of two that arrive at one corner one is dropped in the next step
    assert np.diff(gone, axis=0).min() >= -1e-9 * np.ptp(potential)
    assert abs(sim.ledger.total - sim.ledger.start) < 5e-3 * np.ptp(potential)


@pytest.mark.slow
def test_a_corner_forced_over_another_makes_no_energy():
    """A block, held at its height, is pushed over the edge of a base 1 cm too low, and back.

    Its bottom is parallel to the base's top, its side is not parallel to the base's: a corner 1 cm
    from the end of its edge, of 0.1 m, gives way to an edge that
    overlaps by 1 cm, and takes over again on the way back. The first drops stored energy, the
    second would make it: the corner starts anew instead, with a closure offset.
    """
    scene = parse(
        f"gravity = [0, 0]\n[laws.rock]\n{coulomb(0.0, 1e9, 8e8)}"
        + """
[[block]]
name = "base"
box = [4.0, 1.0]
at = [2.0, -0.5]
fixed = true
[[block]]
name = "block"
corners = [[-1.0, -0.01], [-0.005, -0.01], [-0.3, 0.99], [-1.0, 0.99]]
held = ["y", "turn"]
[[block]]
name = "free"
box = [1.0, 1.0]
at = [3.0, 0.5]
[[drive]]
block = "block"
motion = "x"
times = [0.0, 0.3, 0.6]
values = [0.0, 0.02, 0.0]
[run]
end = 0.75
seat = false
step = 1e-4
corner_length = 0.1
dashpot_normal = 0.0
dashpot_shear = 0.0
"""
    )
    sim = Simulation(scene)
    booked = until(
        sim, scene.run.end, lambda: (sim.ledger.value, sim.tracker.offset.max(initial=0))
    )
    dropped, stored, work = np.array([[v["dropped"], v["stored"], v["work"]] for v, _ in booked]).T
    assert stored.max() > 100
    assert dropped[-1] > 100
    assert np.diff(dropped).min() >= 0
    assert max(offset for _, offset in booked) > 1e-3
    assert work[-1] == pytest.approx(dropped[-1], rel=1e-2)  # all that the drive spent
    # The corner is 7 micrometres past the other when it gives way, of 1 cm: a share of that order.
    assert abs(sim.ledger.error) < 1e-3
