"""Solids in space: moments, cuts, files of surfaces, and rocks cut along joint sets."""

import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem_demo.scene import Files
from dem_demo.space.cutting import (
    PlaneSet,
    cut_rock,
    direction_in_plane,
    estimate_block_count,
    plane_normal,
)
from dem_demo.space.meshes import read_solid
from dem_demo.space.solids import OUTLINE, Solid, box, convex_hull, convex_solid, extruded

ROCK = box([10.0, 10.0, 10.0], [5.0, 5.0, 5.0])
SETS = [
    PlaneSet(35.0, 160.0, 1.6, "a", scatter=0.3),
    PlaneSet(70.0, 60.0, 1.9, "b", scatter=0.3),
    PlaneSet(75.0, 300.0, 1.9, "c", scatter=0.3),
]
TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def assert_closed(solid):
    """Every edge belongs to two faces that run along it in opposite directions."""
    edges = [e for f in solid.faces for e in zip(f, f[1:] + f[:1], strict=True)]
    assert len(edges) == len({*edges})
    assert {(b, a) for a, b in edges} == {*edges}
    assert len(solid.vertices) - len(edges) // 2 + len(solid.faces) == 2  # Euler


def assert_convex(solid, tolerance=1e-6):
    heights = solid.vertices @ solid.face_normals.T
    starts = [face[0] for face in solid.faces]
    on_face = heights[starts, range(len(starts))]
    assert (heights <= on_face + tolerance).all()


def test_moments_of_a_box_a_tetrahedron_and_a_distant_solid():
    """Closed forms; 1e7 m from the origin 1e-9 of the side is lost to rounding."""
    solid = box([2.0, 3.0, 4.0], [1e7, -1e7, 5.0])
    assert solid.volume == pytest.approx(24.0, rel=1e-8)
    assert solid.centroid == pytest.approx([1e7, -1e7, 5.0], abs=1e-8)
    by_hand = np.diag([3**2 + 4**2, 2**2 + 4**2, 2**2 + 3**2]) * 24 / 12
    assert solid.inertia == pytest.approx(by_hand, abs=1e-6)
    solid = convex_hull(TETRAHEDRON)
    assert solid.volume == pytest.approx(1 / 6, rel=1e-14)
    assert solid.centroid == pytest.approx([0.25] * 3, rel=1e-14)
    assert solid.inertia == pytest.approx(np.full((3, 3), 1 / 480) + np.eye(3) / 96, rel=1e-12)
    assert sorted(solid.face_areas) == pytest.approx([0.5, 0.5, 0.5, np.sqrt(3) / 2])


@pytest.mark.parametrize("seed", range(5))
def test_a_cut_keeps_volume_and_moments_and_its_parts_fit(seed):
    """Both parts are closed and convex and share the new face, which remembers its set."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=seed).as_matrix()
    solid = box([1.0, 2.0, 0.7]).rotated(rotation)
    normal = rng.standard_normal(3)
    normal /= np.linalg.norm(normal)
    below, above = solid.split(normal, 0.1, 7, 1e-9)
    for part in (below, above):
        assert_closed(part)
        assert_convex(part, 1e-12)
        assert part.face_sets.count(7) == 1
    assert below.volume + above.volume == pytest.approx(solid.volume, rel=1e-13)
    first = below.volume * below.centroid + above.volume * above.centroid
    assert first == pytest.approx(solid.volume * solid.centroid, abs=1e-13)
    new = below.face_sets.index(7), above.face_sets.index(7)
    assert below.face_normals[new[0]] == pytest.approx(normal, abs=1e-12)
    assert above.face_normals[new[1]] == pytest.approx(-normal, abs=1e-12)
    assert below.face_areas[new[0]] == pytest.approx(above.face_areas[new[1]], rel=1e-12)


def test_a_cut_through_corners_edges_and_beside_a_solid():
    """Vertices in the plane belong to both parts; a plane along a face cuts nothing."""
    cube = box([2.0, 2.0, 2.0])
    diagonal = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    below, above = cube.split(diagonal, 0.0, 1, 1e-9)
    assert (below.volume, above.volume) == pytest.approx((4.0, 4.0), rel=1e-14)
    assert len(below.vertices) == len(above.vertices) == 6
    assert_closed(below)
    x = np.array([1.0, 0.0, 0.0])
    assert cube.split(x, 1.0, 1, 1e-9) == (cube, None)
    assert cube.split(x, -1.0 + 1e-12, 1, 1e-9) == (None, cube)
    corner = np.ones(3) / np.sqrt(3.0)
    below, above = cube.split(corner, np.sqrt(3.0) - 1e-3, 1, 1e-9)
    assert len(above.faces) == 4
    assert above.volume == pytest.approx(np.sqrt(3.0) / 2 * 1e-9, rel=1e-6)


def test_a_mirror_and_a_polygon_extruded():
    solid = box([1.0, 2.0, 3.0]).rotated(np.diag([-1.0, 1.0, 1.0]))
    assert solid.volume == pytest.approx(6.0)
    solid = extruded(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]), 1.0, 3.0)
    assert_closed(solid)
    assert_convex(solid, 1e-12)
    assert solid.volume == pytest.approx(3.0)
    assert solid.centroid == pytest.approx([2 / 3, 2.5, 1 / 3])


def test_dip_and_dip_direction():
    """A plane that dips by 30 degrees to the east; the rough direction turns towards the north."""
    assert plane_normal(30.0, 90.0) == pytest.approx([0.5, 0.0, np.sqrt(0.75)])
    down = direction_in_plane(30.0, 90.0, 0.0)
    assert down == pytest.approx([np.sqrt(0.75), 0.0, -0.5])
    assert direction_in_plane(30.0, 90.0, 90.0) == pytest.approx([0.0, 1.0, 0.0])
    for dip, azimuth, angle in ((10, 20, 30), (80, 200, 70), (0, 10, 45), (90, 300, -20)):
        direction = direction_in_plane(dip, azimuth, angle)
        assert direction @ plane_normal(dip, azimuth) == pytest.approx(0.0, abs=1e-15)
        assert np.linalg.norm(direction) == pytest.approx(1.0)


def test_a_regular_grid_is_exact():
    sets = [PlaneSet(0, 0, 2.0, "a"), PlaneSet(90, 0, 5.0, "a"), PlaneSet(90, 90, 1.0, "a")]
    pieces = cut_rock(ROCK, sets, seed=0, min_width=0.1)
    assert (len(pieces.solids), pieces.merged, pieces.dropped) == (100, 0, [])
    for solid in pieces.solids:
        assert np.ptp(solid.vertices, axis=0) == pytest.approx([1.0, 5.0, 2.0], abs=1e-12)
        on_outline = np.isclose(solid.vertices, 0.0).any() or np.isclose(solid.vertices, 10.0).any()
        assert (OUTLINE in solid.face_sets) == on_outline


@pytest.mark.parametrize("seed", range(3))
def test_blocks_are_convex_wide_enough_and_fill_the_rock(seed):
    """Only reported slivers are lost; each face of a set lies in a plane of this set."""
    pieces = cut_rock(ROCK, SETS, seed, min_width=0.3)
    assert pieces.merged > 10
    lost = sum(sliver.volume for sliver in pieces.dropped)
    assert lost < 0.5
    assert sum(solid.volume for solid in pieces.solids) == pytest.approx(1000.0 - lost, rel=1e-9)
    for solid in pieces.solids:
        assert_closed(solid)
        assert_convex(solid)
        assert solid.width >= 0.3
        for number, normal in zip(solid.face_sets, solid.face_normals, strict=True):
            if number != OUTLINE:
                assert abs(normal @ SETS[number].normal) == pytest.approx(1.0, abs=1e-9)
            else:
                assert np.abs(normal).max() == pytest.approx(1.0, abs=1e-9)


def test_a_distant_rock_is_cut_alike():
    """At the coordinates of a map the blocks are the same up to their rounding."""
    shift = np.array([6.0e5, 5.4e6, 800.0])
    far = [PlaneSet(**{**vars(one), "through": tuple(shift)}) for one in SETS]
    near = cut_rock(ROCK, SETS, 1, 0.3).solids
    displaced = cut_rock(ROCK.moved(shift), far, 1, 0.3).solids
    volumes = [sorted(solid.volume for solid in solids) for solids in (near, displaced)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-6)


def test_the_number_of_blocks_is_estimated_before_cutting():
    """Within a quarter of the number cut, slivers included; 1e9 blocks at once."""
    for persistence in (1.0, 0.8):
        sets = [PlaneSet(**{**vars(one), "persistence": persistence}) for one in SETS]
        count = len(cut_rock(ROCK, sets, 0, 0.0).solids)
        assert estimate_block_count(ROCK, sets) == pytest.approx(count, rel=0.25)
    fine = [PlaneSet(**{**vars(one), "spacing": 1e-2}) for one in SETS]
    assert estimate_block_count(ROCK, fine) > 3e8


def test_persistence_is_the_share_of_area_that_is_a_joint():
    sets = [PlaneSet(0, 0, 0.5, "bed"), PlaneSet(90, 0, 0.5, "cross", persistence=0.3)]
    count = len(cut_rock(ROCK, sets, 3, 0.1).solids)
    fraction = (count - 20) / (20 * 19)
    assert fraction == pytest.approx(0.3, abs=3 * np.sqrt(0.3 * 0.7 / (20 * 19)))  # three sigma


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.append(TETRAHEDRON, [[0.1, 0.1, 0.1]], axis=0), "must be convex"),
        (np.append(TETRAHEDRON, TETRAHEDRON[:1], axis=0), "same place"),
        (TETRAHEDRON * [1.0, 1.0, 0.0], "volume is zero"),
        (TETRAHEDRON[:3], "volume is zero"),
    ],
)
def test_corners_of_no_convex_solid_are_refused(points, message):
    with pytest.raises(ValueError, match=message):
        convex_solid(points)


def obj(vertices, faces):
    lines = [f"v {x} {y} {z}" for x, y, z in np.asarray(vertices).tolist()]
    return "\n".join([*lines, *("f " + " ".join(str(v + 1) for v in face) for face in faces)])


CUBE = box([1.0, 1.0, 1.0])
DENTED = [*CUBE.vertices.tolist(), [0.0, 0.0, 0.2]]
DENTED_FACES = [f for f in CUBE.faces if f != (4, 5, 7, 6)]
DENTED_FACES += [(4, 5, 8), (5, 7, 8), (7, 6, 8), (6, 4, 8)]


def test_solids_from_obj_and_stl_files(tmp_path):
    """One cube: quadrangles, triangles with texture numbers, ASCII and binary STL."""
    rotation = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    vertices = CUBE.vertices @ rotation.T
    corners = vertices[CUBE.triangles]
    (tmp_path / "quads.obj").write_text(obj(vertices, CUBE.faces))
    triangles = obj(vertices, CUBE.triangles.tolist())
    lines = [
        " ".join([word + "/1/2" if line[0] == "f" and i else word for i, word in enumerate(words)])
        for line in triangles.splitlines()
        for words in [line.split()]
    ]
    (tmp_path / "triangles.obj").write_text("# cube\n" + "\n".join(lines))
    text = "\n".join(f"  vertex {x} {y} {z}" for x, y, z in corners.reshape(-1, 3).tolist())
    (tmp_path / "ascii.stl").write_text(f"solid cube\n{text}\nendsolid\n")
    binary = b"cube".ljust(80) + struct.pack("<I", len(corners))
    for triangle in corners:
        binary += struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0)
    (tmp_path / "binary.STL").write_bytes(binary)
    files = Files(tmp_path)
    for name in ("quads.obj", "triangles.obj", "ascii.stl", "binary.STL"):
        solid = read_solid(name, files)
        assert (len(solid.vertices), len(solid.faces)) == (8, 6)
        assert solid.volume == pytest.approx(1.0, rel=1e-6)
    (tmp_path / "binary.STL").unlink()
    assert read_solid("binary.STL", files).volume == pytest.approx(1.0, rel=1e-6)  # as saved


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("dent.obj", obj(DENTED, DENTED_FACES), "not convex"),
        ("open.obj", obj(CUBE.vertices, CUBE.faces[1:]), "not closed"),
        ("inside.obj", obj(CUBE.vertices, [f[::-1] for f in CUBE.faces]), "clockwise"),
        ("turned.obj", obj(CUBE.vertices, [CUBE.faces[0][::-1], *CUBE.faces[1:]]), "different"),
        ("empty.obj", "# nothing", "enclose no solid"),
        ("number.obj", obj(CUBE.vertices, [(0, 1, 9), *CUBE.faces]), "vertex that is not there"),
        ("cube.ply", "ply", "OBJ or STL"),
        ("cube.stl", "solid cube", "no triangles"),
        ("flat.obj", obj(CUBE.vertices * [1, 1, 0], CUBE.faces), "volume is zero"),
    ],
)
def test_files_of_no_convex_solid_are_refused_by_name(name, text, message):
    with pytest.raises(ValueError, match=rf"(?s){name}.*{message}"):
        read_solid(name, Files(known={name: text}))


def test_a_file_that_is_missing_is_named():
    with pytest.raises(ValueError, match=r"no-such\.obj.*No such file"):
        read_solid("no-such.obj", Files())
    assert isinstance(CUBE, Solid)
