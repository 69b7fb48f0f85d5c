"""Prescribed motions: a base that tilts, a machine that shears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .shapes import Block
from .tables import SceneError, Table

AXES = {"x": 0, "y": 1, "turn": 2}


@dataclass(frozen=True)
class Back:
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
    back: Back | None = None

    def __call__(self, t: float, turned_at: float = np.inf) -> float:
        """Prescribed displacement at time t, when the way back was triggered at `turned_at`."""
        if self.ease == 0:
            return float(self._line(np.array([t]), turned_at)[0])
        low, corners = t - self.ease, [*self.times]
        if self.back and np.isfinite(turned_at):
            end = turned_at + self.back.by / self.back.rate
            corners = sorted([*corners, turned_at, end])
        knots = np.array([low, *(s for s in corners if low < s < t), t])
        values = self._line(knots, turned_at)
        return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(knots)) / self.ease)

    def _line(self, t: np.ndarray, turned_at: float) -> np.ndarray:
        values = np.interp(np.minimum(t, turned_at), self.times, self.values)
        if self.back and np.isfinite(turned_at):
            values = values - np.clip(self.back.rate * (t - turned_at), 0.0, self.back.by)
        return values


class Drives:
    """All prescribed motions of a scene, and when each was told to go back (s)."""

    def __init__(self, drives: tuple[Drive, ...]) -> None:
        self.drives = drives
        self.rows = np.array([d.block for d in drives], int)
        self.axes = np.array([d.axis for d in drives], int)
        self.turned_at = np.full(len(drives), np.inf)
        self.waiting = any(d.back for d in drives)
        self._still = np.array([len(d.times) == 1 for d in drives])

    def velocity(self, t: float, dt: float) -> np.ndarray:
        """Velocities that carry the drives exactly from t to t + dt."""
        out = np.zeros(len(self.drives))
        for i, (d, at) in enumerate(zip(self.drives, self.turned_at, strict=True)):
            if not self._still[i]:
                out[i] = (d(t + dt, at) - d(t, at)) / dt
        return out

    def watch(self, t: float, slid) -> None:
        """Send back those drives whose block has slid far enough; slid(block, base) in m."""
        for i, d in enumerate(self.drives):
            if d.back and t < self.turned_at[i] and slid(d.back.block, d.block) > d.back.slid:
                self.turned_at[i] = t
        self.waiting = any(
            d.back and t < at for d, at in zip(self.drives, self.turned_at, strict=True)
        )


def read_drives(
    top: Table, where: str, number: dict[str, int], blocks: Sequence[Block]
) -> tuple[Drive, ...]:
    """The drives of a scene's `[[drive]]` tables and of its blocks' `held` motions.

    number: of each block by name. Raises SceneError.
    """
    out = [
        Drive(i, AXES[axis], (0.0,), (0.0,), 0.0) for i, b in enumerate(blocks) for axis in b.held
    ]
    for n, data in enumerate(top.take("drive", list, [])):
        table = Table(data, f"{where}.drive[{n}]")
        block, motion = table.take("block", str), table.take("motion", str)
        if block not in number or blocks[number[block]].fixed:
            raise SceneError(
                f"{table.path('block')} = {block!r}: must be a block that is not fixed"
            )
        if motion not in AXES:
            raise SceneError(f"{table.path('motion')} = {motion!r}: must be x, y or turn")
        times, values = table.numbers("times"), table.numbers("values")
        if len(times) != len(values) or len(times) < 1 or (np.diff(times) <= 0).any():
            raise SceneError(f"{table.path('times')}: must increase, one for each of `values`")
        unit = np.pi / 180 if motion == "turn" else 1.0
        ease = table.take("ease", float, 0.1, least=0)
        way = tuple(times), tuple(unit * values)
        back = _way_back(table, number, unit)
        out.append(Drive(number[block], AXES[motion], *way, ease, back))
        table.finish()
    moved = [(d.block, d.axis) for d in out]
    if len(set(moved)) < len(moved):
        raise SceneError(f"{where}.drive: a motion of a block is prescribed twice")
    return tuple(out)


def _way_back(table: Table, number: dict[str, int], unit: float) -> Back | None:
    if not (data := table.take("back", dict, {})):
        return None
    back = Table(data, table.path("back"))
    block = back.take("block", str)
    if block not in number:
        raise SceneError(f"{back.path('block')} = {block!r}: no such block")
    slid = back.take("slid", float, above=0, say="m")
    by, rate = (back.take(key, float, above=0) * unit for key in ("by", "rate"))
    back.finish()
    return Back(number[block], slid, by, rate)
