"""Outlines and lines of scenes from CSV and DXF files: the same scene as with lists of points."""

import io

import numpy as np
import pytest

from dem_demo import Simulation, parse
from dem_demo.scene import Files
from dem_demo.studies.strength import alone

LAWS = (
    '[laws.j]\nkind = "coulomb"\nnormal_stiffness = 1e9\nshear_stiffness = 1e9\nfriction = 0.6\n'
    "[run]\nend = 0.1\n"
)
OUTLINE = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]
TABLE = [[0.0, 1.0], [3.0, 0.5]]
OPENING = [[1.0, 1.5], [2.0, 1.5], [2.0, 2.5], [1.0, 2.5]]


def scene_text(outline, table, region):
    return (
        f'[[rock]]\nname = "rock"\noutline = {outline}\n'
        '[[rock.set]]\ndip = 0.0\nspacing = 5.0\nthrough = [0.0, 1.0]\nlaw = "j"\n'
        "[[rock.fixed]]\ncorners = [[-1, -1], [4, -1], [4, 0.9], [-1, 0.9]]\n"
        f"[water]\ntable = {table}\n"
        f"[[excavate]]\ncorners = {region}\nrelease_time = 0.1\n" + LAWS
    )


def csv(points, title="x_m,y_m\n", separator=","):
    return title + "".join(f"{x}{separator} {y}\n" for x, y in points)


def dxf(layers, unit=6, closed=True, **more):
    """A drawing with a polyline on each layer; unit: 6 for m, 4 for mm."""
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010")
    drawing.units = unit
    for layer, points in layers.items():
        drawing.modelspace().add_lwpolyline(
            points, close=closed, dxfattribs={"layer": layer}, **more
        )
    stream = io.StringIO()
    drawing.write(stream)
    return stream.getvalue()


def same(scene):
    """Corners, water table and stages of a scene."""
    corners = np.concatenate([block.corners for block in scene.blocks])
    return corners.tolist(), scene.water.line.tolist(), [stage["blocks"] for stage in scene.stages]


def from_files(outline, table, region, files):
    return parse(
        scene_text(f'"{outline}"', f'"{table}"', f'"{region}"'), files=Files(known=dict(files))
    )


BY_HAND = same(parse(scene_text(OUTLINE, TABLE, OPENING)))


@pytest.mark.parametrize("title", ["x_m,y_m\n", "", "# a comment\nx, y\n"])
@pytest.mark.parametrize("separator", [",", ";", " "])
def test_csv_files(title, separator):
    files = {
        "outline.csv": csv([*OUTLINE[::-1], OUTLINE[-1]], title, separator),  # clockwise, closed
        "table.csv": csv(TABLE, title, separator),
        "opening.csv": csv(OPENING, title, separator),
    }
    scene = from_files("outline.csv", "table.csv", "opening.csv", files)
    corners, table, stages = same(scene)
    assert sorted(corners) == sorted(BY_HAND[0])
    assert (table, stages) == BY_HAND[1:]


def test_dxf_files():
    """By layer, in mm; the water table is an open line."""
    in_mm = {
        "outline": (1e3 * np.array(OUTLINE)).tolist(),
        "opening": (1e3 * np.array(OPENING)).tolist(),
    }
    files = {"section.dxf": dxf(in_mm, unit=4), "water.dxf": dxf({"0": TABLE}, closed=False)}
    scene = from_files("section.dxf:outline", "water.dxf", "section.dxf:opening", files)
    corners, table, stages = same(scene)
    np.testing.assert_allclose(sorted(corners), sorted(BY_HAND[0]), atol=1e-12)
    assert (table, stages) == BY_HAND[1:]


def test_rocks_alone_and_saved_states_keep_their_files(tmp_path):
    for name, points in (("outline", OUTLINE), ("table", TABLE), ("opening", OPENING)):
        (tmp_path / f"{name}.csv").write_text(csv(points))
    text = scene_text('"outline.csv"', '"table.csv"', '"opening.csv"')
    sim = Simulation(parse(text, files=Files(tmp_path)))
    sim.save(tmp_path / "state")
    for path in tmp_path.glob("*.csv"):
        path.unlink()
    repeated = Simulation.load(tmp_path / "state")
    assert same(repeated.scene) == same(sim.scene)
    assert same(alone(sim.scene, "rock")) == same(sim.scene)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "outline: outline.csv: has no points"),
        ("x,y\n1,2\n3,up\n", "outline.csv, line 3: '3,up' must be x and y in m"),
        ("x,y\n1,2\n3,4,5\n", "outline.csv, line 3: '3,4,5' must be x and y"),
        ("x,y\n1,2\n3,nan\n", "outline.csv, line 3: '3,nan' must be x and y"),
        ("0,0\n1,0\n", "outline.*3 corners"),
    ],
)
def test_invalid_csv_files_are_named(content, message):
    files = {"outline.csv": content, "table.csv": csv(TABLE), "opening.csv": csv(OPENING)}
    with pytest.raises(ValueError, match=message):
        from_files("outline.csv", "table.csv", "opening.csv", files)


def test_missing_files_are_named(tmp_path):
    text = scene_text('"nowhere.csv"', TABLE, OPENING)
    with pytest.raises(ValueError, match=r"outline: nowhere.csv cannot be read .*No such file"):
        parse(text, files=Files(tmp_path))


@pytest.mark.parametrize(
    ("layers", "more", "message"),
    [
        ({"a": OUTLINE, "b": OPENING}, {}, r"one polyline in it, it has 2 \(layers: a, b\)"),
        ({}, {}, "it has 0"),
        ({"a": OUTLINE}, {"closed": False}, "the polyline must be closed"),
        ({"a": [(0, 0, 0, 0, 1.0), (3, 0), (3, 2)]}, {}, "has arcs"),
    ],
)
def test_invalid_dxf_files_are_named(layers, more, message):
    files = {"section.dxf": dxf(layers, **more)}
    with pytest.raises(ValueError, match=f"section.dxf: .*{message}"):
        parse(scene_text('"section.dxf"', TABLE, OPENING), files=Files(known=files))


def test_a_file_that_is_no_drawing_is_named():
    pytest.importorskip("ezdxf")
    files = Files(known={"section.dxf": "no drawing\n"})
    with pytest.raises(ValueError, match=r"section.dxf is no DXF drawing"):
        parse(scene_text('"section.dxf"', TABLE, OPENING), files=files)
