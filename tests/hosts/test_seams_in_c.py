"""Every declared parameter, off its default, in C: through the exported header and table file."""

import numpy as np
import pytest
from c_host import CLaw, build, library, run
from kinds import PARAMETERS, off_default

import jointlaw as jl
from jointlaw.hosts.c.export import header_text

STEPS = ((3e-7, 0.0, 0.0), (2e-7, 1e-7, -5e-8), (-1e-7, 2e-7, 1e-7), (1e-7, -1e-7, 1e-7))
PROGRAM = """#define JOINTLAW_IMPLEMENTATION
#define JOINTLAW_PLAIN
{headers}
#include <stdio.h>
static void show(const jlaw_law *law)
{{
  static double s[1000];
  const double d[][3] = {{{steps}}};
  char message[JLAW_MESSAGE];
  double F[3] = {{0.0}};
  for (int i = 0; i < 1000; i++) s[i] = 0.0;
  for (int i = 0; i < {count}; i++) jlaw_update(law, s, s, d[i], F, NULL, message, sizeof message);
  for (int i = 0; i < jlaw_dim(law); i++) printf("%.17g ", F[i]);
  printf("%.17g %.17g %.17g %.17g\\n", jlaw_stored(law, s), jlaw_dissipated(law, s),
         jlaw_normal_stress(law, 3e-7), jlaw_max_stiffness(law, 3e-7));
}}
int main(void)
{{
{calls}
  return 0;
}}
"""


@pytest.fixture(scope="module")
def laws():
    return [off_default(name)[0] for name in PARAMETERS]


def shown(law):
    """What the program prints, by Python."""
    joint = law.joint()
    for d in STEPS:
        F, _ = joint.update(d[: law.dim], tangent=False)
    amounts = joint.stored_energy, joint.dissipated_energy
    return [*F, *amounts, law.normal_stress(3e-7), law.max_stiffness(3e-7)]


def test_constants_of_the_header(laws, tmp_path):
    names = [f"law_{i}" for i in range(len(laws))]
    for law, name in zip(laws, names, strict=True):
        (tmp_path / f"{name}.h").write_text(header_text(law, name))
    source = PROGRAM.format(
        headers="\n".join(f'#include "{name}.h"' for name in names),
        steps=", ".join(f"{{{', '.join(map(repr, d))}}}" for d in STEPS),
        count=len(STEPS),
        calls="\n".join(f"  show(&{name});" for name in names),
    )
    flags = "-O1", "-ffp-contract=off", "-Wno-psabi", f"-I{tmp_path}"
    lines = run(build(tmp_path, source, *flags)).splitlines()
    for law, line in zip(laws, lines, strict=True):
        np.testing.assert_allclose(np.array(line.split(), float), shown(law), rtol=1e-9, atol=1e-9)


def test_table_files(laws, tmp_path):
    lib = library(tmp_path, "-O1", "-DJOINTLAW_PLAIN", "-ffp-contract=off")
    for law in laws:
        one = CLaw(lib, law, tmp_path)
        for d in STEPS:
            F, _ = one.step(d[: law.dim])
        found = [
            *F, lib.jlaw_stored(one.law, one.state.ctypes.data_as(type(one.law))),
            one.state[law.dim], lib.jlaw_normal_stress(one.law, 3e-7),
            lib.jlaw_max_stiffness(one.law, 3e-7),
        ]  # fmt: skip
        np.testing.assert_allclose(found, shown(law), rtol=1e-9, atol=1e-9)


def test_the_law_file_of_lammps(laws, tmp_path):
    for law in laws:
        if law.dim == 3:
            jl.export_lammps(law, tmp_path)
            assert jl.JointLaw.from_toml(tmp_path / "law.toml") == law
