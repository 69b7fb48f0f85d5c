"""The record of a simulated laboratory test on a joint: columns with units, summary, figure."""

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
_SI_PREFIXES = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
_MIN_PEAK_DROP = 1e-3  # relative drop of the friction angle that makes its maximum a peak
_MIN_SLIP = 1e-9  # of the largest shear displacement; smaller steps have no dilation angle
Panels = dict[str, dict[str, Array]]  # axis label -> {curve label: values}


@dataclass(frozen=True, eq=False, repr=False)
class TestRecord:
    """Columns of a test: one row for the initial state of the joint, then one per step.

    Columns are also attributes, arrays of shape (rows,):

    - closure, shear_2, shear_3: relative displacement in m;
    - F1, F2, F3: traction in Pa;
    - sliding, separated: fractions of the facet orientations;
    - stored, dissipated: energy in J/m2.

    Parameters
    ----------
    columns: the columns by name.
    azimuth: direction of shear in rad.
    name: name of the test.
    """

    __test__ = False  # not a test class of pytest

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
        if not self._is_shear_test:
            stress = f"{np.max(self.F1) / 1e6:.3g} MPa"
            closure = f"{np.max(self.closure):.3g} m"
            return (
                f"<TestRecord of a closure test, {len(self)} rows: normal stress to {stress}, "
                f"closure to {closure}>"
            )
        displacement = np.max(np.abs(self.shear))
        kind = "peak" if self.has_peak else "largest"
        return (
            f"<TestRecord of a direct shear test, {len(self)} rows: shear displacement to "
            f"{displacement:.3g} m, {kind} friction angle {self.peak_friction_angle:.1f} deg, "
            f"largest dilation angle {self.peak_dilation_angle:.1f} deg>"
        )

    @property
    def _is_shear_test(self) -> bool:
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
        """Largest absolute mobilised friction angle in degrees; see `has_peak`."""
        return float(np.max(np.abs(self.friction_angle)))

    @property
    def has_peak(self) -> bool:
        """Whether the friction angle falls by 0.1 % or more after its maximum.

        A friction angle that increases until shear ends or reverses has a maximum but no peak.
        """
        angle = np.abs(self.friction_angle)
        peak_row = int(np.argmax(angle))
        sense = np.sign(np.diff(self.shear))
        is_reversed = sense[peak_row:] != sense[max(peak_row - 1, 0)]
        rows = int(np.argmax(is_reversed)) if is_reversed.any() else len(is_reversed)
        until_reversal = angle[peak_row:][: 1 + rows]
        return bool(until_reversal.min() < (1 - _MIN_PEAK_DROP) * until_reversal[0])

    @property
    def residual_friction_angle(self) -> float:
        """Absolute mobilised friction angle at the end of the test, in degrees."""
        return float(abs(self.friction_angle[-1]))

    @property
    def dilation_angle(self) -> Array:
        """Dilation angle atan(opening/slip) in degrees of the step that leads to each row, (rows,).

        The opening is the decrease of the closure in the step, the slip the absolute change of the
        shear displacement. 0 in the first row and in steps without slip.
        """
        slip = np.abs(np.diff(self.shear, prepend=self.shear[0]))
        opening = -np.diff(self.closure, prepend=self.closure[0])
        slips = slip > _MIN_SLIP * np.max(np.abs(self.shear))
        return np.degrees(np.where(slips, np.arctan2(opening, slip), 0.0))

    @property
    def peak_dilation_angle(self) -> float:
        """Largest dilation angle of a step in degrees; 0 if the joint never opens."""
        return max(0.0, float(np.max(self.dilation_angle)))

    @property
    def secant_stiffness(self) -> float:
        """Shear stress over shear displacement at the peak friction angle, in Pa/m.

        NaN without shear displacement there.
        """
        peak_row = int(np.argmax(np.abs(self.friction_angle)))
        displacement = float(self.shear[peak_row] - self.shear[0])
        return float(self.shear_stress[peak_row]) / displacement if displacement else math.nan

    def summary(self) -> dict[str, float]:
        """Summary figures by name, with the unit at the end of the name."""
        figures: dict[str, float] = {
            "rows": len(self),
            "largest_closure_m": float(np.max(self.closure)),
            "largest_normal_stress_Pa": float(np.max(self.F1)),
            "stored_J_per_m2": float(self.stored[-1]),
            "dissipated_J_per_m2": float(self.dissipated[-1]),
        }
        if self._is_shear_test:
            figures |= {
                "peak_friction_angle_deg": self.peak_friction_angle,
                "has_peak": self.has_peak,
                "residual_friction_angle_deg": self.residual_friction_angle,
                "peak_dilation_angle_deg": self.peak_dilation_angle,
                "secant_shear_stiffness_Pa_per_m": self.secant_stiffness,
            }
        return figures

    def to_csv(self, path: str | Path, length: str = "m", stress: str = "Pa") -> None:
        """Write the columns as CSV, with the unit at the end of each title ("closure_m").

        Fractions have no unit. A shear test has four more columns: shear stress, opening, friction
        angle and dilation angle.

        Parameters
        ----------
        path: path of the file.
        length, stress: units of lengths and stresses, such as "mm" and "MPa".

        Raises ValueError for an unknown unit.
        """
        chosen_units = {"m": length, "Pa": stress}
        factors = {si: units.parse(f"1{unit}", si) for si, unit in chosen_units.items()}
        columns = [(name, UNITS[name], column) for name, column in self.columns.items()]
        if self._is_shear_test:
            columns += [
                ("shear_stress", "Pa", self.shear_stress),
                ("opening", "m", self.closure[0] - self.closure),
                ("friction_angle_deg", "1", self.friction_angle),
                ("dilation_angle_deg", "1", self.dilation_angle),
            ]
        titles = (
            f"{name}_{chosen_units.get(unit, unit)}".removesuffix("_1") for name, unit, _ in columns
        )
        table = np.column_stack([column / factors.get(unit, 1.0) for _, unit, column in columns])
        buffer = io.StringIO()
        header = ",".join(titles)
        np.savetxt(buffer, table, fmt="%.12g", delimiter=",", header=header, comments="")
        replace_file(Path(path), buffer.getvalue().encode())

    @style()
    def plot(self, path: str | Path | None = None) -> Any:
        """Plot the test (needs matplotlib: extra `plot`).

        Parameters
        ----------
        path: file to save the figure to, or None.

        Returns the figure. Raises ImportError without matplotlib, OSError if the file cannot be
        written.
        """
        make_panels = _shear_panels if self._is_shear_test else _closure_panels
        title, x, x_label, panels = make_panels(self)
        rows = len(panels) // 2
        figure, axes = pyplot().subplots(rows, 2, figsize=(7.5, 1 + 2.6 * rows), sharex=True)
        figure.suptitle(title)
        figure.supxlabel(x_label, fontsize="medium")
        for axis, (y_label, curves) in zip(axes.flat, panels.items(), strict=True):
            axis.set_ylabel(y_label)
            for curve_label, values in curves.items():
                axis.plot(x, values, label=curve_label)
            if len(curves) > 1:
                axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
        return written(figure, path)


def _scale_to_prefix(values: Array, unit: str) -> tuple[Array, str]:
    """Scale values to the largest SI multiple of a unit in which their maximum is at least 1.

    Returns the scaled values and the unit with its prefix.
    """
    maximum = float(np.max(np.abs(values)))
    prefixes = reversed(_SI_PREFIXES.items())
    prefix = next((name for name, factor in prefixes if factor <= maximum), "")
    return values / _SI_PREFIXES[prefix], prefix + unit


def _shear_panels(record: TestRecord) -> tuple[str, Array, str, Panels]:
    """Title, x values, x label and panels of the figure of a direct shear test."""
    shear, shear_unit = _scale_to_prefix(record.shear, "m")
    stress, stress_unit = _scale_to_prefix(np.stack([record.shear_stress, record.F1]), "Pa")
    opening, opening_unit = _scale_to_prefix(record.closure[0] - record.closure, "m")
    title = (
        f"Direct shear at azimuth {np.degrees(record.azimuth):.0f}°, "
        f"largest friction angle {record.peak_friction_angle:.1f}°"
    )
    panels = {
        f"stress ({stress_unit})": {"shear stress": stress[0], "normal stress": stress[1]},
        "mobilised friction angle (°)": {"": record.friction_angle},
        f"dilation ({opening_unit})": {"": opening},
        "fraction of facets (%)": {
            "sliding": 100 * record.sliding,
            "separated": 100 * record.separated,
        },
    }
    return title, shear, f"shear displacement ({shear_unit})", panels


def _closure_panels(record: TestRecord) -> tuple[str, Array, str, Panels]:
    """Title, x values, x label and panels of the figure of a closure test."""
    closure, closure_unit = _scale_to_prefix(record.closure, "m")
    stress, stress_unit = _scale_to_prefix(record.F1, "Pa")
    energy, energy_unit = _scale_to_prefix(np.stack([record.stored, record.dissipated]), "J/m²")
    panels = {
        f"normal stress ({stress_unit})": {"": stress},
        f"energy ({energy_unit})": {"stored": energy[0], "dissipated": energy[1]},
    }
    return "Closure test", closure, f"closure ({closure_unit})", panels
