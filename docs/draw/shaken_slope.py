"""Picture: slip of the scene `shaken-slope` with plain Coulomb and with the joint law, and of
Newmark's sliding block (1965): `python docs/draw/shaken_slope.py FOLDER`."""

import numpy as np
from folder import asked
from matplotlib.figure import Figure
from scipy.integrate import cumulative_trapezoid

from dem_demo import Simulation, load, run
from jointlaw.support.pyplot import style, written

DIP, GRAVITY = np.radians(25.0), 9.81  # rad, m/s2: of the scene
CASES = {"shaken-slope-plain": "blocks, Coulomb 0.6", "shaken-slope": "blocks, joint law"}


def newmark(drive, until):
    """Times (s) and slip (m) of a rigid block with friction 0.6."""
    t = np.arange(0.0, until, 1e-4)
    a = drive.path(np.minimum(t, drive.times[-1]), nu=2) * (t < drive.times[-1])
    along = GRAVITY * np.sin(DIP) - a * np.cos(DIP)
    gained = along - 0.6 * (GRAVITY * np.cos(DIP) + a * np.sin(DIP))
    velocity = cumulative_trapezoid(gained, t, initial=0.0)
    velocity -= np.minimum.accumulate(velocity)
    return t, cumulative_trapezoid(velocity, t, initial=0.0)


@style()
def draw(path):
    figure = Figure(figsize=(7, 4.5))
    axes = figure.subplots()
    for name, label in CASES.items():
        record, _ = run(Simulation(load(name)))
        rock = record.scene.rocks[0].free
        slid = [record.displaced(i)[rock].mean(axis=0) for i in range(len(record.times))]
        along = (np.array(slid) - slid[0]) @ [np.cos(DIP), -np.sin(DIP)]
        axes.plot(record.times, 1e3 * along, label=label)
        print(f"{label}: {1e3 * along[-1]:.3g} mm")
    drive = next(drive for drive in record.scene.drives if drive.order)
    times, slip = newmark(drive, record.times[-1])
    print(f"Newmark: {1e3 * slip[-1]:.3g} mm")
    axes.plot(times, 1e3 * slip, "k:", label="Newmark's block, 0.6")
    axes.set(xlabel="time (s)", ylabel="slip relative to the rock below (mm)")
    figure.legend(loc="outside lower center", ncols=3)
    written(figure, path)


draw(asked(__doc__) / "shaken-slope.png")
