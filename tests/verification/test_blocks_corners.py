"""Corners on edges: energy of rocking and tumbling blocks, continuity, one joint all along.
Blocks that are put down again slide on faces that no longer fit each other."""

import collections

import numpy as np
import pytest
from running import steps, until
from scene_text import PLAIN, ROCK, block, coulomb, on_base

import jointlaw as jl
from dem_demo import Simulation, parse

ELASTIC = coulomb(0.0, 1e9, 8e8)
COULOMB = coulomb(1.0, 1e9, 8e8)
JOINT = ROCK.replace("a = 3.0", "a = 4.0")


def scene(law, width, height, at, run, **more):
    """One block on a fixed base whose top is y = 0, without dashpots."""
    text = on_base(law, [width, height], at=at, base=(10.0, 1.0), end=10.0, **more)
    return parse(f"{text}seat = false\ndashpot_normal = 0.0\ndashpot_shear = 0.0\n{run}")


def on_corner(law, width, height, tilt, spin, run):
    """Turned clockwise by `tilt` degrees about the lower right corner, which is at the origin."""
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    x, y = -0.5 * width * c + 0.5 * height * s, 0.5 * width * s + 0.5 * height * c
    more = {"angle": -tilt, "velocity": (spin * y, -spin * x), "spin": -spin}
    return scene(law, width, height, (x, y), run, **more)


def play(sim, tilt, end):
    """Run on: tilts (degrees), energies of the balance and potential energies (J), pressed joints,
    each by its place and how many contacts have had that."""
    had, (held,) = collections.Counter(), sim.joints.held
    take = held.take

    def counted(m):
        places = take(m)
        had.update(places.tolist())
        return places

    def see():
        places = sim.joints.place[sim.joints.traction[:, 0] > 0].tolist()
        pressed = {(place, had[place]) for place in places}
        energies = sim.ledger.total - sim.ledger.start, sim.ledger.value["potential"]
        return tilt - np.degrees(sim.blocks.motion[2, 1]), *energies, pressed

    held.take = counted
    *numbers, pressed = zip(*until(sim, end, see), strict=True)
    return *np.array(numbers), pressed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "spin", "steps", "within"),
    [(ELASTIC, 3.5, 1, 2e-3), (COULOMB, 2.0, 24, 4e-3), (JOINT, 2.0, 24, 5e-3)],
    ids=["elastic", "coulomb", "joint"],
)
def test_tumbling_block_keeps_its_energy(law, spin, steps, within):
    """Set spinning at 20 degrees, it goes over its corner and lands on its next side at 2 m/s.

    The law's friction work is first order in its own step: it takes many of them in the landing.
    """
    sim = Simulation(on_corner(law, 1.0, 1.0, 20.0, spin, f"step = 1e-4\nlaw_steps = {steps}"))
    tilts, total, potential, pressed = play(sim, 20.0, 0.72)
    in_play = np.ptp(potential)
    landing = int((tilts > 88.0).argmax())
    assert landing < len(tilts) - 400
    assert np.abs(total[:landing]).max() < 1e-4 * in_play
    assert np.abs(total).max() < within * in_play
    # One and the same joint on the corner from one side to the next, and in the landing.
    stood = set().union(*pressed[:landing])
    assert len(stood) == 1
    assert stood <= set().union(*pressed[landing:])


LAW = (
    ROCK.replace("a = 3.0", "a = 4.0")
    + "plane = 0.0\nresolution = { u = 4, phi = 10, depth = 1 }\n"
)
TEXT = (
    on_base(LAW, [2.0, 1.0], at=[-1.0, 0.5], held=["turn"], end=0.5)
    + """\
step = 2e-4
skin = 0.02
dashpot_normal = 0.5
[[drive]]
block = "block"
motion = "x"
times = [0.0, 0.1, 0.5]
values = [0.0, 0.0, 1e-3]
"""
)
SCENE = parse(TEXT)


def put(sim, across, up):
    """Move the block by hand and bring it to rest."""
    motion = sim.blocks.motion
    motion[0, 1] += across
    motion[1, 1] += up
    sim.blocks.motion[:], sim.blocks.velocity[:] = motion, 0.0


def friction(sim):
    """Largest friction angle (degrees) while the block is driven along."""
    until(sim, 0.2)
    forces = np.array(until(sim, 0.5, lambda: sim.ledger.area @ sim.joints.traction))
    return np.degrees(np.arctan(np.abs(forces[:, 1]) / forces[:, 0])).max()


@pytest.mark.slow
def test_a_block_put_down_elsewhere_slides_at_the_friction_of_its_asperities():
    """Never lifted: the peak of the law alone. Lifted: atan 0.4 = 21.8 degrees, bit for bit so
    after a saved state. Half a degree for the weight that the rising block's inertia takes."""
    stays, lifted = Simulation(SCENE), Simulation(SCENE)
    at_rest = lifted.blocks.motion[1, 1]
    put(lifted, 0.0, 0.2)
    steps(lifted, 2)
    assert lifted.joints.n == 0
    put(lifted, 1.0, at_rest + 1e-4 - lifted.blocks.motion[1, 1])
    steps(lifted, 40)
    assert lifted.joints.delta[:, 0] == pytest.approx(0.0, abs=2e-3)  # closure from first touch
    again = Simulation(SCENE, saved=lifted.state())
    law, stress = SCENE.laws["rock"], 2600 * 9.81
    peak = jl.direct_shear(law.joint(), to=[2e-3], normal=stress, steps=200).peak_friction_angle
    assert friction(stays) == pytest.approx(peak, abs=0.5)
    assert peak > 30
    slides = friction(lifted)
    assert slides == pytest.approx(np.degrees(np.arctan(0.4)), abs=0.5)
    assert friction(again) == slides


def test_a_contact_that_is_pressed_when_found_starts_with_nothing():
    """Its closure would be energy that no one put in: the depth of 0.1 mm becomes its offset."""
    sim = Simulation(SCENE)
    at_rest = sim.blocks.motion[1, 1]
    put(sim, 0.0, 0.2)
    steps(sim, 2)
    assert sim.joints.n == 0
    put(sim, 0.0, at_rest - 1e-4 - sim.blocks.motion[1, 1])
    sim.step()
    assert sim.contacts.closure.min() > 0.9e-4
    assert sim.tracker.closure.max() < 1e-6
    assert sim.ledger.value["stored"] == pytest.approx(0.0, abs=1e-6 * sim.ledger.value["turned"])


def test_a_sliver_rules_neither_the_search_nor_the_corners_of_the_others():
    """Blocks 1 m wide and a sliver of 0.05 m: what follows from the width of the usual block."""
    wide = [block(f"{i}", box=[1.0, 1.0], at=[2 * i, 0.5]) for i in range(4)]
    sliver = block("sliver", box=[0.05, 2.0], at=[9.0, 1.0])
    law = f"[laws.a]\n{PLAIN}"
    scene = parse("\n".join([law, *wide, sliver, "[run]\nend = 1.0"]))
    assert scene.skins == pytest.approx([0.02] * 4 + [0.005])
    assert scene.run.corner_length == pytest.approx(0.07)
    given = parse("\n".join([law, *wide, sliver, "[run]\nend = 1.0\nskin = 0.01"]))
    assert given.skins == pytest.approx([0.01] * 5)
