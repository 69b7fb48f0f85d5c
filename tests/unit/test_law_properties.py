"""Tension, stiffness and reduced strength that a law reports, against its joints in the step."""

import math
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest
from kinds import LAWS, make_law
from own_law import CLAY, Clay, ClayLaw

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.kernels.pack import pack
from jointlaw.support.thresholds import SEPARATED_STATE

STRESS = 1e5  # Pa
UNDER_SHEAR = {name: law for name, law in LAWS.items() if law.dim > 1}


def normal(law, size):
    return size * np.eye(law.dim)[0]


@pytest.mark.parametrize("name", LAWS)
def test_tension_ends_at_the_tensile_opening(name):
    law = LAWS[name]
    opening = law.tensile_opening
    if opening == 0.0:
        assert law.tensile_strength == 0.0
        F, _ = law.joint().update(normal(law, -1e-9))
        assert F[0] == 0.0
        return
    F, _ = law.joint().update(normal(law, -0.999 * opening))
    assert F[0] < 0.0
    F, _ = law.joint().update(normal(law, -1.001 * opening))
    assert F[0] == 0.0
    pulled = law.joint()
    tension = [-pulled.update(normal(law, -opening / 1000))[0][0] for _ in range(999)]
    assert max(tension) == pytest.approx(law.tensile_strength, rel=2e-3)
    F, _ = law.joint().update(normal(law, -1e-6 * opening))
    assert -F[0] / (1e-6 * opening) == pytest.approx(law.tensile_stiffness, rel=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_secant_stiffness_is_that_of_a_joint_at_the_stress(name):
    law = LAWS[name]
    joint = law.joint(normal_stress=STRESS)
    stiffness, shear = law.secant_stiffness(STRESS)
    sparse = 2e-3 if law.tables.yields else 1e-9  # few cells slip later than many
    assert stiffness == pytest.approx(STRESS / joint.delta[0], rel=sparse)
    if law.dim == 1:
        assert shear == 0.0
    elif law.tables.asperities is None:
        assert shear == joint.trial(1e-12 * np.eye(law.dim)[1])[1][1, 1]
    else:
        bond = 0.0 if law.bond is None else law.bond.shear_stiffness
        filling = getattr(law, "filling_stiffness", 0.0)
        expected = (stiffness - filling) / law.asperity.lam + bond + 0.5 * filling
        assert shear == pytest.approx(expected, rel=1e-12)


def test_secant_stiffness_of_an_element_without_a_formula_is_its_tangent():
    assert CLAY.secant_stiffness(STRESS) == pytest.approx((1e10, 6e9), rel=1e-9)


@pytest.mark.parametrize("name", [*UNDER_SHEAR, "clay"])
@pytest.mark.parametrize("reduction", [0.7, 1.0, 2.0])
def test_no_eigenvalue_exceeds_the_first_loading_stiffness(name, reduction):
    """Pressed joints on random walks of increments of up to a tenth of their closure."""
    law = (LAWS | {"clay": CLAY})[name]
    rng = np.random.default_rng(2)
    batch = law.joints(50, normal_stress=10 ** rng.uniform(3, 6, 50))
    scale = np.append(1.0, np.full(law.dim - 1, 1.0 / reduction))
    highest = batch.delta[:, 0].copy()
    for _ in range(20):
        size = 0.1 * batch.delta[:, :1] * rng.uniform(-1, 1, (50, law.dim))
        _, C = batch.update(size * np.append(1.0, np.full(law.dim - 1, 0.1)))
        highest = np.maximum(highest, batch.delta[:, 0])
        largest = np.abs(np.linalg.eigvals(scale[:, None] * C * scale)).max(axis=1)
        # a sheared joint may be closed less at a stress, so the bound is that of closure and shear
        closed = (
            highest
            + np.linalg.norm(batch.delta[:, 1:], axis=1) * law.tables.closure_per_displacement
        )
        assert (largest <= law.first_loading_stiffness(closed, reduction) * (1 + 1e-9)).all()


def test_first_loading_stiffness_is_the_bound_of_closure():
    law = make_law()
    closure = np.array([1e-7, 1e-6])
    assert (law.first_loading_stiffness(closure) == law.max_stiffness(closure)).all()
    # friction couples closure to shear, without an eigenvalue of its own
    coulomb = LAWS["coulomb"]
    assert coulomb.first_loading_stiffness(1e-7) == coulomb.normal_stiffness
    assert coulomb.max_stiffness(1e-7) > coulomb.normal_stiffness
    assert coulomb.first_loading_stiffness(1e-7, 0.5) == 4 * coulomb.shear_stiffness


@pytest.mark.parametrize("factor", [0.7, 1.0, 2.5])
@pytest.mark.parametrize("name", ["coulomb in a plane", "clay"])
def test_reduced_strength_is_exact_for_coulomb_and_clay(name, factor):
    law = (LAWS | {"clay": CLAY})[name]
    inside = law.strength_reduced(factor)
    by = np.array([1.0, factor])
    slip = np.array([0.0, 1e-3])
    tractions = []
    for one, scale in ((law, np.ones(2)), (inside, by)):
        joint = one.joint(normal_stress=STRESS)
        _, C = joint.trial(np.array([0.0, 1e-12]) / scale)
        F, _ = joint.update(slip / scale)
        tractions.append([F[0], F[1] / scale[1], C[1, 1] / scale[1] ** 2])
    (sigma, strength, stiffness), (sigma_f, strength_f, stiffness_f) = tractions
    assert sigma_f == sigma
    assert strength_f * factor == pytest.approx(strength, rel=1e-12)
    assert stiffness_f == pytest.approx(stiffness, rel=1e-12)
    assert inside.tensile_opening * factor == pytest.approx(law.tensile_opening, rel=1e-12)


def test_bond_is_reduced_in_tension_and_shear():
    law = LAWS["bond"]
    inside = law.strength_reduced(2.0)
    assert inside.tensile_opening == pytest.approx(law.tensile_opening / 2.0)
    assert inside.tensile_stiffness == law.tensile_stiffness
    assert law.strength_reduced(1.0) == law


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_invalid_factors_are_refused(bad):
    for law in (make_law(), LAWS["coulomb"]):
        with pytest.raises(ValueError, match="factor = "):
            law.strength_reduced(bad)
        with pytest.raises(ValueError, match="reduction = "):
            law.first_loading_stiffness(1e-7, bad)
        with pytest.raises(ValueError, match="normal_stress = "):
            law.secant_stiffness(bad)


def test_a_law_with_an_element_of_its_own_runs_in_python(monkeypatch):
    """Beside native laws; files, copies and energy as of any law."""
    monkeypatch.setitem(jl.Law.kinds, "clay", ClayLaw)
    assert CLAY.joint().kernel == "numpy"
    assert jl.CoulombLaw.from_text(CLAY.to_toml()) == CLAY
    rng = np.random.default_rng(1)
    batch = CLAY.joints(3, normal_stress=STRESS)
    alone = replace(CLAY, clay_strength=1e-9).joints(3, normal_stress=STRESS)
    before = batch.F
    stored = batch.stored_energy
    work = np.zeros(3)
    for d in rng.normal(size=(300, 3, 2)) * [1e-8, 3e-7]:
        F, _ = batch.update(d)
        rest, _ = alone.update(d)
        assert (np.abs(F - rest)[:, 1] <= 2e3 + 1e-6).all()
        work += 0.5 * np.sum((before + F) * d, axis=1)
        before = F
    change = batch.stored_energy - stored + batch.dissipated_energy
    assert change == pytest.approx(work, rel=0.1)  # first order in the step
    states = batch.snapshot()
    alternative = CLAY.joints(3)
    alternative.restore(states)
    np.testing.assert_allclose(alternative.F, batch.F, rtol=1e-12)


def test_hosts_in_c_and_the_native_kernel_refuse_it_by_name(monkeypatch):
    with pytest.raises(ValueError, match="the element Clay has no C version"):
        table_text(CLAY)
    monkeypatch.setenv("JOINTLAW_KERNEL", "native")
    with pytest.raises(ImportError, match="the element Clay has no C version"):
        CLAY.joint()


def test_a_subclass_of_an_element_with_c_does_not_run_as_its_base():
    class Rough(type(make_law().tables.elements[0])):
        pass

    tables = make_law().tables
    own = jl.LawTables(3, (Rough(tables.asperities),))
    assert own.python_only == ["Rough"]
    assert tables.python_only == []


def named(name, rows, damage_row="", native_name=""):
    """An element of a class of this name with these rows, without mechanics."""
    functions = {"step": None, "stiffness": None}
    values = {"rows": rows, "damage_row": damage_row, "native_name": native_name}
    return type(name, (jl.Element,), functions | values)()


def test_elements_with_rows_of_one_name_are_refused():
    rows = {"memory": 2, "wear": 1}
    with pytest.raises(ValueError, match=r"First and Second have a state row .*'wear': rename"):
        jl.LawTables(2, (named("First", rows), named("Second", {"wear": 1})))
    for reserved in ("delta", "dissipated_energy"):
        with pytest.raises(ValueError, match=f"the joint and First have a state row .*{reserved}"):
            jl.LawTables(2, (named("First", {reserved: 1}),))
    with pytest.raises(ValueError, match=r"First.damage_row = 'broken' is none of its rows"):
        jl.LawTables(2, (named("First", rows, "broken"),))


def test_rows_and_order_of_elements_are_those_of_c():
    rough, bond, filling = LAWS["bond and filling"].tables.elements
    longer = copy(bond)
    longer.rows = {"damage": 1, "age": 1}
    wider = copy(filling)
    wider.row_bounds = filling.row_bounds | {"softening": (0.0, 3.0)}
    for elements in ((rough, longer), (rough, bond, wider)):
        with pytest.raises(ValueError, match=r"has the state rows .* in native/layout\.py"):
            pack(jl.LawTables(3, elements))
    for elements in ((rough, filling, bond), (bond, rough)):
        with pytest.raises(ValueError, match="in the order asperities, bonded, coulomb"):
            pack(jl.LawTables(3, elements))


def test_a_state_of_another_size_in_c_is_refused(monkeypatch):
    rough = copy(make_law().tables.elements[0])
    rough.rows = rough.rows | {"age": 1}
    law = make_law()
    monkeypatch.setenv("JOINTLAW_KERNEL", "native")
    monkeypatch.setitem(law.__dict__, "tables", jl.LawTables(3, (rough,)))
    with pytest.raises(ValueError, match=r"has \d+ rows in Python and \d+ in C"):
        law.joint()


def test_damage_is_that_of_the_least_damaged_element():
    joints = LAWS["bond and filling"].joints(2)
    joints.break_bond([1])
    assert joints.damage.tolist() == [0.0, 1.0]
    values = joints.snapshot().values
    rows = list(joints.law.tables.damage_rows)
    assert values[1, rows].tolist() == [1.0, SEPARATED_STATE]
    values[:, rows] = [[0.25, 2.0], [1.0, 0.5]]
    joints.restore(jl.JointState(joints.law.fingerprint, values))
    assert joints.damage.tolist() == [0.25, 0.5]


def test_a_law_that_cannot_be_reduced_says_so():
    @jl.declared
    @dataclass(frozen=True, kw_only=True)
    class Unreduced(jl.CoulombLaw, kind="unreduced"):
        """A law whose reduction is not defined."""

        @cached_property
        def tables(self):
            return jl.LawTables(2, (*super().tables.elements, Clay(1e9, 1e3)))

    law = Unreduced(1e10, 5e9, 0.6, plane=0.0)
    with pytest.raises(NotImplementedError, match="Unreduced defines no strength_reduced"):
        law.strength_reduced(1.5)
    del jl.Law.kinds["unreduced"]
