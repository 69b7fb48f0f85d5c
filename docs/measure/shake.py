"""The scene `shake` against Newmark's sliding block: slip in mm per cycle.

The base of the scene is shaken by sines of several sizes: the largest acceleration over that at
which Newmark's block begins to slide. His block (1965) is rigid and has the friction that the law
has at the present normal stress after the slip so far; before the peak that of the peak. Slips are
means over the last five of ten full cycles.
"""

from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import brentq
from tables import asked, table

import dem_demo
import jointlaw as jl
from dem_demo.scene.read import SCENES

asked(__doc__)

BASE, SLAB = 0, 1
DIP, FREQUENCY, LOAD = np.radians(20.0), 4.0, 2600 * 0.6  # rad, 1/s, kg/m2: of the scene
GRAVITY = 9.81  # m/s2
NAMES = "balanced", "fine", "reference"
SIZES = 0.5, 0.9, 1.2, 1.5, 2.0
CYCLES, LAST = 10, 5
STRESSES = LOAD * GRAVITY * np.cos(DIP) * np.linspace(0.6, 1.4, 5)  # Pa, around that at rest


def scene(acceleration, name):
    """The scene with a sine of this size (m/s2) and this resolution."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    changed = text.replace("acceleration = 5.0", f"acceleration = {float(acceleration)}")
    if changed == text:
        raise ValueError("shake.toml has changed: it no longer holds acceleration = 5.0")
    given = dem_demo.parse(changed)
    return replace(given, laws={"joint": replace(given.laws["joint"], resolution=name)})


def friction(law):
    """Friction of the law alone: a function of points of normal stress (Pa) and slip (m)."""
    curves, slips = [], np.linspace(0.0, 10.0, 401) * law.mating_length
    for stress in STRESSES:
        record = jl.direct_shear(law.joint(), to=[slips[-1]], normal=stress, steps=400)
        ratio = record.F2[-401:] / record.F1[-401:]
        curves.append(np.maximum.accumulate(ratio[::-1])[::-1])
    return RegularGridInterpolator((STRESSES, slips), np.array(curves))


def gain(a, slid, mu):
    """Acceleration (m/s2) of Newmark's block down the joint, for one of the base (m/s2)."""
    normal = GRAVITY * np.cos(DIP) + a * np.sin(DIP)
    mu_now = mu(np.stack(np.broadcast_arrays(LOAD * normal, np.minimum(slid, mu.grid[1][-1])), -1))
    return GRAVITY * np.sin(DIP) - a * np.cos(DIP) - mu_now * normal


def newmark(given, mu):
    """Times (s) and slip (m). The block never slides up the joint."""
    drive = next(drive for drive in given.drives if drive.order)
    t = np.arange(0.0, drive.times[-1], 1e-5)
    slid, more = np.zeros_like(t), np.inf
    while more > 1e-9:  # friction falls with slip: each pass slides farther, less and less so
        gained = cumulative_trapezoid(gain(drive.path(t, nu=2), slid, mu), t, initial=0.0)
        velocity = gained - np.minimum.accumulate(gained)  # what was gained since it last stuck
        before, slid = slid, cumulative_trapezoid(velocity, t, initial=0.0)
        more = np.max(np.abs(slid - before))
    return t, slid


def slip(given):
    """Times (s) and slip (m) of the slab, at every step while the base is shaken."""
    sim, rows = dem_demo.Simulation(given), []
    while sim.time < (CYCLES + 1) / FREQUENCY:
        sim.step()
        rows.append([sim.time, sim.shear_displacement(SLAB, BASE)])
    return np.transpose(rows)


def per_cycle(t, slid):
    """Mean slip (mm) in the last of the full cycles."""
    ends = np.array([CYCLES + 1 - LAST, CYCLES + 1]) / FREQUENCY
    return f"{1e3 * np.diff(np.interp(ends, t, slid))[0] / LAST:.3g}"


mu = friction(scene(1.0, "reference").laws["joint"])
yields_at = brentq(lambda a: gain(-a, 0.0, mu).item(), 0.0, 0.4 * GRAVITY)
rows = []
for size in SIZES:
    scenes = [scene(size * yields_at, name) for name in NAMES]
    found = [*map(slip, scenes), newmark(scenes[0], mu)]
    rows.append([f"{size:g}", *(per_cycle(*one) for one in found)])
print(table(["size", *NAMES, "Newmark"], rows))
