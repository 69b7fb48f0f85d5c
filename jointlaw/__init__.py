"""jointlaw: a micromechanical, anisotropic, path-dependent rock-joint law for DEM codes.

The law of A. Misra, Micromechanical model for anisotropic rock joints, J. Geophys. Res. 104(B10),
1999, made incremental and energy-consistent. All quantities are SI: m, Pa, 1/m2.
"""

from . import closed_form, presets
from .asperity import Asperity
from .heights import GammaHeights, Heights
from .joint import Joint, JointBatch
from .law import JointLaw
from .orientation import Orientation
from .paths import PathError, closure_test, direct_shear
from .record import Record
from .resolution import Resolution
from .secant import Secant, secant
from .state import JointState, NonFiniteError, load_state

__version__ = "0.1.0"

__all__ = [
    "Asperity",
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
    "closed_form",
    "closure_test",
    "direct_shear",
    "load_state",
    "presets",
    "secant",
]
