"""Motion of blocks in space: sliding, free flight and spin, saved states, blocks that tip."""

import numpy as np
import pytest
from scene_text import block, coulomb, lines

from dem_demo.scene import SceneError
from dem_demo.space import SpaceSimulation, parse

FRICTION = 0.6  # carries a block up to 30.964 degrees
GRAVITY = 9.81


def inclined(degrees, azimuth=0.0):
    """Gravity (m/s2) in the frame of an incline that dips towards an azimuth (rad) from x."""
    dip = np.radians(degrees)
    down = np.sin(dip) * np.array([np.cos(azimuth), np.sin(azimuth)])
    return GRAVITY * np.array([*down, -np.cos(dip)])


def block_on_bed(gravity, law, end, size=(1.0, 1.0, 0.2), bed=None, run="", at=None):
    """A block on a fixed bed whose top is z = 0."""
    text = lines(gravity=gravity) + f"[laws.rock]\n{law}"
    for number, (low, high) in enumerate(bed or [(-4.0, 8.0)]):
        middle = [0.5 * (low + high), 0.0, -0.5]
        text += block(f"bed {number}", box=[high - low, 8.0, 1.0], at=middle, fixed=True)
    text += block("block", box=size, at=at or [0.0, 0.0, 0.5 * size[2]])
    return f"{text}[run]\nend = {end}\n{run}"


def run_to(sim, end):
    """Advance a simulation to a time (s)."""
    while sim.time < end - 0.5 * sim.dt:
        sim.step()


@pytest.mark.parametrize("azimuth", [0.0, 0.9])
@pytest.mark.parametrize(
    ("degrees", "end", "tolerance"),
    [(30.96, 0.3, 0.0), (30.97, 1.0, 3e-3), (32.0, 0.4, 1e-4), (45.0, 0.3, 1e-4)],
)
def test_coulomb_block_on_an_incline(degrees, azimuth, end, tolerance):
    """A block stands up to atan(0.6) = 30.964 degrees; beyond it slides down the dip line by
    g (sin - 0.6 cos) t^2/2, while its contact is renewed every millimetre."""
    sim = SpaceSimulation(parse(block_on_bed(inclined(degrees, azimuth), coulomb(FRICTION), end)))
    start = sim.blocks.motion[:3, -1].copy()
    run_to(sim, end)
    path = sim.blocks.motion[:3, -1] - start
    dip = np.radians(degrees)
    slope = max(np.sin(dip) - FRICTION * np.cos(dip), 0.0)
    expected = 0.5 * GRAVITY * slope * sim.time**2
    down = np.array([np.cos(azimuth), np.sin(azimuth)])
    assert path[:2] @ down == pytest.approx(expected, rel=tolerance, abs=1e-9)
    assert path[:2] @ [-down[1], down[0]] == pytest.approx(0.0, abs=1e-6 * expected + 1e-12)
    assert abs(sim.energy_balance.error) < 1e-5


def rotor(spin, end=1.0, step=1e-3):
    """A free block of three different moments of inertia far above a fixed one, without gravity."""
    text = lines(gravity=[0.0, 0.0, 0.0]) + f"[laws.rock]\n{coulomb()}"
    text += block("base", box=[1, 1, 1], fixed=True)
    text += block("rotor", box=[1.0, 0.8, 0.3], at=[0, 0, 50], velocity=[0.3, -0.2, 0.1], spin=spin)
    return SpaceSimulation(parse(f"{text}[run]\nend = {end}\nstep = {step}\nskin = 0.5\n"))


def test_free_flight_with_spin():
    """A block thrown with a spin about a principal axis: a parabola, and a steady rotation."""
    text = f"[laws.rock]\n{coulomb()}" + block("base", box=[1, 1, 1], fixed=True)
    text += block(
        "stone", box=[1.0, 0.8, 0.3], at=[0, 0, 50], velocity=[2.0, -1.0, 3.0], spin=[0, 0, 1.5]
    )
    sim = SpaceSimulation(parse(f"{text}[run]\nend = 1.0\nstep = 1e-3\nskin = 0.1\n"))
    run_to(sim, 1.0)
    t = sim.time
    assert sim.blocks.motion[:3, 1] == pytest.approx(
        [2.0 * t, -t, 50 + 3 * t - 0.5 * GRAVITY * t**2], rel=1e-12
    )
    turned = sim.blocks.axes[1] @ sim.initial_axes[1].T
    angle = 1.5 * t
    cosine, sine = np.cos(angle), np.sin(angle)
    assert turned == pytest.approx(np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))
    assert abs(sim.energy_balance.error) < 1e-12


def test_saved_state_continues_bit_for_bit(tmp_path):
    """A run that is saved while its contact is renewed ends as an uninterrupted run."""
    text = block_on_bed(inclined(38.0, 0.4), coulomb(FRICTION), 0.1)
    whole = SpaceSimulation(parse(text))
    first = SpaceSimulation(parse(text))
    run_to(whole, 0.06)
    run_to(first, 0.03)
    first.save(tmp_path)
    second = SpaceSimulation.load(tmp_path)
    run_to(second, 0.06)
    one, other = whole.state(), second.state()
    assert one.keys() == other.keys()
    for name, value in one.items():
        assert np.array_equal(value, other[name]), name


def test_block_that_tips_stops_the_run():
    """Contacts of edges are not there: a run says so instead of losing the block in its bed."""
    tall = block_on_bed(inclined(30.0), coulomb(0.9), 2.0, size=(0.5, 1.0, 2.0))
    sim = SpaceSimulation(parse(tall))
    with pytest.raises(SceneError, match="'bed 0' and 'block' touch along an edge"):
        run_to(sim, 2.0)
    corners = sim.blocks.surfaces
    sim.blocks.place()
    assert corners.box[1, 0, 2] > -2e-3
