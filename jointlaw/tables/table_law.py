"""The law that a host runs from a joint table: numpy alone, so that hosts copy this file.

Normal stress follows the closure; shear is elastic, with the stiffness and the friction of its
direction. Arrays run over joints, last; SI units: m, Pa, Pa/m.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

VERSION = 1  # of the table's files
MARKER = "# metadata: "


def read_table(path: str | Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Columns by name, and metadata, of a table's text or NPZ file.

    A text file without the line of metadata, as people write it by hand, has none. Raises
    ValueError for a file of another version.
    """
    if str(path).endswith(".npz"):
        with np.load(path, allow_pickle=False) as file:
            names, data = file["names"].tolist(), file["data"]
            metadata = json.loads(str(file["metadata"]))
        column = {name: data[:, k] for k, name in enumerate(names)}
    else:
        data = np.genfromtxt(path, names=True)
        column = {name: np.atleast_1d(data[name]) for name in data.dtype.names or ()}
        with open(path, encoding="utf-8") as lines:
            found = next((line for line in lines if line.startswith(MARKER)), None)
        metadata = {} if found is None else json.loads(found[len(MARKER) :])
    if metadata and metadata.get("version") != VERSION:
        raise ValueError(
            f"version {metadata.get('version')} of the table is not {VERSION}: tabulate the law "
            "again with this version of jointlaw"
        )
    return column, metadata


class TableLaw:
    """A tabulated joint: normal stress by closure, and elastic-frictional shear by azimuth.

    table: the file, text or NPZ, or its columns by name. Shear is incremental, as in the laws of
    most hosts. Between rows all is linear, past the last the normal stress follows its tangent.
    """

    def __init__(self, table: str | Path | Mapping[str, Array]) -> None:
        column, self.metadata = (table, {}) if isinstance(table, Mapping) else read_table(table)
        self.un, self.sn = column["un"], column["sn"]
        self.kn_secant, self.kn_tangent = column["kn_secant"], column["kn_tangent"]
        angles = sorted(int(name[3:]) for name in column if name.startswith("kt_"))
        psi = np.radians(angles)
        kt = np.array([column[f"kt_{a:03d}"] for a in angles])
        # a table written by hand may give one friction for all azimuths
        mu = np.array([column.get(f"mu_{a:03d}", column["mu"]) for a in angles])
        # Stiffness over azimuth is e.K.e with a symmetric K: mean and second harmonic give K
        self.kt = kt.mean(axis=0)
        c, s = np.cos(2 * psi)[:, None] * kt, np.sin(2 * psi)[:, None] * kt
        many = len(angles) > 2
        self.kc = 2 * c.mean(axis=0) if many else c.mean(axis=0) * (len(angles) == 2)
        self.ks = 2 * s.mean(axis=0) if many else np.zeros_like(self.kt)
        self.mu, self.mu_low, self.mu_mean = mu, mu.min(), mu.mean(axis=0)
        self.k_max = float(max(self.kn_tangent.max(), self.kn_secant.max(), kt.max()))
        self.f = np.zeros((2, 0))  # shear traction in the joint's frame
        self.K = np.zeros((3, 0))  # shear stiffness K22, K33, K23 of the last step

    def stiffness(self, closure: float | None = None) -> float:
        """Largest stiffness (Pa/m) of the table."""
        return self.k_max

    def at(self, closure: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Rows and weights of linear interpolation, and secant normal stiffness (Pa/m)."""
        row = np.clip(np.searchsorted(self.un, closure, "right") - 1, 0, len(self.un) - 2)
        low = self.un[row]
        w = np.clip((closure - low) / (self.un[row + 1] - low), 0.0, 1.0)
        secant = between(self.kn_secant, row, w)
        beyond = closure > self.un[-1]
        if beyond.any():
            extra = closure[beyond] - self.un[-1]
            secant[beyond] = (self.sn[-1] + self.kn_tangent[-1] * extra) / closure[beyond]
        return row, w, secant

    def shear_stiffness(self, row: NDArray[np.intp], w: Array) -> Array:
        """K22, K33, K23 (Pa/m)."""
        k, c = between(self.kt, row, w), between(self.kc, row, w)
        return np.array([k + c, k - c, between(self.ks, row, w)])

    def friction(self, f: Array, row: NDArray[np.intp], w: Array) -> Array:
        """Friction coefficient in the direction of the shear tractions f (2, n)."""
        return around(self.mu, np.arctan2(f[1], f[0]), row, w)

    def step(self, d: Array, closure: Array, spin: Array | float = 0.0) -> Array:
        """Tractions (3, n) after increments d (3, n); `spin` (n,) turns the old shear force."""
        row, w, secant = self.at(closure)
        normal = np.where(closure > 0, secant * closure, 0.0)
        K, old = self.shear_stiffness(row, w), self.K
        c, s = np.cos(spin / 2), np.sin(spin / 2)  # half before the new shear is added, half after
        f = np.array([c * self.f[0] - s * self.f[1], s * self.f[0] + c * self.f[1]])
        falls = np.flatnonzero(K[0] + K[1] < old[0] + old[1])
        if falls.size:  # a joint that softens gives back elastic force: no energy is made
            a, b, g = old[:, falls]
            f2, f3 = f[:, falls] / (a * b - g * g)
            f[:, falls] = times(K[:, falls], np.array([b * f2 - g * f3, a * f3 - g * f2]))
        f += times(K, d[1:])
        f = np.array([c * f[0] - s * f[1], s * f[0] + c * f[1]])
        size = np.hypot(f[0], f[1])
        over = np.flatnonzero(size > self.mu_low * normal)
        if over.size:
            cap = normal[over] * self.friction(f[:, over], row[over], w[over])
            f[:, over] *= np.minimum(1.0, cap / np.where(size[over] > 0, size[over], 1.0))
        self.f, self.K = f, K
        return np.array([normal, f[0], f[1]])

    def add(self, closure: Array) -> None:
        """Joints that came, at the end of the list."""
        row, w, _ = self.at(closure)
        self.f = np.concatenate([self.f, np.zeros((2, len(closure)))], axis=1)
        self.K = np.concatenate([self.K, self.shear_stiffness(row, w)], axis=1)

    def keep(self, mask: NDArray[np.bool_]) -> None:
        """Forget the joints where `mask` is False."""
        self.f, self.K = self.f[:, mask], self.K[:, mask]

    def state(self) -> dict[str, Array]:
        """Arrays to save."""
        return {"f": self.f, "K": self.K}

    def restore(self, data: Mapping[str, Array]) -> None:
        """State from such arrays."""
        self.f, self.K = data["f"].copy(), data["K"].copy()


def between(values: Array, row: NDArray[np.intp], w: Array) -> Array:
    """Linear interpolation between rows of values (rows,)."""
    low = values[row]
    return np.asarray(low + (values[row + 1] - low) * w)


def around(values: Array, psi: Array, row: NDArray[np.intp], w: Array) -> Array:
    """Linear interpolation in azimuth psi and between rows of values (azimuths, rows)."""
    place = np.mod(psi, np.pi) * (len(values) / np.pi)
    a = np.floor(place).astype(int) % len(values)
    x, b = place - np.floor(place), (a + 1) % len(values)
    low = values[a, row] * (1 - w) + values[a, row + 1] * w
    high = values[b, row] * (1 - w) + values[b, row + 1] * w
    return np.asarray(low * (1 - x) + high * x)


def times(K: Array, v: Array) -> Array:
    """Products of symmetric matrices K (22, 33, 23; n) with vectors v (2, n)."""
    return np.array([K[0] * v[0] + K[2] * v[1], K[2] * v[0] + K[1] * v[1]])
