"""Tilt tests: the tilts at which two slabs slip, and the friction at which they slide on.

    python docs/draw/tilt.py FOLDER

Runs the scene `tilt`. Each pair of slab and table is drawn when the slab has slid by half a metre.
The friction angle is drawn where the slab slides. At 5 and 8 s the tables slow down, the slabs
stick, and for half a second their joints carry less shear stress than their friction: such records
are left out. Writes FOLDER/tilt.png.
"""

from dataclasses import replace

import numpy as np
from command_line import output_folder

import dem_demo
from dem_demo.output.pictures import FIXED_COLOUR, outlines
from jointlaw.support.pyplot import style

COLOURS = "#c95500", "#1f6fd0"
TITLES = "rough direction\ndown the slope", "rough direction\nacross the slope"
DRAWN_SLIP = 0.5  # m
MIN_SLIDING_FRACTION = 0.5  # of the joint under a sliding slab, to a slip of STICKING_SLIP
STICKING_SLIP = 1e-3  # m, past the peak: beyond it a slab sticks only when it comes to rest
# smallest growth of slip between two records of a sliding slab
MIN_RELATIVE_GROWTH = 1e-4  # of the slip
MIN_GROWTH = 1e-12  # m


def main(folder):
    """Run the scene and draw slabs and friction angles."""
    scene = dem_demo.load("tilt")
    scene = replace(scene, run=replace(scene.run, record=0.01))
    record, _ = dem_demo.run(dem_demo.Simulation(scene))
    with style() as plt:
        plt.rcParams.update({"font.size": 15, "lines.linewidth": 2.4})
        figure, (above, below) = plt.subplots(2, 1, figsize=(7.8, 8.0), height_ratios=(1, 1.5))
        for (slab, table), colour, title in zip(record.slips, COLOURS, TITLES, strict=True):
            name = scene.blocks[slab].name
            slip = np.abs(record.series(f"{name}: slip_m"))
            draw_slab(above, outlines(record, int(np.argmax(slip > DRAWN_SLIP))), slab, table,
                      colour, title)  # fmt: skip
            slides = is_sliding(record, name, slip)
            ratio = record.series(f"{name}: shear_Pa") / record.series(f"{name}: normal_Pa")
            angle = np.degrees(np.arctan(np.abs(ratio)))
            below.semilogx(1e3 * slip[slides], angle[slides], color=colour)
            slip_angle = record.slips[slab, table]["slip_angle"]
            below.text(2.2, slip_angle, f"slips at a tilt of {slip_angle:.2f}°", color=colour,
                       weight="bold", va="center")  # fmt: skip
        basic_friction = np.degrees(np.arctan(scene.laws["along"].asperity.mu))
        below.axhline(basic_friction, color="0.4", ls=":")
        below.text(0.1, basic_friction - 0.4,
                   f"slides on at $φ_b$ = {basic_friction:.1f}°, friction of flat rock",
                   va="top")  # fmt: skip
        above.set(aspect="equal", ylim=(-4.2, 5.2))
        above.axis("off")
        below.set(xlabel="slip (mm)", ylabel="friction angle (°)", xlim=(0.01, 9e3), ylim=(18, 37))
        below.grid(alpha=0.3)
        figure.savefig(folder / "tilt.png", dpi=100)


def draw_slab(axes, shapes, slab, table, colour, title):
    """Draw the outlines of a slab and its table."""
    axes.fill(*shapes[table].T, color=FIXED_COLOUR)
    axes.fill(*shapes[slab].T, color="#efe9dc", ec=colour, lw=2)
    axes.text(shapes[table][:, 0].mean(), 3.2, title, color=colour, ha="center", va="bottom")


def is_sliding(record, slab, slip):
    """Whether the slab slides, for each record."""
    growth = np.diff(np.maximum.accumulate(slip), prepend=0.0)
    grows = growth > MIN_RELATIVE_GROWTH * slip + MIN_GROWTH
    sliding_fraction = record.series(f"{slab}: sliding_fraction")
    sticks = (sliding_fraction < MIN_SLIDING_FRACTION) & (slip < STICKING_SLIP)
    return grows & ~sticks


if __name__ == "__main__":
    main(output_folder(__doc__))
