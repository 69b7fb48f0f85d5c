"""jointlaw: a micromechanical, anisotropic, path-dependent rock-joint law for DEM codes.

The law of A. Misra, Micromechanical model for anisotropic rock joints, J. Geophys. Res. 104(B10),
1999, made incremental and energy-consistent. All quantities are SI: m, Pa, 1/m2.
"""

from . import baselines, closed_form, datasets, presets, unloading
from .asperity import Asperity
from .calibrate import fit_closure, fit_curves, fit_shear
from .fit import Fit
from .heights import GammaHeights, Heights
from .joint import Joint, JointBatch
from .law import JointLaw
from .measured import ClosureCurve, ShearCurve, first_loading
from .orientation import Orientation
from .paths import PathError, closure_test, direct_shear
from .record import Record
from .resolution import Resolution
from .secant import Secant, secant
from .state import JointState, NonFiniteError, load_state
from .surface import SurfaceFit, from_surface
from .sweep import fit_many
from .synthetic import synthetic_surface

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
    "first_loading",
    "fit_closure",
    "fit_curves",
    "fit_many",
    "fit_shear",
    "from_surface",
    "load_state",
    "presets",
    "secant",
    "synthetic_surface",
    "unloading",
]
