"""Every declared parameter, off its default, in C: through the exported header and table file."""

import contextlib
import ctypes

import numpy as np
import pytest
from c_host import CLaw, at, library, random_law
from kinds import PARAMETERS, off_default

import jointlaw as jl
from jointlaw.hosts.c.export import header_text

STEPS = ((3e-7, 0.0, 0.0), (2e-7, 1e-7, -5e-8), (-1e-7, 2e-7, 1e-7), (1e-7, -1e-7, 1e-7))
CLOSURES, STRESSES = (-1e-6, 0.0, 1e-9, 3e-7, 2e-6), (0.0, 1e3, 5e6)
LAWS = [off_default(name)[0] for name in PARAMETERS]
LAWS.append(random_law(6))  # heights of a density that is infinite at the point of contact
CONSTANTS = """#include "law_{0}.h"
const jlaw_law *constants_{0}(void);
const jlaw_law *constants_{0}(void) {{ return &law_{0}; }}
"""


def by_python(law):
    """Traction and energies at the end of a path; the unsheared joint."""
    joint = law.joint()
    for d in STEPS:
        F, _ = joint.update(d[: law.dim], tangent=False)
    return [
        *F, joint.stored_energy, joint.dissipated_energy, *law.normal_stress(CLOSURES),
        *map(law.max_stiffness, CLOSURES), *map(law.closure, STRESSES),
    ]  # fmt: skip


def by_c(one):
    """The same numbers."""
    for d in STEPS:
        F, _ = one.step(d[: one.dim])
    energies = [f(one.law, at(one.state)) for f in (one.lib.jlaw_stored, one.lib.jlaw_dissipated)]
    stresses, bounds = (
        [f(one.law, closure) for closure in CLOSURES]
        for f in (one.lib.jlaw_normal_stress, one.lib.jlaw_max_stiffness)
    )
    closures = [one.lib.jlaw_closure(one.law, stress) for stress in STRESSES]
    return [*F, *energies, *stresses, *bounds, *closures]


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    """The law in C, with the tables of all laws as constants."""
    folder = tmp_path_factory.mktemp("constants")
    for i, law in enumerate(LAWS):
        (folder / f"law_{i}.h").write_text(header_text(law, f"law_{i}"))
    more = "".join(map(CONSTANTS.format, range(len(LAWS))))
    flags = "-O1", "-DJOINTLAW_PLAIN", "-ffp-contract=off", f"-I{folder}"
    return library(folder, *flags, more=more)


@pytest.mark.parametrize("i", range(len(LAWS)))
def test_both_forms_of_the_tables_give_what_python_gives(lib, tmp_path, i):
    law, read, compiled = LAWS[i], *(CLaw(lib, LAWS[i], tmp_path) for _ in range(2))
    constants = getattr(lib, f"constants_{i}")
    constants.restype = ctypes.c_void_p
    compiled.law = ctypes.c_void_p(constants())
    found = by_c(read)
    np.testing.assert_allclose(found, by_python(law), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(by_c(compiled), found)
    for one in (read, compiled):
        assert lib.jlaw_fingerprint(one.law).decode() == law.fingerprint
        assert np.isnan([lib.jlaw_closure(one.law, bad) for bad in (np.nan, -1.0, np.inf)]).all()
        assert np.isnan(lib.jlaw_normal_stress(one.law, 2 * law.largest_reach))
        apart = law.joint()
        with contextlib.suppress(ValueError):  # of a law whose faces always fit
            apart = law.joint(mated=False)
        assert lib.jlaw_unmated(one.law, at(one.state)) == (0 if apart.delta.any() else -1)
        np.testing.assert_array_equal(one.state, apart.snapshot().values[0])


def test_the_law_file_of_lammps(tmp_path):
    for law in LAWS:
        if law.dim == 3:
            jl.export_lammps(law, tmp_path)
            assert jl.JointLaw.from_toml(tmp_path / "law.toml") == law
