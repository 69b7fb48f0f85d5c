"""The exported projects in the real OpenGeoSys, against the laboratory test in Python."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from fem_host import is_the_test_in_python

OGS = Path(sys.prefix) / "bin" / "ogs"
PRESSED, TURN, END = 10, 50, 70  # steps


def run(folder, dim, edits=(), steps=END):
    """Run a project, its text changed by (old, new); jumps (m) and stresses (Pa) of the layer."""
    if not OGS.exists():
        pytest.skip("OpenGeoSys is not installed (pip install 'jointlaw[fem]')")
    project = "opengeosys_2d.prj" if dim == 2 else "opengeosys_3d.xml"
    text = (folder / project).read_text()
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    test = f"test{Path(project).suffix}"
    (folder / test).write_text(text)
    out = folder / "results"
    out.mkdir(exist_ok=True)
    command = [OGS, test, "-o", "results"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    files = [meshio.read(out / f"shear_{dim}d_{i}.vtu") for i in range(steps + 1)]
    jumps = [jump(file.point_data["displacement"], dim) for file in files]
    stresses = [np.split(file.field_data["sigma_ip"], 3)[1].mean(axis=0) for file in files]
    return np.array(jumps), np.array(stresses), done.stdout


def jump(displacement, dim):
    """Mean displacement of the layer's upper face against its lower one."""
    lower, upper = displacement.reshape(4, -1, dim)[1:3]
    return (upper - lower).mean(axis=0)


@pytest.mark.parametrize("dim", [2, 3])
def test_direct_shear_at_constant_normal_stress(finite_elements, dim):
    jumps, stress, log = run(finite_elements, dim)
    shear = stress[:, 3 if dim == 2 else 5]  # xx yy zz xy yz xz
    is_the_test_in_python(jumps[:, 0], jumps[:, dim - 1], shear, PRESSED, TURN)
    assert np.abs(stress[PRESSED:, dim - 1] + 2e6).max() < 1e-3 * 2e6
    steps = re.split(r"Time step #\d+ started", log)[2:]
    iterations = [step.count("|dx|=") for step in steps]
    assert max(iterations) <= 10  # to 1e-15 m
    assert np.median(iterations) <= 6


def test_restart(finite_elements):
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
    jumps, again, _ = run(finite_elements, 2, edits, 40)
    np.testing.assert_allclose(jumps, whole[30:], rtol=0, atol=1e-9 * np.abs(whole).max())
    np.testing.assert_allclose(again, stress[30:], rtol=0, atol=1e-9 * np.abs(stress).max())


def moved(folder, down, along):
    """Edits by which the upper block is moved, not pressed: curves of its two displacements (m)."""
    text = (folder / "opengeosys_2d.prj").read_text()
    return (
        ("<mesh>top_2d</mesh><type>Neumann</type>", "<mesh>upper_2d</mesh><type>Dirichlet</type>"),
        *zip(re.findall(r"<coords>.*?</values>", text, re.DOTALL), (down, along), strict=True),
    )


def curve(times, values):
    words = (" ".join(map(repr, numbers)) for numbers in (times, values))
    return "<coords>{}</coords><values>{}</values>".format(*words)


def test_a_layer_that_is_not_level(finite_elements, tmp_path):
    """Turned by 30 degrees with all that moves it, by the lines of the page: the same stress."""
    page = (Path(__file__).parents[2] / "docs" / "native.md").read_text()
    axes, vectors = re.findall(r"```xml\n(.*?)```", page, re.DOTALL)
    times, down, along = [0, 20, 70], [0.0, -2e-6, -2e-6], [0.0, 0.0, 3e-6]
    level = moved(finite_elements, curve(times, down), curve(times, along))
    _, there, _ = run(finite_elements, 2, level)
    shutil.copytree(finite_elements, tmp_path / "turned")
    turn = np.array([[3**0.5 / 2, -0.5], [0.5, 3**0.5 / 2]])  # columns: the two axes
    assert re.findall(r"<values>(.*?)</values>", vectors) == ["0.8660254 0.5", "-0.5 0.8660254"]
    for row, axis in zip(turn.T, ("0.8660254 0.5", "-0.5 0.8660254"), strict=True):
        vectors = vectors.replace(f">{axis}<", f">{row[0].item()!r} {row[1].item()!r}<")
    for path in (tmp_path / "turned").glob("*_2d.vtu"):
        mesh = meshio.read(path)
        mesh.points[:, :2] = mesh.points[:, :2] @ turn.T
        mesh.write(path)
    x, y = (turn @ [along, down]).tolist()
    edits = (
        *moved(finite_elements, curve(times, y), curve(times, x)),
        ("  <parameters>", f"{axes}  <parameters>{vectors}"),
    )
    _, stress, _ = run(tmp_path / "turned", 2, edits)
    xx, yy, _, xy = stress.T
    back = [turn.T @ [[a, b], [b, c]] @ turn for a, b, c in zip(xx, xy, yy, strict=True)]
    for mine, theirs in zip(np.array(back)[:, 1].T, there[:, [3, 1]].T, strict=True):
        assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max()
    assert np.abs(there[-1, 3]) > 0.1 * np.abs(there[-1, 1])
