"""The moving picture: a joint that is sheared forward and back, with the state of its asperities.

    python docs/draw/moving.py FOLDER

A run of the law at a constant normal stress. Each drawn face represents a facet and one of its
cells, with their inclination, gap and state; all displacements are enlarged by the same factor.
Writes FOLDER/moving.gif.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from command_line import output_folder
from PIL import Image

import jointlaw as jl
from jointlaw.kernels.asperities import friction_limit, is_at_limit
from jointlaw.kernels.cells import evaluate_cells
from jointlaw.kernels.interlock import effective_closure, planes
from jointlaw.kernels.reference import state_parts
from jointlaw.support.pyplot import style

NORMAL_STRESS = 10e6  # Pa
LEGS = (3.5, -7.0, 7.0)  # slips, over the closure at this stress
FRAMES_PER_CLOSURE = 6  # for a slip as long as that closure
FRAME_DURATION = 80  # ms
TEETH = 8
TIP_RADIUS = 0.1  # over the width of a ramp
MAX_ENLARGED_SLIP = 0.36  # of the largest slip, over the width of a ramp
SCALE_BAR = 0.5e-6  # m
STUCK_COLOUR = "#1f6fd0"
SLIDING_COLOUR = "#c95500"
SEPARATED_COLOUR = "#8a8a8a"
UPPER_COLOUR = "#e6e1d7"
LOWER_COLOUR = "#cfc8bb"
LARGE_TEXT = {"font.size": 15, "legend.fontsize": 14, "axes.labelsize": 15, "lines.linewidth": 2.0}


class Faces(NamedTuple):
    """The faces of the drawn profiles, in the direction of slip: (TEETH,) each."""

    facet: np.ndarray
    cell: np.ndarray
    tilt: np.ndarray  # rad, upward in the direction of slip
    gap: np.ndarray  # m, before the joint was closed


class Run(NamedTuple):
    """The test, a value for each frame."""

    slip: np.ndarray  # m
    closure: np.ndarray  # m
    shear_stress: np.ndarray  # Pa
    stored: np.ndarray  # J/m2
    dissipated: np.ndarray  # J/m2
    colours: list  # of the faces


def choose_faces(law):
    """Facets that face the slip or look along it, in turn, and cells of all depths."""
    facets = law.tables.asperities
    tilt = np.arctan2(facets.n[1], facets.n[0])
    is_along_slip = np.abs(facets.n[2]) < 0.6 * np.abs(np.sin(tilt)) + 0.05
    along_slip = np.flatnonzero(is_along_slip)
    sides = [
        [i for i in along_slip[np.argsort(sign * tilt[along_slip])] if sign * tilt[i] > 0.05]
        for sign in (1, -1)
    ]
    chosen = []
    for tooth in range(TEETH):
        side = sides[tooth % 2]
        chosen.append(side[(2 * (tooth // 2) + tooth // 4) % len(side)])
    facet = np.array(chosen)
    gaps = facets.c1[facet, None] * facets.cell_depth[facet, :-1]
    touching_cells = np.sum(gaps < 1.5 * law.closure(NORMAL_STRESS), axis=1)
    teeth = np.arange(TEETH)
    cell = (3 * teeth + teeth // 2) % np.maximum(touching_cells, 1)
    return Faces(facet, cell, tilt[facet], gaps[teeth, cell])


def face_colours(joint, faces):
    """Colour of each face by its state."""
    facets = joint.law.tables.asperities
    chosen = faces.facet, faces.cell
    state = state_parts(joint.law.tables, joint.snapshot().values.T)
    cell_states = evaluate_cells(
        facets, effective_closure(facets, state.delta, state.slope_retention)
    )
    limit = friction_limit(facets, planes(facets, state.delta[1:], state.slope_retention).gamma)
    slides = is_at_limit(np.hypot(*state.q), limit, cell_states.G, cell_states.force)
    slides = slides[:, :, 0][chosen]
    touches = (cell_states.y > facets.cell_depth[:, :-1])[chosen]
    contact_colours = np.where(slides, SLIDING_COLOUR, STUCK_COLOUR)
    return np.where(touches, contact_colours, SEPARATED_COLOUR)


def run_test(law, faces):
    """Shear the joint forward and back at the constant normal stress."""
    joint = law.joint()
    closure = float(law.closure(NORMAL_STRESS))
    rows = []
    colours = []
    for leg in LEGS:
        frames = round(FRAMES_PER_CLOSURE * abs(leg))
        for _ in range(frames):
            record = jl.direct_shear(joint, leg * closure / frames, NORMAL_STRESS, steps=5)
            columns = (record.shear, record.closure, record.shear_stress, record.stored,
                       record.dissipated)  # fmt: skip
            rows.append([column[-1] for column in columns])
            colours.append(face_colours(joint, faces))
    return Run(*np.transpose(rows), colours)


def draw_profile(axes, faces, run, i):
    """Ramps with the inclinations of the facets, and above each a tip of the upper block.

    Where a tip is pressed against its ramp it is drawn behind the ramp.
    """
    enlargement = MAX_ENLARGED_SLIP / run.slip.max()
    ground = np.stack([np.arange(TEETH + 1.0), np.cumsum([0.0, *np.tan(faces.tilt)])], -1)
    along = np.stack([np.cos(faces.tilt), np.sin(faces.tilt)], -1)
    normal = np.stack([-np.sin(faces.tilt), np.cos(faces.tilt)], -1)
    centres = 0.5 * (ground[1:] + ground[:-1])
    centres += normal * (enlargement * faces.gap + TIP_RADIUS)[:, None]
    centres += enlargement * np.array([run.slip[i], -run.closure[i]])
    outline = upper_outline(centres, ground, enlargement * (run.closure[i] - run.closure[0]))
    axes.fill_between(*outline.T, 2.0, color=UPPER_COLOUR, lw=0, zorder=0)
    axes.plot(*outline.T, color="0.45", lw=1, zorder=0)
    axes.fill_between(*ground.T, -1.0, color=LOWER_COLOUR, lw=0, zorder=1)
    axes.plot(*ground.T, color="0.45", lw=1, zorder=1)
    draw_states(axes, centres, ground, along, normal, run.colours[i])
    for x, name, colour in ((0.22, "stuck", STUCK_COLOUR), (0.5, "sliding", SLIDING_COLOUR),
                            (0.78, "separated", SEPARATED_COLOUR)):  # fmt: skip
        axes.text(x, 0.95, name, color=colour, weight="bold", ha="center", va="top",
                  transform=axes.transAxes)  # fmt: skip
    bar_end = 0.6 + enlargement * SCALE_BAR
    axes.plot([0.6, bar_end], [-0.3, -0.3], color="k", lw=3)
    axes.text(bar_end + 0.1, -0.3, f"{1e6 * SCALE_BAR:g} µm", va="center")
    axes.set(xlim=(0.5, TEETH - 0.5), ylim=(-0.4, 1.35), xticks=[], yticks=[])


def upper_outline(centres, ground, lowering):
    """Outline of the upper block, whose tips are half circles about the centres."""
    angles = np.linspace(np.pi, 2 * np.pi, 24)
    top = ground[:, 1].max() + 0.22 - lowering
    circle = TIP_RADIUS * np.stack([np.cos(angles), np.sin(angles)], -1)
    outline = [[(-1, top)]]
    for centre in centres:
        outline.append([(centre[0] - 0.4, top), *(centre + circle), (centre[0] + 0.4, top)])
    return np.concatenate([*outline, [(TEETH + 1, top)]])


def draw_states(axes, centres, ground, along, normal, colours):
    """A bar in the colour of its state where each tip touches, or is nearest to, its ramp."""
    slope = along[:, 1] / along[:, 0]
    ramp_height = ground[:-1, 1] + (centres[:, 0] - np.arange(TEETH)) * slope
    distance = (centres[:, 1] - ramp_height) * along[:, 0]  # along the normal, to the ramp
    feet = centres - np.minimum(TIP_RADIUS, distance)[:, None] * normal
    for foot, direction, colour in zip(feet, along, colours, strict=True):
        ends = np.transpose([foot - 0.11 * direction, foot + 0.11 * direction])
        axes.plot(*ends, color=colour, lw=7, solid_capstyle="round")


def draw_curve(axes, i, slip, title, *lines):
    """Lines (values, colour) up to frame i against slip (m), in axes for the whole test."""
    for values, colour in lines:
        axes.plot(1e6 * slip, values, color=colour, alpha=0.12)
        axes.plot(1e6 * slip[: i + 1], values[: i + 1], color=colour)
        axes.plot(1e6 * slip[i], values[i], "o", color=colour, ms=8)
    axes.set(xlabel="slip (µm)", xticks=[-0.5, 0, 0.5], xticklabels=["−0.5", "0", "0.5"])
    axes.set_title(title, fontsize=15, loc="left")
    axes.grid(alpha=0.3)


def draw_frames(law):
    """The frames of the moving picture."""
    faces = choose_faces(law)
    run = run_test(law, faces)
    dilation = run.closure[0] - run.closure
    images = []
    with style() as plt:
        plt.rcParams.update(LARGE_TEXT)
        figure, axes = plt.subplot_mosaic("AAA;BCD", figsize=(7.8, 5.4), dpi=100)
        energies = axes["D"]
        for i in range(len(run.slip)):
            for panel in axes.values():
                panel.clear()
            draw_profile(axes["A"], faces, run, i)
            draw_curve(axes["B"], i, run.slip, "shear stress (MPa)", (run.shear_stress / 1e6, "k"))
            draw_curve(axes["C"], i, run.slip, "dilation (nm)", (1e9 * dilation, "k"))
            draw_curve(energies, i, run.slip, "energy (J/m²)", (run.stored, STUCK_COLOUR),
                       (run.dissipated, SLIDING_COLOUR))  # fmt: skip
            for y, name, colour in ((0.96, "dissipated", SLIDING_COLOUR),
                                    (0.28, "stored", STUCK_COLOUR)):  # fmt: skip
                energies.text(0.04, y, name, color=colour, transform=energies.transAxes, va="top")
            figure.canvas.draw()
            pixels = np.array(figure.canvas.buffer_rgba())[..., :3]
            images.append(Image.fromarray(pixels))
    return images


def main(folder):
    """Draw the frames and write them as a GIF."""
    law = replace(jl.presets.load("biegel-rough"), resolution="fine")
    images = draw_frames(law)
    palette = images[len(images) // 2].quantize(64)
    first, *later = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    first.save(folder / "moving.gif", save_all=True, append_images=later, duration=FRAME_DURATION,
               loop=0, optimize=True)  # fmt: skip


if __name__ == "__main__":
    main(output_folder(__doc__))
