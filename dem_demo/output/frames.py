"""Pictures of a run of single blocks: what slides, what opens, what carries; and animations."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from jointlaw.support.progress import track

from .drawing import CLOSURE, OPEN, SEPARATED, SLIDES, SLIPPING, STRESS, TAU, Scale, draw_blocks
from .record import Record

MAP = "viridis"
FRAMES = 60  # most frames of an animation
FEW = 12  # blocks: most that bear their names


def draw(axes: Axes, record: Record, i: int, scale: Scale) -> None:
    """The blocks and joints of frame i."""
    blocks, shapes = record.scene.blocks, draw_blocks(axes, record, i, scale)
    for b, (block, shape) in enumerate(zip(blocks, shapes, strict=True)):
        if len(blocks) <= FEW and not block.fixed:
            axes.text(
                *shape.mean(axis=0), block.name, rotation=np.degrees(record.motion[i][2, b]),
                fontsize=8, ha="center", va="center", rotation_mode="anchor",
            )  # fmt: skip
    values, ends = record.joints[i]["values"], record.joints[i]["ends"]
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


def frame(record: Record, i: int, scale: Scale, dpi: int, note: str = "") -> Figure:
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
        *scale.marks(),
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
    """Time and what is monitored, for the title of a frame."""
    parts = [f"t = {record.times[i]:.2f} s"]
    row = record.monitored[i]
    for moving, _ in record.scene.monitors.slip:
        name = record.scene.blocks[moving].name
        angle, slid = row[f"{name}: base angle_deg"], 1e3 * abs(row[f"{name}: slid_m"])
        parts.append(f"{name}: base at {angle:.2f}°, slid {_digits(slid)} mm")
    for moving, _ in record.scene.monitors.shear:
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
    frame(record, last, Scale(record, [0, last]), 130, note).savefig(path)


def animation(record: Record, path: Path, draw_frame: Callable[..., Figure]) -> None:
    """The whole run as GIF, at a constant rate of model time."""
    wanted = np.linspace(record.times[0], record.times[-1], min(len(record.times), FRAMES))
    frames = np.unique(np.abs(np.subtract.outer(wanted, record.times)).argmin(axis=1))
    scale, images = Scale(record, frames), []
    for i in track(frames, "animation", len(frames)):
        figure = draw_frame(record, i, scale, 75)
        figure.canvas.draw()
        image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
        images.append(image.quantize(256, dither=Image.Dither.NONE))
    pause = [90] * (len(images) - 1) + [2000]
    images[0].save(path, save_all=True, append_images=images[1:], duration=pause, loop=0)


def _digits(millimetres: float) -> str:
    return f"{round(millimetres, 2) + 0.0:.2f}" if abs(millimetres) < 10 else f"{millimetres:.0f}"
