"""jointlaw: a micromechanical, anisotropic, path-dependent rock-joint law for DEM codes.

The law of A. Misra, Micromechanical model for anisotropic rock joints, J. Geophys. Res. 104(B10),
1999, made incremental and energy-consistent. All quantities are SI: m, Pa, 1/m2.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import closed_form, presets
from .asperity import Asperity
from .batch import JointBatch
from .heights import GammaHeights, Heights
from .joint import Joint
from .law import JointLaw
from .orientation import Orientation
from .paths import PathError, closure_test, direct_shear
from .record import Record
from .resolution import Resolution
from .secant import Secant, secant
from .state import JointState, NonFiniteError, load_state
from .table import JointTable, load_table

if TYPE_CHECKING:
    from .hosts import export_yade
    from .measurements import baselines, datasets, unloading
    from .measurements.calibrate import fit_closure, fit_curves, fit_shear
    from .measurements.fit import Fit
    from .measurements.measured import ClosureCurve, ShearCurve, first_loading
    from .measurements.surface import SurfaceFit, from_surface
    from .measurements.sweep import fit_many
    from .measurements.synthetic import synthetic_surface
    from .tables.tabulate import tabulate

__version__ = "0.1.0"

__all__ = [
    "Asperity",
    "ClosureCurve",
    "Fit",
    "GammaHeights",
    "Heights",
    "Joint",
    "JointBatch",
    "JointLaw",
    "JointState",
    "JointTable",
    "NonFiniteError",
    "Orientation",
    "PathError",
    "Record",
    "Resolution",
    "Secant",
    "ShearCurve",
    "SurfaceFit",
    "baselines",
    "closed_form",
    "closure_test",
    "datasets",
    "direct_shear",
    "export_yade",
    "first_loading",
    "fit_closure",
    "fit_curves",
    "fit_many",
    "fit_shear",
    "from_surface",
    "load_state",
    "load_table",
    "presets",
    "secant",
    "synthetic_surface",
    "tabulate",
    "unloading",
]

# Tools for measurements and hosts load on first use: a DEM code that embeds the law needs none
_LATER = {
    "ClosureCurve": "measurements.measured",
    "Fit": "measurements.fit",
    "ShearCurve": "measurements.measured",
    "SurfaceFit": "measurements.surface",
    "export_yade": "hosts",
    "first_loading": "measurements.measured",
    "fit_closure": "measurements.calibrate",
    "fit_curves": "measurements.calibrate",
    "fit_many": "measurements.sweep",
    "fit_shear": "measurements.calibrate",
    "from_surface": "measurements.surface",
    "synthetic_surface": "measurements.synthetic",
    "tabulate": "tables.tabulate",
}
_LATER_MODULES = {name: f"measurements.{name}" for name in ("baselines", "datasets", "unloading")}


def __getattr__(name: str) -> Any:
    if name in _LATER_MODULES:
        return import_module(f".{_LATER_MODULES[name]}", __name__)
    if name in _LATER:
        return getattr(import_module(f".{_LATER[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
