"""Slip of the scene `shaken-slope` with the joint law, with Coulomb's law of the same strength and
with the friction of the asperities alone, and of Newmark's sliding block (1965):
`python docs/draw/shaken_slope.py FOLDER` writes FOLDER/shaken-slope.png and prints the slips."""

import numpy as np
from command_line import output_folder
from matplotlib.figure import Figure
from scipy.integrate import cumulative_trapezoid

import dem_demo
from dem_demo.studies.compare import with_coulomb_laws
from jointlaw.support.pyplot import style, written

DIP = np.radians(25.0)  # of the scene
GRAVITY = 9.81  # m/s2
FRICTION = 0.6  # of Newmark's block and of the scene with Coulomb


@style()
def main(folder):
    """Run the scenes and draw their slip beside the slip of Newmark's block."""
    figure = Figure(figsize=(7, 4.5))
    axes = figure.subplots()
    scene = dem_demo.load("shaken-slope")
    record, _ = dem_demo.run(dem_demo.Simulation(scene))
    equal_strength, _ = with_coulomb_laws(scene, record)
    plain = dem_demo.load("shaken-slope-plain")
    draw_slip(axes, record, "blocks, joint law", "-")
    for other, label, line in (
        (equal_strength, "blocks, Coulomb of the same strength", "--"),
        (plain, "blocks, Coulomb 0.6", "-."),
    ):
        record, _ = dem_demo.run(dem_demo.Simulation(other))
        draw_slip(axes, record, label, line)
    drive = next(drive for drive in record.scene.drives if drive.order)
    times, slip = newmark_slip(drive, record.times[-1])
    print(f"Newmark: {1e3 * slip[-1]:.3g} mm")
    axes.plot(times, 1e3 * slip, "k:", label="Newmark's block, 0.6")
    axes.set(xlabel="time (s)", ylabel="slip relative to the rock below (mm)")
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_yticks([0, 1, 10, 100], ["0", "1", "10", "100"])
    axes.set_ylim(bottom=-0.2)
    figure.legend(loc="outside lower center", ncols=2)
    written(figure, folder / "shaken-slope.png")


def draw_slip(axes, record, label, line):
    """Draw and print the mean slip of a run."""
    slip = mean_slip(record)
    axes.plot(record.times, 1e3 * slip, line, label=label)
    print(f"{label}: {1e3 * slip[-1]:.3g} mm")


def mean_slip(record):
    """Mean slip (m) of the free blocks down the slope, at each record."""
    free_blocks = record.scene.rocks[0].free
    displacements = [
        record.displacements(i)[free_blocks].mean(axis=0) for i in range(len(record.times))
    ]
    downslope = np.array([np.cos(DIP), -np.sin(DIP)])
    return (np.array(displacements) - displacements[0]) @ downslope


def newmark_slip(drive, until):
    """Times (s) and slip (m) of a rigid block with a constant friction."""
    times = np.arange(0.0, until, 1e-4)
    acceleration = drive.path(np.minimum(times, drive.times[-1]), nu=2) * (times < drive.times[-1])
    driving = GRAVITY * np.sin(DIP) - acceleration * np.cos(DIP)
    normal = GRAVITY * np.cos(DIP) + acceleration * np.sin(DIP)
    velocity = cumulative_trapezoid(driving - FRICTION * normal, times, initial=0.0)
    velocity -= np.minimum.accumulate(velocity)  # the block sticks where this is zero
    return times, cumulative_trapezoid(velocity, times, initial=0.0)


if __name__ == "__main__":
    main(output_folder(__doc__))
