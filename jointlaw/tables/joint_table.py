"""A rock joint as a table against closure, for hosts that take stiffnesses instead of a law.

Needs numpy alone (matplotlib to draw), so that hosts copy this file. SI units: m, Pa, Pa/m.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

VERSION = 1  # of the table's files
MARKER = "# metadata: "
STEPS = 60  # per leg of the paths of `JointTable.report`
# names in the file, and the attributes that they hold
BY_CLOSURE = {
    "un": "closure",
    "sn": "normal_stress",
    "kn_secant": "kn_secant",
    "kn_tangent": "kn_tangent",
}
BY_AZIMUTH = {
    "kt": "shear_stiffness",
    "mu": "peak_friction",
    "mob": "mobilised_friction",
    "dil": "dilation",
}


class PathError(NamedTuple):
    """Error of the table on one path, as shares of the law's largest traction on that path.

    `largest`: of the traction vector; `normal`, `along`, `across`: of the normal traction, of the
    shear traction along the motion and of that across it. The normal part is what the table drops
    of normal-shear coupling, the part across is what it drops of the off-diagonal shear terms.
    """

    largest: float
    normal: float
    along: float
    across: float


class Report(dict[str, PathError]):
    """Errors of a table against its law by the name of the path; print it to read it."""

    def __str__(self) -> str:
        rows = [[f"{'path':34s}", *(f"{name:>8s}" for name in PathError._fields)]]
        rows += [[f"{n:34s}", *(f"{100 * x:6.1f} %" for x in error)] for n, error in self.items()]
        return "\n".join(map(" ".join, rows))


@dataclass(frozen=True, eq=False)
class JointTable:
    """The first loading of a joint law against closure, per unit area. Made by `tabulate`.

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

    def lookup(self, closure: ArrayLike, azimuth: ArrayLike = 0.0) -> SimpleNamespace:
        """Interpolated values at closures (m) and azimuths (rad), broadcast together.

        They have the names of the table: normal_stress, kn_secant, kn_tangent, shear_stiffness,
        peak_friction, mobilised_friction and dilation.
        Linear in closure; normal stress is closure times the interpolated secant, past the last
        row it follows the last tangent. Shear stiffness over azimuth is the mean and second
        harmonic (a symmetric matrix), the rest linear. Zero stress and stiffness for closure <= 0.
        Raises ValueError for values that are not finite.
        """
        u, psi = np.broadcast_arrays(np.asarray(closure, float), np.asarray(azimuth, float))
        if not (np.isfinite(u).all() and np.isfinite(psi).all()):
            raise ValueError("closure and azimuth must be finite (m, rad)")
        shape, u, psi = u.shape, u.ravel(), psi.ravel()
        row, w, secant = self.at(u)
        K22, K33, K23 = self.shear_matrix(row, w)
        stiffness = (K22 + K33) / 2 + (K22 - K33) / 2 * np.cos(2 * psi) + K23 * np.sin(2 * psi)
        while_closed = {
            "normal_stress": secant * u,
            "kn_secant": secant,
            "kn_tangent": between(self.kn_tangent, row, w),
            "shear_stiffness": stiffness,
        }
        found = {name: np.where(u > 0, value, 0.0) for name, value in while_closed.items()}
        for name in ("peak_friction", "mobilised_friction", "dilation"):
            found[name] = around(getattr(self, name), psi, row, w)
        return SimpleNamespace(**{name: value.reshape(shape)[()] for name, value in found.items()})

    def follow(self, delta: ArrayLike) -> Array:
        """Traction (m, 3) in Pa that a host computes from the table along a path delta (m, 3) in m.

        Raises ValueError for another shape, or values that are not finite.
        """
        path = np.asarray(delta, float)
        if path.ndim != 2 or path.shape[1] != 3 or not np.isfinite(path).all():
            raise ValueError(f"delta has shape {path.shape}; expected finite values (m, 3) in m")
        row, w, _ = self.at(np.zeros(1))
        F, K = np.zeros((3, 1)), self.shear_matrix(row, w)
        tractions = np.zeros_like(path)
        for k, d in enumerate(np.diff(path, axis=0, prepend=np.zeros((1, 3)))):
            F, K = self.step(F[1:], K, d[:, None], path[k, :1])
            tractions[k] = F[:, 0]
        return tractions

    # ---------------------------------------------- what a host calls in every step

    def step(
        self, f: Array, K: Array, d: Array, closure: Array, spin: Array | float = 0.0
    ) -> tuple[Array, Array]:
        """Tractions (3, n) after the increments d (3, n), and the shear stiffness (3, n) there.

        f (2, n), K (3, n): shear traction and stiffness at the beginning; closure (n,) at the end;
        spin (n,) in rad turns f. Shear is elastic with d, scaled down with K when the joint
        softens, and capped at friction times normal stress in the direction of the force. Raises
        nothing.
        """
        row, w, secant = self.at(closure)
        normal = np.where(closure > 0, secant * closure, 0.0)
        now = self.shear_matrix(row, w)
        c, s = np.cos(spin / 2), np.sin(spin / 2)  # half before the new shear is added, half after
        f = np.array([c * f[0] - s * f[1], s * f[0] + c * f[1]])
        softer = np.flatnonzero(now[0] + now[1] < K[0] + K[1])
        if softer.size:  # what it gives up of its elastic force makes no energy
            a, b, g = K[:, softer]
            f2, f3 = f[:, softer] / (a * b - g * g)
            f[:, softer] = times(now[:, softer], np.array([b * f2 - g * f3, a * f3 - g * f2]))
        f += times(now, d[1:])
        f = np.array([c * f[0] - s * f[1], s * f[0] + c * f[1]])
        size = np.hypot(f[0], f[1])
        over = np.flatnonzero(size > self.peak_friction.min() * normal)
        if over.size:
            azimuth = np.arctan2(f[1, over], f[0, over])
            cap = normal[over] * around(self.peak_friction, azimuth, row[over], w[over])
            f[:, over] *= np.minimum(1.0, cap / np.where(size[over] > 0, size[over], 1.0))
        return np.array([normal, f[0], f[1]]), now

    def at(self, closure: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Rows, weights of linear interpolation and secant normal stiffness (Pa/m), each (n,).

        closure: (n,) in m. Raises nothing.
        """
        row = np.clip(np.searchsorted(self.closure, closure, "right") - 1, 0, len(self.closure) - 2)
        low, end = self.closure[row], self.closure[-1]
        w = np.clip((closure - low) / (self.closure[row + 1] - low), 0.0, 1.0)
        secant = between(self.kn_secant, row, w)
        past = closure > end
        if past.any():
            more = self.kn_tangent[-1] * (closure[past] - end)
            secant[past] = (self.normal_stress[-1] + more) / closure[past]
        return row, w, secant

    def shear_matrix(self, row: NDArray[np.intp], w: Array) -> Array:
        """Initial shear stiffness K22, K33, K23 (3, n) in Pa/m at these rows and weights w.

        row, w: (n,) each, as `at` gives them. Raises nothing.
        """
        mean, c, s = (between(part, row, w) for part in self._harmonics)
        return np.array([mean + c, mean - c, s])

    @cached_property
    def _harmonics(self) -> tuple[Array, Array, Array]:
        """Mean and second harmonic over azimuth of the shear stiffness e.K.e, K symmetric."""
        kt, twice = np.ascontiguousarray(self.shear_stiffness.T), 2 * self.azimuth[:, None]
        c, s = np.cos(twice) * kt, np.sin(twice) * kt
        return kt.mean(axis=0), 2 * c.mean(axis=0), 2 * s.mean(axis=0)

    # ------------------------------------------------------- what the table drops

    def report(self, law: Any) -> Report:
        """What the table drops: its error against its `law` on a suite of paths. Raises nothing."""
        report = Report()
        for name, azimuth, corners in _paths(self.closure[-1], self.metadata["shear_limit"]):
            psi = np.radians(azimuth)
            axes = np.array(
                [[1, 0, 0], [0, np.cos(psi), np.sin(psi)], [0, -np.sin(psi), np.cos(psi)]]
            )
            path, joint = _points(np.array(corners) @ axes[:2]), law.joint()
            steps = np.diff(path, axis=0, prepend=np.zeros((1, 3)))
            exact = np.array([joint.update(d, tangent=False)[0] for d in steps])
            off = (self.follow(path) - exact) / np.linalg.norm(exact, axis=1).max()
            parts = np.abs(off @ axes.T).max(axis=0)
            report[name] = PathError(float(np.linalg.norm(off, axis=1).max()), *parts.tolist())
        return report

    # -------------------------------------------------------------------- files

    @property
    def columns(self) -> dict[str, Array]:
        """Columns as in the file: `un sn kn_secant kn_tangent mu kt_000 ... mu_.. mob_.. dil_..`

        `mu` is the mean over azimuth of the peak friction, the numbers are azimuths in degrees.
        """
        result = {name: getattr(self, attribute) for name, attribute in BY_CLOSURE.items()}
        result["mu"] = self.peak_friction.mean(axis=1)
        for name, attribute in BY_AZIMUTH.items():
            titles = (f"{name}_{round(np.degrees(psi)):03d}" for psi in self.azimuth)
            result |= zip(titles, getattr(self, attribute).T, strict=True)
        return result

    def save(self, path: str | Path) -> None:
        """Write text for `numpy.genfromtxt(path, names=True)`: names first, then metadata.

        Raises OSError where it cannot be written.
        """
        path, columns = Path(path), self.columns
        part = path.with_name(path.name + ".part")  # half a table would still look like one
        with part.open("w", encoding="utf-8") as file:
            file.write("# " + " ".join(columns) + "\n")
            file.writelines(f"# {k}: {v}\n" for k, v in self.metadata.items() if k != "law")
            file.write(MARKER + json.dumps({"version": VERSION, **self.metadata}) + "\n")
            np.savetxt(file, np.array(list(columns.values())).T, fmt="%.17g")
        part.replace(path)


def load_table(path: str | Path) -> JointTable:
    """Read a table that `JointTable.save` wrote to `path`. Raises ValueError if it is none."""
    try:
        _, marker, rest = Path(path).read_text("utf-8", "replace").partition(MARKER)
        if not marker:
            raise ValueError(f"it has no line {MARKER.strip()!r}; export the law again")
        metadata = json.loads(rest.splitlines()[0])
        if (version := metadata.pop("version")) != VERSION:
            raise ValueError(
                f"version {version} of the table is not {VERSION}: tabulate the law again with "
                "this version of jointlaw"
            )
        data = np.genfromtxt(path, names=True)
        angles = sorted(int(name[3:]) for name in data.dtype.names or () if name.startswith("kt_"))
        held = {attribute: data[name].copy() for name, attribute in BY_CLOSURE.items()} | {
            attribute: np.array([data[f"{name}_{a:03d}"] for a in angles]).T
            for name, attribute in BY_AZIMUTH.items()
        }
        even = len(angles) > 2 and angles == [k * 180 // len(angles) for k in range(len(angles))]
        if not (even and np.isfinite(data.tolist()).all() and (np.diff(data["un"]) > 0).all()):
            raise ValueError(
                "un must increase, azimuths be three or more, evenly spaced over 180 degrees, and "
                "all values finite"
            )
        return JointTable(azimuth=np.radians(angles), metadata=metadata, **held)
    except (OSError, KeyError, ValueError, TypeError, IndexError) as error:
        raise ValueError(f"{str(path)!r} is not a joint table: {error}") from None


# ------------------------------------------------------------------- interpolation


def between(values: Array, row: NDArray[np.intp], w: Array) -> Array:
    """Linear interpolation between rows of values (rows,)."""
    low = values[row]
    return np.asarray(low + (values[row + 1] - low) * w)


def around(values: Array, psi: Array, row: NDArray[np.intp], w: Array) -> Array:
    """Linear interpolation in azimuth psi and between rows of values (rows, azimuths)."""
    azimuths = values.shape[1]
    whole, x = np.divmod(np.mod(psi, np.pi) * (azimuths / np.pi), 1.0)
    a = whole.astype(int)
    columns = (a % azimuths, (a + 1) % azimuths)
    low, high = (values[row, k] * (1 - w) + values[row + 1, k] * w for k in columns)
    return np.asarray(low * (1 - x) + high * x)


def times(K: Array, v: Array) -> Array:
    """Products of symmetric matrices K (22, 33, 23; n) with vectors v (2, n)."""
    return np.array([K[0] * v[0] + K[2] * v[1], K[2] * v[0] + K[1] * v[1]])


# ----------------------------------------------------------- the paths of the report


def _points(corners: Array) -> Array:
    """Points (m, 3) from the origin along straight legs of STEPS points between corners (k, 3)."""
    share = np.arange(1, STEPS + 1)[:, None] / STEPS
    return np.concatenate([a + (b - a) * share for a, b in pairwise([np.zeros(3), *corners])])


def _paths(end: float, limit: float) -> list[tuple[str, int, list[tuple[float, float]]]]:
    """Names, azimuths (degrees) and corners (closure, shear in m) from the virgin state."""
    u, s = end / 2, min(limit, end)
    return [
        ("closure", 0, [(end, 0)]),
        ("closure, unloading", 0, [(end, 0), (0, 0)]),
        ("shear at 0 deg, closure held", 0, [(u, 0), (u, s)]),
        ("shear at 45 deg, closure held", 45, [(u, 0), (u, s)]),
        ("shear at 90 deg, closure held", 90, [(u, 0), (u, s)]),
        ("shear and reversal", 0, [(u, 0), (u, s), (u, -s)]),
        ("shear, then closure", 0, [(u, 0), (u, s / 4), (end, s / 4)]),
        ("closure and shear together", 0, [(end, end / 2)]),
        ("shear, unloading", 0, [(end, 0), (end, s / 4), (end / 4, s / 4)]),
        ("shear, opening, re-contact", 0, [(u, 0), (u, s / 2), (-u / 4, s / 2), (u, s / 2)]),
    ]
