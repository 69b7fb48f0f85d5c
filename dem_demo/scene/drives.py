"""Prescribed motions: a base that tilts, a machine that shears."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from .blocks import Block
from .tables import Table

AXES = {"x": 0, "y": 1, "turn": 2}


@dataclass(frozen=True)
class Reversal:
    """What a drive does once `block` has slid `slid` (m) along it: go back `by` at `rate` (1/s)."""

    block: int
    slid: float
    by: float
    rate: float


@dataclass(frozen=True)
class Drive:
    """Motion of one block along "x" or "y" (m) or "turn" (rad) about its centroid.

    Straight lines between (times, values), averaged over the last `ease` seconds so that the
    machine does not strike the rock at a corner; before and after them the block rests.
    """

    block: int
    axis: int
    times: tuple[float, ...]
    values: tuple[float, ...]
    ease: float
    back: Reversal | None = None

    def __call__(self, t: float, reversed_at: float = np.inf) -> float:
        """Prescribed displacement at time t, when it was sent back at `reversed_at`."""
        if self.ease == 0:
            return float(self._line(np.array([t]), reversed_at)[0])
        low, corners = t - self.ease, [*self.times]
        if self.back and np.isfinite(reversed_at):
            end = reversed_at + self.back.by / self.back.rate
            corners = sorted([*corners, reversed_at, end])
        knots = np.array([low, *(s for s in corners if low < s < t), t])
        values = self._line(knots, reversed_at)
        return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(knots)) / self.ease)

    def _line(self, t: np.ndarray, reversed_at: float) -> np.ndarray:
        values = np.interp(np.minimum(t, reversed_at), self.times, self.values)
        if self.back and np.isfinite(reversed_at):
            values = values - np.clip(self.back.rate * (t - reversed_at), 0.0, self.back.by)
        return values


class Drives:
    """The drives of a scene. reversed_at (d,): when each was told to go back, inf before (s)."""

    def __init__(self, drives: tuple[Drive, ...]) -> None:
        self.drives = drives
        self.rows = np.array([d.block for d in drives], int)
        self.axes = np.array([d.axis for d in drives], int)

    def velocity(self, t: float, dt: float, reversed_at: np.ndarray) -> np.ndarray:
        """Velocities that carry the drives exactly from t to t + dt."""
        out = np.zeros(len(self.drives))
        for i, (d, at) in enumerate(zip(self.drives, reversed_at, strict=True)):
            if len(d.times) > 1:
                out[i] = (d(t + dt, at) - d(t, at)) / dt
        return out

    def reverse(
        self, t: float, reversed_at: np.ndarray, slid: Callable[[int, int], float]
    ) -> np.ndarray:
        """Send back those drives whose block has slid far enough; slid(block, base) in m."""
        out = reversed_at.copy()
        for i, d in enumerate(self.drives):
            if d.back and t < out[i] and slid(d.back.block, d.block) > d.back.slid:
                out[i] = t
        return out


def read_drives(top: Table, number: dict[str, int], blocks: Sequence[Block]) -> tuple[Drive, ...]:
    """The drives of a scene's `[[drive]]` tables and of its blocks' `held` motions.

    number: of each block by name. Raises SceneError.
    """
    out = [
        Drive(i, AXES[axis], (0.0,), (0.0,), 0.0) for i, b in enumerate(blocks) for axis in b.held
    ]
    for table in top.tables("drive", []):
        block, motion = table.take("block", str), table.take("motion", str)
        if block not in number or blocks[number[block]].fixed:
            raise table.error("block", "must be a block that is not fixed")
        if motion not in AXES:
            raise table.error("motion", "must be x, y or turn")
        times, values = table.numbers("times"), table.numbers("values")
        if len(times) != len(values) or len(times) < 1 or (np.diff(times) <= 0).any():
            raise SceneError(f"{table.path('times')}: must increase, one for each of `values`")
        unit = np.pi / 180 if motion == "turn" else 1.0
        ease = table.take("ease", float, 0.1, least=0)
        line = tuple(times), tuple(unit * values)
        back = _reversal(table, number, unit)
        out.append(Drive(number[block], AXES[motion], *line, ease, back))
        table.finish()
    moved = [(d.block, d.axis) for d in out]
    if len(set(moved)) < len(moved):
        raise SceneError(f"{top.path('drive')}: a motion of a block is prescribed twice")
    return tuple(out)


def _reversal(drive: Table, number: dict[str, int], unit: float) -> Reversal | None:
    data = drive.take("back", dict, {})
    if not data:
        return None
    table = Table(data, drive.path("back"))
    block = table.take("block", str)
    if block not in number:
        raise table.error("block", "no such block")
    slid = table.take("slid", float, above=0, say="m")
    by, rate = (table.take(key, float, above=0) * unit for key in ("by", "rate"))
    table.finish()
    return Reversal(number[block], slid, by, rate)
