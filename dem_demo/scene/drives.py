"""Prescribed motions: a base that tilts, a machine that shears, an earthquake that shakes.

Records of earthquakes and of machines are CSV files of time and of what the rock does then.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from jointlaw.support.checks import finite, one_of

from .blocks import Block
from .keys import AXES, Tables
from .laws import Files

SAMPLES = 40  # of a sine, per cycle
# Keys that go together, of the three ways to say a motion
WAYS = {"times", "values", "ease", "back"}, {"sine"}, {"file", "scale", "baseline"}
UNITS = {  # of the second column: which time derivative of the motion it is, and its SI unit
    "m": (0, 1.0), "cm": (0, 1e-2), "mm": (0, 1e-3),
    "m/s": (1, 1.0), "cm/s": (1, 1e-2), "mm/s": (1, 1e-3),
    "m/s2": (2, 1.0), "cm/s2": (2, 1e-2), "gal": (2, 1e-2), "g": (2, 9.80665),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Drive:
    """Motion of blocks, all alike, along "x" or "y" (m) or "turn" (rad) about their centroids.

    Straight lines between (times, values), averaged over the last `ease` seconds so that the
    machine does not strike the rock at a corner; before and after them the blocks rest. `smooth`:
    a cubic spline that begins and ends at rest instead.
    With `order` 1 or 2 the values are velocities or accelerations (m/s, m/s2), and after the last
    the blocks keep their velocity, so that nothing strikes them. `back`: once `block` has slid
    `slid` (m) along the driven block, that moves by `by` from where it is within `over` (s).
    """

    blocks: tuple[int, ...]
    axis: int
    times: tuple[float, ...]
    values: tuple[float, ...]
    ease: float = 0.0
    back: dict[str, float] | None = None
    order: int = 0
    smooth: bool = False

    @cached_property
    def path(self) -> BSpline:
        """Displacement (m or rad) over the time (s)."""
        if self.smooth:
            return make_interp_spline(self.times, self.values, k=3, bc_type="clamped")
        if not self.ease:
            return make_interp_spline(self.times, self.values, k=1).antiderivative(self.order)
        corners = np.union1d(self.times, np.add(self.times, self.ease))
        now, before = (np.interp(corners - s, self.times, self.values) for s in (0.0, self.ease))
        return make_interp_spline(corners, (now - before) / self.ease, k=1).antiderivative()

    def __call__(self, t: float, reversed_at: float = np.inf) -> float:
        """Prescribed displacement at time t, when it was sent back at `reversed_at`."""
        if np.isfinite(reversed_at):
            return _sent_back(self, reversed_at)(t)
        path = self.path
        at = min(max(t, path.t[0]), path.t[-1])
        goes_on = (t - at) * path(at, nu=1) if self.order else 0.0
        return float(path(at) + goes_on)


@cache
def _sent_back(drive: Drive, at: float) -> Drive:
    """A drive that was told at time `at` to go back."""
    n, here = int(np.searchsorted(drive.times, at)), float(np.interp(at, drive.times, drive.values))
    values = *drive.values[:n], here, here + drive.back["by"]
    return replace(drive, times=(*drive.times[:n], at, at + drive.back["over"]), values=values)


class Drives:
    """The drives of a scene.

    rows, axes, which (m,): driven block, its motion, and the number of the drive that moves it;
    reversed_at (d,): when each drive was told to go back, inf before (s); aim (m,): velocities that
    the driven blocks are to have next, for the compiled step.
    """

    def __init__(self, drives: tuple[Drive, ...]) -> None:
        self.drives = drives
        moved = [(block, d.axis, i) for i, d in enumerate(drives) for block in d.blocks]
        self.rows, self.axes, self.which = np.array(moved, int).reshape(-1, 3).T.copy()
        self.reversed_at = np.full(len(drives), np.inf)
        self.aim = np.zeros(len(moved))

    def velocity(self, t: float, dt: float) -> np.ndarray:
        """Velocities (m,) that carry the driven blocks exactly from t to t + dt."""
        drives = zip(self.drives, self.reversed_at.tolist(), strict=True)
        moved = [d(t + dt, at) - d(t, at) if len(d.times) > 1 else 0.0 for d, at in drives]
        return np.array(moved, float)[self.which] / dt

    def reverse(self, t: float, slid: Callable[[int, int], float]) -> None:
        """Send back those drives whose block has slid far enough; slid(block, base) in m."""
        for i, d in enumerate(self.drives):
            if (
                d.back
                and t < self.reversed_at[i]
                and slid(d.back["block"], d.blocks[0]) > d.back["slid"]
            ):
                self.reversed_at[i] = t


def read_drives(
    tables: list[Tables], number: dict[str, int], blocks: list[Block], files: Files, where: str
) -> tuple[Drive, ...]:
    """The drives of `[[drive]]` tables and of the blocks' `held` motions; these blocks are held.

    number: of each block by name. Fixed blocks move as their drives say and no other way.
    Raises ValueError.
    """
    drives, rock = [], tuple(i for i, block in enumerate(blocks) if block.fixed)
    for i, table in enumerate(tables):
        name, motion = f"{where}: drive[{i}]", table["motion"]
        moved = rock
        if "block" in table:
            moved = (number[one_of(f"{name}.block", table["block"], tuple(number))],)
        elif motion == "turn" or "back" in table or not rock:
            raise ValueError(f"{name}.block: name one; without it all fixed rock moves, along x or "
                             "y and not back")  # fmt: skip
        given = set(table) - {"block", "motion"}
        if not any(given <= way for way in WAYS):
            raise ValueError(
                f"{name}: {', '.join(sorted(given))} do not go together: give times and values "
                "(ease, back), or sine, or file (scale, baseline)"
            )
        if motion == "turn" and {"file", "sine"} & given:
            raise ValueError(f"{name}: file and sine shake along x or y; for a turn give times")
        if "file" in table:
            line = read_record(files, f"{name}.file", table)
        elif "sine" in table:
            line = _sine(**table["sine"])
        else:
            line = _lines(table, number, np.pi / 180 if motion == "turn" else 1.0, name)
        drives.append(Drive(moved, AXES[motion], **line))
    driven = [(block, d.axis) for d in drives for block in d.blocks]
    held = [(i, AXES[name]) for i, b in enumerate(blocks) if not b.fixed for name in b.held]
    if len({*driven, *held}) < len(driven) + len(held):
        raise ValueError(f"{where}: drive: a motion of a block is prescribed twice")
    shaken = {block for block, _ in driven if blocks[block].fixed}
    held += [(i, axis) for i in sorted(shaken) for axis in AXES.values() if (i, axis) not in driven]
    for i, block in enumerate(blocks):
        names = tuple(name for name, axis in AXES.items() if (i, axis) in {*driven, *held})
        blocks[i] = replace(block, held=names)
    return *(Drive((i,), axis, (0.0,), (0.0,)) for i, axis in held), *drives


def _lines(table: Tables, number: dict[str, int], unit: float, where: str) -> dict:
    """Straight lines between displacements."""
    times, values = (np.asarray(table.get(key, ())) for key in ("times", "values"))
    same = times.ndim == 1 and times.size and times.shape == values.shape
    if not same or (np.diff(times) <= 0).any():
        raise ValueError(f"{where}.times: must increase, one for each of `values`")
    back = table.get("back")
    return {
        "times": tuple(times), "values": tuple(unit * values), "ease": table.get("ease", 0.1),
        "back": back and {
            **back, "block": number[one_of(f"{where}.back.block", back["block"], tuple(number))],
            "by": unit * back["by"],
        },
    }  # fmt: skip


def _sine(acceleration: float, frequency: float, cycles: int = 10) -> dict:
    """Acceleration as a sine; it rises over a cycle before, and falls after."""
    phase = np.arange((cycles + 2) * SAMPLES + 1) / SAMPLES  # in cycles
    envelope = np.clip(np.minimum(phase, cycles + 2 - phase), 0.0, 1.0)
    values = acceleration * envelope * np.sin(2 * np.pi * phase)
    return {"times": tuple((phase / frequency).tolist()), "values": tuple(values.tolist()),
            "order": 2}  # fmt: skip


def read_record(files: Files, name: str, table: Tables) -> Tables:
    """Times and values of the CSV file of a `[[drive]]` table, as keys of a `Drive`.

    Raises ValueError naming a line that is wrong.
    """
    where = f"{name}: {table['file']}"
    try:
        lines = files[table["file"]].splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{where} cannot be read ({error}); give a CSV file in UTF-8") from None
    # what a title ends in: time_s, Time (s), Acc [m/s^2]
    units = [re.split(r"[\s_(\[]", title.strip(" \t\"')]").lower())[-1].replace("^", "")
             for title in "".join(lines[:1]).split(",")]  # fmt: skip
    if len(units) != 2 or units[0] != "s" or units[1] not in UNITS or len(lines) < 3:
        raise ValueError(
            f"{where}: must be a line such as 'time_s,velocity_m/s' or 'Time (s),Acc (g)', then "
            f"numbers; the second unit is one of {', '.join(UNITS)}"
        )
    order, unit = UNITS[units[1]]
    times, values = _numbers(lines, where)
    if order < 2 and values[0]:
        raise ValueError(f"{where}, line 2: the first value must be 0, because the blocks rest")
    values *= unit * table.get("scale", 1.0)
    if table.get("baseline") and order:  # a displacement ends at rest in any case
        values = _at_rest(times, values, order)
    return {"times": tuple(times.tolist()), "values": tuple(values.tolist()), "order": order,
            "smooth": order == 0}  # fmt: skip


def _numbers(lines: list[str], where: str) -> np.ndarray:
    """Times and values (2, n) of the lines below the first."""
    rows: list[tuple[float, float]] = []
    for n, line in enumerate(lines[1:], 2):
        try:
            time, value = finite("line", [float(part) for part in line.split(",")], "SI units")
        except ValueError:
            raise ValueError(f"{where}, line {n}: {line!r} must be two numbers") from None
        if time < 0 or (rows and time <= rows[-1][0]):
            raise ValueError(f"{where}, line {n}: time {time:g} s must be >= 0 and increase")
        rows.append((time, value))
    return np.transpose(rows)


def _at_rest(times: np.ndarray, values: np.ndarray, order: int) -> np.ndarray:
    """Values less a straight line in acceleration (a parabola in velocity), so that the motion ends
    at rest where it began."""
    since = times - times[0]
    parts = since ** (2 - order), since ** (3 - order)

    def end(column):
        path = make_interp_spline(times, column, k=1).antiderivative(order)
        return [path(times[-1], nu=1), path(times[-1])]

    share = np.linalg.solve(np.transpose([end(part) for part in parts]), end(values))
    return values - share @ parts
