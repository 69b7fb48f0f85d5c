"""Pictures of a rock mass for a report: joints by state, displacement vectors, histories."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .outcome import CREEP, displacement, kinetic, outcomes, sentence
from .picture import FIXED, FREE, RATE, SEPARATED, SLIPPING, STRESS, Scale, outline
from .record import Record

STUCK, PARTLY, SLIDES, OPEN = "#3a3a3a", "#e69f00", "#d81b1b", "#1f9ed1"
STATES = {"stuck": STUCK, "partly sliding": PARTLY, "sliding": SLIDES, "open": OPEN}
BELOW = {
    "loc": "upper center", "bbox_to_anchor": (0.5, -0.13), "ncols": 6, "fontsize": 8,
    "frameon": False,
}  # fmt: skip
PARTIAL, FULL = 0.05, 0.9  # shares of the shear capacity in sliding that divide the states


def states(record: Record, i: int, scale: Scale) -> np.ndarray:
    """State (k,) of the joints of frame i, as one of the names in STATES.

    A joint that moves along itself slower than CREEP is stuck, whatever part of its asperities
    waits at the friction limit.
    """
    values = record.joints[i]["values"]
    shares = values[:, SLIPPING] / np.maximum(1 - values[:, SEPARATED], 1e-12)
    full, partial = shares > FULL, shares > PARTIAL
    moves = np.abs(values[:, RATE]) > CREEP
    names = np.where(moves & full, "sliding", np.where(moves & partial, "partly sliding", "stuck"))
    return np.where(values[:, STRESS] > 1e-3 * scale.stress, names, "open")


def draw_states(axes, record: Record, i: int, scale: Scale) -> None:
    """Blocks, and their joints: colour by state, width by normal stress."""
    _rock(axes, record, i, scale)
    ends, values = record.joints[i]["ends"], record.joints[i]["values"]
    state = states(record, i, scale)
    for name, colour in STATES.items():
        here = state == name
        style = {"linestyles": (0, (2, 1.5)), "linewidths": 1.1}
        if name != "open":
            style = {"linewidths": 0.5 * scale.width(values[here, STRESS])}
        axes.add_collection(LineCollection(ends[here], colors=colour, zorder=3, **style))


def draw_vectors(axes, record: Record, i: int, scale: Scale) -> None:
    """Displacement of the blocks since they were drawn; every rock has its own arrow scale."""
    _rock(axes, record, i, scale)
    moved = displacement(record, i)
    places = record.motion[i][:2].T
    for number, rock in enumerate(record.scene.rocks):
        free = [b for b in rock.blocks if not record.scene.blocks[b].fixed]
        most = float(np.hypot(*moved[free].T).max())
        unit = 0.06 * scale.size / most
        start = places[free] - (moved[free] if most > 0.01 * scale.size else 0)
        arrow = axes.quiver(
            *start.T, *(moved[free] * (1 if most > 0.01 * scale.size else unit)).T,
            angles="xy", scale_units="xy", scale=1, width=0.0022, color=f"C{number}", zorder=4,
        )  # fmt: skip
        arrow.set_label(f"{rock.name}: longest arrow {_metres(most)}")
    axes.legend(**BELOW)


def frame(record: Record, i: int, scale: Scale, dpi: int) -> Figure:
    """One frame of the animation."""
    wide, high = scale.high - scale.low
    figure = Figure(figsize=(9.0, max(9.0 * high / wide, 2.0) + 1.3), dpi=dpi)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.07, 0.75 / figure.get_figheight(), 0.91, 1))
    axes.set_position((0.07, 0.75 / figure.get_figheight(), 0.91, 1 - 1.2 / figure.get_figheight()))
    draw_states(axes, record, i, scale)
    figure.legend(handles=_key(scale), loc="lower center", ncols=6, fontsize=8, frameon=False)
    figure.suptitle(f"{record.scene.title}: t = {record.times[i]:.2f} s", fontsize=10)
    return figure


def report(record: Record, path: Path) -> None:
    """Before and after, displacement vectors, kinetic energy and displacement in time."""
    last = len(record.times) - 1
    scale = Scale(record, [0, last])
    wide, high = scale.high - scale.low
    tall = max(9.0 * high / wide, 2.0)
    figure = Figure(figsize=(9.6, 3 * tall + 6.0), dpi=120, layout="constrained")
    parts = figure.subplots(4, 1, height_ratios=[tall, tall, tall, 3.2])
    draw_states(parts[0], record, 0, scale)
    parts[0].set_title(f"before: t = {record.times[0]:.2f} s", fontsize=10)
    parts[0].legend(handles=_key(scale), **BELOW)
    draw_states(parts[1], record, last, scale)
    parts[1].set_title(f"after: t = {record.times[last]:.2f} s", fontsize=10)
    draw_vectors(parts[2], record, last, scale)
    parts[2].set_title("displacement since the blocks were drawn without weight", fontsize=10)
    _histories(parts[3], record)
    said = "\n".join(sentence(entry) for entry in outcomes(record))
    figure.suptitle(f"{record.scene.title}\n{said}", fontsize=10)
    figure.savefig(path)


def _histories(axes, record: Record) -> None:
    times, right = np.array(record.times), axes.twinx()
    energy = np.array([kinetic(record, i) for i in range(len(times))])
    moved = np.array([displacement(record, i) for i in range(len(times))])
    moved = np.hypot(*np.moveaxis(moved - moved[0], 2, 0))
    for number, rock in enumerate(record.scene.rocks):
        here = list(rock.blocks)
        axes.semilogy(
            times, np.maximum(energy[:, here].sum(axis=1), 1e-300), color=f"C{number}",
            label=f"{rock.name}: kinetic energy",
        )  # fmt: skip
        right.plot(times, moved[:, here].max(axis=1), color=f"C{number}", ls="--")
    top = float(energy.sum(axis=1).max())
    axes.set_ylim(max(1e-14 * top, 1e-14), 5 * top)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("kinetic energy (J), full line")
    right.set_ylabel("largest displacement\nsince step 0 (m), dashed")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")


def _rock(axes, record: Record, i: int, scale: Scale) -> None:
    blocks = record.scene.blocks
    free = [b for b in range(len(blocks)) if not blocks[b].fixed]
    axes.add_collection(
        PolyCollection(
            [outline(record, 0, b) for b in free], facecolors="none", edgecolors="0.75",
            linestyles=":", linewidths=0.6,
        )
    )  # fmt: skip
    axes.add_collection(
        PolyCollection(
            [outline(record, i, b) for b in range(len(blocks))],
            facecolors=[FIXED if b.fixed else FREE for b in blocks],
            edgecolors="0.45",
            linewidths=0.5,
        )
    )
    axes.set_xlim(scale.low[0] - 0.02 * scale.size, scale.high[0] + 0.02 * scale.size)
    axes.set_ylim(scale.low[1] - 0.02 * scale.size, scale.high[1] + 0.02 * scale.size)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")


def _key(scale: Scale) -> list[Line2D]:
    marks = [
        Line2D([], [], color=colour, lw=1.1 if name == "open" else 2.5, label=name,
               ls=(0, (2, 1.5)) if name == "open" else "-")
        for name, colour in STATES.items()
    ]  # fmt: skip
    for stress in scale.marks():
        mark = Line2D([], [], color="0.3", lw=0.5 * scale.width(stress))
        mark.set_label(f"{stress / 1e3:g} kPa" if stress < 1e6 else f"{stress / 1e6:g} MPa")
        marks.append(mark)
    return marks


def _metres(length: float) -> str:
    return f"{length:.2f} m" if length >= 0.1 else f"{1e3 * length:.2g} mm"
