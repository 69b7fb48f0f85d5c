"""jointlaw: a micromechanical, anisotropic, path-dependent rock-joint law for DEM codes.

The law of A. Misra, Micromechanical model for anisotropic rock joints, J. Geophys. Res. 104(B10),
1999, made incremental and energy-consistent. All quantities are SI: m, Pa, 1/m2.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import presets
from .joints.batch import JointBatch
from .joints.joint import Joint
from .joints.pool import JointPool
from .joints.state import JointState, NonFiniteError, load_state
from .laboratory.experiments import PathError, closure_test, direct_shear
from .laboratory.record import Record
from .law import JointLaw
from .paper import closed_form
from .paper.secant import Secant, secant
from .parameters.asperity import Asperity
from .parameters.heights import GammaHeights, Heights
from .parameters.orientation import Orientation
from .parameters.resolution import Resolution
from .support.version import __version__ as __version__
from .tables.joint_table import JointTable, load_table

if TYPE_CHECKING:
    from .calibration import baselines, datasets, unloading
    from .calibration.fit import Fit, fit_closure, fit_curves, fit_many, fit_shear
    from .calibration.measured import ClosureCurve, ShearCurve, first_loading
    from .hosts.c.export import export_c, include_dir
    from .hosts.lammps.export import export_lammps
    from .hosts.yade.export import export_yade
    from .laboratory.flow import hydraulic_aperture, transmissivity
    from .surface.fit import SurfaceFit, from_surface
    from .surface.synthetic import synthetic_surface
    from .tables.tabulate import tabulate

__all__ = [
    "Asperity",
    "ClosureCurve",
    "Fit",
    "GammaHeights",
    "Heights",
    "Joint",
    "JointBatch",
    "JointLaw",
    "JointPool",
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
    "export_c",
    "export_lammps",
    "export_yade",
    "first_loading",
    "fit_closure",
    "fit_curves",
    "fit_many",
    "fit_shear",
    "from_surface",
    "hydraulic_aperture",
    "include_dir",
    "load_state",
    "load_table",
    "presets",
    "secant",
    "synthetic_surface",
    "tabulate",
    "transmissivity",
    "unloading",
]

# Tools for measurements and hosts load on first use: a DEM code that embeds the law needs none
_LATER = {
    "ClosureCurve": "calibration.measured",
    "Fit": "calibration.fit",
    "ShearCurve": "calibration.measured",
    "SurfaceFit": "surface.fit",
    "export_c": "hosts.c.export",
    "export_lammps": "hosts.lammps.export",
    "export_yade": "hosts.yade.export",
    "first_loading": "calibration.measured",
    "fit_closure": "calibration.fit",
    "fit_curves": "calibration.fit",
    "fit_many": "calibration.fit",
    "fit_shear": "calibration.fit",
    "from_surface": "surface.fit",
    "hydraulic_aperture": "laboratory.flow",
    "include_dir": "hosts.c.export",
    "synthetic_surface": "surface.synthetic",
    "tabulate": "tables.tabulate",
    "transmissivity": "laboratory.flow",
}
_LATER_MODULES = {name: f"calibration.{name}" for name in ("baselines", "datasets", "unloading")}


def __getattr__(name: str) -> Any:
    if name in _LATER_MODULES:
        return import_module(f".{_LATER_MODULES[name]}", __name__)
    if name in _LATER:
        return getattr(import_module(f".{_LATER[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
