"""What a table drops: its error against the law, by path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..law import JointLaw
from ..support.checks import Array, whole

Follow = Callable[[Array], Array]


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
        head = (
            f"{'path':34s} {'largest':>8s} {'rms':>8s} {'normal':>8s} {'along':>8s} {'across':>8s}"
        )
        lines = [head]
        for r in self.rows:
            values = (r.largest, r.rms, r.normal, r.along, r.across)
            lines.append(f"{r.name:34s} " + " ".join(f"{100 * v:6.1f} %" for v in values))
        return "\n".join([*lines, self.note] if self.note else lines)

    def __getitem__(self, name: str) -> PathDifference:
        return next(row for row in self.rows if row.name == name)

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """The same as nested mappings: path, then measure."""
        return {r.name: {k: v for k, v in vars(r).items() if k != "name"} for r in self.rows}


def report(follow: Follow, law: JointLaw, end: float, shear_limit: float, steps: int) -> Report:
    """Tractions of `follow` along the path suite, compared with those of the law.

    follow: tractions (m, 3) in Pa of the table along a path (m, 3) in m; end: last closure and
    shear_limit: largest shear of the suite, in m; steps: per leg of a path.
    """
    steps = whole("steps", steps, 2)
    rows = []
    for name, corners in _suite(end, shear_limit).items():
        path = _legs(corners, steps)
        increments, joint = np.diff(path, axis=0, prepend=np.zeros((1, 3))), law.joint()
        exact = np.array([joint.update(d, tangent=False)[0] for d in increments])
        rows.append(_error(name, follow(path), exact, corners))
    damage = [name for name, on in (("yield", law.tables.yields), ("wear", law.tables.wears)) if on]
    note = f"asperities {' and '.join(damage)}: the table holds their first loading alone"
    return Report(tuple(rows), note if damage else "")


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
