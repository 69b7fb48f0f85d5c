"""jointlaw: a micromechanical, anisotropic, path-dependent rock-joint law for DEM codes.

The law of A. Misra, Micromechanical model for anisotropic rock joints, J. Geophys. Res. 104(B10),
1999, made incremental and energy-consistent. All quantities are SI: m, Pa, 1/m2.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import presets
from .hosts import HOSTS
from .joints.batch import JointBatch
from .joints.joint import Joint
from .joints.pool import JointPool
from .joints.state import JointState, NonFiniteError, load_state
from .joints.time_step import stable_time_step
from .kernels.element import Element, ElementResponse
from .kernels.engine import Step
from .kernels.reference import LawTables
from .laboratory.experiments import PathError, closure_test, direct_shear
from .laboratory.record import TestRecord
from .laws.coulomb_law import CoulombLaw
from .laws.joint_law import JointLaw
from .laws.law import Law
from .paper import closed_form
from .paper.secant import secant
from .parameters.aperture import Aperture
from .parameters.asperity import Asperity
from .parameters.bond import Bond
from .parameters.declared import declared, parameter
from .parameters.heights import GammaHeights, Heights
from .parameters.orientation import Orientation
from .parameters.resolution import Resolution
from .support.version import __version__ as __version__
from .tables.joint_table import JointTable, load_table

if TYPE_CHECKING:
    from .calibration.field import from_field
    from .calibration.fit import fit_curves
    from .calibration.measured import ClosureCurve, ShearCurve
    from .hosts.c.export import export_c
    from .hosts.fem.export import export_fem
    from .hosts.lammps.export import export_lammps
    from .hosts.yade.export import export_yade
    from .surface.fit import from_surface
    from .tables.tabulate import tabulate

__all__ = [
    "Aperture",
    "Asperity",
    "Bond",
    "ClosureCurve",
    "CoulombLaw",
    "Element",
    "ElementResponse",
    "GammaHeights",
    "Heights",
    "Joint",
    "JointBatch",
    "JointLaw",
    "JointPool",
    "JointState",
    "JointTable",
    "Law",
    "LawTables",
    "NonFiniteError",
    "Orientation",
    "PathError",
    "Resolution",
    "ShearCurve",
    "Step",
    "TestRecord",
    "closed_form",
    "closure_test",
    "declared",
    "direct_shear",
    "export_c",
    "export_fem",
    "export_lammps",
    "export_yade",
    "fit_curves",
    "from_field",
    "from_surface",
    "load_state",
    "load_table",
    "parameter",
    "presets",
    "secant",
    "stable_time_step",
    "tabulate",
]

# Modules for measurements and hosts are imported on first use: a host of the law needs none
_LAZY_MODULES = {
    "ClosureCurve": "calibration.measured",
    "ShearCurve": "calibration.measured",
    "fit_curves": "calibration.fit",
    "from_field": "calibration.field",
    "from_surface": "surface.fit",
    "tabulate": "tables.tabulate",
    **{host.function: f"hosts.{host.module}" for host in HOSTS.values()},
}


def __getattr__(name: str) -> Any:
    if name in _LAZY_MODULES:
        return getattr(import_module(f".{_LAZY_MODULES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
