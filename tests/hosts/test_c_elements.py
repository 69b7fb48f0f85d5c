"""Elements that a contributor adds in C, with rows of any names and numbers, or without."""

import os
import shutil
import sys
from pathlib import Path

import pytest
from programs import run_program

import jointlaw

HERE = Path(__file__).parent
LAYOUT = {
    '    "coulomb": Field("0", "1",': '    "spring": Field("0", "1", ""),\n'
    '    "strut": Field("0", "1", ""),\n',
    '    "coulomb": {': '    "spring": {},\n    "strut": {"strut_damage": Row(0.0, 3.0, '
    'is_damage=True), "longest": Row(0.0, 1e3)},\n',
    '    "normal_stress_factor"': '    "spring_stiffness": Field("0", "DBL_MAX", "Pa/m"),\n'
    '    "strut_stiffness": Field("0", "DBL_MAX", "Pa/m"),\n'
    '    "strut_length": Field("0", "DBL_MAX", "m"),\n',
}
FUNCTIONS = """
JL_INLINE double jl_spring_stiffness(const jlaw_law *law, const double *row, double closure)
{
  (void) closure, (void) row;
  return law->spring_stiffness;
}
JL_INLINE double jl_spring_step(const jlaw_law *law, jl_element_step *p, int tangent)
{
  const double k = law->spring_stiffness, u = p->from[0] + p->d[0];
  for (int i = 0; i < 3; i++) p->F[i] = 0.0;
  for (int i = 0; i < 9; i++) p->C[i] = 0.0;
  p->F[0] = k * u, p->C[0] = tangent ? k : 0.0, p->loss = 0.0;
  return 0.5 * k * u * u;
}
JL_INLINE double jl_strut_stiffness(const jlaw_law *law, const double *row, double closure)
{
  (void) closure;
  return row[0] > 0.0 ? 0.0 : law->strut_stiffness;
}
JL_INLINE double jl_strut_step(const jlaw_law *law, jl_element_step *p, int tangent)
{
  const double u = p->from[0] + p->d[0], k = p->row[0] > 0.0 ? 0.0 : law->strut_stiffness;
  const double opening = u < 0.0 ? -u : 0.0;
  const int breaks = p->row[0] == 0.0 && opening > law->strut_length;
  for (int i = 0; i < 3; i++) p->F[i] = 0.0;
  for (int i = 0; i < 9; i++) p->C[i] = 0.0;
  p->row[1] = p->row[1] > opening ? p->row[1] : opening;
  p->loss = breaks ? 0.5 * k * law->strut_length * law->strut_length : 0.0;
  if (breaks) p->row[0] = 3.0;
  if (p->row[0] > 0.0 || !(u < 0.0)) return 0.0;
  p->F[0] = k * u, p->C[0] = tangent ? k : 0.0;
  return 0.5 * k * u * u;
}
"""
MARK = "/* --------------------------------------------------------- all elements of a joint */"
PROGRAM = '''
"""A joint with a bond, a spring, a strut and a filling in both kernels and in the header."""
import sys
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from c_host import CLaw, at, library
from kinds import LAWS

import jointlaw as jl
from jointlaw.kernels import reference
from jointlaw.native import build

class Spring(jl.Element):
    native_name = "spring"
    rows = {}

    def numbers(self):
        return {"spring_stiffness": 2e11}

    def step(self, delta, d, state, new, tangent):
        u = delta[0] + d[0]
        C = np.zeros((len(d), *d.shape))
        C[0, 0] = 2e11
        return jl.ElementResponse(np.stack([2e11 * u, *(0.0 * d[1:])]), 0.0 * u, C)

    def stored_energy(self, delta, state):
        return 0.5 * 2e11 * delta[0] ** 2

    def stiffness(self, delta, state):
        return np.full(delta.shape[1], 2e11)

class Strut(jl.Element):
    native_name = "strut"
    rows = {"strut_damage": 1, "longest": 1}
    row_bounds = {"strut_damage": (0.0, 3.0), "longest": (0.0, 1e3)}
    damage_row = "strut_damage"
    separated_damage = 3.0
    tensile_opening = 1e-7

    def numbers(self):
        return {"strut_stiffness": 3e11, "strut_length": 1e-7}

    def step(self, delta, d, state, new, tangent):
        u = delta[0] + d[0]
        k = np.where(state[0] > 0.0, 0.0, 3e11)
        opening = np.maximum(-u, 0.0)
        breaks = (state[0] == 0.0) & (opening > 1e-7)
        new[0] = np.where(breaks, 3.0, state[0])
        new[1] = np.maximum(state[1], opening)
        k = np.where((new[0] > 0.0) | (u >= 0.0), 0.0, k)
        C = np.zeros((len(d), *d.shape))
        C[0, 0] = k
        loss = np.where(breaks, 0.5 * 3e11 * 1e-14, 0.0)
        return jl.ElementResponse(np.stack([k * u, *(0.0 * d[1:])]), loss, C)

    def stored_energy(self, delta, state):
        k = np.where(state[0] > 0.0, 0.0, 3e11)
        return 0.5 * k * np.minimum(delta[0], 0.0) ** 2

    def stiffness(self, delta, state):
        return np.where(state[0] > 0.0, 0.0, 3e11)

class Own(type(LAWS["bond and filling"]), kind="own"):
    elements = (Spring, Strut)

    @cached_property
    def tables(self):
        rough, bond, filling = super().tables.elements
        own = [kind() for kind in self.elements]
        return jl.LawTables(3, (rough, bond, *own, filling))

class OnlySpring(jl.JointLaw, kind="spring"):
    @cached_property
    def tables(self):
        return jl.LawTables(3, (*super().tables.elements, Spring()))

folder = Path(sys.argv[1])
build.BUILT.mkdir(exist_ok=True)
build.build(build.find_compiler())
header = library(folder, "-O1", "-DJOINTLAW_SCALAR", "-ffp-contract=off")
rough = LAWS["mating length"].__getstate__() | {"plane": None}
for law in (Own(**LAWS["bond and filling"].__getstate__()), OnlySpring(**rough)):
    one = CLaw(header, law, folder)
    assert len(one.state) == law.state_size
    joints = law.joints(3)
    assert joints.kernel == "native"
    state = np.zeros((law.state_size, 1))
    rng = np.random.default_rng(2)
    for step in range(60):
        d = 1e-7 * rng.normal(size=3)
        d[0] += 2e-8 * (1 if step < 30 else -1)
        state, F, C = reference.step(law.tables, state, d[:, None], True)
        size = np.abs(F).max() + 1.0
        for F_native, C_native in (joints.update(np.tile(d, (3, 1))), [[x] for x in one.step(d)]):
            assert np.abs(F_native[0] - F[:, 0]).max() <= 1e-11 * size, step
            assert np.abs(C_native[0] - C[..., 0]).max() <= 1e-9 * np.abs(C).max(), step
        np.testing.assert_array_equal(joints.snapshot().values[0], one.state)
        np.testing.assert_allclose(one.state, state[:, 0], rtol=1e-9, atol=1e-9 * size)
        assert joints.damage[0] == reference.damage(law.tables, state)[0]
        stored = reference.measures(law.tables, state).stored_energy[0]
        np.testing.assert_allclose(joints.stored_energy[0], stored, rtol=1e-9)
        in_header = header.jlaw_stored_energy(one.law, at(one.state))
        np.testing.assert_allclose(in_header, stored, rtol=1e-9)
        stiffness = reference.stiffness(law.tables, state)[0]
        np.testing.assert_allclose(joints.max_stiffness()[0], stiffness, rtol=1e-9)
    assert header.jlaw_has_damage(one.law) == law.tables.breaks == isinstance(law, Own)
    for closure in (-5e-8, 1e-7):
        stress = header.jlaw_normal_stress(one.law, closure)
        np.testing.assert_allclose(stress, law.normal_stress(closure), rtol=1e-9)
        bound = header.jlaw_max_stiffness(one.law, closure)
        np.testing.assert_allclose(bound, law.max_stiffness(closure), rtol=1e-9)
    broken = law.joints(1)
    broken.break_bond([0])
    one.state[:] = 0.0
    header.jlaw_break_bond(one.law, at(one.state))
    np.testing.assert_array_equal(one.state, broken.snapshot().values[0])
print("as in Python")
'''


@pytest.mark.slow
def test_rows_of_any_number_reach_c(tmp_path):
    """A copy of the package with an element without rows, and one whose damage is not its last."""
    copy = tmp_path / "jointlaw"
    ignored = shutil.ignore_patterns("built", "__pycache__")
    shutil.copytree(Path(jointlaw.__file__).parent, copy, ignore=ignored)
    edits = {"layout.py": LAYOUT, "elements.h": {MARK: FUNCTIONS}}
    for name, insertions in edits.items():
        path = copy / "native" / name
        text = path.read_text()
        for before, inserted in insertions.items():
            assert text.count(before) == 1, before
            text = text.replace(before, inserted + before)
        path.write_text(text)
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    paths = os.pathsep.join(map(str, (tmp_path, HERE, HERE.parent)))
    output = run_program(sys.executable, program, tmp_path, env=os.environ | {"PYTHONPATH": paths})
    assert "as in Python" in output
