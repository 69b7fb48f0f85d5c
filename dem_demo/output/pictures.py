"""Pictures of a run: how far the blocks have moved and the state of their joints, one frame or a
GIF; and curves."""

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap, Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jointlaw.support.progress import track
from jointlaw.support.pyplot import escape_math, style, written

from ..scene import median_size, rotation
from .monitors import shear_curve
from .record import CREEP, Record, sentences

FIXED, MARKED, WATER = "#8d8d8d", "#c2187a", "#1f6fd0"
MOVED = ListedColormap(colormaps["Purples"](np.linspace(0.05, 0.65, 100)))
STATES = {  # of a joint: colour and line
    "stuck": ("#3a3a3a", "-"), "partly sliding": ("#e69f00", "-"), "sliding": ("#d81b1b", "-"),
    "open": ("#1f9ed1", "--"),
}  # fmt: skip
PARTIAL, FULL = 0.05, 0.9  # shares of the shear capacity in sliding that divide the states
FRAMES, RATE, DPI = 60, 11, 75  # of an animation: most frames, frames per second
FEW = 12  # blocks: most that bear their names
ARROW = 0.02  # of the farthest: shorter ways bear no arrow


def outlines(record: Record, i: int) -> list[np.ndarray]:
    """Corners (m, 2) of all blocks in frame i (m); NaN for those that are gone."""
    return [
        block.local @ rotation(angle).T + [x, y]
        for block, (x, y, angle) in zip(record.scene.blocks, record.motion[i][:3].T, strict=True)
    ]


def pressure(stress: float) -> tuple[float, str]:
    """The unit in which a stress (Pa) is told, and what it is times Pa."""
    return (1e-6, "MPa") if stress >= 1e6 else (1e-3, "kPa")


class Pictures:
    """Draws a run, all frames to one scale: low, high (2,) in m, of the blocks that move and what
    is beside them; colours by distances moved, up to `most` (m); widths by `stress` (Pa).

    That is the stress of the start, or of all frames where nothing touches then: those of impacts
    would make all others hair lines. title: that of the scene unless another is given; marked (n,):
    blocks to be marked, and what they are; without it those that nothing held at the start.
    """

    def __init__(
        self, record: Record, title: str | None = None, marked: np.ndarray | None = None,
        mark: str = "block that nothing holds",
    ) -> None:  # fmt: skip
        self.record, self.title = record, title or record.scene.title
        self.marked, self.mark = record.loose if marked is None else marked, mark
        blocks = record.scene.blocks
        corners = np.concatenate([
            shape for i in (0, -1)
            for block, shape in zip(blocks, outlines(record, i), strict=True) if block.moves
        ])  # fmt: skip
        low, high = np.nanmin(corners, axis=0), np.nanmax(corners, axis=0)
        margin = 0.07 * (high - low).max()
        self.low, self.high = low - margin, high + margin
        self.free = np.array([not block.fixed for block in blocks])
        self.most = max(float(np.nanmax(record.moved[self.free])), 1e-6)
        size = median_size(block for block in blocks if not block.fixed)
        self.longer = float(f"{0.5 * size / self.most:.0e}")  # of arrows than what they stand for
        self.unit, self.name = (1e3, "mm") if self.most < 0.1 else (1.0, "m")
        frames = [frame["normal_stress_Pa"] for frame in record.joints]
        start, whole = (stress[stress > 0] for stress in (frames[0], np.concatenate(frames)))
        pressed = start if len(start) else whole
        self.stress = float(np.quantile(pressed, 0.9)) if len(pressed) else 1.0

    def states(self, i: int) -> np.ndarray:
        """State (k,) of the joints of frame i, as one of the names in STATES.

        A joint that moves along itself slower than CREEP is stuck, whatever part of its asperities
        waits at the friction limit.
        """
        now = self.record.joints[i]
        shares = now["slipping"] / np.maximum(1 - now["separated"], 1e-12)
        rests = np.abs(now["sliding_m/s"]) <= CREEP
        is_open = now["normal_stress_Pa"] <= 1e-3 * self.stress
        asked = [is_open, rests | (shares <= PARTIAL), shares <= FULL]
        return np.select(asked, ["open", "stuck", "partly sliding"], "sliding")

    def figure(self) -> tuple[Figure, Axes]:
        """An empty frame with its legend: states, a round stress, how long the arrows are."""
        (wide, high), scene = self.high - self.low, self.record.scene
        across = min(6.5, 6.0 * wide / high)
        figure = Figure(figsize=(max(across + 1.0, 7.5), across * high / wide + 2.6))
        stress, unit, name = float(f"{self.stress:.1g}"), *pressure(self.stress)
        lines = [
            *((f"joint {state}", {"color": colour, "ls": line, "lw": 2.0})
              for state, (colour, line) in STATES.items()),
            (f"{'effective ' * scene.wet}normal stress {unit * stress:g} {name}",
             {"color": STATES["stuck"][0], "lw": self._width(stress)}),
            (f"displacement, drawn × {self.longer:g}", {"color": "k", "lw": 1.0, "marker": ">"}),
            *[("water table", {"color": WATER, "ls": "-."})] * bool(scene.water),
            *[(self.mark, {"color": MARKED, "lw": 2.0})] * bool(self.marked.any()),
        ]  # fmt: skip
        figure.legend(handles=[Line2D([], [], label=label, **drawn) for label, drawn in lines],
                      loc="outside lower center", ncols=3, frameon=False)  # fmt: skip
        axes, scale = figure.add_subplot(), Normalize(0.0, self.unit * self.most)
        figure.colorbar(
            ScalarMappable(scale, MOVED), ax=axes, location="bottom", aspect=50,
            label=f"moved since the start ({self.name})",
        )  # fmt: skip
        return figure, axes

    def draw(self, axes: Axes, i: int, note: str = "") -> None:
        """Frame i: blocks, colour and arrow by displacement; joints, colour by state, width by
        normal stress; a note below the title."""
        record, blocks, shapes = self.record, self.record.scene.blocks, outlines(self.record, i)
        moved = record.displaced(i)
        colours = MOVED(np.hypot(*moved.T) / self.most)
        colours[~self.free] = to_rgba(FIXED)
        for which, edge, width in ((~self.marked, "0.45", 0.6), (self.marked, MARKED, 2.0)):
            axes.add_collection(PolyCollection(
                [shapes[j] for j in np.flatnonzero(which)], facecolors=colours[which],
                edgecolors=edge, linewidths=width,
            ))  # fmt: skip
        far = self.free & (np.hypot(*moved.T) > ARROW * self.most)
        tails, arrows = record.motion[i][:2].T[far], self.longer * moved[far]
        axes.quiver(
            *tails.T, *arrows.T, angles="xy", scale_units="xy", scale=1.0, width=0.003, zorder=5
        )
        if len(blocks) <= FEW:
            for block, shape in zip(blocks, shapes, strict=True):
                name = escape_math(block.name)
                axes.text(*shape.mean(axis=0), name, ha="center", va="center", clip_on=True)
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
        axes.set(xlim=(self.low[0], self.high[0]), xlabel="x (m)", aspect="equal",
                 ylim=(self.low[1], self.high[1]), ylabel="y (m)")  # fmt: skip
        title = f"{self.title}\nt = {record.times[i]:.2f} s{note}"
        axes.figure.suptitle(escape_math(title))

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
        return 0.7 + 2.0 * np.clip(np.asarray(stress) / self.stress, 0, 1.2)


@style()
def curves(record: Record, path: Path) -> None:
    """Stress and dilation of the sheared joints against sliding, and of the law alone."""
    figure = Figure(figsize=(7, 7))
    upper, lower = figure.subplots(2, sharex=True)
    for moving, base in record.scene.shear:
        name = record.scene.blocks[moving].name
        slid, closure, stress, tau = (
            record.column(f"{name}: {key}")
            for key in ("slid_m", "closure_m", "normal_Pa", "shear_Pa")
        )
        unit, told = pressure(float(stress.max()))
        upper.plot(1e3 * slid, unit * tau, label=escape_math(f"{name} (blocks)"))
        lower.plot(1e3 * slid, 1e3 * (closure[0] - closure))
        law = record.scene.laws[record.laws[moving, base]]
        if alone := shear_curve(law, float(stress[0]), slid):
            dots, label = {"color": "k", "ls": ":"}, "law alone, at the normal stress of the start"
            upper.plot(1e3 * alone.shear_2, unit * alone.F2, label=label, **dots)
            lower.plot(1e3 * alone.shear_2, 1e3 * (alone.closure[0] - alone.closure), **dots)
    upper.set(title=escape_math(record.scene.title), ylabel=f"shear stress ({told})")
    lower.set(ylabel="dilation since seating (mm)", xlabel="shear displacement (mm)")
    figure.legend(loc="outside lower center", ncols=3)
    written(figure, path)
