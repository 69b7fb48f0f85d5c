"""The exported projects in the real OpenGeoSys, against the laboratory test in Python."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from fem_host import LAW, SEATING

import jointlaw as jl

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
    joint = LAW.joint(normal_stress=SEATING)
    start = joint.delta[0]
    shear = jumps[:, 0]
    forth = jl.direct_shear(joint, shear[TURN], normal=2e6, steps=TURN - PRESSED)
    back = jl.direct_shear(joint, shear[END] - shear[TURN], normal=2e6, steps=END - TURN)
    for rows, record in ((slice(PRESSED, TURN + 1), forth), (slice(TURN, END + 1), back)):
        measured = stress[rows, 3 if dim == 2 else 5]  # xx yy zz xy yz xz
        peak, rise = forth.shear_stress.max(), np.ptp(forth.closure)
        assert np.abs(measured - record.shear_stress).max() < 1e-3 * peak
        assert np.abs(stress[rows, dim - 1] + 2e6).max() < 1e-3 * 2e6
        opening = start - record.closure
        assert np.abs(jumps[rows, dim - 1] - opening).max() < 1e-3 * rise
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
    page = (Path(__file__).parents[2] / "docs" / "fem.md").read_text()
    axes, vectors = re.findall(r"```xml\n(.*?)```", page, re.DOTALL)
    times, down, along = [0, 20, 70], [0.0, -2e-6, -2e-6], [0.0, 0.0, 3e-6]
    level = run(finite_elements, 2, moved(finite_elements, curve(times, down), curve(times, along)))
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
    there = level[1]
    for mine, theirs in (
        (np.array(back)[:, 1, 1], there[:, 1]),
        (np.array(back)[:, 0, 1], there[:, 3]),
    ):
        assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max()
    assert np.abs(there[-1, 3]) > 0.1 * np.abs(there[-1, 1])


def test_a_reason_is_told_on_stderr(finite_elements):
    with pytest.raises(AssertionError, match="rock: Thickness must be > 0"):
        run(finite_elements, 2, [("<value>1e-3</value>", "<value>-1</value>")])


def test_opens_separates_and_touches_again(finite_elements):
    """The top is moved, not pressed: down, up until nothing touches, and down again, in shear."""
    edits = moved(
        finite_elements,
        "<coords>0 20 40 70</coords><values>0 -2e-6 3e-6 -2e-6</values>",
        "<coords>0 10 30 70</coords><values>0 0 2e-7 2e-7</values>",
    )
    jumps, stress, _ = run(finite_elements, 2, edits)
    joint, traction = LAW.joint(normal_stress=SEATING), []
    for opening, slip in np.diff(jumps[:, ::-1], axis=0):
        traction.append(joint.update([-opening, slip, 0.0])[0][:2])
    measured = stress[1:, [1, 3]] * [-1, 1]
    assert np.abs(measured - traction).max() < 1e-3 * np.abs(traction).max()
    assert not measured[39].any(), "open joint: no stress"
    assert measured[-1, 0] > 1e6
    assert measured[19:, 1].any()
