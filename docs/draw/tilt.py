"""Tilt tests: the tilts at which two slabs slip, and the friction on which they slide away.

    python docs/draw/tilt.py FOLDER

Runs the scene `tilt`. Each pair of slab and table is drawn when the slab has slid by half a metre.
The friction angle is drawn where the slab slides. At 5 and 8 s the tables slow down, the slabs
stick, and for half a second their joints carry less shear stress than their friction: such records
are left out. Writes FOLDER/tilt.png.
"""

from dataclasses import replace

import numpy as np
from folder import asked

import dem_demo
from dem_demo.output.pictures import FIXED, outlines
from jointlaw.support.pyplot import style

COLOURS = "#c95500", "#1f6fd0"
WAYS = "rough direction\ndown the slope", "rough direction\nacross the slope"
DRAWN = 0.5  # m of slip
SLIDING = 0.5  # smallest share of the joint that slides under a sliding slab, to a slip of FAR
FAR = 1e-3  # m of slip, past the peak: a slab does not stick again before it comes to rest
SLOW, LEAST = 1e-4, 1e-12  # growth of slip between two records: share of the slip, m; less is rest


def main(folder):
    scene = dem_demo.load("tilt")
    scene = replace(scene, run=replace(scene.run, record=0.01))
    record, _ = dem_demo.run(dem_demo.Simulation(scene))
    with style() as plt:
        plt.rcParams.update({"font.size": 15, "lines.linewidth": 2.4})
        figure, (above, below) = plt.subplots(2, 1, figsize=(7.8, 8.0), height_ratios=(1, 1.5))
        for (moving, base), colour, way in zip(record.slips, COLOURS, WAYS, strict=True):
            name, tilt = scene.blocks[moving].name, record.slips[moving, base]["slip_angle"]
            slip = np.abs(record.column(f"{name}: slid_m"))
            shape = outlines(record, int(np.argmax(slip > DRAWN)))
            above.fill(*shape[base].T, color=FIXED)
            above.fill(*shape[moving].T, color="#efe9dc", ec=colour, lw=2)
            above.text(shape[base][:, 0].mean(), 3.2, way, color=colour, ha="center", va="bottom")
            grows = np.diff(np.maximum.accumulate(slip), prepend=0.0) > SLOW * slip + LEAST
            sticks = (record.column(f"{name}: sliding_share") < SLIDING) & (slip < FAR)
            slides = grows & ~sticks
            ratio = record.column(f"{name}: shear_Pa") / record.column(f"{name}: normal_Pa")
            angle = np.degrees(np.arctan(np.abs(ratio)))
            below.semilogx(1e3 * slip[slides], angle[slides], color=colour)
            below.text(2.2, tilt, f"slips at a tilt of {tilt:.2f}°", color=colour, weight="bold",
                       va="center")  # fmt: skip
        rest = np.degrees(np.arctan(scene.laws["along"].asperity.mu))
        below.axhline(rest, color="0.4", ls=":")
        below.text(
            0.1, rest - 0.4, f"slides on at $φ_b$ = {rest:.1f}°, friction of flat rock", va="top"
        )
        above.set(aspect="equal", ylim=(-4.2, 5.2))
        above.axis("off")
        below.set(xlabel="slip (mm)", ylabel="friction angle (°)", xlim=(0.01, 9e3), ylim=(18, 37))
        below.grid(alpha=0.3)
        figure.savefig(folder / "tilt.png", dpi=100)


if __name__ == "__main__":
    main(asked(__doc__))
