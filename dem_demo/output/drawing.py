"""What the pictures of a run share: scales, blocks, keys."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D

from ..scene import turn
from .record import JOINT_COLUMNS, Record

CLOSURE, _, STRESS, TAU, _, SLIPPING, SEPARATED, _, RATE = range(len(JOINT_COLUMNS))
FIXED, DRIVEN, FREE, OPEN, SLIDES = "#8d8d8d", "#b9b4a7", "#efe9dc", "#1f9ed1", "#d81b1b"


class Scale:
    """What colours and widths mean, the same in every frame: friction angle and stress."""

    def __init__(self, record: Record, frames: Sequence[int]) -> None:
        values = np.concatenate([record.joints[i]["values"] for i in frames])
        closed = values[values[:, STRESS] > 0]
        angle = np.degrees(np.arctan2(np.abs(closed[:, TAU]), closed[:, STRESS]))
        self.stress = float(np.percentile(closed[:, STRESS], 98)) if len(closed) else 1.0
        firm = angle[closed[:, STRESS] > 0.02 * self.stress]
        top = max(5.0, np.ceil(float(firm.max(initial=0.0)) / 5 - 1e-6) * 5)
        self.angle = Normalize(0.0, top)
        corners = np.concatenate([c for i in frames for c in outlines(record, i)])
        self.low, self.high = corners.min(axis=0), corners.max(axis=0)
        self.size = float(max(self.high - self.low))

    def width(self, stress):
        """Line width (points) of a normal stress (Pa)."""
        return 0.8 + 8.0 * np.clip(np.asarray(stress) / self.stress, 0, 1.2)

    def marks(self, thinner: float = 1.0) -> list[Line2D]:
        """Keys of two round stresses: their lines, so much thinner."""
        power = 10.0 ** np.floor(np.log10(self.stress))
        most = self.stress * (1 + 1e-9)
        leading = max(digit for digit in (1, 2, 5) if digit * power <= most)
        return [
            Line2D([], [], color="0.3", lw=thinner * self.width(stress), label=_pressure(stress))
            for stress in (0.25 * leading * power, leading * power)
        ]


def outlines(record: Record, i: int) -> list[np.ndarray]:
    """Corners of all blocks in frame i."""
    return [
        block.local @ turn(angle).T + [x, y]
        for block, (x, y, angle) in zip(record.scene.blocks, record.motion[i][:3].T, strict=True)
    ]


def draw_blocks(
    axes: Axes, record: Record, i: int, scale: Scale,
    line=0.7, edge="0.35", start="0.6", margin=0.04,
) -> list[np.ndarray]:  # fmt: skip
    """The blocks of frame i, dotted where they were at the start; their corners.

    line: width in points; edge, start: greys; margin: share of the size left around them.
    """
    blocks = record.scene.blocks
    drawn = zip(blocks, outlines(record, 0), strict=True)
    axes.add_collection(
        PolyCollection(
            [shape for block, shape in drawn if not block.fixed], facecolors="none",
            edgecolors=start, linestyles=":", linewidths=line + 0.1,
        )
    )  # fmt: skip
    shapes = outlines(record, i)
    colours = [FIXED if b.fixed else DRIVEN if len(b.held) > 1 else FREE for b in blocks]
    axes.add_collection(
        PolyCollection(shapes, facecolors=colours, edgecolors=edge, linewidths=line)
    )
    low, high = scale.low - margin * scale.size, scale.high + margin * scale.size
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    return shapes


def positive(values: np.ndarray) -> np.ndarray:
    """What a logarithmic axis can show."""
    return np.where(values > 0, values, np.nan)


def _pressure(stress: float) -> str:
    return f"{stress / 1e3:.3g} kPa" if stress < 1e6 else f"{stress / 1e6:g} MPa"
