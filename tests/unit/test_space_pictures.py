"""Pictures of blocks in space: actors, legends and pixels against values computed here.

Tests that draw need pyvista (`pip install 'jointlaw[view]'`), and are slow: it loads VTK.
"""

import csv
import json
import re
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.figure import Figure
from scene_text import block
from scipy.spatial.transform import Rotation

import dem_demo.space.pictures as space_pictures
from dem_demo.cli import main
from dem_demo.output.pictures import DISPLACEMENT_COLOURS
from dem_demo.output.run import run
from dem_demo.space import SpaceSimulation, Statics, load, parse
from dem_demo.space.contacts import Surfaces
from dem_demo.space.drawing import Drawing, Motion, hatched
from dem_demo.space.picture_files import drawing_of_run
from dem_demo.space.pictures import STATE_COLOURS, SpacePictures, colour_limit, nice_length
from dem_demo.space.view import page, scene_data

ROUGH_LAW = """
asperity_density = 1e4
closure_range = 2e-4
mating_length = 2e-3
resolution = "fast"
orientation = { a = 3.0, b = -1.0, c = 0.3 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.38 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
"""
ROUGH = 30.0  # degrees from north, counter-clockwise seen from above
SCENE = (
    f'title = "known blocks"\nrough = {ROUGH}\n[laws.joint]\n{ROUGH_LAW}'
    + block("base", box=[40.0, 40.0, 2.0], at=[0.0, 0.0, -1.0], fixed=True)
    + block("west", box=[2.0, 2.0, 2.0], at=[-3.0, 0.0, 1.0])
    + block("east", box=[2.0, 2.0, 2.0], at=[3.0, 0.0, 1.0])
)
TURN = 0.2  # of the west block about z, rad
needs_pyvista = [
    pytest.mark.slow,
    pytest.mark.skipif(not find_spec("pyvista"), reason="needs pyvista: jointlaw[view]"),
]


@pytest.fixture(scope="module")
def drawing():
    return Drawing(Statics(parse(SCENE)), np.array([False, True, False]))


@pytest.fixture(scope="module")
def moved(drawing):
    """West by 5 mm and turned about z, east by 1 mm."""
    rotation = np.array(drawing.as_drawn.rotation)
    rotation[1] = Rotation.from_rotvec([0.0, 0.0, TURN]).as_matrix()
    return Motion(np.array([[0.0, 0.0, 0.0], [3e-3, 0.0, 4e-3], [0.0, 1e-3, 0.0]]), rotation)


# ------------------------------------------------------------------------- what is drawn, no VTK


def test_fixed_rock_is_cut_to_a_box_around_the_free_blocks(drawing):
    """A quarter of 8 m around blocks from -4 to 4 in x and -1 to 1 in y; above 0 - 2 in z."""
    base = drawing.solids[0].vertices
    assert base.min(axis=0) == pytest.approx([-6.0, -3.0, -2.0])
    assert base.max(axis=0) == pytest.approx([6.0, 3.0, 0.0])
    assert drawing.solids[1].volume == pytest.approx(8.0)


def test_fixed_blocks_outside_the_picture_are_left_out():
    far = block("far", box=[1.0, 1.0, 1.0], at=[15.0, 0.0, 0.5], fixed=True)
    drawing = Drawing(Statics(parse(SCENE + far)), np.zeros(4, bool))
    assert drawing.solids[3] is None
    assert set(drawing.edges[0]) == {0, 1, 2}


def test_hatching_is_the_rough_direction_on_both_faces_of_each_contact(drawing):
    lines = drawing.hatch[:, 1] - drawing.hatch[:, 0]
    angle = np.radians(ROUGH)
    along = np.array([-np.sin(angle), np.cos(angle), 0.0])
    assert np.abs(np.cross(lines, along)).max() < 1e-12
    for number, middle in ((1, -3.0), (2, 3.0)):
        ends = drawing.hatch[drawing.hatch_block == number].reshape(-1, 3)
        assert ends[:, 2] == pytest.approx(0.0, abs=1e-12)
        offsets = np.abs(ends[:, :2] - [middle, 0.0]).max(axis=1)
        assert offsets == pytest.approx(1.0)  # they end on the edges of the face
        # lines a sixth of the width apart across a square of 2 m seen at 30 degrees
        assert len(ends) // 2 == pytest.approx(6 * (np.cos(angle) + np.sin(angle)), abs=1)
    assert (drawing.hatch_block == 0).sum() == (drawing.hatch_block != 0).sum()


def test_lines_of_hatching_continue_over_neighbouring_polygons():
    axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    square = np.array([[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0], [0.0, 1.0, 3.0]])
    left, right = (hatched(square + np.array([x, 0.05, 0.0]), axes, 0.2) for x in (0.0, 1.0))
    assert left[:, 0, 1] == pytest.approx(np.arange(0.2, 1.05, 0.2))
    np.testing.assert_allclose(np.sort(left[:, :, 0], axis=1), [[0.0, 1.0]] * 5)
    np.testing.assert_allclose(left[:, 0, 1:], right[:, 0, 1:])


def test_a_law_without_a_rough_direction_has_no_hatching():
    drawing = Drawing(Statics(load("wall-3d")), np.zeros(28, bool))
    assert len(drawing.hatch) == 0


@pytest.mark.parametrize("name", ["wedge", "wall-3d"])
def test_pulled_blocks_are_apart(name):
    statics = Statics(load(name))
    drawing = Drawing(statics, np.zeros(len(statics.is_free), bool))
    motion = drawing.pulled_apart(0.3)
    assert not motion.displacement[~statics.is_free].any()
    solids = [
        one.solid.moved(by)
        for one, by in zip(statics.scene.blocks, motion.displacement, strict=True)
    ]
    surfaces = Surfaces(solids, statics.is_free)
    pairs = np.column_stack([statics.points.block_a, statics.points.block_b])
    gaps = surfaces.separations(np.unique(pairs, axis=0), 0.0)
    assert gaps.min() > 0.02 * drawing.free_extent


def test_a_slope_is_seen_from_its_free_side():
    """The wedge daylights in a face that dips to the south."""
    statics = Statics(load("wedge"))
    eye = Drawing(statics, np.zeros(len(statics.is_free), bool)).view_direction
    assert np.linalg.norm(eye) == pytest.approx(1.0)
    assert np.degrees(np.arcsin(eye[2])) == pytest.approx(28.0)
    assert np.degrees(np.arctan2(eye[0], -eye[1])) == pytest.approx(-25.0, abs=1.0)


def test_a_failed_block_does_not_set_the_colours():
    size = 2.0
    assert colour_limit(np.array([1e-3, 5e-3]), size) == (5e-3, False)
    assert colour_limit(np.array([1e-3, 5e-3, 3.0]), size) == (5e-3, True)
    assert colour_limit(np.array([0.19, 0.21]), size) == (0.21, False)  # nearly all of one size
    assert colour_limit(np.array([3.0]), size) == (3.0, False)


def test_lengths_of_scale_bars():
    lengths = [nice_length(length) for length in (0.99, 1.0, 4.9, 7.0, 23.0, 0.02)]
    assert lengths == pytest.approx([0.5, 1.0, 2.0, 5.0, 20.0, 0.02])


def test_places_of_a_run_are_its_vertices():
    """The drawing, moved to each frame, beside the vertices of the record."""
    scene = load("wedge-across")
    record, _ = run(SpaceSimulation(scene), until=0.2, pictures=None)
    drawing, motions = drawing_of_run(record)
    number = int(np.flatnonzero(drawing.is_free)[0])
    solid = drawing.solids[number]
    first = record.surfaces.first_vertex[number]
    for i in (0, len(record.times) - 1):
        block = np.full(len(solid.vertices), number)
        placed = motions[i].place(block, drawing.centroid, solid.vertices)
        expected = record.vertices(i)[first : first + len(solid.vertices)]
        np.testing.assert_allclose(placed, expected, atol=1e-12)
    assert motions[-1].distances == pytest.approx(record.distances)
    assert record.distances[number] > 0.01


def test_removed_blocks_are_left_out(drawing, moved):
    """Of the page for the browser; `TestDrawn` has the pictures."""
    displacement = moved.displacement.copy()
    displacement[1] = np.nan
    gone = Motion(displacement, moved.rotation)
    assert gone.is_present.tolist() == [True, False, True]
    data = scene_data(drawing, "", motions=[drawing.as_drawn, gone], times=[0.0, 1.0])
    assert data["frames"][1]["displacement"] == [[0.0] * 3, None, [0.0, 1e-3, 0.0]]
    assert data["frames"][1]["largest"] == pytest.approx(1e-3)
    assert "NaN" not in page([data])


def test_without_pyvista_a_run_says_so_and_writes_vtk_files(tmp_path, capsys, monkeypatch):
    for module in ("cli", "space.picture_files"):
        monkeypatch.setattr(f"dem_demo.{module}.has_pyvista", lambda: False)
    assert main(["wedge", "--until", "0.05", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "they need pyvista: pip install 'jointlaw[view]'" in printed
    assert "VTK files are written in place of pictures" in printed
    assert (tmp_path / "vtk" / "blocks_0000.vtu").exists()
    assert not list(tmp_path.glob("*.png"))
    assert (tmp_path / "view.html").exists()


class RecordedPyvista:
    """Stands for pyvista: keeps the meshes and options that a plotter is given, draws nothing."""

    class PolyData:
        def __init__(self, points, faces=None, lines=None):
            self.points = np.array(points, float)
            self.cells = np.array(lines if faces is None else faces)
            self.cell_data = {}

    class Light:
        def __init__(self, position, light_type):
            self.position = position

    class Plotter:
        def __init__(self, off_screen, window_size):
            self.window_size = window_size
            self.meshes = {}
            self.camera = SimpleNamespace()
            self.lights = []

        def enable_anti_aliasing(self, kind):
            pass

        def remove_all_lights(self):
            self.lights.clear()

        def add_light(self, light):
            self.lights.append(light)

        def add_mesh(self, mesh, name, **options):
            assert isinstance(mesh, RecordedPyvista.PolyData)
            self.meshes[name] = mesh, options


def segments_of(mesh):
    """Blocks and ends (m, 2, 3) of the segments of a mesh."""
    cells = mesh.cells.reshape(-1, 3)
    assert (cells[:, 0] == 2).all()
    return np.array(mesh.cell_data["block"]), mesh.points[cells[:, 1:]]


@pytest.mark.parametrize("by", ["state", "displacement"])
def test_meshes_and_options_of_a_picture(drawing, moved, by, monkeypatch):
    """Faces, edges, outlines and hatching are at the places of the blocks, and coloured by them."""
    monkeypatch.setattr(space_pictures, "import_pyvista", lambda: RecordedPyvista)
    pictures = SpacePictures(drawing, [drawing.as_drawn, moved], by=by)
    plotter = pictures.plotter(1, 1000)
    assert [*plotter.meshes] == ["blocks", "edges", "marked", "rough direction"]
    mesh, options = plotter.meshes["blocks"]
    distances = np.array([0.0, 5.0, 1.0])  # mm: west by 3 and 4 mm, east by 1 mm
    block = np.array(mesh.cell_data["block"])
    assert np.bincount(block).tolist() == [6, 6, 6]
    np.testing.assert_allclose(mesh.cell_data["displacement (mm)"], distances[block])
    if by == "state":
        names = [*STATE_COLOURS]
        states = [names[number] for number in mesh.cell_data["state"]]
        expected = ["fixed", "unstable", "stable"]
        assert states == [expected[number] for number in block]
        assert options["scalars"] == "state"
        low, high = options["clim"]
        for number, colour in enumerate(STATE_COLOURS.values()):  # as VTK looks a colour up
            assert to_rgb(colour) == options["cmap"]((number - low) / (high - low))[:3]
    else:
        assert options["scalars"] == "coloured by"
        np.testing.assert_allclose(
            mesh.cell_data["coloured by"], np.where(block == 0, -1.0, distances[block])
        )
        assert options["cmap"] is DISPLACEMENT_COLOURS
        assert options["clim"] == pytest.approx((0.0, 5.0))
        assert options["below_color"] == STATE_COLOURS["fixed"]
    towards_eye = 1e-3 * drawing.size * pictures.eye
    half = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    cosine, sine = np.cos(TURN), np.sin(TURN)
    west = half @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    west += np.array([-3 + 3e-3, 0, 1 + 4e-3])
    edges, look = plotter.meshes["edges"]
    number, ends = segments_of(edges)
    assert np.bincount(number).tolist() == [12, 12, 12]
    corners = np.unique((ends[number == 1] - towards_eye).reshape(-1, 3).round(9), axis=0)
    np.testing.assert_allclose(corners, np.unique(west.round(9), axis=0), atol=1e-8)
    outlined, thick = plotter.meshes["marked"]
    number, ends = segments_of(outlined)
    assert set(number) == {1}
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) == pytest.approx(2.0)
    corners = np.unique((ends - 2 * towards_eye).reshape(-1, 3).round(9), axis=0)
    np.testing.assert_allclose(corners, np.unique(west.round(9), axis=0), atol=1e-8)
    assert thick["line_width"] > 2 * look["line_width"] > 0.0
    assert thick["lighting"] is False
    assert thick["color"] == space_pictures.MARKED_COLOUR
    hatching, _ = plotter.meshes["rough direction"]
    number, ends = segments_of(hatching)
    for block, turn in ((0, 0.0), (1, TURN), (2, 0.0)):
        angle = np.radians(ROUGH) + turn  # lines turn with their block
        lines = (ends[:, 1] - ends[:, 0])[number == block]
        assert len(lines) == (drawing.hatch_block == block).sum() > 0
        assert np.abs(np.cross(lines, [-np.sin(angle), np.cos(angle), 0.0])).max() < 1e-9
    camera = plotter.camera
    seen = np.subtract(camera.position, camera.focal_point)
    np.testing.assert_allclose(seen / np.linalg.norm(seen), pictures.eye, atol=1e-12)
    assert camera.parallel_projection
    height = pictures.high[1] - pictures.low[1]
    assert camera.parallel_scale == pytest.approx(0.5 * height)


def test_colours_of_states():
    """Grey, green, orange-red and yellow: what the legend calls them is what a reader expects."""
    hue, saturation, _ = rgb_to_hsv([to_rgb(colour) for colour in STATE_COLOURS.values()]).T
    by_name = dict(zip(STATE_COLOURS, zip(360 * hue, saturation, strict=True), strict=True))
    assert by_name["fixed"][1] < 0.1
    assert 100 < by_name["stable"][0] < 180
    assert by_name["unstable"][0] < 40
    assert 45 < by_name["not decided"][0] < 65


def test_scale_bar_compass_and_note(drawing, moved, monkeypatch):
    """Artists below the solids, in metres of the picture."""
    monkeypatch.setattr(SpacePictures, "render", lambda *_: np.zeros((4, 4, 4)))
    pictures = SpacePictures(drawing, [drawing.as_drawn, moved])
    pictures.low = pictures.low - [2.0, 0.0]  # not symmetric
    figure, axes = pictures.figure()
    pictures.draw(axes, 1, "t = 0.25 s")
    (image,) = axes.images
    left, right, bottom, top = image.get_extent()
    assert [left, bottom] == pytest.approx(pictures.low)
    assert [right, top] == pytest.approx(pictures.high)
    # the fixed rock is 12 m by 6 m in plan, 2 m high
    assert right - left >= np.ptp(drawing.solids[0].vertices @ pictures.right)
    (line,) = axes.lines
    assert line.get_gid() == "scale bar"
    x, y = line.get_data()
    texts = {text.get_text(): text for text in axes.texts if text.get_text()}
    label = texts.pop(f"{np.ptp(x):g} m")
    assert y[0] == y[1]
    assert axes.get_ylim()[0] < y[0] < bottom
    assert left < x.min() < x.max() < right
    assert label.get_position()[0] == pytest.approx(x.mean())
    assert axes.get_ylim()[0] < label.get_position()[1] < y[0]  # below the bar
    assert (label.get_ha(), label.get_va()) == ("center", "top")
    note = texts.pop("t = 0.25 s")
    assert note.get_gid() == "note"
    assert note.get_position() == pytest.approx((0.5 * (left + right), y[0]))
    arrows = {text.get_gid(): text for text in axes.texts if text.get_gid() in ("N", "up")}
    assert {*texts} == {*arrows} == {"N", "up"}
    for name, axis in (("N", [0.0, 1.0, 0.0]), ("up", [0.0, 0.0, 1.0])):
        arrow = arrows[name]
        origin = np.array(arrow.get_position())
        assert arrow.arrowprops["arrowstyle"] == "-|>"  # with its head at the end
        assert arrow.arrowprops["color"] == "k"
        along = np.subtract(arrow.xy, origin)
        seen = np.array([pictures.right @ axis, pictures.up @ axis])
        np.testing.assert_allclose(along / np.linalg.norm(along), seen / np.linalg.norm(seen))
        beyond = np.array(texts[name].get_position()) - origin
        np.testing.assert_allclose(beyond / np.linalg.norm(beyond), seen / np.linalg.norm(seen))
        assert np.linalg.norm(beyond) > np.linalg.norm(along)
        assert left < origin[0] < 0.5 * (left + right)
        assert axes.get_ylim()[0] < origin[1] < bottom
    assert figure.get_suptitle() == "known blocks"


# ------------------------------------------------------------------------------- drawn by pyvista


class TestDrawn:
    pytestmark = needs_pyvista

    def test_actors_hold_places_displacements_and_outlines(self, drawing, moved):
        pictures = SpacePictures(drawing, [drawing.as_drawn, moved], by="displacement")
        plotter = pictures.plotter(1, 200)
        try:
            blocks = plotter.actors["blocks"].mapper.dataset
            (name,) = (key for key in blocks.cell_data if key.startswith("displacement"))
            factor = {"mm": 1e-3, "m": 1.0}[re.search(r"\((\w+)\)", name)[1]]
            drawn = {}
            for cell in range(blocks.n_cells):
                number = int(blocks.cell_data["block"][cell])
                drawn.setdefault(number, []).append(blocks.get_cell(cell).points)
                expected = [0.0, 5e-3, 1e-3][number]
                assert factor * blocks.cell_data[name][cell] == pytest.approx(expected)
                is_coloured = number > 0
                shown = blocks.cell_data["coloured by"][cell]
                assert shown == (blocks.cell_data[name][cell] if is_coloured else -1.0)
            assert {number: len(faces) for number, faces in drawn.items()} == {0: 6, 1: 6, 2: 6}
            half = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            cosine, sine = np.cos(TURN), np.sin(TURN)
            west = half @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
            for number, corners in (
                (1, west + np.array([-3 + 3e-3, 0, 1 + 4e-3])),
                (2, half + np.array([3, 1e-3, 1])),
            ):
                points = np.unique(np.concatenate(drawn[number]).round(6), axis=0)
                np.testing.assert_allclose(points, np.unique(corners.round(6), axis=0), atol=2e-6)
            assert plotter.actors["blocks"].mapper.scalar_range == pytest.approx((0.0, 5.0))
            marked = plotter.actors["marked"].mapper.dataset
            assert set(marked.cell_data["block"]) == {1}
            assert marked.n_cells == 12  # edges of a box
            assert plotter.actors["edges"].mapper.dataset.n_cells == 36
            hatching = plotter.actors["rough direction"].mapper.dataset
            on_west = hatching.extract_cells(np.flatnonzero(hatching.cell_data["block"] == 1))
            ends = on_west.points.reshape(-1, 2, 3)
            line = ends[0, 1] - ends[0, 0]
            angle = np.radians(ROUGH) + TURN  # the lines turn with the block
            assert np.cross(line, [-np.sin(angle), np.cos(angle), 0.0]) == pytest.approx(
                0, abs=1e-5
            )
            assert plotter.camera.parallel_projection
        finally:
            plotter.close()

    def test_as_many_blocks_are_outlined_as_are_unstable(self):
        statics = Statics(load("wall-3d-shaken"))
        unstable = statics.solve().unstable
        assert unstable.sum() == 27
        plotter = SpacePictures(Drawing(statics, unstable)).plotter(0, 200)
        try:
            marked = plotter.actors["marked"].mapper.dataset
            assert set(marked.cell_data["block"]) == set(np.flatnonzero(unstable))
            assert "rough direction" not in plotter.actors
        finally:
            plotter.close()

    def test_removed_blocks_have_no_cells(self, drawing, moved):
        displacement = moved.displacement.copy()
        displacement[1] = np.nan
        gone = Motion(displacement, moved.rotation)
        pictures = SpacePictures(drawing, [drawing.as_drawn, gone], by="displacement")
        plotter = pictures.plotter(1, 100)
        try:
            assert {0, 2} == set(plotter.actors["blocks"].mapper.dataset.cell_data["block"])
            assert {0, 2} == set(plotter.actors["edges"].mapper.dataset.cell_data["block"])
            assert "marked" not in plotter.actors
        finally:
            plotter.close()

    def test_pixels_have_the_colour_of_the_state_at_the_place_of_the_block(self, drawing):
        pictures = SpacePictures(drawing)
        image = pictures.render(0, 800)
        assert image.shape[2] == 4
        rows, columns = image.shape[:2]
        assert columns / rows == pytest.approx(np.divide(*(pictures.high - pictures.low)), rel=0.01)
        for top, state in (([-3, 0, 2], "unstable"), ([3, 0, 2], "stable"), ([0, 0, 0], "fixed")):
            place = (pictures._project(np.array(top, float)) - pictures.low) / (
                pictures.high - pictures.low
            )
            pixel = image[round((1 - place[1]) * rows), round(place[0] * columns)] / 255.0
            assert pixel[3] == 1.0
            colour = np.array(to_rgb(STATE_COLOURS[state]))  # shaded: as bright or darker
            shade = pixel[:3].max() / colour.max()
            assert 0.5 < shade <= 1.01
            np.testing.assert_allclose(pixel[:3], shade * colour, atol=0.03)
        assert image[0, 0, 3] == 0  # nothing is drawn in the corner

    def test_texts_scale_bar_and_compass(self, drawing, moved, monkeypatch):
        saved = []
        monkeypatch.setattr(space_pictures, "written", lambda figure, path: saved.append(figure))
        monkeypatch.setattr(space_pictures, "PIXELS", 300)
        by_state = SpacePictures(drawing)
        by_state.write("unused.png", "without equilibrium")
        SpacePictures(drawing, [drawing.as_drawn, moved], by="displacement").write("unused.png")
        labels = [[text.get_text() for text in one.legends[0].get_texts()] for one in saved]
        assert labels == [
            ["fixed: 1 block", "stable: 1 block", "unstable: 1 block",
             "rough direction of the joints"],
            ["fixed", "unstable block", "rough direction of the joints"],
        ]  # fmt: skip
        assert [one.get_suptitle() for one in saved] == ["known blocks"] * 2
        (bar,) = (axis for axis in saved[1].axes if axis.get_xlabel())
        assert bar.get_xlabel() == "displacement since the start (mm)"
        assert bar.get_xlim() == pytest.approx((0.0, 5.0))
        assert bar._colorbar.cmap is DISPLACEMENT_COLOURS
        for figure in saved:
            axes = next(axis for axis in figure.axes if axis.images)
            texts = {text.get_text() for text in axes.texts}
            (line,) = (line for line in axes.lines if line.get_gid() == "scale bar")
            length = np.ptp(line.get_xdata())
            assert f"{length:g} m" in texts
            assert {"N", "up"} <= texts
            # a block of 2 m lies between its corners in the picture: the axes count in metres
            right = by_state.right
            assert np.ptp(axes.get_xlim()) == pytest.approx(
                1.04 * np.ptp(drawing.solids[0].vertices @ right), rel=0.05
            )
            arrows = {text.get_gid(): np.subtract(text.xy, text.get_position())
                      for text in axes.texts if text.get_gid() in ("N", "up")}  # fmt: skip
            for name, axis in (("N", [0, 1, 0]), ("up", [0, 0, 1])):
                seen = np.array([by_state.right @ axis, by_state.up @ axis])
                direction = arrows[name] / np.linalg.norm(arrows[name])
                np.testing.assert_allclose(direction, seen / np.linalg.norm(seen), atol=1e-9)
        (note,) = (text.get_text() for text in saved[0].axes[0].texts if text.get_gid() == "note")
        assert note == "without equilibrium"

    def test_commands_write_pictures(self, tmp_path, monkeypatch, capsys):
        drawn = []

        def remember(self, path, note=""):
            drawn.append((self, path.name, note))

        monkeypatch.setattr(SpacePictures, "write", remember)
        monkeypatch.setattr(SpacePictures, "animation", remember)
        assert main(["wedge-across", "--until", "0.1", "--out", str(tmp_path)]) == 0
        assert json.loads((tmp_path / "summary.json").read_text())["files"] == [
            "history.csv", "blocks.csv", "view.html", "start.png", "joints.png", "final.png",
            "motion.gif",
        ]  # fmt: skip
        assert [row[1:] for row in drawn[:3]] == [
            ("start.png", "without equilibrium"),
            ("joints.png", "pulled apart to show the joints"),
            ("final.png", "t = 0.10 s"),
        ]
        assert drawn[0][0].marked.sum() == 1
        animation, name, times = drawn[3]
        assert name == "motion.gif"
        assert animation.by == "displacement"
        assert times[0] == 0.0
        assert times[-1] == pytest.approx(0.1, rel=0.01)
        assert len(animation.motions) == len(times)
        with (tmp_path / "blocks.csv").open(newline="") as file:
            displacements = [float(row["displacement_m"]) for row in csv.DictReader(file)]
        assert animation.motions[-1].distances == pytest.approx(displacements, abs=1e-12)
        assert max(displacements) == pytest.approx(animation.max_distance)
        assert main(["strength-reduction", "wedge", "--out", str(tmp_path / "strength")]) == 0
        pictures, name, note = drawn[-1]
        assert name == "initiating.png"
        assert note == "factor of safety 1.14"
        assert [pictures.drawing.names[i] for i in np.flatnonzero(pictures.marked)] == ["slope 4"]
        assert not pictures.drawing.unstable.any()
        assert "pictures of the failure" in capsys.readouterr().out

    def test_an_animation_has_all_frames(self, drawing, moved, tmp_path, monkeypatch):
        from PIL import Image

        monkeypatch.setattr(space_pictures, "ANIMATION_PIXELS", 150)
        notes = []
        draw = SpacePictures.draw

        def remember(self, axes, i, note="", pixels=0):
            notes.append((i, note))
            draw(self, axes, i, note, pixels)

        monkeypatch.setattr(SpacePictures, "draw", remember)
        path = tmp_path / "motion.gif"
        pictures = SpacePictures(drawing, [drawing.as_drawn, moved], by="displacement")
        pictures.animation(path, [0.0, 0.25])
        assert notes == [(0, "t = 0.00 s"), (1, "t = 0.25 s")]
        with Image.open(path) as image:
            assert image.n_frames == 2


def test_a_picture_without_pyvista_names_the_remedy(drawing, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    with pytest.raises(ImportError, match=r"pip install 'jointlaw\[view\]'"):
        SpacePictures(drawing).plotter(0)
    assert isinstance(SpacePictures(drawing).figure()[0], Figure)  # what matplotlib draws alone
