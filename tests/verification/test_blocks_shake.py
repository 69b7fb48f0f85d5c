"""Shaken scenes with plain friction slip as Newmark's sliding block (1965)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import jointlaw as jl
from dem_demo import Simulation, load, parse
from dem_demo.output.record import Record
from dem_demo.scene.read import SCENES

pytestmark = pytest.mark.slow
DIP, FREQUENCY, MU = np.radians(20.0), 4.0, 0.6  # rad, 1/s
SLOPE = np.radians(25.0)  # of the scene `shaken-slope`
G, CYCLES = 9.81, 5


def scene(acceleration):
    """The scene with a sine of this size (m/s2), and plain friction."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    text = text.replace("acceleration = 5.0", f"acceleration = {float(acceleration)}")
    given = parse(text.replace("cycles = 10", f"cycles = {CYCLES}"))
    return replace(given, laws={"joint": jl.CoulombLaw(2e8, 1.6e8, MU, plane=0.0)})


def per_cycle(t, slid):
    """Mean slip (m) in the last two full cycles."""
    ends = np.array([CYCLES - 1, CYCLES + 1]) / FREQUENCY
    return float(np.diff(np.interp(ends, t, slid))[0] / 2)


def measured(given):
    sim, rows = Simulation(given), []
    while sim.time < (CYCLES + 1) / FREQUENCY:
        sim.step()
        rows.append([sim.time, sim.slid(1, 0)])
    return per_cycle(*np.transpose(rows))


def gain(a, dip=DIP):
    """Acceleration (m/s2) down the joint while the block slides, for one of the base (m/s2)."""
    normal = G * np.cos(dip) + a * np.sin(dip)
    return G * np.sin(dip) - a * np.cos(dip) - MU * normal


def predicted(given):
    """Newmark's slip per cycle (m) by quadrature: it is rigid and never slides up."""
    (drive,) = (drive for drive in given.drives if drive.order)
    t = np.arange(0.0, (CYCLES + 1) / FREQUENCY, 1e-5)
    gained = cumulative_trapezoid(gain(drive.path(t, nu=2)), t, initial=0.0)
    velocity = gained - np.minimum.accumulate(gained)  # what was gained since it last stuck
    return per_cycle(t, cumulative_trapezoid(velocity, t, initial=0.0))


def test_plain_friction_slides_as_newmark_says():
    """Springs of 2e8 Pa/m: they come back by less than 1e-4 m, the same in every cycle."""
    given = scene(3.0)
    assert measured(given) == pytest.approx(predicted(given), rel=2e-3)


def slope_slips(name):
    """Times (s) and mean slips (m) of the mass of a shipped scene down the slope, of Newmark's
    block too."""
    given, rows = load(name), []
    sim = Simulation(given)
    record, rock = Record(sim), given.rocks[0].free
    start = record.displaced(0)[rock]
    while sim.time < given.run.end:
        for _ in range(50):
            sim.step()
        record.take(sim)
        moved = record.displaced(-1)[rock] - start
        rows.append([sim.time, float((moved @ [np.cos(SLOPE), -np.sin(SLOPE)]).mean())])
    times, slid = np.transpose(rows)
    (drive,) = (drive for drive in given.drives if drive.order)
    t = np.arange(0.0, times[-1], 1e-5)
    shaken = drive.path(np.minimum(t, drive.times[-1]), nu=2) * (t < drive.times[-1])
    gained = cumulative_trapezoid(gain(shaken, SLOPE), t, initial=0.0)
    velocity = gained - np.minimum.accumulate(gained)
    return times, slid, np.interp(times, t, cumulative_trapezoid(velocity, t, initial=0.0))


def test_a_slope_of_blocks_slides_as_newmark_says():
    """Nine blocks in two beds; that beds also slip on each other is not in Newmark's: 15 %."""
    _, slid, newmark = slope_slips("shaken-slope-plain")
    assert newmark[-1] > 0.05
    assert slid[-1] == pytest.approx(newmark[-1], rel=0.15)
