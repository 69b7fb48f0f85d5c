"""Pictures of a run: blocks with the state of their joints, a frame or a GIF; and curves."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from jointlaw.support.progress import track

from ..dynamics.energy import COLUMNS
from ..scene import turn
from .monitors import shear_curve
from .record import CREEP, Record, outcomes, sentence

FIXED, DRIVEN, FREE = "#8d8d8d", "#b9b4a7", "#efe9dc"
STATES = {"stuck": "#3a3a3a", "partly sliding": "#e69f00", "sliding": "#d81b1b", "open": "#1f9ed1"}
DASHED = (0, (2, 1.5))
PARTIAL, FULL = 0.05, 0.9  # shares of the shear capacity in sliding that divide the states
LABELS = {
    "potential": "potential (gravity)", "work": "work of drives and loads",
    "kinetic": "kinetic", "stored": "stored in joints", "friction": "friction in joints",
    "dashpots": "dashpots", "dropped": "lost with contacts that end",
}  # fmt: skip
FRAMES = 60  # most frames of an animation
FEW = 12  # blocks: most that bear their names


def outlines(record: Record, i: int) -> list[np.ndarray]:
    """Corners (m, 2) of all blocks in frame i (m)."""
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
        n = len(record.times)
        corners = np.concatenate([c for i in (0, n - 1) for c in outlines(record, i)])
        self.low, self.high = corners.min(axis=0), corners.max(axis=0)
        self.size = float(max(self.high - self.low))
        start = record.joint(0, "normal_stress_Pa")
        whole = [record.joint(i, "normal_stress_Pa") for i in range(n)]
        pressed = start[start > 0] if (start > 0).any() else np.concatenate(whole)
        pressed = pressed[pressed > 0]
        self.stress = float(np.quantile(pressed, 0.9)) if len(pressed) else 1.0

    def states(self, i: int) -> np.ndarray:
        """State (k,) of the joints of frame i, as one of the names in STATES.

        A joint that moves along itself slower than CREEP is stuck, whatever part of its asperities
        waits at the friction limit.
        """
        shares = self.record.joint(i, "slipping")
        shares = shares / np.maximum(1 - self.record.joint(i, "separated"), 1e-12)
        moves = np.abs(self.record.joint(i, "sliding_m/s")) > CREEP
        names = np.where(moves & (shares > PARTIAL), "partly sliding", "stuck")
        names = np.where(moves & (shares > FULL), "sliding", names)
        closed = self.record.joint(i, "normal_stress_Pa") > 1e-3 * self.stress
        return np.where(closed, names, "open")

    def draw(self, axes: Axes, i: int) -> None:
        """Blocks of frame i, dotted where they were at the start, and joints: colour by state,
        width by normal stress."""
        blocks, shapes = self.record.scene.blocks, outlines(self.record, i)
        drawn = zip(blocks, outlines(self.record, 0), strict=True)
        start = [shape for block, shape in drawn if not block.fixed]
        style = {"facecolors": "none", "edgecolors": "0.7", "linestyles": ":", "linewidths": 0.7}
        axes.add_collection(PolyCollection(start, **style))
        colours = [FIXED if b.fixed else DRIVEN if len(b.held) > 1 else FREE for b in blocks]
        style = {"facecolors": colours, "edgecolors": "0.45", "linewidths": 0.6}
        axes.add_collection(PolyCollection(shapes, **style))
        if len(blocks) <= FEW:
            for block, shape in zip(blocks, shapes, strict=True):
                axes.text(*shape.mean(axis=0), block.name, fontsize=8, ha="center", va="center")
        ends, state = self.record.joints[i]["ends"], self.states(i)
        stress = self.record.joint(i, "normal_stress_Pa")
        for name, colour in STATES.items():
            here = state == name
            style = {"linestyles": DASHED, "linewidths": 1.3}
            if name != "open":
                style = {"linewidths": self._width(stress[here])}
            axes.add_collection(LineCollection(ends[here], colors=colour, zorder=3, **style))
        margin = 0.03 * self.size
        axes.set(xlim=(self.low[0] - margin, self.high[0] + margin), xlabel="x (m)", aspect="equal")
        axes.set(ylim=(self.low[1] - margin, self.high[1] + margin), ylabel="y (m)")

    def frame(self, i: int, dpi: int, note: str = "") -> Figure:
        """One frame, laid out in inches so that the frames of an animation do not jump."""
        wide, high = self.high - self.low + 0.06 * self.size
        across = min(8.2, 6.0 * wide / high)
        tall = across * high / wide
        size = max(across + 1.4, 7.5), tall + 1.65 + 0.17 * note.count("\n")
        figure = Figure(figsize=size, dpi=dpi)
        FigureCanvasAgg(figure)
        left = 0.5 * (size[0] - across) + 0.3
        place = left / size[0], 1.1 / size[1], across / size[0], tall / size[1]
        self.draw(figure.add_axes(place), i)
        figure.legend(handles=self.key(), loc="lower center", ncols=4, fontsize=8, frameon=False)
        title = f"{self.record.scene.title}\n{caption(self.record, i)}{note}"
        figure.suptitle(title, fontsize=9, y=1 - 0.08 / size[1], va="top")
        return figure

    def final(self, path: Path) -> None:
        """The last frame, with slip angles and what became of each rock."""
        parts = [sentence(entry) for entry in outcomes(self.record)]
        for slip in self.record.slips.report():
            if slip["slip_angle"] is not None:
                parts.append(f"{slip['block']} slipped at {slip['slip_angle']:.2f}°")
                if slip["predicted_angle"] is not None:
                    parts[-1] += f", the law alone says {slip['predicted_angle']:.2f}°"
        note = "".join(f"\n{part}" for part in parts)
        self.frame(len(self.record.times) - 1, 130, note).savefig(path)

    def animation(self, path: Path) -> None:
        """The whole run as GIF, at a constant rate of model time."""
        times = self.record.times
        wanted = np.linspace(times[0], times[-1], min(len(times), FRAMES))
        frames = np.unique(np.abs(np.subtract.outer(wanted, times)).argmin(axis=1))
        images = []
        for i in track(frames, "animation", len(frames)):
            figure = self.frame(i, 75)
            figure.canvas.draw()
            image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
            images.append(image.quantize(256, dither=Image.Dither.NONE))
        pause = [90] * (len(images) - 1) + [2000]
        images[0].save(path, save_all=True, append_images=images[1:], duration=pause, loop=0)

    def key(self) -> list[Line2D]:
        """What the lines mean: states, two round stresses, the dots of the start."""
        marks = []
        for name, colour in STATES.items():
            style = {"lw": 1.3, "ls": DASHED} if name == "open" else {"lw": 2.5}
            marks.append(Line2D([], [], color=colour, label=f"joint {name}", **style))
        for share in (0.25, 1.0):
            stress = float(f"{share * self.stress:.1g}")
            label, width = f"normal stress {1e-3 * stress:g} kPa", self._width(stress)
            marks.append(Line2D([], [], color=STATES["stuck"], lw=width, label=label))
        return [*marks, Line2D([], [], color="0.6", ls=":", lw=0.9, label="place at the start")]

    def _width(self, stress):
        """Line width (points) of a normal stress (Pa)."""
        return 0.4 + 4.0 * np.clip(np.asarray(stress) / self.stress, 0, 1.2)


def caption(record: Record, i: int) -> str:
    """Time and what is monitored, for the title of a frame."""
    parts, row = [f"t = {record.times[i]:.2f} s"], record.monitored[i]
    for moving, _ in record.laws:
        name = record.scene.blocks[moving].name
        slid, angle = round(1e3 * row[f"{name}: slid_m"], 2) + 0.0, row[f"{name}: base angle_deg"]
        tau = 1e-3 * row[f"{name}: shear_Pa"]
        parts.append(f"{name}: slid {slid:.2f} mm, shear {tau:.1f} kPa, base at {angle:.2f}°")
    return "; ".join(parts)


def energy(record: Record, path: Path) -> None:
    """Where the energy is, where it went, and how well it balances."""
    t, columns = record.times, [*COLUMNS, "error"]
    of = dict(zip(columns, np.transpose(record.energy), strict=True))
    figure, top, low = _figure()
    for name, label in LABELS.items():
        top.plot(t, 1e-3 * of[name], label=label)
    low.plot(t, 1e6 * of["error"], color="k")
    low.set(ylabel="imbalance (ppm of the\nenergy turned over)", xlabel="time (s)")
    top.set_ylabel("energy (kJ)")
    _finish(figure, top, record, path)


def joints(record: Record, path: Path) -> None:
    """Stress and dilation of the sheared joints against sliding, and of the law alone."""
    figure, upper, lower = _figure()
    for moving, base in record.scene.monitors.shear:
        name = record.scene.blocks[moving].name
        keys = ("slid_m", "closure_m", "normal_Pa", "shear_Pa")
        slid, closure, stress, tau = (record.column(f"{name}: {key}") for key in keys)
        upper.plot(1e3 * slid, 1e-3 * tau, label=f"{name} (blocks)")
        lower.plot(1e3 * slid, 1e3 * (closure[0] - closure))
        law = record.scene.laws[record.laws[moving, base]]
        if alone := shear_curve(law, float(stress[0]), slid):
            style = {"color": "k", "ls": ":", "lw": 1.5}
            label = "law alone, at the normal stress of the start"
            upper.plot(1e3 * alone.shear_2, 1e-3 * alone.F2, label=label, **style)
            lower.plot(1e3 * alone.shear_2, 1e3 * (alone.closure[0] - alone.closure), **style)
    upper.set_ylabel("shear stress (kPa)")
    lower.set(ylabel="dilation since seating (mm)", xlabel="shear displacement (mm)")
    _finish(figure, upper, record, path)


def _figure():
    figure = Figure(figsize=(8, 7), dpi=120, layout="constrained")
    return figure, *figure.subplots(2, sharex=True)


def _finish(figure: Figure, first, record: Record, path: Path) -> None:
    first.set_title(record.scene.title)
    figure.legend(fontsize=8, ncols=3, loc="outside lower center")
    for axes in figure.axes:
        axes.grid(alpha=0.3)
    figure.savefig(path)
