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


class Face(NamedTuple):
    """A face of the drawn profiles."""

    place: int
    facet: int
    cell: int
    tilt: float  # rad, upward in the direction of slip
    gap: float  # m, before the joint was closed


class Moment(NamedTuple):
    """What a frame shows: m, Pa, J/m2, and a colour for each face."""

    slip: float
    start: float  # of the closure
    closure: float
    stress: float
    stored: float
    lost: float
    colours: list[str]


def choose(law):
    """Faces for the picture: facets that look along the slip or against it, cells of all depths."""
    k = law.tables.asperities
    tilt = np.arctan2(k.n[1], k.n[0])
    along = np.flatnonzero(np.abs(k.n[2]) < 0.6 * np.abs(np.sin(tilt)) + 0.05)
    sides = [[i for i in along[np.argsort(sign * tilt[along])] if sign * tilt[i] > 0.05]
             for sign in (1, -1)]  # fmt: skip
    faces = []
    for j in range(TEETH):
        facet = sides[j % 2][(2 * (j // 2) + j // 4) % len(sides[j % 2])]
        gaps = k.c1[facet] * k.depth[facet, :-1]
        cell = (3 * j + j // 2) % max(1, np.sum(gaps < 1.5 * law.closure(STRESS)))
        faces.append(Face(j, facet, cell, tilt[facet], gaps[cell]))
    return faces


def states(joint, faces):
    """Colour of each face."""
    k = joint.law.tables.asperities
    now = parts(joint.law.tables, joint.snapshot().values.T)
    found = cells(k, effective_closure(k, now.delta, now.slopes))
    size = np.hypot(*now.q)
    limit = strength(k, planes(k, now.delta[1:], now.slopes).gamma)
    slides = at_limit(size, limit, found.G, found.force)[:, :, 0]
    touches = found.y > k.depth[:, :-1]
    return [
        (SLIDING if slides[f.facet, f.cell] else STUCK) if touches[f.facet, f.cell] else APART
        for f in faces
    ]


def run(law, faces):
    """The moments of the test."""
    joint, moments, slip = law.joint(), [], 0.0
    length = float(law.closure(STRESS))
    for leg in LEGS:
        count = round(FRAMES * abs(leg))
        for _ in range(count):
            step = leg * length / count
            now = jl.direct_shear(joint, step, normal=STRESS, steps=5)
            slip += step
            last = [x[-1] for x in (now.closure, now.shear_stress, now.stored, now.dissipated)]
            moments.append(Moment(slip, length, *last, states(joint, faces)))
    return moments


def tips(faces, moment, zoom):
    """Ground under the faces, (TEETH + 1, 2), and the middles of the tips above it, (TEETH, 2)."""
    tilt, gap = np.array([f.tilt for f in faces]), np.array([f.gap for f in faces])
    ground = np.stack([np.arange(TEETH + 1.0), np.cumsum([0.0, *np.tan(tilt)])], -1)
    above = np.stack([-np.sin(tilt), np.cos(tilt)], -1) * (zoom * gap + ROUND)[:, None]
    moved = zoom * np.array([moment.slip, -moment.closure])
    return ground, 0.5 * (ground[1:] + ground[:-1]) + above + moved


def draw_blocks(axes, faces, moment, zoom):
    """Ramps with the inclinations of the facets, and over each a tip of the upper block.

    Where a tip is pressed against its ramp it lies behind it.
    """
    ground, middle = tips(faces, moment, zoom)
    turn, top = np.linspace(np.pi, 2 * np.pi, 24), ground[:, 1].max() + 0.22
    top -= zoom * (moment.closure - moment.start)
    arcs = middle[:, None] + ROUND * np.stack([np.cos(turn), np.sin(turn)], -1)
    feet = zip(middle[:, 0], arcs, strict=True)
    tooth = [[(x - 0.4, top), *arc, (x + 0.4, top)] for x, arc in feet]
    outline = np.concatenate([[(-1, top)], *tooth, [(TEETH + 1, top)]])
    parts = (outline, 2.0, "#e6e1d7"), (ground, -1.0, "#cfc8bb")
    for order, (line, edge, colour) in enumerate(parts):
        axes.fill_between(*line.T, edge, color=colour, lw=0, zorder=order)
        axes.plot(*line.T, color="0.45", lw=1, zorder=order)
    for face, (x, z), colour in zip(faces, middle, moment.colours, strict=True):
        along = np.array([np.cos(face.tilt), np.sin(face.tilt)])
        floor = ground[face.place, 1] + (x - face.place) * np.tan(face.tilt)
        foot = min(ROUND, (z - floor) * np.cos(face.tilt))  # along the normal, from ramp to middle
        at = np.array([x, z]) + foot * np.array([np.sin(face.tilt), -np.cos(face.tilt)])
        ends = at + np.outer([-0.11, 0.11], along)
        axes.plot(*ends.T, color=colour, lw=7, solid_capstyle="round")
    for i, (name, colour) in enumerate(
        (("stuck", STUCK), ("sliding", SLIDING), ("separated", APART))
    ):
        axes.text(0.22 + 0.28 * i, 0.95, name, color=colour, weight="bold", ha="center", va="top",
                  transform=axes.transAxes)  # fmt: skip
    axes.plot([0.6, 0.6 + zoom * BAR], [-0.3, -0.3], color="k", lw=3)
    axes.text(0.7 + zoom * BAR, -0.3, f"{1e6 * BAR:g} µm", va="center")
    axes.set(xlim=(0.5, TEETH - 0.5), ylim=(-0.4, 1.35), xticks=[], yticks=[])


def draw_curve(axes, moments, all_moments, lines, label):
    """Lines up to this moment against slip, in axes that hold all of the test."""
    slip = np.array([m.slip for m in all_moments]) * 1e6
    for of, colour in lines:
        values = np.array([of(m) for m in all_moments])
        axes.plot(slip, values, color=colour, alpha=0.12)
        axes.plot(slip[: len(moments)], values[: len(moments)], color=colour)
        axes.plot(slip[len(moments) - 1], values[len(moments) - 1], "o", color=colour, ms=8)
    axes.set(xlabel="slip (µm)", xticks=[-0.5, 0, 0.5], xticklabels=["−0.5", "0", "0.5"])
    axes.set_title(label, fontsize=15, loc="left")
    axes.grid(alpha=0.3)


def frame(plt, faces, moments, all_moments):
    """One picture."""
    now, start = moments[-1], all_moments[0].closure
    figure, axes = plt.subplot_mosaic("AAA;BCD", figsize=(7.8, 5.4), height_ratios=(1, 1))
    draw_blocks(axes["A"], faces, now, 0.36 / max(m.slip for m in all_moments))
    draw_curve(axes["B"], moments, all_moments, [(lambda m: m.stress / 1e6, "k")],
               "shear stress (MPa)")  # fmt: skip
    draw_curve(axes["C"], moments, all_moments, [(lambda m: 1e9 * (start - m.closure), "k")],
               "dilation (nm)")  # fmt: skip
    energies = [(lambda m: m.stored, STUCK), (lambda m: m.lost, SLIDING)]
    draw_curve(axes["D"], moments, all_moments, energies, "energy (J/m²)")
    axes["D"].text(0.04, 0.96, "lost", color=SLIDING, transform=axes["D"].transAxes, va="top")
    axes["D"].text(0.04, 0.28, "stored", color=STUCK, transform=axes["D"].transAxes, va="top")
    figure.canvas.draw()
    image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())
    plt.close(figure)
    return image


def main(folder):
    law = replace(jl.presets.load("biegel-rough"), resolution="fine")
    faces = choose(law)
    moments = run(law, faces)
    with style() as plt:
        plt.rcParams.update(LARGE)
        plt.rcParams["figure.dpi"] = 100
        images = [frame(plt, faces, moments[: i + 1], moments) for i in range(len(moments))]
    palette = images[len(images) // 2].quantize(64)
    small = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    path = folder / "moving.gif"
    small[0].save(path, save_all=True, append_images=small[1:], duration=80, loop=0, optimize=True)
    print(f"{path}: {len(small)} frames, {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(asked(__doc__))
