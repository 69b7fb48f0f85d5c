"""Prescribed motions: a base that tilts, a machine that shears, an earthquake that shakes.

Records of earthquakes and of machines are CSV files with two columns, time and motion.
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

SAMPLES_PER_CYCLE = 40  # of a sine
DEFAULT_RAMP = 0.1  # s
# The three ways to prescribe a motion, each with the keys that belong together
MOTION_KEYS = (
    {"times", "values", "ramp", "reverse"},
    {"sine"},
    {"file", "scale", "baseline"},
)
# Units of the second column of a record: order of the time derivative, and value in SI units
UNITS = {
    "m": (0, 1.0), "cm": (0, 1e-2), "mm": (0, 1e-3),
    "m/s": (1, 1.0), "cm/s": (1, 1e-2), "mm/s": (1, 1e-3),
    "m/s2": (2, 1.0), "cm/s2": (2, 1e-2), "gal": (2, 1e-2), "g": (2, 9.80665),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Drive:
    """A prescribed motion of blocks, the same for all of them.

    blocks: numbers of the blocks in the scene.
    axis: 0 and 1 for a displacement along x and y (m), 2 for a rotation about the centroid (rad).
        In space 0 to 2 for a displacement, and 3 to 5 for a rotation about x, y and z.
    times (n,), in s, and values (n,): linear between the points; at rest before and after them.
    ramp: duration (s) of the moving average that is applied to the values, so that the velocity
        does not jump at a point.
    reverse: reversal of the motion, None for none. Once the block `block` has slipped by `slip` (m)
        along the driven block, the driven block moves by `by` (m or rad) from its present position
        within `duration` (s).
    order: time derivative that `values` are: 0 displacements, 1 velocities (m/s), 2 accelerations
        (m/s2). With 1 and 2 the blocks keep their last velocity, because a stop would be an impact.
    smooth: whether displacements are interpolated by a cubic spline that begins and ends at rest.
    """

    blocks: tuple[int, ...]
    axis: int
    times: tuple[float, ...]
    values: tuple[float, ...]
    ramp: float = 0.0
    reverse: dict[str, float] | None = None
    order: int = 0
    smooth: bool = False

    @cached_property
    def path(self) -> BSpline:
        """Displacement (m or rad) as a function of time (s)."""
        if self.smooth:
            return make_interp_spline(self.times, self.values, k=3, bc_type="clamped")
        if not self.ramp:
            return make_interp_spline(self.times, self.values, k=1).antiderivative(self.order)
        corners = np.union1d(self.times, np.add(self.times, self.ramp))
        present = np.interp(corners, self.times, self.values)
        delayed = np.interp(corners - self.ramp, self.times, self.values)
        mean_velocity = make_interp_spline(corners, (present - delayed) / self.ramp, k=1)
        return mean_velocity.antiderivative()

    @cached_property
    def span(self) -> tuple[float, float]:
        """First and last time (s) of the path."""
        return float(self.path.t[0]), float(self.path.t[-1])

    def __call__(self, t: float, reversed_at: float = np.inf) -> float:
        """Return the prescribed displacement (m or rad) at time t (s).

        reversed_at: time (s) at which the motion was reversed, inf if it was not.
        """
        if np.isfinite(reversed_at):
            return _reversed_drive(self, reversed_at)(t)
        path = self.path
        first, last = self.span
        inside = min(max(t, first), last)
        coasted = (t - inside) * path(inside, nu=1) if self.order else 0.0
        return float(path(inside) + coasted)


@cache
def _reversed_drive(drive: Drive, time: float) -> Drive:
    """A drive that follows another one until a time (s), and then its reversal.

    From its value at that time, it changes by `reverse["by"]` within `reverse["duration"]`.
    """
    count = int(np.searchsorted(drive.times, time))
    present = float(np.interp(time, drive.times, drive.values))
    return replace(
        drive,
        times=(*drive.times[:count], time, time + drive.reverse["duration"]),
        values=(*drive.values[:count], present, present + drive.reverse["by"]),
    )


class Drives:
    """All drives of a scene, as arrays.

    rows, axes, which (m,): block, motion (0 x, 1 y, 2 rotation) and number of the drive of each
    prescribed motion. reversed_at (d,): time at which each drive was reversed, inf before (s).
    aim (m,): velocities of the next step (m/s or rad/s), read by the compiled step.
    """

    def __init__(self, drives: tuple[Drive, ...]) -> None:
        self.drives = drives
        motions = [(block, d.axis, i) for i, d in enumerate(drives) for block in d.blocks]
        self.rows, self.axes, self.which = np.array(motions, int).reshape(-1, 3).T.copy()
        self.reversed_at = np.full(len(drives), np.inf)
        self.aim = np.zeros(len(motions))

    def velocity(self, t: float, dt: float) -> np.ndarray:
        """Velocities (m,) of the driven motions that carry blocks exactly from time t to t + dt
        (s).

        Each is the change of the prescribed path over the step divided by dt, one for each driven
        motion of a block; a drive with a single point in time holds its block at rest.
        """
        drives = zip(self.drives, self.reversed_at.tolist(), strict=True)
        paths = [d(t + dt, at) - d(t, at) if len(d.times) > 1 else 0.0 for d, at in drives]
        return np.array(paths, float)[self.which] / dt

    def reverse(self, t: float, slip: Callable[[int, int], float]) -> None:
        """Reverse the drives whose block has slipped far enough at time t (s).

        slip(block, base): shear displacement (m) of the joint between two blocks.
        """
        for i, drive in enumerate(self.drives):
            condition = drive.reverse
            if condition is None or t >= self.reversed_at[i]:
                continue
            if slip(condition["block"], drive.blocks[0]) > condition["slip"]:
                self.reversed_at[i] = t


def read_drives(
    tables: list[Tables], number: dict[str, int], blocks: list[Block], files: Files, where: str
) -> tuple[Drive, ...]:
    """Build the drives of the `[[drive]]` tables and of the fixed motions of blocks.

    number: index of each block by name. blocks: their `prescribed` motions are completed. A fixed
    block that a drive moves has no other motion.

    Raises ValueError for keys that do not go together and for a motion that is prescribed twice.
    """
    fixed_rock = tuple(i for i, block in enumerate(blocks) if block.fixed)
    drives = [
        read_drive(table, number, fixed_rock, AXES, files, f"{where}: drive[{i}]")
        for i, table in enumerate(tables)
    ]
    driven = [(block, d.axis) for d in drives for block in d.blocks]
    fixed = [
        (i, AXES[name])
        for i, block in enumerate(blocks)
        if not block.fixed
        for name in block.prescribed
    ]
    if len({*driven, *fixed}) < len(driven) + len(fixed):
        raise ValueError(f"{where}: drive: a motion of a block is prescribed twice")
    moving_rock = sorted({block for block, _ in driven if blocks[block].fixed})
    fixed += [(i, axis) for i in moving_rock for axis in AXES.values() if (i, axis) not in driven]
    prescribed = {*driven, *fixed}
    for i, block in enumerate(blocks):
        names = tuple(name for name, axis in AXES.items() if (i, axis) in prescribed)
        blocks[i] = replace(block, prescribed=names)
    return *(Drive((i,), axis, (0.0,), (0.0,)) for i, axis in fixed), *drives


def read_drive(
    table: Tables,
    number: dict[str, int],
    fixed_rock: tuple[int, ...],
    axes: dict[str, int],
    files: Files,
    name: str,
) -> Drive:
    """Build the drive of one `[[drive]]` table.

    number: index of each block by name; fixed_rock: fixed blocks; axes: numbers of the motions by
    their names, of which rotations begin with "turn". Raises ValueError.
    """
    motion = table["motion"]
    is_rotation = motion.startswith("turn")
    blocks = fixed_rock
    if "block" in table:
        blocks = (number[one_of(f"{name}.block", table["block"], tuple(number))],)
    elif is_rotation or "reverse" in table or not fixed_rock:
        along = " or ".join(one for one in axes if not one.startswith("turn"))
        raise ValueError(
            f"{name}.block: name one; without it all fixed rock moves, along {along} and without "
            "`reverse`"
        )
    keys = set(table) - {"block", "motion"}
    if not any(keys <= group for group in MOTION_KEYS):
        raise ValueError(
            f"{name}: {', '.join(sorted(keys))} do not go together: give times and values "
            "(ramp, reverse), or sine, or file (scale, baseline)"
        )
    if is_rotation and {"file", "sine"} & keys:
        along = " or ".join(one for one in axes if not one.startswith("turn"))
        raise ValueError(f"{name}: file and sine shake along {along}; for a turn give times")
    if "file" in table:
        path = read_record(files, f"{name}.file", table)
    elif "sine" in table:
        path = _sine(**table["sine"])
    else:
        path = _polyline(table, number, np.pi / 180 if is_rotation else 1.0, name)
    return Drive(blocks, axes[motion], **path)


def _polyline(table: Tables, number: dict[str, int], unit: float, where: str) -> dict:
    """Return times, values, ramp and reversal of a drive that is linear between points.

    unit: factor from the unit of the table to SI units.
    """
    times, values = (np.asarray(table.get(key, ())) for key in ("times", "values"))
    has_pairs = times.ndim == 1 and times.size and times.shape == values.shape
    if not has_pairs or (np.diff(times) <= 0).any():
        raise ValueError(f"{where}.times: must increase, one for each of `values`")
    reverse = table.get("reverse")
    if reverse:
        block = one_of(f"{where}.reverse.block", reverse["block"], tuple(number))
        reverse = {**reverse, "block": number[block], "by": unit * reverse["by"]}
    return {
        "times": tuple(times),
        "values": tuple(unit * values),
        "ramp": table.get("ramp", DEFAULT_RAMP),
        "reverse": reverse,
    }


def _sine(acceleration: float, frequency: float, cycles: int = 10) -> dict:
    """Return a sine of acceleration (m/s2) whose amplitude rises over the cycle before `cycles`
    full ones and falls over the cycle after them; frequency in 1/s."""
    phase = np.arange((cycles + 2) * SAMPLES_PER_CYCLE + 1) / SAMPLES_PER_CYCLE  # in cycles
    envelope = np.clip(np.minimum(phase, cycles + 2 - phase), 0.0, 1.0)
    values = acceleration * envelope * np.sin(2 * np.pi * phase)
    return {
        "times": tuple((phase / frequency).tolist()),
        "values": tuple(values.tolist()),
        "order": 2,
    }


def read_record(files: Files, name: str, table: Tables) -> Tables:
    """Read the CSV file of a `[[drive]]` table; returns the keys of a `Drive`.

    name: of the key, for error messages.

    Raises ValueError naming the line that is wrong.
    """
    where = f"{name}: {table['file']}"
    try:
        lines = files[table["file"]].splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{where} cannot be read ({error}); give a CSV file in UTF-8") from None
    units = [_unit_of(title) for title in "".join(lines[:1]).split(",")]
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
        values = _correct_baseline(times, values, order)
    return {
        "times": tuple(times.tolist()),
        "values": tuple(values.tolist()),
        "order": order,
        "smooth": order == 0,
    }


def _unit_of(title: str) -> str:
    """Return the unit at the end of a title such as "time_s", "Time (s)" or "Acc [m/s^2]"."""
    return re.split(r"[\s_(\[]", title.strip(" \t\"')]").lower())[-1].replace("^", "")


def _numbers(lines: list[str], where: str) -> np.ndarray:
    """Read times and values (2, n) from the lines below the first."""
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


def _correct_baseline(times: np.ndarray, values: np.ndarray, order: int) -> np.ndarray:
    """Subtract the straight line in acceleration (the parabola in velocity) with which the motion
    ends at rest at its initial position."""
    elapsed = times - times[0]
    corrections = elapsed ** (2 - order), elapsed ** (3 - order)

    def final_motion(column):
        """Velocity and displacement at the end."""
        path = make_interp_spline(times, column, k=1).antiderivative(order)
        return [path(times[-1], nu=1), path(times[-1])]

    columns = np.transpose([final_motion(correction) for correction in corrections])
    coefficients = np.linalg.solve(columns, final_motion(values))
    return values - coefficients @ corrections
