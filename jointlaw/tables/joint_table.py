"""A rock joint as a table against closure, for hosts that use stiffnesses instead of a law.

Hosts copy this file, so it imports numpy alone. SI units: m, Pa, Pa/m.
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

VERSION = 1  # of the file format
METADATA_MARK = "# metadata: "
STEPS_PER_LEG = 60  # of the paths of `JointTable.report`
# column names in the file, and the attributes of the table
CLOSURE_COLUMNS = {
    "un": "closure",
    "sn": "normal_stress",
    "kn_secant": "kn_secant",
    "kn_tangent": "kn_tangent",
}
AZIMUTH_COLUMNS = {
    "kt": "shear_stiffness",
    "mu": "peak_friction",
    "mob": "mobilised_friction",
    "dil": "dilation",
}


class TableError(NamedTuple):
    """Largest error of the table on one path, over the law's largest traction on that path.

    largest: error of the traction vector.
    normal: error of the normal traction; the table has no normal-shear coupling.
    along: error of the shear traction in the direction of shear.
    across: error of the shear traction at right angles; the table has no off-diagonal shear terms.
    """

    largest: float
    normal: float
    along: float
    across: float


class TableReport(dict[str, TableError]):
    """Errors of a table against its law by the name of the path; `print` shows a table of them."""

    def __str__(self) -> str:
        rows = [[f"{'path':34s}", *(f"{name:>8s}" for name in TableError._fields)]]
        for name, error in self.items():
            rows.append([f"{name:34s}", *(f"{100 * value:6.1f} %" for value in error)])
        return "\n".join(map(" ".join, rows))


@dataclass(frozen=True, eq=False)
class JointTable:
    """The first loading of a joint law against closure, per unit area. Made by `tabulate`.

    closure: (n,) in m, from 0.
    normal_stress: (n,) in Pa.
    kn_secant, kn_tangent: (n,) in Pa/m, normal stress over closure, and slope of the normal stress.
    azimuth: (p,) in rad, evenly spaced over the half circle.
    shear_stiffness: (n, p) in Pa/m, initial tangent of the unsheared joint.
    peak_friction: (n, p), largest ratio of shear to normal stress up to the shear limit, at
        constant normal stress.
    mobilised_friction: (n, p), ratio of shear to normal stress at the shear limit.
    dilation: (n, p), opening per shear displacement at the shear limit.
    metadata: law, units, conventions, loading path, tolerances, largest stiffnesses, time step.
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

        Returns a namespace with normal_stress, kn_secant, kn_tangent, shear_stiffness,
        peak_friction, mobilised_friction and dilation.

        Interpolation is linear in closure; normal stress is closure times the interpolated secant
        stiffness, and beyond the last row it follows the last tangent. Shear stiffness varies with
        azimuth as its mean and second harmonic (a symmetric matrix), the others vary linearly.
        Stress and stiffness are zero for closure <= 0.

        Raises ValueError for values that are not finite.
        """
        u, psi = np.broadcast_arrays(np.asarray(closure, float), np.asarray(azimuth, float))
        if not (np.isfinite(u).all() and np.isfinite(psi).all()):
            raise ValueError("closure and azimuth must be finite (m, rad)")
        shape = u.shape
        u = u.ravel()
        psi = psi.ravel()
        row, w, secant = self.locate(u)
        K22, K33, K23 = self.shear_matrix(row, w)
        stiffness = (K22 + K33) / 2 + (K22 - K33) / 2 * np.cos(2 * psi) + K23 * np.sin(2 * psi)
        values = {
            "normal_stress": secant * u,
            "kn_secant": secant,
            "kn_tangent": interpolate_rows(self.kn_tangent, row, w),
            "shear_stiffness": stiffness,
        }
        values = {name: np.where(u > 0, value, 0.0) for name, value in values.items()}
        for name in ("peak_friction", "mobilised_friction", "dilation"):
            values[name] = interpolate_azimuths(getattr(self, name), psi, row, w)
        return SimpleNamespace(**{name: value.reshape(shape)[()] for name, value in values.items()})

    def follow(self, delta: ArrayLike) -> Array:
        """Traction (m, 3) in Pa of a host that uses the table, along a path delta (m, 3) in m.

        Raises ValueError for another shape, or values that are not finite.
        """
        path = np.asarray(delta, float)
        if path.ndim != 2 or path.shape[1] != 3 or not np.isfinite(path).all():
            raise ValueError(f"delta has shape {path.shape}; expected finite values (m, 3) in m")
        row, w, _ = self.locate(np.zeros(1))
        F = np.zeros((3, 1))
        K = self.shear_matrix(row, w)
        tractions = np.zeros_like(path)
        for k, d in enumerate(np.diff(path, axis=0, prepend=np.zeros((1, 3)))):
            F, K = self.step(F[1:], K, d[:, None], path[k, :1])
            tractions[k] = F[:, 0]
        return tractions

    # ---------------------------------------------------- called by a host in every step

    def step(
        self, f: Array, K: Array, d: Array, closure: Array, spin: Array | float = 0.0
    ) -> tuple[Array, Array]:
        """Advance n contacts: elastic shear, limited by friction.

        Elastic shear decreases with the stiffness when the joint opens, so that softening creates
        no energy; its size is limited to friction times normal stress in its direction.

        Parameters
        ----------
        f: shear traction (2, n) in Pa before the step.
        K: shear stiffness (3, n) in Pa/m before the step, as `shear_matrix` returns it.
        d: increments of closure and shear (3, n) in m.
        closure: (n,) in m after the step.
        spin: rotation (n,) in rad of the contact about its normal in this step.

        Returns tractions (3, n) in Pa and shear stiffness (3, n) in Pa/m after the step. Raises
        nothing: arguments are not checked.
        """
        row, w, secant = self.locate(closure)
        normal = np.where(closure > 0, secant * closure, 0.0)
        K_new = self.shear_matrix(row, w)
        f = rotate(f, spin / 2)  # half of the spin before the new shear is added, half after it
        softer = np.flatnonzero(K_new[0] + K_new[1] < K[0] + K[1])
        if softer.size:
            elastic_shear = solve_symmetric(K[:, softer], f[:, softer])
            f[:, softer] = multiply_symmetric(K_new[:, softer], elastic_shear)
        f += multiply_symmetric(K_new, d[1:])
        f = rotate(f, spin / 2)
        size = np.hypot(f[0], f[1])
        candidates = np.flatnonzero(size > self.peak_friction.min() * normal)
        if candidates.size:
            azimuth = np.arctan2(f[1, candidates], f[0, candidates])
            friction = interpolate_azimuths(
                self.peak_friction, azimuth, row[candidates], w[candidates]
            )
            limit = normal[candidates] * friction
            trial = np.where(size[candidates] > 0, size[candidates], 1.0)
            f[:, candidates] *= np.minimum(1.0, limit / trial)
        return np.array([normal, f[0], f[1]]), K_new

    def locate(self, closure: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Rows, weights of linear interpolation and secant normal stiffness (Pa/m), each (n,).

        closure: (n,) in m; beyond the last row the normal stress follows the last tangent. Raises
        nothing: arguments are not checked.
        """
        row = np.clip(np.searchsorted(self.closure, closure, "right") - 1, 0, len(self.closure) - 2)
        low = self.closure[row]
        end = self.closure[-1]
        w = np.clip((closure - low) / (self.closure[row + 1] - low), 0.0, 1.0)
        secant = interpolate_rows(self.kn_secant, row, w)
        is_beyond = closure > end
        if is_beyond.any():
            increase = self.kn_tangent[-1] * (closure[is_beyond] - end)
            secant[is_beyond] = (self.normal_stress[-1] + increase) / closure[is_beyond]
        return row, w, secant

    def shear_matrix(self, row: NDArray[np.intp], w: Array) -> Array:
        """Initial shear stiffness K22, K33, K23 (3, n) in Pa/m at these rows and weights w.

        row, w: (n,) each, as `locate` returns them. Raises nothing: arguments are not checked.
        """
        mean, c, s = (interpolate_rows(part, row, w) for part in self._harmonics)
        return np.array([mean + c, mean - c, s])

    @cached_property
    def _harmonics(self) -> tuple[Array, Array, Array]:
        """Mean and amplitudes of cos 2 psi and sin 2 psi of the shear stiffness over azimuth psi.

        Each (rows,) in Pa/m. They are the components of a symmetric 2 by 2 shear stiffness K by
        row.
        """
        kt = np.ascontiguousarray(self.shear_stiffness.T)
        c = np.cos(2 * self.azimuth[:, None]) * kt
        s = np.sin(2 * self.azimuth[:, None]) * kt
        return kt.mean(axis=0), 2 * c.mean(axis=0), 2 * s.mean(axis=0)

    # --------------------------------------------------------- error against the law

    def report(self, law: Any) -> TableReport:
        """Errors of the table against its law on ten paths from the virgin state.

        law: the law that the table was made from. Raises ValueError for a law of one plane.
        """
        report = TableReport()
        for name, azimuth, corners in _report_paths(self.closure[-1], self.metadata["shear_limit"]):
            psi = np.radians(azimuth)
            axes = np.array(
                [[1, 0, 0], [0, np.cos(psi), np.sin(psi)], [0, -np.sin(psi), np.cos(psi)]]
            )
            path = _straight_path(np.array(corners) @ axes[:2])
            joint = law.joint()
            steps = np.diff(path, axis=0, prepend=np.zeros((1, 3)))
            exact = np.array([joint.update(d, tangent=False)[0] for d in steps])
            error = (self.follow(path) - exact) / np.linalg.norm(exact, axis=1).max()
            components = np.abs(error @ axes.T).max(axis=0)
            largest = float(np.linalg.norm(error, axis=1).max())
            report[name] = TableError(largest, *components.tolist())
        return report

    # -------------------------------------------------------------------- files

    @property
    def columns(self) -> dict[str, Array]:
        """Columns of the file: `un sn kn_secant kn_tangent mu kt_000 ... mu_.. mob_.. dil_..`

        `mu` is the mean over azimuth of the peak friction; the numbers are azimuths in degrees.
        """
        result = {name: getattr(self, attribute) for name, attribute in CLOSURE_COLUMNS.items()}
        result["mu"] = self.peak_friction.mean(axis=1)
        for name, attribute in AZIMUTH_COLUMNS.items():
            titles = (f"{name}_{round(np.degrees(psi)):03d}" for psi in self.azimuth)
            result |= zip(titles, getattr(self, attribute).T, strict=True)
        return result

    def save(self, path: str | Path) -> None:
        """Write a text file for `numpy.genfromtxt(path, names=True)`: names, metadata, rows.

        Raises OSError where it cannot be written.
        """
        path = Path(path)
        columns = self.columns
        part = path.with_name(path.name + ".part")  # an incomplete table could be read as a table
        with part.open("w", encoding="utf-8") as file:
            file.write("# " + " ".join(columns) + "\n")
            file.writelines(f"# {k}: {v}\n" for k, v in self.metadata.items() if k != "law")
            file.write(METADATA_MARK + json.dumps({"version": VERSION, **self.metadata}) + "\n")
            np.savetxt(file, np.array(list(columns.values())).T, fmt="%.17g")
        part.replace(path)


def load_table(path: str | Path) -> JointTable:
    """Read a table that `JointTable.save` wrote.

    path: of the file. Raises ValueError for any other file.
    """
    try:
        _, mark, rest = Path(path).read_text("utf-8", "replace").partition(METADATA_MARK)
        if not mark:
            raise ValueError(f"it has no line {METADATA_MARK.strip()!r}; export the law again")
        metadata = json.loads(rest.splitlines()[0])
        if (version := metadata.pop("version")) != VERSION:
            raise ValueError(
                f"version {version} of the table is not {VERSION}: tabulate the law again with "
                "this version of jointlaw"
            )
        data = np.genfromtxt(path, names=True)
        angles = sorted(int(name[3:]) for name in data.dtype.names or () if name.startswith("kt_"))
        values = {attribute: data[name].copy() for name, attribute in CLOSURE_COLUMNS.items()} | {
            attribute: np.array([data[f"{name}_{a:03d}"] for a in angles]).T
            for name, attribute in AZIMUTH_COLUMNS.items()
        }
        spaced = [k * 180 // len(angles) for k in range(len(angles))]
        is_even = len(angles) > 2 and angles == spaced
        if not (is_even and np.isfinite(data.tolist()).all() and (np.diff(data["un"]) > 0).all()):
            raise ValueError(
                "un must increase, azimuths be three or more, evenly spaced over 180 degrees, and "
                "all values finite"
            )
        return JointTable(azimuth=np.radians(angles), metadata=metadata, **values)
    except (OSError, KeyError, ValueError, TypeError, IndexError) as error:
        raise ValueError(f"{str(path)!r} is not a joint table: {error}") from None


# ------------------------------------------------------------------- interpolation


def interpolate_rows(values: Array, row: NDArray[np.intp], w: Array) -> Array:
    """Linear interpolation between rows of values (rows,)."""
    low = values[row]
    return np.asarray(low + (values[row + 1] - low) * w)


def interpolate_azimuths(values: Array, psi: Array, row: NDArray[np.intp], w: Array) -> Array:
    """Linear interpolation in the azimuth psi (n,) in rad and between rows of a table, (n,).

    values: (rows, azimuths) for azimuths evenly spaced over half a circle, after which they repeat.
    row, w: row below and weight of the row above, (n,) each.
    """
    azimuths = values.shape[1]
    index, x = np.divmod(np.mod(psi, np.pi) * (azimuths / np.pi), 1.0)
    a = index.astype(int)
    columns = (a % azimuths, (a + 1) % azimuths)
    low, high = (values[row, k] * (1 - w) + values[row + 1, k] * w for k in columns)
    return np.asarray(low * (1 - x) + high * x)


def multiply_symmetric(K: Array, v: Array) -> Array:
    """Products of symmetric matrices K (22, 33, 23; n) with vectors v (2, n)."""
    return np.array([K[0] * v[0] + K[2] * v[1], K[2] * v[0] + K[1] * v[1]])


def solve_symmetric(K: Array, v: Array) -> Array:
    """Solutions x (2, n) of K x = v for symmetric matrices K (22, 33, 23; n)."""
    x2, x3 = v / (K[0] * K[1] - K[2] * K[2])
    return np.array([K[1] * x2 - K[2] * x3, K[0] * x3 - K[2] * x2])


def rotate(v: Array, angle: Array | float) -> Array:
    """Vectors v (2, n) turned by an angle (rad) from axis 2 towards axis 3."""
    c = np.cos(angle)
    s = np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


# ----------------------------------------------------------- the paths of the report


def _straight_path(corners: Array) -> Array:
    """Points (m, 3) from the origin on straight legs of STEPS_PER_LEG points to corners (k, 3)."""
    fraction = np.arange(1, STEPS_PER_LEG + 1)[:, None] / STEPS_PER_LEG
    return np.concatenate([a + (b - a) * fraction for a, b in pairwise([np.zeros(3), *corners])])


def _report_paths(end: float, limit: float) -> list[tuple[str, int, list[tuple[float, float]]]]:
    """Names, azimuths (degrees) and corners (closure, shear in m) of the paths of a report."""
    u = end / 2
    s = min(limit, end)
    return [
        ("closure", 0, [(end, 0)]),
        ("closure, unloading", 0, [(end, 0), (0, 0)]),
        ("shear at 0 deg, constant closure", 0, [(u, 0), (u, s)]),
        ("shear at 45 deg, constant closure", 45, [(u, 0), (u, s)]),
        ("shear at 90 deg, constant closure", 90, [(u, 0), (u, s)]),
        ("shear and reversal", 0, [(u, 0), (u, s), (u, -s)]),
        ("shear, then closure", 0, [(u, 0), (u, s / 4), (end, s / 4)]),
        ("closure and shear together", 0, [(end, end / 2)]),
        ("shear, unloading", 0, [(end, 0), (end, s / 4), (end / 4, s / 4)]),
        ("shear, opening, re-contact", 0, [(u, 0), (u, s / 2), (-u / 4, s / 2), (u, s / 2)]),
    ]
