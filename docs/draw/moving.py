"""The moving picture: a joint that is sheared to and fro, with the state of its asperities.

    python docs/draw/moving.py FOLDER

A run of the law at a kept normal stress. Each face stands for a facet and one of its depth cells:
inclination, gap and state are theirs; all displacements are enlarged alike. Writes
FOLDER/moving.gif.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from folder import asked
from PIL import Image

import jointlaw as jl
from jointlaw.kernels.asperities import at_limit, effective_closure, strength
from jointlaw.kernels.cells import cells
from jointlaw.kernels.mating import planes
from jointlaw.kernels.reference import parts
from jointlaw.support.pyplot import style

STRESS = 10e6
LEGS = (3.5, -7.0, 7.0)  # slips, over the closure at this stress
FRAMES = 6  # for a slip as long as that closure
TEETH = 8
ROUND = 0.1  # radius of a tip, over the width of a ramp
BAR = 0.5e-6  # m
STUCK, SLIDING, APART = "#1f6fd0", "#c95500", "#8a8a8a"
LARGE = {"font.size": 15, "legend.fontsize": 14, "axes.labelsize": 15, "lines.linewidth": 2.0}


class Faces(NamedTuple):
    """The faces of the drawn profiles, from left to right: (TEETH,) each."""

    facet: np.ndarray
    cell: np.ndarray
    tilt: np.ndarray  # rad, upward in the direction of slip
    gap: np.ndarray  # m, before the joint was closed


def choose(law):
    """Faces for the picture: facets that look along the slip or against it, cells of all depths."""
    k = law.tables.asperities
    tilt = np.arctan2(k.n[1], k.n[0])
    along = np.flatnonzero(np.abs(k.n[2]) < 0.6 * np.abs(np.sin(tilt)) + 0.05)
    sides = [[i for i in along[np.argsort(sign * tilt[along])] if sign * tilt[i] > 0.05]
             for sign in (1, -1)]  # fmt: skip
    facet = np.array([sides[j % 2][(2 * (j // 2) + j // 4) % len(sides[j % 2])]
                      for j in range(TEETH)])  # fmt: skip
    gaps, j = k.c1[facet, None] * k.depth[facet, :-1], np.arange(TEETH)
    near = np.sum(gaps < 1.5 * law.closure(STRESS), axis=1)
    cell = (3 * j + j // 2) % np.maximum(near, 1)
    return Faces(facet, cell, tilt[facet], gaps[j, cell])


def colours(joint, faces):
    """Colour of each face by its state."""
    k, chosen = joint.law.tables.asperities, faces[:2]
    now = parts(joint.law.tables, joint.snapshot().values.T)
    found = cells(k, effective_closure(k, now.delta, now.slopes))
    limit = strength(k, planes(k, now.delta[1:], now.slopes).gamma)
    slides = at_limit(np.hypot(*now.q), limit, found.G, found.force)[:, :, 0][chosen]
    touches = (found.y > k.depth[:, :-1])[chosen]
    return np.where(touches, np.where(slides, SLIDING, STUCK), APART)


def run(law, faces):
    """The test by frames: columns of its record, with the slip as `shear`, and colours."""
    joint, length, frames, states = law.joint(), float(law.closure(STRESS)), [], []
    for leg in LEGS:
        count = round(FRAMES * abs(leg))
        for _ in range(count):
            now = jl.direct_shear(joint, leg * length / count, normal=STRESS, steps=5)
            frames.append([x[-1] for x in (now.shear, now.closure, now.shear_stress, now.stored,
                                           now.dissipated)])  # fmt: skip
            states.append(colours(joint, faces))
    return np.transpose(frames), states


def draw_blocks(axes, faces, slip, closure, start, states, zoom):
    """Ramps with the inclinations of the facets, and over each a tip of the upper block.

    start: closure (m) from which the upper block is drawn as high as the picture. Where a tip is
    pressed against its ramp it lies behind it.
    """
    tilt, place = faces.tilt, np.arange(TEETH)
    ground = np.stack([np.arange(TEETH + 1.0), np.cumsum([0.0, *np.tan(tilt)])], -1)
    along = np.stack([np.cos(tilt), np.sin(tilt)], -1)
    normal = np.stack([-np.sin(tilt), np.cos(tilt)], -1)
    middle = 0.5 * (ground[1:] + ground[:-1]) + normal * (zoom * faces.gap + ROUND)[:, None]
    middle += zoom * np.array([slip, -closure])
    turn, top = np.linspace(np.pi, 2 * np.pi, 24), ground[:, 1].max() + 0.22
    top -= zoom * (closure - start)
    tips = middle[:, None] + ROUND * np.stack([np.cos(turn), np.sin(turn)], -1)
    teeth = [
        [(x - 0.4, top), *tip, (x + 0.4, top)] for x, tip in zip(middle[:, 0], tips, strict=True)
    ]
    outline = np.concatenate([[(-1, top)], *teeth, [(TEETH + 1, top)]])
    for order, (line, edge, colour) in enumerate(
        ((outline, 2.0, "#e6e1d7"), (ground, -1.0, "#cfc8bb"))
    ):
        axes.fill_between(*line.T, edge, color=colour, lw=0, zorder=order)
        axes.plot(*line.T, color="0.45", lw=1, zorder=order)
    floor = ground[:-1, 1] + (middle[:, 0] - place) * np.tan(tilt)
    foot = np.minimum(ROUND, (middle[:, 1] - floor) * np.cos(tilt))  # along the normal, to the ramp
    at = middle - foot[:, None] * normal
    for a, b, colour in zip(at - 0.11 * along, at + 0.11 * along, states, strict=True):
        axes.plot(*np.transpose([a, b]), color=colour, lw=7, solid_capstyle="round")
    for x, name, colour in ((0.22, "stuck", STUCK), (0.5, "sliding", SLIDING),
                            (0.78, "separated", APART)):  # fmt: skip
        axes.text(x, 0.95, name, color=colour, weight="bold", ha="center", va="top",
                  transform=axes.transAxes)  # fmt: skip
    axes.plot([0.6, 0.6 + zoom * BAR], [-0.3, -0.3], color="k", lw=3)
    axes.text(0.7 + zoom * BAR, -0.3, f"{1e6 * BAR:g} µm", va="center")
    axes.set(xlim=(0.5, TEETH - 0.5), ylim=(-0.4, 1.35), xticks=[], yticks=[])


def draw_curve(axes, i, slip, label, *lines):
    """Lines (values, colour) up to frame i against slip (m), in axes that hold all of the test."""
    for values, colour in lines:
        axes.plot(1e6 * slip, values, color=colour, alpha=0.12)
        axes.plot(1e6 * slip[: i + 1], values[: i + 1], color=colour)
        axes.plot(1e6 * slip[i], values[i], "o", color=colour, ms=8)
    axes.set(xlabel="slip (µm)", xticks=[-0.5, 0, 0.5], xticklabels=["−0.5", "0", "0.5"])
    axes.set_title(label, fontsize=15, loc="left")
    axes.grid(alpha=0.3)


def main(folder):
    law = replace(jl.presets.load("biegel-rough"), resolution="fine")
    faces, start, images = choose(law), float(law.closure(STRESS)), []
    (slip, closure, stress, stored, lost), states = run(law, faces)
    with style() as plt:
        plt.rcParams.update(LARGE)
        figure, axes = plt.subplot_mosaic("AAA;BCD", figsize=(7.8, 5.4), dpi=100)
        for i, state in enumerate(states):
            for one in axes.values():
                one.clear()
            draw_blocks(axes["A"], faces, slip[i], closure[i], start, state, 0.36 / slip.max())
            draw_curve(axes["B"], i, slip, "shear stress (MPa)", (stress / 1e6, "k"))
            dilation = 1e9 * (closure[0] - closure)
            draw_curve(axes["C"], i, slip, "dilation (nm)", (dilation, "k"))
            draw_curve(axes["D"], i, slip, "energy (J/m²)", (stored, STUCK), (lost, SLIDING))
            for y, name, colour in ((0.96, "lost", SLIDING), (0.28, "stored", STUCK)):
                axes["D"].text(0.04, y, name, color=colour, transform=axes["D"].transAxes, va="top")
            figure.canvas.draw()
            images.append(Image.fromarray(np.array(figure.canvas.buffer_rgba())[..., :3]))
    palette = images[len(images) // 2].quantize(64)
    first, *others = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    first.save(folder / "moving.gif", save_all=True, append_images=others, duration=80, loop=0,
               optimize=True)  # fmt: skip


if __name__ == "__main__":
    main(asked(__doc__))
