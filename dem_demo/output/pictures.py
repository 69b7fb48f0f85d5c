"""Pictures of a run: blocks with the state of their joints, one frame or a GIF; and curves."""

from pathlib import Path

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jointlaw.support.progress import track
from jointlaw.support.pyplot import style, written

from ..scene import turn
from .monitors import shear_curve
from .record import CREEP, Record, sentences

FIXED, DRIVEN, FREE, WATER = "#8d8d8d", "#b9b4a7", "#efe9dc", "#1f6fd0"
STATES = {  # of a joint: colour and line
    "stuck": ("#3a3a3a", "-"), "partly sliding": ("#e69f00", "-"), "sliding": ("#d81b1b", "-"),
    "open": ("#1f9ed1", "--"),
}  # fmt: skip
PARTIAL, FULL = 0.05, 0.9  # shares of the shear capacity in sliding that divide the states
FRAMES, RATE, DPI = 60, 11, 75  # of an animation: most frames, frames per second
FEW = 12  # blocks: most that bear their names


def outlines(record: Record, i: int) -> list[np.ndarray]:
    """Corners (m, 2) of all blocks in frame i (m); NaN for those that are gone."""
    return [
        block.local @ turn(angle).T + [x, y]
        for block, (x, y, angle) in zip(record.scene.blocks, record.motion[i][:3].T, strict=True)
    ]


class Pictures:
    """Draws a run, all frames to one scale: low, high (2,) in m; widths by `stress` (Pa).

    That is the stress of the start, or of all frames where nothing touches then: those of impacts
    would make all others hair lines.
    """

    def __init__(self, record: Record) -> None:
        self.record = record
        corners = np.concatenate([c for i in (0, -1) for c in outlines(record, i)])
        low, high = np.nanmin(corners, axis=0), np.nanmax(corners, axis=0)
        margin = 0.03 * (high - low).max()
        self.low, self.high = low - margin, high + margin
        start = record.joints[0]["normal_stress_Pa"]
        whole = [frame["normal_stress_Pa"] for frame in record.joints]
        pressed = start[start > 0] if (start > 0).any() else np.concatenate(whole)
        pressed = pressed[pressed > 0]
        self.stress = float(np.quantile(pressed, 0.9)) if len(pressed) else 1.0

    def states(self, i: int) -> np.ndarray:
        """State (k,) of the joints of frame i, as one of the names in STATES.

        A joint that moves along itself slower than CREEP is stuck, whatever part of its asperities
        waits at the friction limit.
        """
        now = self.record.joints[i]
        shares = now["slipping"] / np.maximum(1 - now["separated"], 1e-12)
        moves = np.abs(now["sliding_m/s"]) > CREEP
        names = np.where(moves & (shares > PARTIAL), "partly sliding", "stuck")
        names = np.where(moves & (shares > FULL), "sliding", names)
        closed = now["normal_stress_Pa"] > 1e-3 * self.stress
        return np.where(closed, names, "open")

    def figure(self) -> tuple[Figure, Axes]:
        """An empty frame with its legend: states, a round stress, the dots of the start."""
        (wide, high), scene = self.high - self.low, self.record.scene
        across = min(6.5, 6.0 * wide / high)
        figure = Figure(figsize=(max(across + 1.0, 7.5), across * high / wide + 1.8))
        marks = [Line2D([], [], color=colour, ls=line, label=f"joint {name}", lw=2.0)
                 for name, (colour, line) in STATES.items()]  # fmt: skip
        stress = float(f"{self.stress:.1g}")
        kind = "effective " * scene.wet
        label, width = f"{kind}normal stress {1e-3 * stress:g} kPa", self._width(stress)
        marks.append(Line2D([], [], color=STATES["stuck"][0], lw=width, label=label))
        marks.append(Line2D([], [], color="0.6", ls=":", lw=0.9, label="place at the start"))
        if scene.water:
            marks.append(Line2D([], [], color=WATER, ls="-.", label="water table"))
        figure.legend(handles=marks, loc="outside lower center", ncols=3, frameon=False)
        return figure, figure.add_subplot()

    def draw(self, axes: Axes, i: int, note: str = "") -> None:
        """Frame i: blocks, dotted where they were at the start, and joints: colour by state, width
        by normal stress; a note below the title."""
        record, blocks, shapes = self.record, self.record.scene.blocks, outlines(self.record, i)
        drawn = zip(blocks, outlines(record, 0), strict=True)
        along = record.base(i) - record.base(0)
        start = [shape + along for block, shape in drawn if not block.fixed]
        axes.add_collection(
            PolyCollection(
                start, facecolors="none", edgecolors="0.7", linestyles=":", linewidths=0.7
            )
        )
        colours = [FIXED if b.fixed else DRIVEN if len(b.held) > 1 else FREE for b in blocks]
        axes.add_collection(
            PolyCollection(shapes, facecolors=colours, edgecolors="0.45", linewidths=0.6)
        )
        if len(blocks) <= FEW:
            for block, shape in zip(blocks, shapes, strict=True):
                axes.text(*shape.mean(axis=0), block.name, ha="center", va="center")
        if record.scene.water:
            axes.plot(*record.scene.water.line.T, color=WATER, lw=1.5, ls="-.", zorder=4)
        ends, state = record.joints[i]["ends"], self.states(i)
        widths = self._width(record.joints[i]["normal_stress_Pa"])
        for name, (colour, line) in STATES.items():
            here = state == name
            axes.add_collection(
                LineCollection(
                    ends[here], linewidths=widths[here], colors=colour, ls=line, zorder=3
                )
            )
        axes.set(xlim=(self.low[0], self.high[0]), xlabel="x (m)", aspect="equal")
        axes.set(ylim=(self.low[1], self.high[1]), ylabel="y (m)")
        axes.figure.suptitle(f"{record.scene.title}\nt = {record.times[i]:.2f} s{note}")

    @style()
    def final(self, path: Path) -> None:
        """The last frame, with slip angles and what became of each rock."""
        figure, axes = self.figure()
        said = [line.partition(";")[0] for line in sentences(self.record)]  # what fits a phone
        self.draw(axes, len(self.record.times) - 1, "\n".join(["", *said]))
        written(figure, path)

    @style()
    def animation(self, path: Path) -> None:
        """The whole run as GIF, at a constant rate of model time."""
        n = len(self.record.times)
        frames = np.linspace(0, n - 1, min(n, FRAMES)).round().astype(int).tolist()
        (figure, axes), writer = self.figure(), PillowWriter(RATE)
        with writer.saving(figure, path, DPI):
            for i in track(frames, "animation", len(frames)):
                axes.clear()
                self.draw(axes, i)
                writer.grab_frame()

    def _width(self, stress):
        """Line width (points) of a normal stress (Pa)."""
        return 0.9 + 3.5 * np.clip(np.asarray(stress) / self.stress, 0, 1.2)


@style()
def curves(record: Record, path: Path) -> None:
    """Stress and dilation of the sheared joints against sliding, and of the law alone."""
    figure = Figure(figsize=(7, 7))
    upper, lower = figure.subplots(2, sharex=True)
    for moving, base in record.scene.shear:
        name = record.scene.blocks[moving].name
        keys = ("slid_m", "closure_m", "normal_Pa", "shear_Pa")
        slid, closure, stress, tau = (record.column(f"{name}: {key}") for key in keys)
        upper.plot(1e3 * slid, 1e-3 * tau, label=f"{name} (blocks)")
        lower.plot(1e3 * slid, 1e3 * (closure[0] - closure))
        law = record.scene.laws[record.laws[moving, base]]
        if alone := shear_curve(law, float(stress[0]), slid):
            dots, label = {"color": "k", "ls": ":"}, "law alone, at the normal stress of the start"
            upper.plot(1e3 * alone.shear_2, 1e-3 * alone.F2, label=label, **dots)
            lower.plot(1e3 * alone.shear_2, 1e3 * (alone.closure[0] - alone.closure), **dots)
    upper.set(title=record.scene.title, ylabel="shear stress (kPa)")
    lower.set(ylabel="dilation since seating (mm)", xlabel="shear displacement (mm)")
    figure.legend(loc="outside lower center", ncols=3)
    written(figure, path)
