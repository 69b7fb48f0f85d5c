"""Pictures of a run: displacements of blocks and states of joints, as one frame or an animation;
and curves."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap, Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jointlaw.support.progress import track
from jointlaw.support.pyplot import escape_math, style, written

from ..scene import median_size, rotation
from .monitors import shear_curve
from .record import CREEP_RATE, FAILURE_DISPLACEMENT, RunRecord, report_lines

FIXED_COLOUR = "#8d8d8d"
MARKED_COLOUR = "#d0009a"
WATER_COLOUR = "#1f6fd0"
BOLT_COLOURS = {"bolt": "#00703c", "bolt at its capacity": "#8a1a8f"}
DISPLACEMENT_COLOURS = ListedColormap(colormaps["Purples"](np.linspace(0.05, 0.65, 100)))
JOINT_STATES = {  # colour, distinguishable with any colour vision, and line style
    "stuck": ("#202020", "-"),
    "partly sliding": ("#f0b400", "-"),
    "sliding": ("#c00000", "-"),
    "open": ("#1f9ed1", "--"),
}
# Fractions of the shear capacity in sliding: up to the first a joint is stuck, from the second on
# it slides
STUCK_FRACTION = 0.05
SLIDING_FRACTION = 0.9
OPEN_STRESS = 1e-3  # of the normal stress that line widths are scaled by: below it a joint is open
MAX_FRAMES = 60  # of an animation
FRAME_RATE = 11  # 1/s
ANIMATION_DPI = 75
FINAL_COST = 4.0  # time to draw the last frame over the time of a frame of the animation: pixels
MAX_NAMED_BLOCKS = 12  # in a picture with more blocks none bears its name
MAX_LABELLED_BOLTS = 12  # in a picture with more bolts none bears its force
CAPACITY_FRACTION = 0.999  # of its capacity: beyond it a bolt is drawn as being there
MIN_DISTANCE = 1e-6  # m: smaller displacements have no colour and no arrow
MIN_ARROW = 0.02  # of the largest displacement: smaller ones get no arrow
ARROW_MARGIN = 1.0  # a block has an arrow up to this share beyond the end of the colours
MAX_COLOUR_RATIO = 10.0  # largest displacement over the largest one of blocks that have not failed
WIDTH, HEIGHT = 6.5, 6.0  # inches: largest extent of the blocks in a figure
NOTE_LINE_HEIGHT = 0.19  # inches, of time and outcomes
MARGIN = 0.07  # of the extent of the blocks
LINE_WIDTHS = 0.7, 2.0, 1.2  # points: without stress, more at the scale; stress at the limit


def outlines(record: RunRecord, i: int) -> list[np.ndarray]:
    """Corners (m, 2) of all blocks in frame i (m); NaN for removed blocks."""
    return [
        block.local @ rotation(angle).T + [x, y]
        for block, (x, y, angle) in zip(record.scene.blocks, record.motion[i][:3].T, strict=True)
    ]


def stress_unit(stress: float) -> tuple[float, str]:
    """Factor from Pa to the unit in which a stress (Pa) is written, and the unit."""
    return (1e-6, "MPa") if stress >= 1e6 else (1e-3, "kPa")


def _extent(shapes: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner (2,) of the box around shapes (m, 2); NaN is left out."""
    corners = np.concatenate(shapes)
    return np.nanmin(corners, axis=0), np.nanmax(corners, axis=0)


def length_unit(length: float) -> tuple[float, str]:
    """Factor from m to the unit in which a displacement (m) is written, and the unit."""
    if length < 1e-4:
        return 1e6, "µm"
    return (1e3, "mm") if length < 0.1 else (1.0, "m")


def write_animation(path: Path, axes: Axes, count: int, draw: Callable[[int], None]) -> None:
    """Write a GIF of `count` frames, or of MAX_FRAMES of them, at a constant rate.

    draw: draws the frame of a number into the axes, which are cleared before.
    """
    frames = np.linspace(0, count - 1, min(count, MAX_FRAMES)).round().astype(int).tolist()
    writer = PillowWriter(FRAME_RATE)
    with writer.saving(axes.figure, path, ANIMATION_DPI):
        for i in track(frames, "animation", len(frames)):
            axes.clear()
            draw(i)
            writer.grab_frame()


class Pictures:
    """Draws the frames of a run, all to one scale.

    title: of the scene, unless another one is given. marked (n,): blocks to be marked, and `mark`,
    their name in the legend; by default the blocks that are unstable at the start.

    low, high (2,): visible range (m), of the blocks that move; a block that has fallen farther than
    their extent may leave it, so that the rock fills the frame. max_distance: displacement (m) at
    the end of the colours, the largest one; or the largest one of blocks that have not failed, if
    failed blocks have moved more than ten times as far, so that small displacements stay visible
    beside a falling block. largest_distance (m): of all blocks. stress: normal stress (Pa), for the
    line widths: of the start, or of all frames if no joint is closed at the start, because stresses
    of impacts would turn all other joints into hair lines.
    """

    def __init__(
        self, record: RunRecord, title: str | None = None, marked: np.ndarray | None = None,
        mark: str = "unstable block",
    ) -> None:  # fmt: skip
        self.record = record
        self.title = title or record.scene.title
        self.marked = record.unstable if marked is None else marked
        self.mark = mark
        blocks = record.scene.blocks
        moving = [i for i, block in enumerate(blocks) if block.moves]
        start = outlines(record, 0)
        low, high = _extent([start[i] for i in moving])
        extent = (high - low).max()
        end = outlines(record, -1)
        distances = np.hypot(*record.displacements(-1).T)
        remaining = [end[i] for i in moving if distances[i] <= extent]
        low, high = _extent([start[i] for i in moving] + remaining)
        margin = MARGIN * (high - low).max()
        self.low = low - margin
        self.high = high + margin
        self.free = np.array([not block.fixed for block in blocks])
        size = median_size(block for block in blocks if not block.fixed)
        distances = record.distances[self.free]
        self.largest_distance = float(np.nanmax(distances))
        kept = distances[distances <= FAILURE_DISPLACEMENT * size]
        of_kept = max(kept.max(initial=0.0), MIN_DISTANCE)
        is_clipped = len(kept) > 0 and self.largest_distance > MAX_COLOUR_RATIO * of_kept
        self.max_distance = of_kept if is_clipped else max(self.largest_distance, MIN_DISTANCE)
        self.arrow_scale = float(f"{0.5 * size / self.max_distance:.0e}")
        self.length_factor, self.length_unit = length_unit(self.max_distance)
        frames = [frame["normal_stress_Pa"] for frame in record.joints]
        at_start, whole_run = (stress[stress > 0] for stress in (frames[0], np.concatenate(frames)))
        compressive = at_start if len(at_start) else whole_run
        self.stress = float(np.quantile(compressive, 0.9)) if len(compressive) else 1.0

    def states(self, i: int) -> np.ndarray:
        """State (k,) of the joints of frame i, as one of the names in JOINT_STATES.

        A joint that slips slower than CREEP_RATE is stuck, even if a part of its asperities is at
        the friction limit.
        """
        joints = self.record.joints[i]
        fraction = joints["slipping"] / np.maximum(1 - joints["separated"], 1e-12)
        is_resting = np.abs(joints["slip_rate_m/s"]) <= CREEP_RATE
        is_open = joints["normal_stress_Pa"] <= OPEN_STRESS * self.stress
        conditions = [
            is_open,
            is_resting | (fraction <= STUCK_FRACTION),
            fraction <= SLIDING_FRACTION,
        ]
        return np.select(conditions, ["open", "stuck", "partly sliding"], "sliding")

    def figure(self) -> tuple[Figure, Axes]:
        """Create an empty frame with legend and colour bar."""
        width, height = self.high - self.low
        inches = min(WIDTH, HEIGHT * width / height)
        figure = Figure(figsize=(max(inches + 1.0, 7.5), inches * height / width + 2.6))
        handles = [Line2D([], [], label=label, **line) for label, line in self._legend()]
        figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
        axes = figure.add_subplot()
        scale = Normalize(0.0, self.length_factor * self.max_distance)
        label = f"displacement since the start ({self.length_unit})"
        is_clipped = self.largest_distance > self.max_distance
        if is_clipped:
            label += f", failed blocks beyond the scale: up to {self.largest_distance:.2g} m"
        figure.colorbar(
            ScalarMappable(scale, DISPLACEMENT_COLOURS), ax=axes, location="bottom", aspect=50,
            label=label, extend="max" if is_clipped else "neither",
        )  # fmt: skip
        return figure, axes

    def _legend(self) -> list[tuple[str, dict]]:
        """Labels and line properties of the legend."""
        scene = self.record.scene
        stress = float(f"{self.stress:.1g}")
        factor, unit = stress_unit(stress)
        entries: list[tuple[str, dict]] = [
            (f"joint {state}", {"color": colour, "ls": line, "lw": 2.0})
            for state, (colour, line) in JOINT_STATES.items()
        ]
        effective = "effective " if scene.wet else ""
        stress_line = {"color": JOINT_STATES["stuck"][0], "lw": self._line_width(stress)}
        entries.append((f"{effective}normal stress {factor * stress:g} {unit}", stress_line))
        if self.max_distance > MIN_DISTANCE:
            arrow = {"color": "k", "lw": 1.0, "marker": ">"}
            entries.append((f"displacement, drawn × {self.arrow_scale:g}", arrow))
        if scene.water:
            entries.append(("water table", {"color": WATER_COLOUR, "ls": "-."}))
        if scene.bolts:
            for label, colour in BOLT_COLOURS.items():
                entries.append((label, {"color": colour, "lw": 2.5}))
        if self.marked.any():
            entries.append((self.mark, {"color": MARKED_COLOUR, "lw": 2.0}))
        return entries

    def draw(self, axes: Axes, i: int, note: str = "") -> None:
        """Draw frame i: colour and arrow of blocks by displacement; colour of joints by state,
        width by normal stress; a note below the title."""
        record = self.record
        shapes = outlines(record, i)
        displacements = record.displacements(i)
        self._draw_blocks(axes, shapes, displacements)
        distances = np.hypot(*displacements.T)
        is_on_scale = distances <= (1.0 + ARROW_MARGIN) * self.max_distance
        min_length = max(MIN_ARROW * self.max_distance, MIN_DISTANCE)
        large = self.free & is_on_scale & (distances > min_length)
        tails = record.motion[i][:2].T[large]
        arrows = self.arrow_scale * displacements[large]
        axes.quiver(
            *tails.T, *arrows.T, angles="xy", scale_units="xy", scale=1.0, width=0.003, zorder=5
        )
        if water := record.scene.water_at(record.times[i]):
            axes.plot(*water.line.T, color=WATER_COLOUR, lw=1.5, ls="-.", zorder=4)
        self._draw_joints(axes, i)
        self._draw_bolts(axes, i)
        width, height = self.high - self.low
        line = NOTE_LINE_HEIGHT * width / min(WIDTH, HEIGHT * width / height)  # m
        top = self.high[1] + line * (1 + note.count("\n"))  # the note hides no block
        axes.set(xlim=(self.low[0], self.high[0]), xlabel="x (m)", aspect="equal",
                 ylim=(self.low[1], top), ylabel="y (m)")  # fmt: skip
        axes.figure.suptitle(escape_math(self.title))
        axes.text(0.01, 0.98, escape_math(f"t = {record.times[i]:.2f} s{note}"), va="top",
                  transform=axes.transAxes, zorder=7, gid="note")  # fmt: skip

    def _draw_blocks(self, axes: Axes, shapes: list[np.ndarray], displacements: np.ndarray) -> None:
        """Draw the blocks, coloured by displacement, and their names if they are few."""
        blocks = self.record.scene.blocks
        colours = DISPLACEMENT_COLOURS(np.hypot(*displacements.T) / self.max_distance)
        colours[~self.free] = to_rgba(FIXED_COLOUR)
        for mask, edge, width in ((~self.marked, "0.45", 0.6), (self.marked, MARKED_COLOUR, 2.0)):
            axes.add_collection(PolyCollection(
                [shapes[j] for j in np.flatnonzero(mask)], facecolors=colours[mask],
                edgecolors=edge, linewidths=width,
            ))  # fmt: skip
        if len(blocks) <= MAX_NAMED_BLOCKS:
            for block, shape in zip(blocks, shapes, strict=True):
                name = escape_math(block.name)
                axes.text(*shape.mean(axis=0), name, ha="center", va="center", clip_on=True)

    def _draw_joints(self, axes: Axes, i: int) -> None:
        """Draw the joints of frame i, coloured by state, as wide as their normal stress."""
        joints = self.record.joints[i]
        states = self.states(i)
        widths = self._line_width(joints["normal_stress_Pa"])
        for state, (colour, line) in JOINT_STATES.items():
            mask = states == state
            axes.add_collection(
                LineCollection(
                    joints["ends"][mask], linewidths=widths[mask], colors=colour, ls=line, zorder=3
                )
            )

    def _draw_bolts(self, axes: Axes, i: int) -> None:
        """Draw the bolts of frame i, and their forces if they are few."""
        bolts = self.record.bolts[i]
        capacity = np.array([bolt.capacity for bolt in self.record.scene.bolts])
        is_full = bolts["tension_N"] >= CAPACITY_FRACTION * capacity
        for (_, colour), mask in zip(BOLT_COLOURS.items(), (~is_full, is_full), strict=True):
            lines = LineCollection(bolts["ends"][mask], colors=colour, linewidths=2.5, zorder=4)
            axes.add_collection(lines)
        if len(capacity) <= MAX_LABELLED_BOLTS:
            for ends, tension in zip(bolts["ends"], bolts["tension_N"], strict=True):
                axes.text(*ends.mean(axis=0), f"{1e-3 * tension:.3g} kN", fontsize="small",
                          ha="center", va="bottom", clip_on=True, zorder=6)  # fmt: skip

    @style()
    def final(self, path: Path) -> None:
        """Draw the last frame, with slip angles and the outcome of each rock."""
        figure, axes = self.figure()
        lines = [line.partition(";")[0] for line in report_lines(self.record)]  # fits a phone
        self.draw(axes, len(self.record.times) - 1, "\n".join(["", *lines]))
        written(figure, path)

    @style()
    def animation(self, path: Path) -> None:
        """Draw the whole run as GIF, at a constant rate of model time."""
        _, axes = self.figure()
        write_animation(path, axes, len(self.record.times), lambda i: self.draw(axes, i))

    @style()
    def estimate_time(self, frames: int) -> float:
        """Estimate the time (s) to draw `final` and an `animation` of a run of so many frames, by
        drawing the first frame."""
        figure, axes = self.figure()
        figure.set_dpi(ANIMATION_DPI)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        started = time.perf_counter()
        axes.clear()
        self.draw(axes, 0)
        canvas.draw()
        frame_time = time.perf_counter() - started
        return (min(frames, MAX_FRAMES) + FINAL_COST) * frame_time

    def _line_width(self, stress):
        """Line width (points) of a normal stress (Pa)."""
        minimum, growth, limit = LINE_WIDTHS
        return minimum + growth * np.clip(np.asarray(stress) / self.stress, 0, limit)


@style()
def curves(record: RunRecord, path: Path) -> None:
    """Draw stress and dilation of the sheared joints over slip, and curves of the law alone."""
    figure = Figure(figsize=(7, 7))
    upper, lower = figure.subplots(2, sharex=True)
    for moving, base in record.scene.shear:
        name = record.scene.blocks[moving].name
        slip, closure, normal, shear = (
            record.series(f"{name}: {key}")
            for key in ("slip_m", "closure_m", "normal_Pa", "shear_Pa")
        )
        factor, unit = stress_unit(float(normal.max()))
        upper.plot(1e3 * slip, factor * shear, label=escape_math(f"{name} (blocks)"))
        lower.plot(1e3 * slip, 1e3 * (closure[0] - closure))
        law = record.scene.laws[record.joint_laws[moving, base]]
        if alone := shear_curve(law, float(normal[0]), slip):
            dots = {"color": "k", "ls": ":"}
            label = "law alone, at the normal stress of the start"
            upper.plot(1e3 * alone.shear_2, factor * alone.F2, label=label, **dots)
            lower.plot(1e3 * alone.shear_2, 1e3 * (alone.closure[0] - alone.closure), **dots)
    upper.set(title=escape_math(record.scene.title), ylabel=f"shear stress ({unit})")
    lower.set(ylabel="dilation since the start (mm)", xlabel="shear displacement (mm)")
    figure.legend(loc="outside lower center", ncols=3)
    written(figure, path)
