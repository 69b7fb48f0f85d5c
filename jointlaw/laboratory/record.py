"""What a laboratory test on a joint measured: named columns, units, summary figures."""

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..support import units
from ..support.checks import Array
from ..support.files import replace_file
from ..support.pyplot import pyplot, style, written

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
_PREFIXES = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
Panels = dict[str, dict[str, Array]]


@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """Columns of a test: a row for the joint at its start (direct shear: seated), one per step.

    Columns (also as attributes, arrays (rows,)): closure, shear_2, shear_3 in m; F1, F2, F3 in Pa;
    sliding, separated as shares of the facet orientations; stored, dissipated in J/m2. `azimuth`
    is the direction of shear in rad; `columns` are all, by name, and `name` is that of the test.
    """

    columns: Mapping[str, Array]
    azimuth: float = 0.0
    name: str = ""

    def __getattr__(self, name: str) -> Array:
        columns = self.__dict__.get("columns", {})
        if name in columns:
            return columns[name]
        raise AttributeError(f"record has no column {name!r}; columns: {', '.join(columns)}")

    def __len__(self) -> int:
        return len(self.columns["closure"])

    def __repr__(self) -> str:
        if not self._sheared:
            most = f"{np.max(self.F1) / 1e6:.3g} MPa at a closure of {np.max(self.closure):.3g} m"
            return f"<Record of a closure test, {len(self)} rows: to {most}>"
        way, peak = np.max(np.abs(self.shear)), "peak" if self.has_peak else "largest"
        return (
            f"<Record of a direct shear test, {len(self)} rows: to {way:.3g} m, {peak} friction "
            f"angle {self.peak_friction_angle:.1f} deg, largest dilation angle "
            f"{self.peak_dilation_angle:.1f} deg>"
        )

    @property
    def _sheared(self) -> bool:
        return bool(np.any(self.shear != self.shear[0]))

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
        """Largest mobilised friction angle, either sense, in degrees; see `has_peak`."""
        return float(np.max(np.abs(self.friction_angle)))

    @property
    def has_peak(self) -> bool:
        """Whether the friction angle falls, by 0.1 % or more, from its largest value.

        A curve that rises until shear ends or turns has no peak, only a largest value.
        """
        angle = np.abs(self.friction_angle)
        top = int(np.argmax(angle))
        way = np.sign(np.diff(self.shear))
        turned = way[top:] != way[max(top - 1, 0)]
        leg = angle[top:][: 1 + (int(np.argmax(turned)) if turned.any() else len(turned))]
        return bool(leg.min() < (1 - 1e-3) * leg[0])

    @property
    def residual_friction_angle(self) -> float:
        """Mobilised friction angle at the end of the test, in degrees."""
        return float(abs(self.friction_angle[-1]))

    @property
    def dilation_angle(self) -> Array:
        """Dilation angle atan(opening/shear) of each row's step in degrees; 0 without shear."""
        slip = np.abs(np.diff(self.shear, prepend=self.shear[0]))
        opening = -np.diff(self.closure, prepend=self.closure[0])
        moved = slip > 1e-9 * np.max(np.abs(self.shear))
        return np.degrees(np.where(moved, np.arctan2(opening, slip), 0.0))

    @property
    def peak_dilation_angle(self) -> float:
        """Largest dilation angle of a step in degrees; 0 where the joint never opens."""
        return max(0.0, float(np.max(self.dilation_angle)))

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
        if self._sheared:
            figures |= {
                "peak_friction_angle_deg": self.peak_friction_angle,
                "has_peak": self.has_peak,
                "residual_friction_angle_deg": self.residual_friction_angle,
                "peak_dilation_angle_deg": self.peak_dilation_angle,
                "secant_shear_stiffness_Pa_per_m": self.secant_stiffness,
            }
        return figures

    def to_csv(self, path: str | Path, length: str = "m", stress: str = "Pa") -> None:
        """Write the columns as CSV; titles end in the unit, "closure_m", and shares have none.

        A shear test has shear stress, opening, friction and dilation angle besides.

        path: of the file. length, stress: units to write, such as "mm" and "MPa"; raises ValueError
        for others.
        """
        chosen = {"m": length, "Pa": stress}
        factors = {unit: units.parse(f"1{chosen[unit]}", unit) for unit in chosen}
        columns = [(name, UNITS[name], column) for name, column in self.columns.items()]
        if self._sheared:
            columns += [
                ("shear_stress", "Pa", self.shear_stress),
                ("opening", "m", self.closure[0] - self.closure),
                ("friction_angle_deg", "1", self.friction_angle),
                ("dilation_angle_deg", "1", self.dilation_angle),
            ]
        titles = (
            f"{name}_{chosen.get(unit, unit)}".removesuffix("_1") for name, unit, _ in columns
        )
        table = np.column_stack([column / factors.get(unit, 1.0) for _, unit, column in columns])
        buffer, head = io.StringIO(), ",".join(titles)
        np.savetxt(buffer, table, fmt="%.12g", delimiter=",", header=head, comments="")
        replace_file(Path(path), buffer.getvalue().encode())

    @style()
    def plot(self, path: str | Path | None = None) -> Any:
        """Draw the test (needs matplotlib: extra `plot`); returns the figure, saved to `path`.

        Raises ImportError without it, OSError where the file cannot be written.
        """
        title, x, label, panels = _shear_panels(self) if self._sheared else _closure_panels(self)
        rows = len(panels) // 2
        figure, axes = pyplot().subplots(rows, 2, figsize=(7.5, 1 + 2.6 * rows), sharex=True)
        figure.suptitle(title)
        figure.supxlabel(label, fontsize="medium")
        for axis, (name, curves) in zip(axes.flat, panels.items(), strict=True):
            axis.set_ylabel(name)
            for curve, values in curves.items():
                axis.plot(x, values, label=curve)
            if len(curves) > 1:
                axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
        return written(figure, path)


def _scaled(values: Array, unit: str) -> tuple[Array, str]:
    """Values in the largest multiple of a unit that leaves their peak at one or more; its name."""
    peak = float(np.max(np.abs(values)))
    prefix = next((p for p, x in reversed(_PREFIXES.items()) if x <= peak), "")
    return values / _PREFIXES[prefix], prefix + unit


def _shear_panels(record: Record) -> tuple[str, Array, str, Panels]:
    """Title, and of the panels of a shear test x with its label, and curves by label and name."""
    shear, length = _scaled(record.shear, "m")
    stress, unit = _scaled(np.stack([record.shear_stress, record.F1]), "Pa")
    dilation, small = _scaled(record.closure[0] - record.closure, "m")
    title = (
        f"Direct shear at azimuth {np.degrees(record.azimuth):.0f}°, "
        f"largest friction angle {record.peak_friction_angle:.1f}°"
    )
    panels = {
        f"stress ({unit})": {"shear stress": stress[0], "normal stress": stress[1]},
        "mobilised friction angle (°)": {"": record.friction_angle},
        f"dilation ({small})": {"": dilation},
        "share of facets (%)": {
            "sliding": 100 * record.sliding,
            "separated": 100 * record.separated,
        },
    }
    return title, shear, f"shear displacement ({length})", panels


def _closure_panels(record: Record) -> tuple[str, Array, str, Panels]:
    """The same of a closure test."""
    closure, length = _scaled(record.closure, "m")
    stress, unit = _scaled(record.F1, "Pa")
    energy, joule = _scaled(np.stack([record.stored, record.dissipated]), "J/m²")
    panels = {
        f"normal stress ({unit})": {"": stress},
        f"energy ({joule})": {"stored": energy[0], "dissipated": energy[1]},
    }
    return "Closure test", closure, f"closure ({length})", panels
