"""Corners on edges: energy of rocking and tumbling blocks, continuity, one joint all along."""

import collections

import numpy as np
import pytest
from running import contact_forces
from scene_text import ROCK, coulomb, on_base

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
    tilts, total, potential, pressed, had = [], [], [], [], collections.Counter()
    (held,) = sim.joints.held
    take = held.take

    def counted(m):
        places = take(m)
        had.update(places.tolist())
        return places

    held.take = counted
    while sim.time < end:
        sim.step()
        tilts.append(tilt - np.degrees(sim.blocks.motion[2, 1]))
        total.append(sim.ledger.total - sim.ledger.start)
        potential.append(sim.ledger.value["potential"])
        places = sim.joints.place[sim.joints.traction[:, 0] > 0].tolist()
        pressed.append({(place, had[place]) for place in places})
    return np.array(tilts), np.array(total), np.ptp(potential), pressed


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
    tilts, total, in_play, pressed = play(sim, 20.0, 0.72)
    landing = int((tilts > 88.0).argmax())
    assert landing < len(tilts) - 400
    assert np.abs(total[:landing]).max() < 1e-4 * in_play
    assert np.abs(total).max() < within * in_play
    # One and the same joint on the corner from one side to the next, and in the landing.
    stood = set().union(*pressed[:landing])
    assert len(stood) == 1
    assert stood <= set().union(*pressed[landing:])


def held(law, at, angle, more=""):
    """A block 1 m square to be put where one likes, and what it stores and feels there."""
    sim = Simulation(scene(law, 1.0, 1.0, at, "step = 1e-6\nmax_overlap = 0.2", angle=angle))

    def place(x, y, tilt):
        motion, tracker = sim.blocks.motion, sim.tracker
        motion[:3, 1] = x, y, np.radians(tilt - angle)
        tracker.follow(motion)
        before = tracker.renew(motion, np.array([[0, 1]]))
        if before is not None:
            sim.joints.rearrange(before, tracker.law, tracker.keys)
        sim.joints.update(sim.contacts.closure, np.zeros(sim.joints.n))
        sim.ledger.area = sim.contacts.length * sim.scene.thickness
        return sim.ledger.area @ sim.joints.stored, contact_forces(sim)[1]

    return place


def standing(tilt, depth=1e-3):
    """Centre of the block when its lower right corner is `depth` below (0, 0)."""
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    return -0.5 * c - 0.5 * s, 0.5 * c - 0.5 * s - depth


def sweep(law, low, high, n, where):
    """Energy (n + 1,) and force (n + 1, 3) along a path of n steps."""
    path = np.linspace(low, high, n + 1)
    place = held(law, where(low)[:2], where(low)[2])
    energy, force = zip(*(place(*where(s)) for s in path), strict=True)
    return path, np.array(energy), np.array(force)


@pytest.mark.slow
@pytest.mark.parametrize("law", [ELASTIC, JOINT], ids=["elastic", "joint"])
def test_force_and_energy_are_continuous_in_tilt(law):
    """From 1 to 7 degrees about a corner held at a depth: the largest differences between
    neighbours halve with the step, and the moment is minus the derivative of the energy."""
    where = lambda tilt: (*standing(-tilt), -tilt)  # noqa: E731
    largest = []
    for n in (100, 200, 400, 800):
        tilts, energy, force = sweep(law, 1.0, 7.0, n, where)
        largest.append([np.abs(np.diff(x)).max() for x in (energy, force[:, 1], force[:, 2])])
        assert np.abs(force[:, 0]).max() < 1e-10 * force[:, 1].max()  # nothing slides
    ratios = np.array(largest[:-1]) / np.array(largest[1:])
    assert ratios[1:] == pytest.approx(2.0, rel=0.02)
    assert energy[0] / energy[-1] == pytest.approx(5.0, rel=1e-3)  # 0.5 m of face, 0.1 of corner
    centre = np.array([where(t)[:2] for t in tilts])
    about = force[:, 2] + centre[:, 0] * force[:, 1] - (centre[:, 1] + 1e-3) * force[:, 0]
    slope = np.gradient(energy, np.radians(-tilts))[1:-1]
    assert (
        np.abs(about[1:-1] + slope).max() < 2e-3 * np.abs(slope).max()
    )  # second order in 0.13 mrad
