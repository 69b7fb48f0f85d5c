"""The scene `shake`: slip per cycle against Newmark's sliding block (1965), and none below yield.

Newmark's block is rigid and has the steady friction of the law at the present normal stress.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

import jointlaw as jl
from dem_demo import Simulation, coulomb_law, parse
from dem_demo.scene.read import SCENES

pytestmark = pytest.mark.slow
DIP, FREQUENCY, LOAD = np.radians(20.0), 4.0, 2600 * 0.6  # rad, 1/s, kg/m2: of the scene
G, CYCLES = 9.81, 5


def scene(acceleration, **law):
    """The scene with a sine of this size (m/s2), and changes of its law."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    text = text.replace("acceleration = 5.0", f"acceleration = {float(acceleration)}")
    given = parse(text.replace("cycles = 10", f"cycles = {CYCLES}"))
    return replace(given, laws={"joint": replace(given.laws["joint"], **law)})


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


def gain(a, friction):
    """Acceleration (m/s2) down the joint while the block slides, for one of the base (m/s2)."""
    normal = G * np.cos(DIP) + a * np.sin(DIP)
    return G * np.sin(DIP) - a * np.cos(DIP) - friction(LOAD * normal) * normal


def predicted(given, friction):
    """Newmark's slip per cycle (m) by quadrature; friction: of a normal stress (Pa)."""
    (drive,) = (drive for drive in given.drives if drive.order)
    t = np.arange(0.0, (CYCLES + 1) / FREQUENCY, 1e-5)
    gained = cumulative_trapezoid(gain(drive.path(t, nu=2), friction), t, initial=0.0)
    velocity = gained - np.minimum.accumulate(gained)  # what was gained since it last stuck
    return per_cycle(t, cumulative_trapezoid(velocity, t, initial=0.0))


@pytest.fixture(scope="module")
def friction():
    """Steady friction of the scene's law, by straight lines between five normal stresses."""
    law, stresses = scene(1.0).laws["joint"], LOAD * G * np.cos(DIP) * np.linspace(0.6, 1.4, 5)
    found = []
    for stress in stresses:
        slide = 10 * law.critical_slip
        test = jl.direct_shear(law.joint(), to=[slide], normal=stress, steps=400)
        found.append(test.F2[-1] / test.F1[-1])
    return lambda stress: np.interp(stress, stresses, found)


def yields_at(friction):
    return brentq(lambda a: gain(-a, friction), 0.0, G)


def test_plain_friction_slides_as_newmark_says():
    """Springs of 2e8 Pa/m: they come back by less than 1e-4 m, the same in every cycle."""
    given = replace(scene(3.0), laws={"joint": coulomb_law(2e8, 1.6e8, 0.6)})
    assert yields_at(lambda _: 0.6) == pytest.approx(G * np.tan(np.arctan(0.6) - DIP))
    assert measured(given) == pytest.approx(predicted(given, lambda _: 0.6), rel=2e-3)


def test_joint_slides_as_newmark_says(friction):
    """Its critical slip, over which friction follows the stress, is 7 % of the slip per cycle."""
    given = scene(1.5 * yields_at(friction))
    assert measured(given) == pytest.approx(predicted(given, friction), rel=0.1)


def test_no_creep_below_yield(friction):
    """Coarse cells forget shear as the normal stress goes up and down, and the slab makes up."""
    above = predicted(scene(1.5 * yields_at(friction)), friction)
    given = scene(0.5 * yields_at(friction), resolution="balanced")
    assert predicted(given, friction) == 0.0
    assert abs(measured(given)) < 1e-5 * above
