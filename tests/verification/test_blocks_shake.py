"""Shaken scenes with plain friction slip as Newmark's sliding block (1965)."""

from dataclasses import replace

import numpy as np
import pytest
from running import until
from scipy.integrate import cumulative_trapezoid

import jointlaw as jl
from dem_demo import Simulation, load, parse
from dem_demo.output.record import Record
from dem_demo.scene.read import SCENES

pytestmark = pytest.mark.slow
FREQUENCY, MU, G, CYCLES = 4.0, 0.6, 9.81, 5  # 1/s; m/s2


def scene(acceleration):
    """The scene with a sine of this size (m/s2), and plain friction."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    text = text.replace("acceleration = 5.0", f"acceleration = {float(acceleration)}")
    given = parse(text.replace("cycles = 10", f"cycles = {CYCLES}"))
    return replace(given, laws={"joint": jl.CoulombLaw(2e8, 1.6e8, MU, plane=0.0)})


def newmark(given, dip, end):
    """Times (s) up to the end, and the slip (m) of Newmark's block on the driven base by
    quadrature: it is rigid and never slides up."""
    (drive,) = (drive for drive in given.drives if drive.order)
    t = np.arange(0.0, end, 1e-5)
    shaken = drive.path(np.minimum(t, drive.times[-1]), nu=2) * (t < drive.times[-1])
    presses = G * np.cos(dip) + shaken * np.sin(dip)
    gained = G * np.sin(dip) - shaken * np.cos(dip) - MU * presses
    velocity = cumulative_trapezoid(gained, t, initial=0.0)
    velocity -= np.minimum.accumulate(velocity)  # what was gained since it last stuck
    return t, cumulative_trapezoid(velocity, t, initial=0.0)


def per_cycle(t, slid):
    """Mean slip (m) in the last two full cycles."""
    ends = np.array([CYCLES - 1, CYCLES + 1]) / FREQUENCY
    return float(np.diff(np.interp(ends, t, slid))[0] / 2)


def test_plain_friction_slides_as_newmark_says():
    """Springs of 2e8 Pa/m: they come back by less than 1e-4 m, the same in every cycle."""
    given, end = scene(3.0), (CYCLES + 1) / FREQUENCY
    sim = Simulation(given)
    rows = until(sim, end, lambda: (sim.time, sim.slid(1, 0)))
    expected = per_cycle(*newmark(given, np.radians(20.0), end))
    assert per_cycle(*np.transpose(rows)) == pytest.approx(expected, rel=2e-3)


def test_a_slope_of_blocks_slides_as_newmark_says():
    """Nine blocks in two beds; that beds also slip on each other is not in Newmark's: 15 %. The
    mean of the blocks, down the slope."""
    given, dip = load("shaken-slope-plain"), np.radians(25.0)
    sim = Simulation(given)
    record = Record(sim)
    until(sim, given.run.end)
    record.take(sim)
    moved = (record.displaced(-1) - record.displaced(0))[given.rocks[0].free]
    slid = (moved @ [np.cos(dip), -np.sin(dip)]).mean()
    expected = newmark(given, dip, sim.time)[1][-1]
    assert expected > 0.05
    assert slid == pytest.approx(expected, rel=0.15)
