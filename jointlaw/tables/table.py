"""The virgin law as a table against closure: what hosts that only take stiffnesses can use."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike

from ..support.checks import Array
from ..support.files import replace_file

if TYPE_CHECKING:
    from ..law import JointLaw
    from .report import Report

_BY_CLOSURE = ("un", "sn", "kn_secant", "kn_tangent", "mu")
_BY_AZIMUTH = ("kt", "mu", "mob", "dil")
_MARKER = "# metadata: "


class Row(NamedTuple):
    """What a table says at one closure and azimuth (or arrays of them)."""

    normal_stress: Any
    kn_secant: Any
    kn_tangent: Any
    shear_stiffness: Any
    peak_friction: Any
    mobilised_friction: Any
    dilation: Any


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
        row = np.clip(np.searchsorted(self.closure, u, "right") - 1, 0, len(self.closure) - 2)
        low = self.closure[row]
        w = np.clip((u - low) / (self.closure[row + 1] - low), 0.0, 1.0)

        def between(values: Array) -> Any:
            return values[row] + (values[row + 1] - values[row]) * w

        touches, end = u > 0, self.closure[-1]
        secant = between(self.kn_secant)
        last = self.normal_stress[-1] + self.kn_tangent[-1] * (u - end)
        secant = np.where(u > end, last / np.where(u > end, u, 1.0), secant)
        stiffness = between(self._harmonics[0])
        stiffness = stiffness + between(self._harmonics[1]) * np.cos(2 * psi)
        stiffness = stiffness + between(self._harmonics[2]) * np.sin(2 * psi)
        p = len(self.azimuth)
        place = np.mod(psi, np.pi) * (p / np.pi)
        a = np.floor(place).astype(int) % p
        b, x = (a + 1) % p, place - np.floor(place)

        def around(values: Array) -> Any:
            first = values[row, a] * (1 - w) + values[row + 1, a] * w
            second = values[row, b] * (1 - w) + values[row + 1, b] * w
            return first * (1 - x) + second * x

        columns = (
            np.where(touches, secant * u, 0.0), np.where(touches, secant, 0.0),
            np.where(touches, between(self.kn_tangent), 0.0), np.where(touches, stiffness, 0.0),
            around(self.peak_friction), around(self.mobilised_friction), around(self.dilation),
        )  # fmt: skip
        return Row(*(value[()] for value in columns))

    def follow(self, delta: ArrayLike) -> Array:
        """Traction (m, 3) in Pa that a host computes from the table along a path delta (m, 3) in m.

        The host is elastic and frictional: dF = K d(delta) in shear, scaled down with K when K
        falls, capped at friction times normal stress in the direction of the force.
        """
        path = np.asarray(delta, float)
        if path.ndim != 2 or path.shape[1] != 3 or not np.isfinite(path).all():
            raise ValueError(f"delta has shape {path.shape}; expected finite values (m, 3) in m")
        result, f = np.zeros_like(path), np.zeros(2)
        here, K_old = np.zeros(3), self.stiffness_matrix(0.0)
        for k, point in enumerate(path):
            K = self.stiffness_matrix(float(point[0]))
            if np.trace(K) < np.trace(K_old):
                f = K @ np.linalg.solve(K_old, f)
            f = f + K @ (point - here)[1:]
            size = float(np.hypot(*f))
            at = self.lookup(point[0], np.arctan2(f[1], f[0]))
            cap = at.peak_friction * at.normal_stress
            if size > cap:
                f = f * (cap / size)
            result[k] = at.normal_stress, *f
            here, K_old = point, K
        return result

    def stiffness_matrix(self, closure: float) -> Array:
        """Initial tangent shear stiffness (2, 2) in Pa/m, axes 2 and 3."""
        if closure <= 0:
            return np.zeros((2, 2))
        mean, c, s = (np.interp(closure, self.closure, part) for part in self._harmonics)
        return np.array([[mean + c, s], [s, mean - c]])

    @property
    def _harmonics(self) -> tuple[Array, Array, Array]:
        k, psi = self.shear_stiffness, self.azimuth
        c, s = 2 * np.cos(2 * psi), 2 * np.sin(2 * psi)
        return k.mean(axis=1), (k * c).mean(axis=1), (k * s).mean(axis=1)

    def report(self, law: JointLaw, steps: int = 60) -> Report:
        """What the table drops: its error against the law on a suite of paths."""
        from .report import report

        return report(self, law, steps)

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw the table (needs matplotlib); returns the figure, written to `path` if given."""
        from .plot import plot_table

        return plot_table(self, path)

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
        data, meta = np.array(list(columns.values())).T, json.dumps(dict(self.metadata))
        if path.suffix == ".npz":
            buffer = io.BytesIO()
            np.savez(buffer, names=list(columns), data=data, metadata=meta)
            replace_file(path, buffer.getvalue())
            return
        text = io.StringIO()
        np.savetxt(text, data, fmt="%.17g")
        notes = "".join(f"# {k}: {v}\n" for k, v in self.metadata.items() if k != "law")
        head = "# " + " ".join(columns) + "\n" + notes + _MARKER + meta + "\n"
        replace_file(path, (head + text.getvalue()).encode())


def load_table(path: str | Path) -> JointTable:
    """Read a table that `JointTable.save` wrote. Raises ValueError if the file is not one."""
    path = Path(path)
    try:
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as file:
                column = dict(zip(file["names"].tolist(), file["data"].T, strict=True))
                metadata = json.loads(str(file["metadata"]))
        else:
            data = np.genfromtxt(path, names=True)
            column = {name: data[name] for name in data.dtype.names or ()}
            lines = path.read_text().splitlines()
            metadata = json.loads(next(s for s in lines if s.startswith(_MARKER))[len(_MARKER) :])
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
    except (OSError, EOFError, KeyError, ValueError, TypeError, StopIteration, BadZipFile) as error:
        raise ValueError(f"{str(path)!r} is not a joint table: {error!r}") from None
