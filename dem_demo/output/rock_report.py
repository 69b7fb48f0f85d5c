"""Pictures of a rock mass for a report: joints by state, displacement vectors, histories."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .drawing import (
    OPEN,
    RATE,
    SEPARATED,
    SLIDES,
    SLIPPING,
    STRESS,
    Scale,
    draw_blocks,
)
from .outcome import CREEP, displacement, kinetic, outcomes, sentence
from .record import Record

STATES = {"stuck": "#3a3a3a", "partly sliding": "#e69f00", "sliding": SLIDES, "open": OPEN}
ABOVE = {
    "loc": "lower right", "bbox_to_anchor": (1.0, 0.99), "ncols": 6, "fontsize": 8,
    "frameon": False, "handlelength": 1.6, "columnspacing": 1.2,
}  # fmt: skip
FINE = {"line": 0.5, "edge": "0.45", "start": "0.75", "margin": 0.02}
LEAST = 1e-9  # J or m: what is less is rounding, and drawn as this
DASHED = (0, (2, 1.5))
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
    draw_blocks(axes, record, i, scale, **FINE)
    ends, values = record.joints[i]["ends"], record.joints[i]["values"]
    state = states(record, i, scale)
    for name, colour in STATES.items():
        here = state == name
        style = {"linestyles": DASHED, "linewidths": 1.1}
        if name != "open":
            style = {"linewidths": 0.5 * scale.width(values[here, STRESS])}
        axes.add_collection(LineCollection(ends[here], colors=colour, zorder=3, **style))


def draw_vectors(axes, record: Record, i: int, scale: Scale) -> None:
    """Displacement of the blocks since they were drawn; small ones enlarged, rock by rock."""
    draw_blocks(axes, record, i, scale, **FINE)
    moved, places = displacement(record, i), record.motion[i][:2].T
    for number, rock in enumerate(record.scene.rocks):
        free = rock.free
        most = float(np.hypot(*moved[free].T).max())
        true = most > 0.02 * scale.size
        arrows = moved[free] * (1.0 if true else 0.06 * scale.size / most)
        axes.quiver(
            *(places[free] - arrows * true).T, *arrows.T, color=f"C{number}", zorder=4,
            angles="xy", scale_units="xy", scale=1, width=0.0022,
            label=f"{rock.name}: longest arrow {_metres(most)}{'' if true else ' (enlarged)'}",
        )  # fmt: skip
    axes.legend(**ABOVE)


def frame(record: Record, i: int, scale: Scale, dpi: int) -> Figure:
    """One frame of the animation."""
    scale = _still(scale, record)
    wide, high = scale.high - scale.low
    tall = max(9.0 * high / wide, 2.0) + 1.3
    figure = Figure(figsize=(9.0, tall), dpi=dpi)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.07, 0.75 / tall, 0.91, 1 - 1.2 / tall))
    draw_states(axes, record, i, scale)
    figure.legend(handles=_key(scale), loc="lower center", ncols=6, fontsize=8, frameon=False)
    figure.suptitle(f"{record.scene.title}: t = {record.times[i]:.2f} s", fontsize=10)
    return figure


def final(record: Record, path: Path) -> None:
    """The last frame."""
    last = len(record.times) - 1
    frame(record, last, Scale(record, [0, last]), 130).savefig(path)


def report(record: Record, path: Path) -> None:
    """Before and after, displacement vectors, kinetic energy and displacement in time."""
    last = len(record.times) - 1
    scale = _still(Scale(record, [0, last]), record)
    wide, high = scale.high - scale.low
    tall = max(9.0 * high / wide, 2.0)
    figure = Figure(figsize=(9.6, 3 * tall + 5.5), dpi=120, layout="constrained")
    part = figure.subplot_mosaic(
        [["before"] * 2, ["after"] * 2, ["vectors"] * 2, ["energy", "moved"]],
        height_ratios=[tall, tall, tall, 2.8],
    )
    for name, i in (("before", 0), ("after", last)):
        draw_states(part[name], record, i, scale)
        part[name].set_title(f"{name}: t = {record.times[i]:.2f} s", fontsize=10, loc="left")
        part[name].legend(handles=_key(scale), **ABOVE)
    draw_vectors(part["vectors"], record, last, scale)
    title = "displacement since drawn, settling included"
    part["vectors"].set_title(title, fontsize=10, loc="left")
    _histories(part["energy"], part["moved"], record)
    said = "\n".join(sentence(entry) for entry in outcomes(record))
    figure.suptitle(f"{record.scene.title}\n{said}", fontsize=10)
    figure.savefig(path)


def _histories(energy_axes, moved_axes, record: Record) -> None:
    """Kinetic energy and largest displacement since step 0 of every rock."""
    times = np.array(record.times)
    energy = np.array([kinetic(record, i) for i in range(len(times))])
    moved = np.array([displacement(record, i) for i in range(len(times))])
    moved = np.hypot(*np.moveaxis(moved - moved[0], 2, 0))
    for number, rock in enumerate(record.scene.rocks):
        style = {"color": f"C{number}", "label": rock.name}
        total, largest = energy[:, rock.free].sum(axis=1), moved[:, rock.free].max(axis=1)
        energy_axes.semilogy(times, np.maximum(total, LEAST), **style)
        moved_axes.semilogy(times, np.maximum(largest, LEAST), **style)
    energy_axes.set_ylabel("kinetic energy (J)")
    energy_axes.set_title("1 nJ and less drawn at 1 nJ", fontsize=8)
    moved_axes.set_ylabel("largest displacement\nsince step 0 (m)")
    moved_axes.set_title("1 nm and less drawn at 1 nm", fontsize=8)
    for axes in (energy_axes, moved_axes):
        axes.set_xlabel("time (s)")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)


def _still(scale: Scale, record: Record) -> Scale:
    """Widths by the stresses at the start: those of impacts would make all others hair lines."""
    values = record.joints[0]["values"]
    pressed = values[values[:, STRESS] > 0]
    if len(pressed):
        scale.stress = float(np.quantile(pressed[:, STRESS], 0.9))
    return scale


def _key(scale: Scale) -> list[Line2D]:
    marks = []
    for name, colour in STATES.items():
        style = {"lw": 1.1, "ls": DASHED} if name == "open" else {"lw": 2.5}
        marks.append(Line2D([], [], color=colour, label=name, **style))
    widths = scale.marks(0.5)
    for mark in widths:
        mark.set_label(f"stress {mark.get_label()}")
    return [*marks, *widths]


def _metres(length: float) -> str:
    return f"{length:.2f} m" if length >= 0.1 else f"{1e3 * length:.2g} mm"
