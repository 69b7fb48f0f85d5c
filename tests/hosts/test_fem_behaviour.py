"""mgis.c and umat.c, called as their hosts call them, against the law in Python."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from fem_host import LAW, SEATING, Behaviour, Umat, export

import jointlaw as jl

YIELDS = replace(LAW.asperity, yield_interference=2e-8)
LAWS = {
    "law in a plane": replace(LAW, asperity=YIELDS, plane=0.0),  # other kinds of numbers of state
    "Coulomb's law": jl.CoulombLaw(normal_stiffness=1e12, shear_stiffness=5e11, friction=0.6),
}
SIGN = np.array([-1.0, 1.0, 1.0])  # closure and compression against opening and tension
THICKNESS, YOUNG, POISSON = 1e-3, 5e10, 0.2


@pytest.fixture(scope="module")
def folder(finite_elements):
    return finite_elements


def path(seed):
    """Steps (300, 3) in m that close, shear, open until the halves part, and close again."""
    d = np.random.default_rng(seed).normal(size=(300, 3)) * [3e-8, 1e-7, 1e-7]
    d[:20, 0] = 5e-8
    d[100] = [-2e-5, 0.0, 0.0]
    d[110] = [2.02e-5, 1e-7, 0.0]
    return d


@pytest.mark.parametrize(
    ("name", "kind", "kinematic", "gradient", "force", "type_", "properties"),
    [("rock", 3, 2, "OpeningDisplacement", "CohesiveForce", 2, []),
     ("rock_layer", 1, 1, "Strain", "Stress", 1, ["Thickness", "YoungModulus", "PoissonRatio"])],
)  # fmt: skip
def test_symbols_are_those_that_mgis_reads(
    folder, name, kind, kinematic, gradient, force, type_, properties
):
    b, rows = Behaviour(folder, name), LAW.state_size + 1
    numbers = {
        "mfront_mkt": 1, "api_version": 1, "BehaviourType": kind,
        "BehaviourKinematic": kinematic, "SymmetryType": 0, "ElasticSymmetryType": 0,
        "requiresStiffnessTensor": 0, "requiresThermalExpansionCoefficientTensor": 0,
        "ComputesInternalEnergy": 1, "ComputesDissipatedEnergy": 1,
        "TemperatureRemovedFromExternalStateVariables": 1, "nTangentOperatorBlocks": 2,
        "nExternalStateVariables": 0, "nParameters": 0, "nInitializeFunctions": 0,
        "nPostProcessings": 0, "nInternalStateVariables": rows,
        "nMaterialProperties": len(properties),
    }  # fmt: skip
    texts = {"mfront_ept": name, "unit_system": "SI", "mfront_interface": "Generic",
             "src": "mgis.c"}  # fmt: skip
    lists = {
        "TangentOperatorBlocks": [force, gradient], "Gradients": [gradient],
        "ThermodynamicForces": [force],
        "InternalStateVariables": [*(f"State{i}" for i in range(1, rows)), "Begun"],
    }  # fmt: skip
    lists |= {"MaterialProperties": properties} if properties else {}
    types = {"Gradients": [type_], "ThermodynamicForces": [type_],
             "InternalStateVariables": [0] * rows}  # fmt: skip
    for read, told in (
        (b.number, numbers), (b.text, texts), (b.names, lists), (b.types, types),
    ):  # fmt: skip
        assert {symbol: read(symbol) for symbol in told} == told


POINTS = {
    "cohesive zone": lambda folder: Behaviour(folder),
    "cohesive zone in a plane": lambda folder: Behaviour(folder, hypothesis="PlaneStrain"),
    "cohesive zone, law in a plane": lambda folder: Behaviour(folder, hypothesis="PlaneStrain"),
    "cohesive zone, Coulomb's law": lambda folder: Behaviour(folder),
    "UMAT": lambda folder: Umat(folder, 3),
    "UMAT in a plane": lambda folder: Umat(folder, 2),
}


@pytest.mark.parametrize("name", POINTS)
def test_a_point_is_the_law_in_python(folder, tmp_path, name):
    law = LAWS.get(name.partition(", ")[2], LAW)
    if law is not LAW:
        folder = export(tmp_path, law, "-O0", "librock_mgis.so")
    point, joint = POINTS[name](folder), law.joint(normal_stress=SEATING)
    n, found, expected = point.size, [], []
    signs = np.outer(SIGN, SIGN)[:n, :n]
    for d in path(1):
        d[n:] = 0.0
        T, K = point.step((SIGN * d)[:n])
        F, C = joint.update(d[: law.dim])
        found.append((SIGN[:n] * T, signs * K, [*point.energies]))
        energies = [joint.measures().stored, joint.dissipated_energy]
        expected.append((F[:n], C[:n, :n], energies))
    for i, share in enumerate((1e-12, 1e-8, 1e-12)):
        mine, theirs = (np.array([step[i] for step in steps]) for steps in (found, expected))
        assert np.abs(mine - theirs).max() < share * np.abs(theirs).max()
    assert not np.any(found[100][0]), "a joint that is open must not bear stress"
    assert np.any(found[110][0]), "a joint that touched again must bear stress"
    state = joint.snapshot().values[0]  # by which Python can go on
    np.testing.assert_allclose(point.state[:-1], state, rtol=0, atol=1e-12 * np.abs(state).max())


@pytest.mark.parametrize(
    ("hypothesis", "at_", "size", "plane"),
    [("Tridimensional", [2, 4, 5], 6, [0, 1, 3]), ("PlaneStrain", [1, 3], 4, [0, 2])],
)
def test_layer_is_the_joint_over_its_thickness(folder, hypothesis, at_, size, plane):
    n = len(at_)
    layer = Behaviour(folder, "rock_layer", hypothesis, [THICKNESS, YOUNG, POISSON])
    joint = Behaviour(folder, "rock", hypothesis)
    rng = np.random.default_rng(2)
    for d in path(2)[:120]:  # to a new contact
        strain = np.zeros(size)
        strain[plane] = 1e-6 * rng.normal(size=len(plane))
        strain[at_] = (SIGN * d)[:n] / THICKNESS * [1.0, 0.5**0.5, 0.5**0.5][:n]  # slip is 2 h e
        stress, K = layer.step(strain)
        T, C = joint.step((SIGN * d)[:n])
        # power, of any further motion, per volume and per area: whatever the factors above
        trial = rng.normal(size=size)
        jump = THICKNESS * trial[at_] * [1.0, 2**0.5, 2**0.5][:n]
        elastic = stress[plane] @ trial[plane]
        assert THICKNESS * (stress @ trial - elastic) == pytest.approx(T @ jump, rel=1e-9, abs=1e-9)
        further = jump @ C @ jump
        in_plane = trial[plane] @ K[np.ix_(plane, plane)] @ trial[plane]
        assert THICKNESS * (trial @ K @ trial - in_plane) == pytest.approx(further, rel=1e-9, abs=1)
    # plane stress of the rock, in the layer's own plane
    total = layer.new["gradients"][plane]
    stiff = np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, 1 - POISSON]])[: len(plane)]
    stiff = YOUNG / (1 - POISSON**2) * stiff[:, : len(plane)]
    np.testing.assert_allclose(layer.new["forces"][plane], stiff @ total, rtol=1e-12)
    np.testing.assert_allclose(K[np.ix_(plane, plane)], stiff, rtol=1e-12)
    stored, dissipated = np.divide(joint.energies, THICKNESS)  # per volume
    expected = [stored + 0.5 * total @ stiff @ total, dissipated]
    assert layer.energies == pytest.approx(expected, rel=1e-9)


def test_what_k_asks_for(folder):
    b, joint = Behaviour(folder), LAW.joint(normal_stress=SEATING)
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
@pytest.mark.parametrize(("bad", "why"), [(np.nan, "finite"), (-1e300, "reach|finite")])
def test_a_step_that_cannot_be_done_leaves_the_state_alone(folder, capfd, name, bad, why):
    b = Behaviour(folder, name, properties=[THICKNESS, YOUNG, POISSON])
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
        for told in (b.message.value.decode(), capfd.readouterr().err):  # OpenGeoSys shows stderr
            assert "Thickness must be > 0" in told


def test_two_threads_do_not_meet(folder):
    def run(seed):
        b = Behaviour(folder)
        return [b.step(SIGN * d)[0] for d in path(seed)]

    with ThreadPoolExecutor(2) as pool:  # ctypes lets go of the interpreter during a call
        together = list(pool.map(run, range(8)))
    np.testing.assert_array_equal(together, [run(seed) for seed in range(8)])


@pytest.mark.parametrize(
    ("step", "rows", "why"),
    [(np.full(3, np.nan), LAW.state_size + 1, "finite"), (np.zeros(3), 7, "NSTATV = 7")],
)
def test_umat_tells_of_a_step_that_cannot_be_done(folder, capfd, step, rows, why):
    point = Umat(folder, 3)
    point.step([-1e-7, 1e-7, 0.0])
    before = point.state.copy()
    stress, _ = point.step(step, rows)
    assert np.isnan(stress).all()
    assert (point.pnewdt[0], (point.state == before).all()) == (0.25, True)
    assert why in capfd.readouterr().err


def test_export_refuses_before_it_writes(tmp_path):
    for law, options, why in (
        (LAW, {"seating": 0.0}, "A joint without stress has no stiffness"),
        (LAW, {"seating": np.nan}, "seating"),
        (LAW, {"name": "a b"}, "identifier of C"),
        (replace(LAW, closure_only=True), {}, "closure_only"),
    ):
        with pytest.raises(ValueError, match=why):
            jl.export_fem(law, tmp_path / "new", **options)
    assert not (tmp_path / "new").exists()
