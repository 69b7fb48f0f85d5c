"""What a laboratory test on a joint measured: named columns, units, summary figures."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..support.checks import Array
from ..support.files import replace_file
from .plot import plot_record

UNITS = {
    "closure": "m",
    "shear_2": "m",
    "shear_3": "m",
    "F1": "Pa",
    "F2": "Pa",
    "F3": "Pa",
    "sliding": "1",
    "separated": "1",
    "stored": "J/m2",
    "dissipated": "J/m2",
}


@dataclass(frozen=True, eq=False)
class Record:
    """Columns of a test: a row for the joint at its start (direct shear: seated), one per step.

    Columns (also as attributes, arrays (rows,)): closure, shear_2, shear_3 in m; F1, F2, F3 in Pa;
    sliding, separated as shares of the facet orientations; stored, dissipated in J/m2. `azimuth`
    is the direction of shear.
    """

    columns: Mapping[str, Array]
    azimuth: float = 0.0
    name: str = ""

    def __getattr__(self, name: str) -> Array:
        columns = self.__dict__.get("columns", {})
        if name in columns:
            column: Array = columns[name]
            return column
        raise AttributeError(f"record has no column {name!r}; columns: {', '.join(columns)}")

    def __len__(self) -> int:
        return len(self.columns["closure"])

    @property
    def shear(self) -> Array:
        """Shear displacement along the azimuth of the test, in m."""
        return self.shear_2 * math.cos(self.azimuth) + self.shear_3 * math.sin(self.azimuth)

    @property
    def shear_stress(self) -> Array:
        """Shear traction along the azimuth of the test, in Pa."""
        return self.F2 * math.cos(self.azimuth) + self.F3 * math.sin(self.azimuth)

    @property
    def friction_angle(self) -> Array:
        """Mobilised friction angle atan(shear stress/normal stress) in degrees; 0 where open."""
        return np.degrees(np.where(self.F1 > 0, np.arctan2(self.shear_stress, self.F1), 0.0))

    @property
    def peak_friction_angle(self) -> float:
        """Largest mobilised friction angle, either sense, in degrees."""
        return float(np.max(np.abs(self.friction_angle)))

    @property
    def residual_friction_angle(self) -> float:
        """Mobilised friction angle at the end of the test, in degrees."""
        return float(abs(self.friction_angle[-1]))

    @property
    def dilation_angle(self) -> float:
        """Largest dilation angle atan(opening/shear) of a step, in degrees; 0 without dilation."""
        slip = np.abs(np.diff(self.shear))
        opening = -np.diff(self.closure)
        moved = slip > 1e-9 * max(float(np.max(np.abs(self.shear))), 1e-300)
        if not moved.any():
            return 0.0
        return float(np.degrees(np.arctan(max(np.max(opening[moved] / slip[moved]), 0.0))))

    @property
    def secant_stiffness(self) -> float:
        """Shear stress over shear displacement at the peak friction angle, in Pa/m; NaN if none."""
        at = int(np.argmax(np.abs(self.friction_angle)))
        shear = float(self.shear[at] - self.shear[0])
        return float(self.shear_stress[at]) / shear if shear else math.nan

    def summary(self) -> dict[str, float]:
        """The summary figures by name, units in the names."""
        figures: dict[str, float] = {
            "rows": len(self),
            "largest_closure_m": float(np.max(self.closure)),
            "largest_normal_stress_Pa": float(np.max(self.F1)),
            "stored_J_per_m2": float(self.stored[-1]),
            "dissipated_J_per_m2": float(self.dissipated[-1]),
        }
        if np.any(self.shear != self.shear[0]):
            figures |= {
                "peak_friction_angle_deg": self.peak_friction_angle,
                "residual_friction_angle_deg": self.residual_friction_angle,
                "dilation_angle_deg": self.dilation_angle,
                "secant_shear_stiffness_Pa_per_m": self.secant_stiffness,
            }
        return figures

    def to_csv(self, path: str | Path) -> None:
        """Write the columns as CSV under their names; the units are those of `UNITS`."""
        buffer = io.StringIO()
        header = ",".join(self.columns)
        table = np.column_stack(list(self.columns.values()))
        np.savetxt(buffer, table, fmt="%.12g", delimiter=",", header=header, comments="")
        replace_file(Path(path), buffer.getvalue().encode())

    def to_npz(self, path: str | Path) -> None:
        """Write the columns as NPZ with a version, the azimuth and a JSON text of the units."""
        buffer = io.BytesIO()
        arrays: dict[str, Any] = dict(self.columns)
        np.savez(buffer, version=1, **arrays, azimuth=self.azimuth, units=json.dumps(UNITS))
        replace_file(Path(path), buffer.getvalue())

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw the test (needs matplotlib: extra `plot`); returns the figure, saved to `path`."""
        derived = ("shear", "shear_stress", "friction_angle")
        curves = {**self.columns, **{name: getattr(self, name) for name in derived}}
        return plot_record(curves, self.azimuth, path)
