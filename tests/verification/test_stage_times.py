"""Excavation stages and water tables begin exactly at their times: the time step that contains such
a time is divided there, in the plane and in space, and nothing else changes."""

import numpy as np
import pytest
from running import until
from scene_text import block, coulomb, lines

from dem_demo import Simulation, parse
from dem_demo.output.run import run
from dem_demo.space.read import parse as parse_in_space
from dem_demo.space.simulation import SpaceSimulation

START = 0.0123456
RELEASE = 0.02
WEIGHT = 2600.0 * 9.81  # N, of a cube of 1 m
STEP = 1.3e-4  # s: its multiples meet none of these times


def traced(kind):
    """A class of simulations that keep the times at which their steps, and parts of them, end."""

    class Traced(kind):
        def _advance(self):
            super()._advance()
            if not hasattr(self, "ends"):
                self.ends = []
            self.ends.append(self.time)

    return Traced


def tower(in_space, start=START, more="", step=STEP):
    """A cube that carries another one; the lower one is excavated, so the upper one falls."""
    size = (lambda x, y: [x, x, y]) if in_space else (lambda x, y: [x, y])
    place = (lambda y: [0.0, 0.0, y]) if in_space else (lambda y: [0.0, y])
    text = f"[laws.rock]\n{coulomb()}"
    text += block("base", box=size(4.0, 1.0), at=place(-0.5), fixed=True)
    text += block("low", box=size(1.0, 1.0), at=place(0.5))
    text += block("high", box=size(1.0, 1.0), at=place(1.5))
    text += "[[excavate]]\n" + lines(start=start, release_time=RELEASE)
    if in_space:
        text += lines(box=[1.2, 1.2, 1.0], at=[0.0, 0.0, 0.5])
    else:
        text += lines(corners=[[-0.6, 0.0], [0.6, 0.0], [0.6, 1.0], [-0.6, 1.0]])
    text += more + f"[run]\nend = 0.2\nstep = {step}\nrecord = 0.0013\n"
    if in_space:
        return traced(SpaceSimulation)(parse_in_space(text))
    return traced(Simulation)(parse(text))


def nearest(sim, time):
    """Distance (s) of a time from the nearest end of a step or of a part of one."""
    return np.abs(np.array(sim.ends) - time).min()


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize("start", [START, 10 * STEP, 10.00005 * STEP, 9.99995 * STEP, 1e-9])
def test_a_stage_begins_at_its_time(in_space, start):
    """The blocks are removed at the time, in a step that ends there, and the support is the weight
    times the rest of the release time, at the end of each step."""
    sim = tower(in_space, start)
    vertical = 2 if in_space else 1
    supports = []
    until(sim, start + RELEASE + STEP, lambda: supports.append(sim.blocks.support[2, vertical]))
    assert nearest(sim, start) <= 1e-15
    assert sim.stage_start_times[0] == start
    assert (
        abs(sim.time / STEP - round(sim.time / STEP)) < 1e-4
    )  # the other steps end where they did
    for i, support in enumerate(supports):
        since = (i + 1) * STEP - start
        if abs(since) > 1e-3 * STEP:  # otherwise either side of the removal
            share = max(RELEASE - since, 0.0) / RELEASE if since > 0 else 0.0
            assert support == pytest.approx(WEIGHT * share, abs=1e-6 * WEIGHT)


@pytest.mark.parametrize("in_space", [False, True])
def test_the_fall_follows_from_the_time_of_the_stage(in_space):
    """The support ends linearly within the release time, so a block falls by
    g (r^2/6 + r s/2 + s^2/2) at s after it. A stage that begins a step late misses a step at the
    speed of the fall."""
    sim = tower(in_space, step=2.6e-4)
    axis = 2 if in_space else 1
    until(sim, START + 0.1)
    after = sim.time - START - RELEASE
    fall = sim.initial[axis, 2] - sim.blocks.motion[axis, 2]
    expected = 9.81 * (RELEASE**2 / 6 + RELEASE * after / 2 + after**2 / 2)
    assert fall == pytest.approx(expected, abs=1e-6)  # a step at this speed: 2e-4 m
    assert abs(sim.energy_balance.error) < 1e-7


WATER = "[water]\ntable = [[-9.0, 1.0], [9.0, 1.0]]\n" + "".join(
    "[[water.at]]\n" + lines(time=time, table=[[-9.0, level], [9.0, level]])
    for time, level in ((0.0051, 1.2), (0.0123457, 1.7), (0.01239, 1.1))
)


def test_water_tables_are_reached_at_their_times():
    """Also two of them, and a stage, within one step."""
    sim = tower(in_space=False, more=WATER)
    seen = []
    apply = sim._apply_loads

    def apply_and_note(*arguments):
        seen.append(sim.water_time)
        return apply(*arguments)

    sim._apply_loads = apply_and_note
    until(sim, 0.0125)
    for time, _ in sim.scene.water_changes:
        assert nearest(sim, time) <= 1e-15
        assert np.abs(np.array(seen) - time).min() <= 1e-15
    assert nearest(sim, START) <= 1e-15
    assert sim.water_time == sim.scene.water_changes[-1][0]
    loads = sim.blocks.loads - sim.blocks.support
    still = Simulation(parse(sim.scene.text), saved=sim.state())
    still.water_time = np.inf
    still._apply_loads()
    assert np.array_equal(loads, still.blocks.loads - still.blocks.support)


DRIVE = "[[drive]]\n" + lines(
    block="base", motion="x", times=[0.0, 0.01, 0.02], values=[0.0, 2e-4, 0.0], ramp=5e-3
)


def flying(in_space, gravity=-9.81):
    """A base that a drive accelerates, a rotating block that falls, water below both that only
    makes an event."""
    size = [1.0, 2.0, 3.0] if in_space else [1.0, 2.0]
    motion = {"velocity": [1.0, 0.5, 0.2], "spin": [3.0, 4.0, 5.0]}
    if not in_space:
        motion = {"velocity": [1.0, 0.5], "spin": 3.0}
    text = lines(gravity=[0.0] * (len(size) - 1) + [gravity]) + f"[laws.rock]\n{coulomb()}"
    text += block("base", box=size, at=[-5.0] + [0.0] * (len(size) - 1), fixed=True)
    text += block("free", box=size, at=[5.0] + [0.0] * (len(size) - 1), **motion)
    corners = [[-9, -9, -90], [9, -9, -90], [0, 9, -90]] if in_space else [[-9, -90], [9, -90]]
    table = lines(table=corners)
    text += DRIVE + f"[water]\n{table}[[water.at]]\ntime = {START}\n{table}"
    text += f"[run]\nend = 0.1\nstep = {STEP}\nsettle = false\n"
    if in_space:
        return traced(SpaceSimulation)(parse_in_space(text))
    return traced(Simulation)(parse(text))


@pytest.mark.parametrize("in_space", [False, True])
def test_a_divided_step_keeps_paths_and_energies(in_space):
    """While a drive accelerates a block: driven blocks stay on their paths, free blocks move as
    without the division, and the sum of the energies stays to rounding."""
    sim = flying(in_space)
    path = sim.scene.drives[-1]
    assert path(START) != pytest.approx(path(START - STEP), abs=1e-7)
    for end in (START, 0.03):
        until(sim, end)
        assert sim.blocks.motion[0, 0] + 5.0 == pytest.approx(path(sim.time), abs=1e-13)
        assert abs(sim.energy_balance.error) < 1e-13
    assert nearest(sim, START) <= 1e-15
    assert path(sim.time) == pytest.approx(0.0, abs=1e-15)
    fall = sim.blocks.motion[2 if in_space else 1, 1]
    speed = 0.2 if in_space else 0.5
    assert fall == pytest.approx(speed * sim.time - 0.5 * 9.81 * sim.time**2, abs=1e-9)


@pytest.mark.parametrize("in_space", [False, True])
def test_other_time_steps_keep_the_sum_of_energies(in_space):
    """Of driven, flying and rotating blocks, at each change of the time step."""
    sim = flying(in_space, gravity=0.0)
    until(sim, 3e-3)
    for share in (0.3, 1.5, 1e-4, 1.0):
        sim._change_time_step(share * STEP)
        assert abs(sim.energy_balance.error) < 1e-13
        sim.step()
        assert abs(sim.energy_balance.error) < 1e-13


@pytest.mark.parametrize("in_space", [False, True])
def test_resumed_runs_have_the_same_bits(in_space):
    more = DRIVE + ("" if in_space else WATER)
    first = tower(in_space, more=more)
    for start in (0.9 * START, START, 0.02):
        until(first, start)
        resumed = type(first)(first.scene, saved=first.state())
        states = []
        for sim in (type(first)(first.scene, saved=first.state()), resumed):
            until(sim, start + 0.002)
            states.append(sim.state())
        until(first, start + 0.002)
        states.append(first.state())
        for name, value in states[0].items():
            for other in states[1:]:
                assert value.tobytes() == other[name].tobytes(), name


@pytest.mark.parametrize("in_space", [False, True])
def test_frames_stay_at_their_times(in_space):
    """Times of records are multiples of their interval, as without a stage."""
    sim = tower(in_space)
    record, summary = run(sim, until=0.026)
    assert record.times == pytest.approx(np.arange(21) * 0.0013, abs=1e-14)
    assert summary["stage_start_s"] == [START]
    assert record.steps == 200


@pytest.mark.parametrize("in_space", [False, True])
def test_a_time_step_that_is_halved_in_a_divided_step(in_space):
    """The stage still begins at its time, and half of the time step is kept."""
    sim = tower(in_space)
    until(sim, START - STEP)
    dt = sim.dt
    sim.halvings_left = 1
    update = sim._move_blocks

    def move_and_halve():
        if sim.dt < 0.999 * dt and sim.halvings_left:
            sim._halve_time_step()
        update()

    sim._move_blocks = move_and_halve
    until(sim, START + 2 * STEP)
    assert sim.dt == 0.5 * dt
    assert sim.halvings_left == 0
    assert nearest(sim, START) <= 1e-15
    assert sim.stage_start_times[0] == START
