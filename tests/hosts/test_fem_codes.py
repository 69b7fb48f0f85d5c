"""The exported projects in the real OpenGeoSys and Kratos, against a laboratory test in Python."""

import re
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import meshio
import numpy as np
import pytest
from fem_host import LAW, SEATING
from programs import find_program, run_program

import jointlaw as jl

LOADED_STEP = 10  # last step of loading
REVERSAL_STEP = 50  # last step of shear before the reversal
LAST_STEP = 70


def is_the_test_in_python(slip, opening, shear, pressed):
    """Direct shear of a host at 2 MPa, from row `pressed` on: 40 steps forth, 20 back."""
    joint = LAW.joint(normal_stress=SEATING)
    turn = pressed + REVERSAL_STEP - LOADED_STEP
    start = joint.delta[0]
    forth = jl.direct_shear(joint, slip[turn], normal=2e6, steps=turn - pressed)
    back = jl.direct_shear(
        joint, slip[-1] - slip[turn], normal=2e6, steps=LAST_STEP - REVERSAL_STEP
    )
    peak = forth.shear_stress.max()
    rise = np.ptp(forth.closure)
    for rows, record in ((slice(pressed, turn + 1), forth), (slice(turn, None), back)):
        assert np.abs(shear[rows] - record.shear_stress).max() < 1e-3 * peak
        assert np.abs(opening[rows] - (start - record.closure)).max() < 1e-3 * rise
    assert forth.shear_stress[-1] - back.shear_stress[-1] > peak / 2, "the way back must differ"


def test_an_interface_element_in_kratos(finite_elements):
    if find_spec("KratosMultiphysics") is None:
        pytest.skip("Kratos is not installed (pip install 'jointlaw[fem]')")
    run_program(sys.executable, "kratos.py", cwd=finite_elements)
    test = np.genfromtxt(finite_elements / "kratos.csv", delimiter=",", names=True)
    assert test["iterations"].max() <= 6
    # closure: each load, on a joint of its own
    loads = -test["normal_Pa"][:LOADED_STEP]
    closure = LAW.closure(SEATING) - test["opening_m"][:LOADED_STEP]
    assert np.abs(loads / LAW.normal_stress(closure) - 1).max() < 1e-3
    assert np.abs(loads / np.linspace(2e5, 2e6, LOADED_STEP) - 1).max() < 1e-3
    is_the_test_in_python(test["slip_m"], test["opening_m"], test["shear_Pa"], LOADED_STEP - 1)


def run(folder, dim, edits=(), steps=LAST_STEP):
    """Run a project, its text changed by (old, new); jumps (m) and stresses (Pa) of the layer."""
    project = "opengeosys_2d.prj" if dim == 2 else "opengeosys_3d.xml"
    text = (folder / project).read_text()
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    test = f"test{Path(project).suffix}"
    (folder / test).write_text(text)
    out = folder / "results"
    out.mkdir(exist_ok=True)
    ogs = find_program("ogs", path=Path(sys.prefix) / "bin")
    log = run_program(ogs, test, "-o", "results", cwd=folder)
    files = [meshio.read(out / f"shear_{dim}d_{i}.vtu") for i in range(steps + 1)]
    # lower block, layer's lower and upper face, upper block
    faces = [file.point_data["displacement"].reshape(4, -1, dim)[1:3] for file in files]
    jumps = np.diff(faces, axis=1)[:, 0].mean(axis=1)
    stresses = [np.split(file.field_data["sigma_ip"], 3)[1].mean(axis=0) for file in files]
    return jumps, np.array(stresses), log


@pytest.mark.parametrize("dim", [2, 3])
def test_direct_shear_in_opengeosys(finite_elements, dim):
    jumps, stress, log = run(finite_elements, dim)
    shear = stress[:, 3 if dim == 2 else 5]  # xx yy zz xy yz xz
    is_the_test_in_python(jumps[:, 0], jumps[:, dim - 1], shear, LOADED_STEP)
    assert np.abs(stress[LOADED_STEP:, dim - 1] + 2e6).max() < 1e-3 * 2e6
    steps = re.split(r"Time step #\d+ started", log)[2:]
    iterations = [step.count("|dx|=") for step in steps]
    assert max(iterations) <= 10  # to 1e-15 m
    assert np.median(iterations) <= 6


def test_restart_in_opengeosys(finite_elements):
    whole, stress, _ = run(finite_elements, 2)
    saved = finite_elements / "results" / "shear_2d_30.vtu"
    (finite_elements / "saved.vtu").write_bytes(saved.read_bytes())
    edits = (
        ("<mesh>blocks_2d.vtu</mesh>", "<mesh>saved.vtu</mesh>"),
        ("<t_initial>0<", "<t_initial>30<"),
        ("<repeat>70<", "<repeat>40<"),
        (
            "<name>still</name><type>Constant</type><values>0 0</values>",
            "<name>still</name><type>MeshNode</type><field_name>displacement</field_name>",
        ),
    )
    jumps, repeated, _ = run(finite_elements, 2, edits, 40)
    np.testing.assert_allclose(jumps, whole[30:], rtol=0, atol=1e-9 * np.abs(whole).max())
    np.testing.assert_allclose(repeated, stress[30:], rtol=0, atol=1e-9 * np.abs(stress).max())


def prescribe_displacement(folder, *curve_values):
    """Edits that prescribe displacements (m) of the upper block, normal and shear, 3 times."""
    old = re.findall(r"<coords>.*?</values>", (folder / "opengeosys_2d.prj").read_text(), re.DOTALL)
    curve = "<coords>0 20 70</coords><values>{!r} {!r} {!r}</values>"
    return (
        ("<mesh>top_2d</mesh><type>Neumann</type>", "<mesh>upper_2d</mesh><type>Dirichlet</type>"),
        *zip(old, (curve.format(*values) for values in curve_values), strict=True),
    )


def test_a_layer_that_is_not_level(finite_elements, tmp_path):
    """Turned by 30 degrees with all that moves it, by the lines of the page: the same stress."""
    page = (Path(__file__).parents[2] / "docs" / "native.md").read_text()
    axes, vectors = re.findall(r"```xml\n(.*?)```", page, re.DOTALL)
    down = [0.0, -2e-6, -2e-6]
    along = [0.0, 0.0, 3e-6]
    _, there, _ = run(finite_elements, 2, prescribe_displacement(finite_elements, down, along))
    shutil.copytree(finite_elements, tmp_path / "turned")
    c = np.cos(np.radians(30))
    turn = np.array([[c, -0.5], [0.5, c]])  # columns: the two axes
    for path in (tmp_path / "turned").glob("*_2d.vtu"):
        mesh = meshio.read(path)
        mesh.points[:, :2] = mesh.points[:, :2] @ turn.T
        mesh.write(path)
    x, y = (turn @ [along, down]).tolist()
    edits = (
        *prescribe_displacement(finite_elements, y, x),
        ("  <parameters>", f"{axes}  <parameters>{vectors}"),
    )
    _, stress, _ = run(tmp_path / "turned", 2, edits)
    xx, yy, _, xy = stress.T
    back = [turn.T @ [[a, b], [b, c]] @ turn for a, b, c in zip(xx, xy, yy, strict=True)]
    for mine, theirs in zip(np.array(back)[:, 1].T, there[:, [3, 1]].T, strict=True):
        assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max()
    assert np.abs(there[-1, 3]) > 0.1 * np.abs(there[-1, 1])
