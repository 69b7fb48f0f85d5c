"""The hydraulic aperture of jointlaw.h equals the aperture of Python, with its derivative."""

import ctypes

import numpy as np
import pytest
from c_host import library

import jointlaw as jl
from jointlaw.hosts.c.export import header_text

WRAPPER = """
double aperture_of(const jlaw_aperture *map, double closure, double *slope);
double aperture_of(const jlaw_aperture *map, double closure, double *slope)
{
  return jlaw_hydraulic_aperture(map, closure, slope);
}
"""
CONSTANTS = '#include "rock.h"\nconst jlaw_aperture *of_rock(void);\n' + (
    "const jlaw_aperture *of_rock(void) { return &rock_aperture; }\n"
)
MAPS = [
    jl.Aperture(hydraulic=30e-6, at=60e-6, length=120e-6),
    jl.Aperture(hydraulic=200e-6, at=-20e-6, length=50e-6),  # given where the slope is -1
]


@pytest.mark.slow
@pytest.mark.parametrize("compiler", ["cc", "g++"])
def test_aperture_and_slope_equal_python(compiler, tmp_path):
    """To the rounding of exp and log, on both branches, from the constants of an exported law."""
    law = jl.presets.load("linear-a3")
    for k, aperture in enumerate(MAPS):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / "rock.h").write_text(header_text(law, "rock", aperture))
        flags = [f"-I{folder}", *(["-x", "c++"] if compiler == "g++" else [])]
        lib = library(folder, *flags, cc=compiler, more='extern "C" {' * (compiler == "g++")
                      + WRAPPER + CONSTANTS + "}" * (compiler == "g++"))  # fmt: skip
        lib.aperture_of.restype = ctypes.c_double
        lib.aperture_of.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p]
        lib.of_rock.restype = ctypes.c_void_p
        closures = aperture.at + aperture.length * np.linspace(-8.0, 8.0, 801)
        expected = aperture(closures)
        for closure, e, slope in zip(closures, expected.hydraulic, expected.slope, strict=True):
            c_slope = ctypes.c_double()
            c_e = lib.aperture_of(lib.of_rock(), closure, ctypes.byref(c_slope))
            assert c_e == pytest.approx(e, rel=1e-14)
            assert c_slope.value == pytest.approx(slope, rel=1e-14)
            assert lib.aperture_of(lib.of_rock(), closure, None) == c_e
