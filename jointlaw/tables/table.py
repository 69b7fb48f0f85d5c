"""The virgin law as a table against closure: what hosts that only take stiffnesses can use."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike

from ..law import JointLaw
from ..support.checks import Array, whole
from ..support.files import replace_file
from ..support.pyplot import pyplot, written
from .table_law import MARKER, VERSION, TableLaw, around, between, read_table

_BY_CLOSURE = ("un", "sn", "kn_secant", "kn_tangent", "mu")
_BY_AZIMUTH = ("kt", "mu", "mob", "dil")


class Row(NamedTuple):
    """What a table says at one closure and azimuth (or arrays of them)."""

    normal_stress: Any
    kn_secant: Any
    kn_tangent: Any
    shear_stiffness: Any
    peak_friction: Any
    mobilised_friction: Any
    dilation: Any


@dataclass(frozen=True)
class PathDifference:
    """Error of the table on one path, as shares of the law's largest traction on that path.

    `largest`, `rms`: over all components; `normal`, `along`, `across`: the largest in the normal
    traction, in the shear traction along the motion and in that across it. The normal part is what
    the table drops of normal-shear coupling, the part across of the off-diagonal shear terms.
    """

    name: str
    largest: float
    rms: float
    normal: float
    along: float
    across: float


@dataclass(frozen=True)
class Report:
    """Errors of a table against its law, one row per path; print it to read it."""

    rows: tuple[PathDifference, ...]
    note: str = ""

    def __str__(self) -> str:
        lines = [
            f"{'path':34s} {'largest':>8s} {'rms':>8s} {'normal':>8s} {'along':>8s} {'across':>8s}"
        ]
        for r in self.rows:
            values = (r.largest, r.rms, r.normal, r.along, r.across)
            lines.append(f"{r.name:34s} " + " ".join(f"{100 * v:6.1f} %" for v in values))
        return "\n".join([*lines, self.note] if self.note else lines)

    def __getitem__(self, name: str) -> PathDifference:
        return next(row for row in self.rows if row.name == name)

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """The same as nested mappings: path, then measure."""
        return {r.name: {k: v for k, v in vars(r).items() if k != "name"} for r in self.rows}


@dataclass(frozen=True, eq=False)
class JointTable:
    """A joint law tabulated against closure, per unit area of joint. Made by `tabulate`.

    closure (n,) in m, from 0; normal_stress (n,) in Pa; kn_secant, kn_tangent (n,) in Pa/m: normal
    stress over closure, and its slope; azimuth (p,) in rad, evenly spaced over the half circle;
    shear_stiffness (n, p) in Pa/m: initial tangent, of the unsheared joint; peak_friction and
    mobilised_friction (n, p): largest ratio of shear to normal stress on the way to the shear
    limit, and the ratio there, at constant normal stress; dilation (n, p): opening per shear
    displacement there. `metadata` holds the law, units, conventions, loading path, tolerances,
    largest stiffnesses and the time step.
    """

    closure: Array
    normal_stress: Array
    kn_secant: Array
    kn_tangent: Array
    azimuth: Array
    shear_stiffness: Array
    peak_friction: Array
    mobilised_friction: Array
    dilation: Array
    metadata: Mapping[str, Any]

    def lookup(self, closure: ArrayLike, azimuth: ArrayLike = 0.0) -> Row:
        """Interpolated values at closures (m) and azimuths (rad), broadcast together.

        Linear in closure; normal stress is closure times the interpolated secant, past the last
        row it follows the last tangent. Shear stiffness over azimuth is the mean and second
        harmonic (a symmetric matrix), the rest linear. Zero stress and stiffness for closure <= 0.
        """
        u, psi = np.broadcast_arrays(np.asarray(closure, float), np.asarray(azimuth, float))
        if not (np.isfinite(u).all() and np.isfinite(psi).all()):
            raise ValueError("closure and azimuth must be finite (m, rad)")
        shape, u, psi = u.shape, u.ravel(), psi.ravel()
        row, w, secant = self._law.at(u)
        K22, K33, K23 = self._law.shear_stiffness(row, w)
        mean, c = (K22 + K33) / 2, (K22 - K33) / 2
        stiffness = mean + c * np.cos(2 * psi) + K23 * np.sin(2 * psi)
        touches = u > 0
        by_closure = (secant * u, secant, between(self.kn_tangent, row, w), stiffness)
        by_azimuth = (self.peak_friction, self.mobilised_friction, self.dilation)
        values = [np.where(touches, value, 0.0) for value in by_closure]
        values += [around(value.T, psi, row, w) for value in by_azimuth]
        return Row(*(value.reshape(shape)[()] for value in values))

    def follow(self, delta: ArrayLike) -> Array:
        """Traction (m, 3) in Pa that a host computes from the table along a path delta (m, 3) in m.

        The host is elastic and frictional: dF = K d(delta) in shear, scaled down with K when K
        falls, capped at friction times normal stress in the direction of the force.
        """
        path = np.asarray(delta, float)
        if path.ndim != 2 or path.shape[1] != 3 or not np.isfinite(path).all():
            raise ValueError(f"delta has shape {path.shape}; expected finite values (m, 3) in m")
        law = TableLaw(self.columns)
        law.add(np.zeros(1))
        steps = np.diff(path, axis=0, prepend=np.zeros((1, 3)))
        tractions = [law.step(d[:, None], x[:1]) for d, x in zip(steps, path, strict=True)]
        return np.array(tractions).reshape(-1, 3)

    def stiffness_matrix(self, closure: float) -> Array:
        """Initial tangent shear stiffness (2, 2) in Pa/m, axes 2 and 3."""
        row, w, _ = self._law.at(np.array([closure]))
        K22, K33, K23 = self._law.shear_stiffness(row, w)[:, 0] * (closure > 0)
        return np.array([[K22, K23], [K23, K33]])

    @cached_property
    def _law(self) -> TableLaw:
        return TableLaw(self.columns)

    def report(self, law: JointLaw, steps: int = 60) -> Report:
        """What the table drops: its error against the law on a suite of paths.

        steps: per leg of a path.
        """
        limit = float(self.metadata["shear_limit"])
        end = float(self.closure[-1])
        steps = whole("steps", steps, 2)
        rows = []
        for name, corners in _suite(end, limit).items():
            path = _legs(corners, steps)
            increments, joint = np.diff(path, axis=0, prepend=np.zeros((1, 3))), law.joint()
            exact = np.array([joint.update(d, tangent=False)[0] for d in increments])
            rows.append(_error(name, self.follow(path), exact, corners))
        k = law.tables
        damage = " and ".join(name for name, on in (("yield", k.yields), ("wear", k.wears)) if on)
        note = f"asperities {damage}: the table holds their first loading alone"
        return Report(tuple(rows), note if damage else "")

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw the table (needs matplotlib); returns the figure, written to `path` if given."""
        figure, axes = pyplot().subplots(2, 2, figsize=(9, 6.5), layout="constrained", sharex=True)
        columns = self.columns
        u = columns["un"] * 1e6
        axes[0, 0].plot(u, columns["sn"] / 1e6, "o-", ms=2.5)
        axes[0, 0].set_ylabel("normal stress (MPa)")
        for kind in ("secant", "tangent"):
            axes[0, 1].plot(u, columns[f"kn_{kind}"] / 1e9, label=f"normal, {kind}")
        azimuths = [name[3:] for name in columns if name.startswith("kt_")]
        for k in (0, len(azimuths) // 4, len(azimuths) // 2):
            azimuth, label = azimuths[k], f"{int(azimuths[k])}°"
            axes[0, 1].plot(u, columns[f"kt_{azimuth}"] / 1e9, "--", label=f"shear, {label}")
            axes[1, 0].plot(u, columns[f"mu_{azimuth}"], label=f"peak, {label}")
            axes[1, 1].plot(u, np.degrees(np.arctan(columns[f"dil_{azimuth}"])), label=label)
        labels = ("stiffness (GPa/m)", "friction coefficient", "dilation angle (°)")
        for axis, label in zip(axes.flat[1:], labels, strict=True):
            axis.set_ylabel(label)
            axis.legend(fontsize="small")
        for axis in axes[1]:
            axis.set_xlabel("closure (µm)")
        return written(figure, path)

    # ------------------------------------------------------------------ files

    @property
    def columns(self) -> dict[str, Array]:
        """Columns as in the files: `un sn kn_secant kn_tangent mu kt_000 ... mu_.. mob_.. dil_..`

        `mu` is the mean over azimuth of the peak friction, the numbers are azimuths in degrees.
        """
        mean = self.peak_friction.mean(axis=1)
        parts = (self.closure, self.normal_stress, self.kn_secant, self.kn_tangent, mean)
        result = dict(zip(_BY_CLOSURE, parts, strict=True))
        by_azimuth = (
            self.shear_stiffness,
            self.peak_friction,
            self.mobilised_friction,
            self.dilation,
        )
        for name, values in zip(_BY_AZIMUTH, by_azimuth, strict=True):
            for psi, column in zip(np.degrees(self.azimuth), values.T, strict=True):
                result[f"{name}_{round(psi):03d}"] = column
        return result

    def save(self, path: str | Path) -> None:
        """Write `.npz`, or text that `numpy.genfromtxt(path, names=True)` reads: names first."""
        path, columns = Path(path), self.columns
        data = np.array(list(columns.values())).T
        meta = json.dumps({"version": VERSION, **self.metadata})
        if path.suffix == ".npz":
            buffer = io.BytesIO()
            np.savez(buffer, names=list(columns), data=data, metadata=meta)
            replace_file(path, buffer.getvalue())
            return
        text = io.StringIO()
        np.savetxt(text, data, fmt="%.17g")
        notes = "".join(f"# {k}: {v}\n" for k, v in self.metadata.items() if k != "law")
        head = "# " + " ".join(columns) + "\n" + notes + MARKER + meta + "\n"
        replace_file(path, (head + text.getvalue()).encode())


def load_table(path: str | Path) -> JointTable:
    """Read a table that `JointTable.save` wrote. Raises ValueError if the file is not one."""
    try:
        column, metadata = read_table(path)
        if not metadata.pop("version", None):
            raise ValueError(f"it has no line {MARKER.strip()!r}")
        angles = sorted(int(name[3:]) for name in column if name.startswith("kt_"))
        if not (np.isfinite(list(column.values())).all() and (np.diff(column["un"]) > 0).all()):
            raise ValueError("column un must increase and all values must be finite")
        if len(angles) < 3:
            raise ValueError(f"it has {len(angles)} columns kt_...; 3 azimuths are the least")
        un, sn, secant, tangent = (column[name] for name in _BY_CLOSURE[:4])
        kt, mu, mob, dil = (
            np.array([column[f"{name}_{a:03d}"] for a in angles]).T for name in _BY_AZIMUTH
        )
        return JointTable(un, sn, secant, tangent, np.radians(angles), kt, mu, mob, dil, metadata)
    except (OSError, EOFError, KeyError, ValueError, TypeError, IndexError, BadZipFile) as error:
        raise ValueError(f"{str(path)!r} is not a joint table: {error!r}") from None


# ------------------------------------------------------- what a table drops, path by path


def _suite(end: float, limit: float) -> dict[str, list[tuple[float, float, float]]]:
    """Corners (closure, shear, azimuth in degrees) of the paths, from the virgin state."""
    u, s = end / 2, min(limit, end)
    suite = {
        "closure": [(end, 0.0, 0.0)],
        "closure, unloading": [(end, 0.0, 0.0), (0.0, 0.0, 0.0)],
    }
    for azimuth in (0.0, 45.0, 90.0):
        suite[f"shear at {azimuth:.0f} deg, closure held"] = [(u, 0.0, 0.0), (u, s, azimuth)]
    return suite | {
        "shear and reversal": [(u, 0, 0), (u, s, 0), (u, -s, 0)],
        "shear, then closure": [(u, 0, 0), (u, s / 4, 0), (end, s / 4, 0)],
        "closure and shear together": [(end, end / 2, 0)],
        "shear, unloading": [(end, 0, 0), (end, s / 4, 0), (end / 4, s / 4, 0)],
        "shear, opening, re-contact": [(u, 0, 0), (u, s / 2, 0), (-u / 4, s / 2, 0), (u, s / 2, 0)],
    }


def _legs(corners: list[tuple[float, float, float]], steps: int) -> Array:
    """Points (m, 3) along straight legs between the corners."""
    points = [np.zeros(3)]
    for closure, shear, azimuth in corners:
        psi = np.radians(azimuth)
        goal = np.array([closure, shear * np.cos(psi), shear * np.sin(psi)])
        start = points[-1]
        points += [start + (goal - start) * (k / steps) for k in range(1, steps + 1)]
    return np.array(points[1:])


def _error(
    name: str, got: Array, exact: Array, corners: list[tuple[float, float, float]]
) -> PathDifference:
    scale = float(np.sqrt(np.sum(exact**2, axis=1)).max())
    psi = np.radians(corners[-1][2])
    along = np.array([0.0, np.cos(psi), np.sin(psi)])
    across = np.array([0.0, -np.sin(psi), np.cos(psi)])
    off = (got - exact) / scale
    size = np.sqrt(np.sum(off**2, axis=1))
    parts = [float(np.abs(x).max()) for x in (off[:, 0], off @ along, off @ across)]
    return PathDifference(name, float(size.max()), float(np.sqrt(np.mean(size**2))), *parts)
