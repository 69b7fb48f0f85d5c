"""Pictures of a run: what slides, what opens, what carries."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from .record import Record
from .shapes import turn

CLOSURE, SHEAR, STRESS, TAU, SLIDING, SLIPPING, SEPARATED, LENGTH, RATE = range(9)
FIXED, DRIVEN, FREE, OPEN, SLIDES = "#8d8d8d", "#b9b4a7", "#efe9dc", "#1f9ed1", "#d81b1b"
MAP = "viridis"
FRAMES = 60  # most frames of an animation


class Scale:
    """What colours and widths mean, the same in every frame: friction angle and stress."""

    def __init__(self, record: Record, frames) -> None:
        values = np.concatenate([record.joints[i]["values"] for i in frames])
        closed = values[values[:, STRESS] > 0]
        angle = np.degrees(np.arctan2(np.abs(closed[:, TAU]), closed[:, STRESS]))
        self.stress = float(np.percentile(closed[:, STRESS], 98)) if len(closed) else 1.0
        firm = angle[closed[:, STRESS] > 0.02 * self.stress]
        top = max(5.0, np.ceil(float(firm.max(initial=0.0)) / 5 - 1e-6) * 5)
        self.angle = Normalize(0.0, top)
        corners = np.concatenate([outline(record, i, b) for i in frames for b in _all(record)])
        self.low, self.high = corners.min(axis=0), corners.max(axis=0)
        self.size = float(max(self.high - self.low))

    def width(self, stress):
        """Line width (points) of a normal stress (Pa)."""
        return 0.8 + 8.0 * np.clip(np.asarray(stress) / self.stress, 0, 1.2)

    def marks(self) -> np.ndarray:
        """Two round stresses (Pa) for a legend."""
        return _round(self.stress) * np.array([0.25, 1.0])


def draw(axes, record: Record, i: int, scale: Scale) -> None:
    """The blocks and joints of frame i."""
    blocks = record.scene.blocks
    start = [outline(record, 0, b) for b in _all(record) if not blocks[b].fixed]
    axes.add_collection(
        PolyCollection(start, facecolors="none", edgecolors="0.6", linestyles=":", linewidths=0.8)
    )
    colours = [FIXED if b.fixed else DRIVEN if len(b.held) > 1 else FREE for b in blocks]
    shapes = [outline(record, i, b) for b in _all(record)]
    axes.add_collection(
        PolyCollection(shapes, facecolors=colours, edgecolors="0.35", linewidths=0.7)
    )
    if len(blocks) <= 12:
        for block, shape in zip(blocks, shapes, strict=True):
            if not block.fixed:
                angle = np.degrees(record.motion[i][2, blocks.index(block)])
                axes.text(
                    *shape.mean(axis=0), block.name, rotation=angle, fontsize=8,
                    ha="center", va="center", rotation_mode="anchor",
                )  # fmt: skip
    frame = record.joints[i]
    values, ends = frame["values"], frame["ends"]
    closed = values[:, STRESS] > 1e-3 * scale.stress
    gap = ~closed & (values[:, CLOSURE] > -0.05 * scale.size)
    angle = np.degrees(np.arctan2(np.abs(values[:, TAU]), values[:, STRESS]))
    carried = LineCollection(ends[closed], cmap=MAP, norm=scale.angle, zorder=3)
    carried.set_array(angle[closed])
    carried.set_linewidths(scale.width(values[closed, STRESS]))
    axes.add_collection(carried)
    axes.add_collection(
        LineCollection(ends[gap], colors=OPEN, linestyles=(0, (2, 2)), linewidths=1.4, zorder=3)
    )
    sliding = closed & (values[:, SLIPPING] > 0.9 * (1 - values[:, SEPARATED]))
    middle = ends[sliding].mean(axis=1)
    axes.plot(*middle.T, "D", ms=6, mfc="white", mec=SLIDES, mew=1.6, zorder=4, clip_on=False)
    axes.set_xlim(scale.low[0] - 0.04 * scale.size, scale.high[0] + 0.04 * scale.size)
    axes.set_ylim(scale.low[1] - 0.04 * scale.size, scale.high[1] + 0.04 * scale.size)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")


def frame_figure(record: Record, i: int, scale: Scale, dpi: int, note: str = "") -> Figure:
    """One frame with its colour bar and legend, laid out in inches so that frames do not jump."""
    wide, high = (scale.high - scale.low) + 0.08 * scale.size
    across = min(6.8, 5.6 * wide / high)
    tall, left, right, low, up = across * high / wide, 0.75, 1.15, 1.15, 0.8 if note else 0.6
    size = max(left + across + right, 6.2), low + tall + up
    left += 0.5 * (size[0] - left - across - right)
    figure = Figure(figsize=size, dpi=dpi)
    FigureCanvasAgg(figure)

    def part(x, y, width, height):
        return figure.add_axes((x / size[0], y / size[1], width / size[0], height / size[1]))

    axes = part(left, low, across, tall)
    draw(axes, record, i, scale)
    colours = ScalarMappable(scale.angle, MAP)
    bar = figure.colorbar(colours, cax=part(left + across + 0.15, low, 0.17, tall))
    bar.set_label("mobilised friction angle (degrees)", fontsize=9)
    marks = [
        Line2D([], [], color="0.3", lw=scale.width(s), label=f"{s / 1e3:.3g} kPa")
        for s in scale.marks()
    ]
    marks += [
        Line2D([], [], ls="", marker="D", mfc="white", mec=SLIDES, mew=1.6, label="sliding"),
        Line2D([], [], color=OPEN, ls=(0, (2, 2)), lw=1.4, label="open"),
        Line2D([], [], color="0.6", ls=":", lw=0.9, label="at start"),
    ]
    figure.legend(
        handles=marks, loc="lower center", ncols=5, fontsize=8, frameon=False,
        title="joints: normal stress as width", title_fontsize=8,
    )  # fmt: skip
    figure.suptitle(
        f"{record.scene.title}\n{caption(record, i)}{note}",
        fontsize=9.5,
        y=1 - 0.06 / size[1],
        va="top",
    )
    return figure


def caption(record: Record, i: int) -> str:
    """Time and what is watched, for the title of a frame."""
    parts = [f"t = {record.times[i]:.2f} s"]
    row = record.watched[i]
    for moving, _ in record.scene.watch.get("slip", []):
        name = record.scene.blocks[moving].name
        angle, slid = row[f"{name}: base angle_deg"], 1e3 * abs(row[f"{name}: slid_m"])
        parts.append(f"{name}: base at {angle:.2f}°, slid {_digits(slid)} mm")
    for moving, _ in record.scene.watch.get("shear", []):
        name = record.scene.blocks[moving].name
        slid, tau = 1e3 * row[f"{name}: slid_m"], 1e-3 * row[f"{name}: shear_Pa"]
        parts.append(f"{name}: slid {_digits(slid)} mm, shear stress {tau:.1f} kPa")
    return "; ".join(parts)


def final(record: Record, path: Path, slips: list[dict]) -> None:
    """The last frame as PNG, with the slip angles of a tilt test."""
    last, parts = len(record.times) - 1, []
    for slip in slips:
        if slip["slip_angle"] is not None:
            predicted = slip["predicted_angle"]
            alone = f" (law alone {predicted:.2f}°)" if predicted is not None else ""
            parts.append(f"{slip['block']} slipped at {slip['slip_angle']:.2f}°{alone}")
    note = "\n" + "; ".join(parts) if parts else ""
    frame_figure(record, last, Scale(record, [0, last]), 130, note).savefig(path)


def motion(record: Record, path: Path, frame=frame_figure) -> None:
    """The whole run as GIF; more frames where more moves (the time stands in every frame)."""
    places = np.array(record.motion)[:, :2]
    moved = np.append(0.0, np.cumsum(np.abs(np.diff(places, axis=0)).max(axis=(1, 2))))
    even = np.linspace(0.0, 1.0, len(moved))
    progress = 0.5 * even + 0.5 * (moved / moved[-1] if moved[-1] > 0 else even)
    wanted = np.linspace(0.0, 1.0, min(len(moved), FRAMES))
    frames = np.unique(np.searchsorted(progress, wanted - 1e-12))
    scale, images = Scale(record, frames), []
    for i in frames:
        figure = frame(record, i, scale, 75)
        figure.canvas.draw()
        image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
        images.append(image.quantize(256, dither=Image.Dither.NONE))
    pause = [90] * (len(images) - 1) + [2000]
    images[0].save(path, save_all=True, append_images=images[1:], duration=pause, loop=0)


def _all(record: Record) -> range:
    return range(len(record.scene.blocks))


def outline(record: Record, i: int, b: int) -> np.ndarray:
    """Corners of block b in frame i."""
    x, y, angle = record.motion[i][:3, b]
    return record.scene.blocks[b].local @ turn(angle).T + [x, y]


def _digits(millimetres: float) -> str:
    return f"{round(millimetres, 2) + 0.0:.2f}" if abs(millimetres) < 10 else f"{millimetres:.0f}"


def _round(value: float) -> float:
    """One leading digit of 1, 2 or 5."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(d for d in (1, 2, 5) if d * power <= value * (1 + 1e-9)))
