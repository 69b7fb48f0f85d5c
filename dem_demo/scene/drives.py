"""Prescribed motions: a base that tilts, a machine that shears, an earthquake that shakes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from ..errors import SceneError
from .blocks import Block
from .files import Files
from .tables import Table

AXES = {"x": 0, "y": 1, "turn": 2}
# first row of a CSV file: of which time derivative of the motion its second column is
TITLES = {"time_s,velocity_m/s": 1, "time_s,acceleration_m/s2": 2}
SAMPLES = 40  # of a sine, per cycle


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
    With `order` 1 or 2 the values are velocities or accelerations (m/s, m/s2), and after the last
    the block keeps its velocity, so that nothing strikes it. `period` (s) is that of a sine.
    """

    block: int
    axis: int
    times: tuple[float, ...]
    values: tuple[float, ...]
    ease: float = 0.0
    back: Reversal | None = None
    order: int = 0
    period: float = 0.0

    @cached_property
    def path(self) -> BSpline:
        """Displacement (m) over the time (s), where `order` is 1 or 2."""
        return make_interp_spline(self.times, self.values, k=1).antiderivative(self.order)

    def __call__(self, t: float, reversed_at: float = np.inf) -> float:
        """Prescribed displacement at time t, when it was sent back at `reversed_at`."""
        if self.order:
            at = np.clip(t, self.times[0], self.times[-1])
            return float(self.path(at) + max(t - at, 0.0) * self.path(at, nu=1))
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
            gone = np.clip(self.back.rate * (t - reversed_at), 0.0, self.back.by)
            ways = np.sign(np.diff(self.values))[np.array(self.times[:-1]) < reversed_at]
            came = ways[ways != 0][-1:]
            values = values - gone * (came[0] if came.size else 1.0)
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


def read_drives(
    top: Table, number: dict[str, int], blocks: Sequence[Block], files: Files
) -> tuple[Drive, ...]:
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
        kinds = [key for key in ("file", "sine") if key in table.data]
        if kinds and motion == "turn":
            raise table.error(kinds[0], "shakes along x or y; for a turn give times and values")
        if kinds:
            what = table, number[block], AXES[motion]
            out.append(_record(*what, files) if kinds[0] == "file" else _sine(*what))
        else:
            out.append(_lines(table, number, number[block], motion))
        table.finish()
    moved = [(d.block, d.axis) for d in out]
    if len(set(moved)) < len(moved):
        raise SceneError(f"{top.path('drive')}: a motion of a block is prescribed twice")
    return tuple(out)


def _lines(table: Table, number: dict[str, int], block: int, motion: str) -> Drive:
    """A drive along straight lines between displacements."""
    times, values = table.numbers("times"), table.numbers("values")
    if len(times) != len(values) or len(times) < 1 or (np.diff(times) <= 0).any():
        raise SceneError(f"{table.path('times')}: must increase, one for each of `values`")
    unit = np.pi / 180 if motion == "turn" else 1.0
    ease = table.take("ease", float, 0.1, least=0)
    line = tuple(times), tuple(unit * values)
    return Drive(block, AXES[motion], *line, ease, _reversal(table, number, unit))


def _sine(drive: Table, block: int, axis: int) -> Drive:
    """A drive whose acceleration is a sine; it rises over a cycle before, and falls after."""
    table = Table(drive.take("sine", dict), drive.path("sine"))
    size, frequency = (table.take(key, float, above=0) for key in ("acceleration", "frequency"))
    cycles = table.whole("cycles", 10, least=1)
    table.finish()
    phase = np.arange((cycles + 2) * SAMPLES + 1) / SAMPLES  # in cycles
    envelope = np.clip(np.minimum(phase, cycles + 2 - phase), 0.0, 1.0)
    values = size * envelope * np.sin(2 * np.pi * phase)
    line = tuple((phase / frequency).tolist()), tuple(values.tolist())
    return Drive(block, axis, *line, order=2, period=1 / frequency)


def _record(drive: Table, block: int, axis: int, files: Files) -> Drive:
    """A drive from a CSV file of velocities or accelerations.

    Raises SceneError naming the line that is wrong.
    """
    name, scale = drive.take("file", str), drive.take("scale", float, 1.0)
    where = f"{drive.path('file')}: {files.folder / name}"
    try:
        lines = files[name].splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{where} cannot be read ({error}); give a CSV file in UTF-8") from None
    order = TITLES.get("".join(lines[0].split())) if lines else None
    if order is None:
        raise SceneError(f"{where}, line 1: must be {' or '.join(map(repr, TITLES))}")
    rows: list[tuple[float, float]] = []
    for n, line in enumerate(lines[1:], 2):
        try:
            time, value = map(float, line.split(","))
        except ValueError:
            time = value = np.nan
        if not (np.isfinite(time) and np.isfinite(value)):
            raise SceneError(f"{where}, line {n}: {line!r} must be two numbers, time and value")
        if time < 0 or (rows and time <= rows[-1][0]):
            raise SceneError(f"{where}, line {n}: time {time:g} s must be >= 0 and increase")
        if not rows and order == 1 and value:
            raise SceneError(f"{where}, line {n}: velocity {value:g} m/s must be 0: blocks rest")
        rows.append((time, value))
    if len(rows) < 2:
        raise SceneError(f"{where}: must have two rows of numbers or more under its first line")
    times, values = zip(*rows, strict=True)
    return Drive(block, axis, times, tuple(scale * v for v in values), order=order)


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
