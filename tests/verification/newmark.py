"""The scene `shake`, and Newmark's rigid sliding block with the steady friction of a law (1965)."""

from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

import dem_demo
import jointlaw as jl
from dem_demo.scene.read import SCENES

BASE, SLAB = 0, 1
DIP, FREQUENCY, LOAD = np.radians(20.0), 4.0, 2600 * 0.6  # rad, 1/s, kg/m2: of the scene
GRAVITY = 9.81  # m/s2
CYCLES, LAST = 10, 5
GRID = 1e-5  # s, of the quadrature


def scene(acceleration, cycles=CYCLES, **law):
    """The scene with a sine of this size (m/s2), and changes of its law such as the resolution."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    text = text.replace("acceleration = 5.0", f"acceleration = {float(acceleration)}")
    given = dem_demo.parse(text.replace("cycles = 10", f"cycles = {cycles}"))
    return replace(given, laws={"joint": replace(given.laws["joint"], **law)})


def sine(given):
    """The drive of a scene that shakes."""
    return next(drive for drive in given.drives if drive.order)


def friction(law, stress):
    """Steady friction F2/F1 of the law alone, after ten critical slips at a normal stress (Pa)."""
    record = jl.direct_shear(law.joint(), to=[10 * law.critical_slip], normal=stress, steps=400)
    return float(record.F2[-1] / record.F1[-1])


class Newmark:
    """A rigid block on a joint that dips to the right, its base shaken along x.

    stresses (Pa) and the friction there: between them straight lines.
    """

    def __init__(self, stresses, friction):
        self.stresses, self.friction = np.array(stresses), np.array(friction)

    @classmethod
    def of(cls, law):
        """With the friction of a law, at stresses around that under the slab at rest."""
        stresses = LOAD * GRAVITY * np.cos(DIP) * np.linspace(0.6, 1.4, 5)
        return cls(stresses, [friction(law, stress) for stress in stresses])

    def gain(self, a):
        """Acceleration (m/s2) down the joint while it slides, for one of the base (m/s2)."""
        normal = GRAVITY * np.cos(DIP) + a * np.sin(DIP)
        mu = np.interp(LOAD * normal, self.stresses, self.friction)
        return GRAVITY * np.sin(DIP) - a * np.cos(DIP) - mu * normal

    def yields_at(self):
        """Acceleration (m/s2) of the base, against the dip, at which it begins to slide."""
        return float(brentq(lambda a: self.gain(-a), 0.0, GRAVITY))

    def slip(self, drive):
        """Times (s) and slip (m). It never slides up the joint."""
        t = np.arange(0.0, drive.times[-1], GRID)
        gained = cumulative_trapezoid(self.gain(drive.path(t, nu=2)), t, initial=0.0)
        velocity = gained - np.minimum.accumulate(gained)  # what was gained since it last stuck
        return t, cumulative_trapezoid(velocity, t, initial=0.0)


def slip(given):
    """Times (s) and slip (m) of the slab, at every step while the base is shaken."""
    sim, t, slid = dem_demo.Simulation(given), [], []
    while sim.time < sine(given).times[-1]:
        sim.step()
        t.append(sim.time)
        slid.append(sim.now.slid(sim.joints, SLAB, BASE))
    return np.array(t), np.array(slid)


def per_cycle(t, slid, cycles=CYCLES, last=LAST):
    """Mean slip (m) in the last of the full cycles."""
    ends = np.array([cycles + 1 - last, cycles + 1]) / FREQUENCY
    return float(np.diff(np.interp(ends, t, slid))[0] / last)
