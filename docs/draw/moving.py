"""The moving picture: a joint that is sheared to and fro, with the state of its asperities.

    python docs/draw/moving.py FOLDER

A run of the law at a kept normal stress. Each face stands for a facet and one of its depth cells:
inclination, gap and state are theirs. The profiles are drawn through the faces; all displacements
are enlarged alike. Writes FOLDER/moving.gif.
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
TEETH = 14
STUCK, SLIDING, APART = "#1f6fd0", "#c95500", "#8a8a8a"
LARGE = {"font.size": 15, "legend.fontsize": 14, "axes.labelsize": 15, "lines.linewidth": 2.0}


class Face(NamedTuple):
    """A face of the drawn profiles."""

    facet: int
    cell: int
    tilt: float  # rad, upward in the direction of slip
    gap: float  # m, before the joint was closed


class Moment(NamedTuple):
    """What a frame shows: m, Pa, J/m2, and a colour for each face."""

    slip: float
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
        faces.append(Face(facet, cell, tilt[facet], gaps[cell]))
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
            energies = now.stored[-1], now.dissipated[-1]
            moments.append(
                Moment(slip, now.closure[-1], now.shear_stress[-1], *energies, states(joint, faces))
            )
    return moments


def profiles(faces, moment, zoom):
    """Ends (TEETH, 2, 2) of the faces of the lower block, and of the upper one where it is."""
    half = 0.5
    rise = np.tan([f.tilt for f in faces])
    z = np.concatenate([[0.0], np.cumsum(2 * half * rise)])
    x = np.arange(TEETH + 1.0)
    lower = np.stack([np.stack([x[:-1], z[:-1]], -1), np.stack([x[1:], z[1:]], -1)], 1)
    normal = np.array([(-np.sin(f.tilt), np.cos(f.tilt)) for f in faces])
    gap = np.array([f.gap for f in faces])[:, None]
    shift = zoom * (normal * gap + (moment.slip, -moment.closure))
    return lower, lower + shift[:, None]


def shrunk(ends, share):
    """Faces (n, 2, 2) without this share of their length at each end."""
    middle = ends.mean(axis=1, keepdims=True)
    return middle + (1 - 2 * share) * (ends - middle)


def draw_blocks(axes, faces, moment, zoom):
    """The two profiles and the coloured faces between them."""
    lower, upper = profiles(faces, moment, zoom)
    upper = shrunk(upper, 0.12)
    for ends, edge, colour in ((lower, -1.6, "#c9c2b6"), (upper, 1.9, "#dbd5c9")):
        x, z = ends.reshape(-1, 2).T
        axes.fill_between(x, z, edge, color=colour, lw=0, alpha=0.85)
        axes.plot(x, z, color="0.45", lw=1)
    for ends, colour in zip(shrunk(upper, 0.08), moment.colours, strict=True):
        axes.plot(*ends.T, color=colour, lw=6, solid_capstyle="round")
    for i, (name, colour) in enumerate(
        (("stuck", STUCK), ("sliding", SLIDING), ("separated", APART))
    ):
        axes.text(0.22 + 0.28 * i, 0.93, name, color=colour, weight="bold", ha="center", va="top",
                  transform=axes.transAxes)  # fmt: skip
    bar = 0.5e-6
    axes.plot([2.5, 2.5 + zoom * bar], [-1.35, -1.35], color="k", lw=3)
    axes.text(2.5, -1.25, f"{1e6 * bar:g} µm of slip", va="bottom")
    axes.set(xlim=(2.2, TEETH - 2.2), ylim=(-1.6, 1.9), xticks=[], yticks=[])


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
    draw_blocks(axes["A"], faces, now, 1.4 / max(m.slip for m in all_moments))
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
