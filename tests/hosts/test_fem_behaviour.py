"""mgis.c and umat.c, called in the way of their hosts, against the law in Python."""

import ctypes
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from fem_host import LAW, SEATING, Behaviour, Umat, export

import jointlaw as jl

LAWS = {
    "law in a plane": replace(  # other kinds of numbers of state
        LAW, asperity=replace(LAW.asperity, yield_interference=2e-8), plane=0.0
    ),
    "degradation by stress": replace(LAW, mating_length=2e-6, degradation_stress=1e8),
    "Coulomb's law": jl.CoulombLaw(normal_stiffness=1e12, shear_stiffness=5e11, friction=0.6),
}
SIGN = np.array([-1.0, 1.0, 1.0])  # closure and compression against opening and tension
THICKNESS = 1e-3
YOUNG = 5e10
POISSON = 0.2


def path(seed):
    """Steps (300, 3) in m: closure, shear, opening to separation, and new contact."""
    d = np.random.default_rng(seed).normal(size=(300, 3)) * [3e-8, 1e-7, 1e-7]
    d[:20, 0] = 5e-8
    d[100] = [-2e-5, 0.0, 0.0]
    d[110] = [2.02e-5, 1e-7, 0.0]
    return d


@pytest.mark.parametrize(
    ("name", "kind", "gradient", "force", "type_", "properties"),
    [("rock", (3, 2), "OpeningDisplacement", "CohesiveForce", 2, []),
     ("rock_layer", (1, 1), "Strain", "Stress", 1,
      ["Thickness", "YoungModulus", "PoissonRatio"])],
)  # fmt: skip
def test_symbols_are_those_that_mgis_reads(
    finite_elements, name, kind, gradient, force, type_, properties
):
    b = Behaviour(finite_elements, name)
    rows = LAW.state_size + 1
    lists = {
        "TangentOperatorBlocks": [force, gradient], "Gradients": [gradient],
        "ThermodynamicForces": [force], "MaterialProperties": properties,
        "InternalStateVariables": [*(f"State{i}" for i in range(1, rows)), "Initialised"],
        "ExternalStateVariables": [], "Parameters": [], "InitializeFunctions": [],
        "PostProcessings": [],
    }  # fmt: skip
    texts = {"mfront_ept": [name], "unit_system": ["SI"], "mfront_interface": ["Generic"],
             "src": ["mgis.c"]} | {key: names for key, names in lists.items() if names}  # fmt: skip
    numbers = {
        "mfront_mkt": 1, "api_version": 1, "BehaviourType": kind[0],
        "BehaviourKinematic": kind[1], "SymmetryType": 0, "ElasticSymmetryType": 0,
        "requiresStiffnessTensor": 0, "requiresThermalExpansionCoefficientTensor": 0,
        "ComputesInternalEnergy": 1, "ComputesDissipatedEnergy": 1,
        "TemperatureRemovedFromExternalStateVariables": 1,
        **{f"n{key}": len(names) for key, names in lists.items()},
    }  # fmt: skip
    types = {"GradientsTypes": [type_], "ThermodynamicForcesTypes": [type_],
             "InternalStateVariablesTypes": [0] * rows}  # fmt: skip
    for c_type, symbols in (
        (ctypes.c_char_p, {key: [word.encode() for word in words] for key, words in texts.items()}),
        (ctypes.c_ushort, {key: [number] for key, number in numbers.items()}),
        (ctypes.c_int, types),
    ):
        for symbol, values in symbols.items():
            assert [*(c_type * len(values)).in_dll(b.lib, f"{name}_{symbol}")] == values, symbol


POINTS = {
    "cohesive zone": [Behaviour],
    "cohesive zone in a plane": [Behaviour, "rock", "PlaneStrain"],
    "cohesive zone, law in a plane": [Behaviour, "rock", "PlaneStrain"],
    "cohesive zone, degradation by stress": [Behaviour],
    "cohesive zone, Coulomb's law": [Behaviour],
    "UMAT": [Umat, 3],
    "UMAT in a plane": [Umat, 2],
}


@pytest.mark.parametrize("name", POINTS)
def test_a_point_is_the_law_in_python(finite_elements, tmp_path, name):
    law = LAWS.get(name.partition(", ")[2], LAW)
    folder = finite_elements
    if law is not LAW:
        folder = export(tmp_path, law, "-O0", "librock_mgis.so")
    kind, *more = POINTS[name]
    point = kind(folder, *more)
    joint = law.joint(normal_stress=SEATING)
    n = point.size
    results = []
    expected = []
    signs = np.outer(SIGN, SIGN)[:n, :n]
    for d in path(1):
        d[n:] = 0.0
        T, K = point.step((SIGN * d)[:n])
        F, C = joint.update(d[: law.dim])
        results.append((SIGN[:n] * T, signs * K, [*point.energies]))
        energies = [joint.measures().stored_energy, joint.dissipated_energy]
        expected.append((F[:n], C[:n, :n], energies))
    for i, tolerance in enumerate((1e-12, 1e-8, 1e-12)):
        host, python = (np.array([step[i] for step in steps]) for steps in (results, expected))
        assert np.abs(host - python).max() < tolerance * np.abs(python).max()
    assert not np.any(results[100][0]), "a joint that is open must not bear stress"
    assert np.any(results[110][0]), "a joint that touched again must bear stress"
    assert (joint.slope_retention < 0.95) == law.tables.degrades_by_stress
    state = joint.snapshot().values[0]  # by which Python can go on
    np.testing.assert_allclose(point.state[:-1], state, rtol=0, atol=1e-12 * np.abs(state).max())


@pytest.mark.parametrize(
    ("hypothesis", "at_", "size", "plane"),
    [("Tridimensional", [2, 4, 5], 6, [0, 1, 3]), ("PlaneStrain", [1, 3], 4, [0, 2])],
)
def test_layer_is_the_joint_over_its_thickness(finite_elements, hypothesis, at_, size, plane):
    """Energy per volume: energy per area over the thickness, plus plane stress in the layer."""
    n = len(at_)
    layer = Behaviour(finite_elements, "rock_layer", hypothesis, [THICKNESS, YOUNG, POISSON])
    joint = Behaviour(finite_elements, "rock", hypothesis)
    B = np.zeros((n, size))
    elastic = np.zeros((size, size))
    rng = np.random.default_rng(2)
    B[range(n), at_] = THICKNESS * np.array([1.0, 2**0.5, 2**0.5])[:n]  # jump by strain: 2 h e
    stiff = np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, 1 - POISSON]]) / (1 - POISSON**2)
    elastic[np.ix_(plane, plane)] = YOUNG * stiff[: len(plane), : len(plane)]
    for d in path(2)[:120]:  # to a new contact
        strain = np.linalg.pinv(B) @ (SIGN * d)[:n]
        strain[plane] = 1e-6 * rng.normal(size=len(plane))
        (stress, K) = layer.step(strain)
        (T, C) = joint.step((SIGN * d)[:n])
        total = layer.new["gradients"]
        for result, expected in (
            (stress, B.T @ T / THICKNESS + elastic @ total),
            (K, B.T @ C @ B / THICKNESS + elastic),
        ):
            np.testing.assert_allclose(result, expected, rtol=0, atol=1e-9 * np.abs(result).max())
    stored, dissipated = np.divide(joint.energies, THICKNESS)  # per volume
    expected = [stored + 0.5 * total @ elastic @ total, dissipated]
    assert layer.energies == pytest.approx(expected, rel=1e-9)


def test_what_k_asks_for(finite_elements):
    b = Behaviour(finite_elements)
    joint = LAW.joint(normal_stress=SEATING)
    for d in path(3)[:30]:
        b.step(SIGN * d)
        joint.update(d)
    d = np.array([1e-8, 2e-8, -1e-8])
    _, C = joint.trial(d)
    _, now = joint.trial(np.zeros(3))
    for want, expected in ((1.0, C), (4.0, C), (-1.0, now), (-3.0, now)):
        before = {key: value.copy() for key, value in b.new.items()}
        done, K = b.integrate(b.old["gradients"] + SIGN * d, want)
        assert done == 1
        np.testing.assert_allclose(K * np.outer(SIGN, SIGN), expected, rtol=0, atol=1e-8 * C.max())
        if want < 0:  # a prediction moves nothing
            assert all((b.new[key] == before[key]).all() for key in ("state", "forces", "stored"))
        # a host that reverts goes on from the same state, whatever was tried
        done, K = b.integrate(b.old["gradients"] + SIGN * d, 0.0)
        assert np.isnan(K.ravel()[1:]).all()
        np.testing.assert_allclose(SIGN * b.new["forces"], joint.trial(d)[0], rtol=1e-12)
    done, _ = b.integrate(b.old["gradients"], 104.0)
    assert (done, b"speed of sound" in b.message.value) == (-1, True)


@pytest.mark.parametrize("name", ["rock", "rock_layer"])
@pytest.mark.parametrize(("bad", "why"), [(np.nan, "finite"), (-1e300, "admissible|finite")])
def test_a_step_that_cannot_be_done_leaves_the_state_alone(finite_elements, capfd, name, bad, why):
    b = Behaviour(finite_elements, name, properties=[THICKNESS, YOUNG, POISSON])
    normal = 0 if name == "rock" else 2
    b.step(np.eye(b.size)[normal] * -1e-7)
    before = {key: value.copy() for key, value in b.new.items()}
    b.message.value = b""
    done, _ = b.integrate(np.eye(b.size)[normal] * bad)
    assert (done, b.rdt[0]) == (-1, 0.25)
    assert any(word in b.message.value.decode() for word in why.split("|"))
    assert all((b.new[key] == before[key]).all() for key in b.new if key != "gradients")
    if name == "rock_layer":
        b.new["properties"][0] = 0.0
        assert b.integrate(b.old["gradients"])[0] == -1
        for text in (b.message.value.decode(), capfd.readouterr().err):  # OpenGeoSys shows stderr
            assert "Thickness must be > 0" in text


def test_two_threads_do_not_meet(finite_elements):
    def run(seed):
        b = Behaviour(finite_elements)
        return [b.step(SIGN * d)[0] for d in path(seed)]

    with ThreadPoolExecutor(2) as pool:  # ctypes lets go of the interpreter during a call
        together = list(pool.map(run, range(8)))
    np.testing.assert_array_equal(together, [run(seed) for seed in range(8)])


@pytest.mark.parametrize(
    ("step", "rows", "why"),
    [(np.full(3, np.nan), LAW.state_size + 1, "finite"), (np.zeros(3), 7, "NSTATV = 7")],
)
def test_umat_tells_of_a_step_that_cannot_be_done(finite_elements, capfd, step, rows, why):
    point = Umat(finite_elements, 3)
    point.step([-1e-7, 1e-7, 0.0])
    before = point.state.copy()
    stress, _ = point.step(step, rows)
    assert np.isnan(stress).all()
    assert (point.pnewdt[0], (point.state == before).all()) == (0.25, True)
    assert why in capfd.readouterr().err
