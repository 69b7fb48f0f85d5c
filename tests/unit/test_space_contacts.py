"""Contacts of blocks in space: polygons of overlaps, points, roles, and how they follow motions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapely import Polygon

from dem_demo.space.contacts import (
    Surfaces,
    contact_axes,
    contact_rows,
    dip_line,
    find_contacts,
    turned_from_dip,
)
from dem_demo.space.cutting import PlaneSet, cut_rock
from dem_demo.space.solids import box, convex_hull

BASE = box([4.0, 4.0, 1.0], [0.0, 0.0, -0.5])
REACH = 1e-3


def surfaces_of(*solids):
    return Surfaces(solids, np.ones(len(solids), bool))


def contacts_of(*solids, reach=REACH):
    surfaces = surfaces_of(*solids)
    return surfaces, find_contacts(surfaces, np.full(len(solids), reach), 0.1)


def rows_of(surfaces, points, axis_2):
    axes = contact_axes(surfaces, points, np.tile(axis_2, (len(points.area), 1)))
    return contact_rows(surfaces, points, axes)


def move(surfaces, i, displacement, rotation):
    """Move a block by a displacement (3,) in m and a rotation vector (3,) in rad."""
    surfaces.position[i] += displacement
    surfaces.rotation[i] = Rotation.from_rotvec(rotation).as_matrix() @ surfaces.rotation[i]
    surfaces.place()


def prism(corners, bottom=0.0, height=1.0):
    """A solid over a convex polygon (m, 2) in the x-y plane."""
    low = np.column_stack([corners, np.full(len(corners), bottom)])
    return convex_hull(np.concatenate([low, low + np.array([0.0, 0.0, height])]))


def test_a_box_on_a_box():
    """Four points, a quarter of the area each; the drawn gap is minus the closure."""
    for gap in (0.0, 4e-4, -2e-4):
        surfaces, points = contacts_of(BASE, box([1.0, 2.0, 1.0], [0.5, 0.2, 0.5 + gap]))
        assert points.block_a.tolist() == [0] * 4
        assert points.block_b.tolist() == [1] * 4
        assert points.area == pytest.approx([0.5] * 4, rel=1e-14)
        xy = sorted(points.point[:, :2].round(12).tolist())
        assert xy == [[0.0, -0.8], [0.0, 1.2], [1.0, -0.8], [1.0, 1.2]]
        rows = rows_of(surfaces, points, [1.0, 0.0, 0.0])
        assert rows.closure == pytest.approx([-gap] * 4, abs=1e-14)
    assert not len(contacts_of(BASE, box([1, 1, 1], [0, 0, 0.503]))[1].area)
    assert not len(contacts_of(BASE, box([1, 1, 1], [3.0, 0, 0.5]))[1].area)


@pytest.mark.parametrize("seed", range(20))
def test_the_overlap_of_two_polygons(seed):
    """Area and centroid as shapely finds them, for random convex polygons."""
    rng = np.random.default_rng(seed)
    shapes = [rng.uniform(-1, 1, (9, 2)) + rng.uniform(-0.5, 0.5, 2) for _ in range(2)]
    upper, lower = prism(shapes[0]), prism(shapes[1], -1.0)
    _, points = contacts_of(lower, upper)
    overlap = Polygon(shapes[0]).convex_hull & Polygon(shapes[1]).convex_hull
    assert points.area.sum() == pytest.approx(overlap.area, rel=1e-4)  # up to the ties
    centroid = points.area @ points.point[:, :2] / points.area.sum()
    assert centroid == pytest.approx([overlap.centroid.x, overlap.centroid.y], abs=1e-3)
    assert (points.area > 0).all()


def test_points_carry_area_and_first_moments_exactly():
    """The force of a closure that varies linearly acts where the integral over the overlap says."""
    triangle = np.array([[0.0, 0.0], [1.5, 0.2], [0.4, 1.1]])
    _, points = contacts_of(BASE, prism(triangle))
    assert points.area.sum() == pytest.approx(Polygon(triangle).area, rel=1e-13)
    centroid = points.area @ points.point[:, :2] / points.area.sum()
    assert centroid == pytest.approx(triangle.mean(axis=0), rel=1e-13)


def test_roles_follow_the_numbers_of_blocks():
    """Whatever block is larger or above: a is the first one, and its face carries the points."""
    small = box([1.0, 1.0, 1.0], [0.3, 0.0, 0.5])
    for solids in ((BASE, small), (small, BASE)):
        surfaces, points = contacts_of(*solids)
        assert (points.block_a == 0).all()
        assert (surfaces.block_of_face[points.face_a] == 0).all()
        assert points.area.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("tilt", [0.5, 1.9])
def test_points_of_tilted_faces_lie_on_one_of_them(tilt):
    """A corner of the face of b is fixed to b, over the plane of a; others lie on the face of a.
    Their closures are the depths of the tilted face, so a rebuild forgets nothing."""
    upper = box([1.0, 1.0, 1.0], [0.0, 0.0, 0.5])
    for solids, displaced in (((BASE, upper), 1), ((upper, BASE), 0)):
        surfaces = surfaces_of(*solids)
        move(surfaces, displaced, [0.0, 0.0, 0.0], [0.0, np.radians(tilt), 0.0])
        points = find_contacts(surfaces, np.full(2, REACH), 0.1)
        assert (points.plane_is_of_a == (displaced == 1)).all()  # corners of the smaller block
        face = np.where(points.plane_is_of_a, points.face_b, points.face_a)
        start = np.array([surfaces.ring(number)[0] for number in face])
        height = np.einsum("ki,ki->k", points.point - start, surfaces.normal[face])
        assert np.abs(height).max() < 1e-14
        rows = rows_of(surfaces, points, [0.0, 1.0, 0.0])
        assert np.ptp(rows.closure) == pytest.approx(np.sin(np.radians(tilt)), rel=0.05)


@pytest.mark.parametrize("order", [0, 1])
def test_a_tilted_block_that_slides_keeps_the_depth_of_its_corners(order):
    """On a base which it does not leave, and beyond whose edge half of it lies: the closures of its
    corners, found anew after a slip, are the same, and so are their rates, none by the slip."""
    upper = box([1.0, 1.0, 1.0], [0.0, 0.0, 0.5])
    number = 1 - order
    surfaces = surfaces_of(*((upper, BASE) if order else (BASE, upper)))
    move(surfaces, number, [0.0, 0.0, -1e-4], np.radians([1.2, -0.7, 0.0]))
    depth = []
    for slip in ([0.0, 0.0, 0.0], [0.3, 0.2, 0.0], [1.4, -0.1, 0.0]):
        move(surfaces, number, slip, [0.0, 0.0, 0.0])
        points = find_contacts(surfaces, np.full(2, REACH), 0.1)
        corners = surfaces.vertex[surfaces.first_vertex[number] : surfaces.first_vertex[number + 1]]
        distance = np.linalg.norm(points.point[:, None] - corners, axis=2)
        is_corner = distance.min(axis=1) < 1e-12
        own = distance.argmin(axis=1)[is_corner]
        depth.append(dict(zip(own.tolist(), points.closure[is_corner], strict=True)))
        rows = rows_of(surfaces, points, [0.0, 1.0, 0.0])
        slides = rows.kinematics[is_corner, 0, 6 * number : 6 * number + 2]
        assert slides == pytest.approx(np.zeros_like(slides), abs=1e-15)
    assert [len(found) for found in depth] == [4, 4, 2]
    for found in depth[1:]:
        assert found == pytest.approx({corner: depth[0][corner] for corner in found}, abs=1e-15)


def test_the_number_of_points_does_not_depend_on_rounding():
    """Two flush boxes in 300 poses that differ by 1e-8 m and rad: always four points."""
    surfaces = surfaces_of(BASE, box([4.0, 4.0, 1.0], [0.0, 0.0, 0.5]))
    position, rotation = surfaces.position[1].copy(), surfaces.rotation[1].copy()
    rng = np.random.default_rng(0)
    for _ in range(300):
        surfaces.position[1], surfaces.rotation[1] = position, rotation
        move(surfaces, 1, 1e-8 * rng.standard_normal(3), 1e-8 * rng.standard_normal(3))
        points = find_contacts(surfaces, np.full(2, REACH), 0.1)
        assert len(points.area) == 4
        assert points.area == pytest.approx([4.0] * 4, rel=1e-6)


@pytest.mark.parametrize("order", [0, 1])
def test_a_block_past_the_seam_of_its_bed_bears_on_the_top_of_the_next_block(order):
    """It is 2e-5 m deep, and its front 3 mm behind the side of the next block: no contact with
    this side."""
    next_bed = box([2.0, 4.0, 1.0], [3.0, 0.0, -0.5])
    slider = box([1.0, 1.0, 1.0], [1.503, 0.1, 0.5 - 2e-5])
    _, points = contacts_of(*[(next_bed, slider), (slider, next_bed)][order])
    assert len(points.area) == 4
    assert np.abs(points.normal[:, 2]) == pytest.approx([1.0] * 4)
    assert points.closure == pytest.approx([2e-5] * 4, rel=1e-9)
    assert points.area.sum() == pytest.approx(3e-3, rel=1e-9)
    assert (points.point[:, 0] < 2.0031).all()


def test_contacts_of_a_cut_rock_cover_all_joints():
    """Each joint face has one face, or several, on the other side."""
    sets = [
        PlaneSet(35.0, 160.0, 1.6, "a", scatter=0.3),
        PlaneSet(70.0, 60.0, 1.9, "b", scatter=0.3, persistence=0.7),
        PlaneSet(75.0, 300.0, 1.9, "c", scatter=0.3),
    ]
    solids = cut_rock(box([10.0, 10.0, 10.0]), sets, 1, 0.0).solids
    surfaces, points = contacts_of(*solids)
    joints = sum(s.face_areas[np.array(s.face_sets) >= 0].sum() for s in solids) / 2
    assert points.area.sum() == pytest.approx(joints, rel=1e-4)
    same = surfaces.face_sets[points.face_a] == surfaces.face_sets[points.face_b]
    assert same.all()
    assert points.contact[-1] + 1 == len({*zip(points.face_a, points.face_b, strict=True)})


def test_near_pairs_are_all_boxes_within_reach():
    """Beside a comparison of every box with every other."""
    rng = np.random.default_rng(3)
    solids = [box(rng.uniform(0.2, 1.0, 3), rng.uniform(0, 4, 3)) for _ in range(60)]
    is_mobile = rng.random(60) < 0.7
    surfaces = Surfaces(solids, is_mobile)
    reach = rng.uniform(0.0, 0.2, 60)
    low, high = surfaces.box.transpose(1, 0, 2)
    gap = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=2)
    near = (gap <= reach[:, None] + reach) & (is_mobile[:, None] | is_mobile)
    expected = np.argwhere(np.triu(near, 1))
    assert len(expected) > 50
    assert surfaces.near_pairs(reach).tolist() == expected.tolist()


def test_separation_of_solids():
    """Boxes side by side, in each other, and two edges that cross."""
    one = box([1.0, 1.0, 1.0])
    pairs = np.array([[0, 1]])
    for shift, expected in ((0.3, -0.7), (1.2, 0.2)):
        surfaces = surfaces_of(one, box([1.0, 1.0, 1.0], [shift, 0.1, 0.2]))
        assert surfaces.separations(pairs, 1e-9) == pytest.approx([expected], abs=1e-14)
    turn = Rotation.from_rotvec([np.pi / 4, 0.0, 0.0]).as_matrix()  # an edge along x on top
    alternative = Rotation.from_rotvec([0.0, np.pi / 4, 0.0]).as_matrix()  # an edge along y below
    for gap in (-0.01, 0.01):
        upper = one.rotated(alternative).moved(np.array([0.0, 0.0, np.sqrt(2.0) + gap]))
        surfaces = surfaces_of(one.rotated(turn), upper)
        assert surfaces.separations(pairs, 1e-9) == pytest.approx([gap], abs=1e-14)


def test_rows_are_the_rates_of_closure_and_shears():
    """Beside differences of closure and of the positions of the points under small motions."""
    turn = Rotation.from_rotvec([0.3, 0.5, -0.2]).as_matrix()
    rng = np.random.default_rng(1)
    solids = [
        BASE.rotated(turn),
        prism(np.array([[0.0, 0.0], [1.5, 0.2], [0.4, 1.1]])).rotated(turn),
    ]
    surfaces, points = contacts_of(*solids)
    k = len(points.area)
    axis_2 = turned_from_dip(surfaces.normal[points.face_b], np.full(k, 30.0))
    axes = contact_axes(surfaces, points, axis_2)
    rows = contact_rows(surfaces, points, axes)
    assert axes @ axes.transpose(0, 2, 1) == pytest.approx(np.tile(np.eye(3), (k, 1, 1)))
    start = [surfaces.position.copy(), surfaces.rotation.copy()]
    motions = 1e-6 * rng.standard_normal((2, 6))  # displacement; rotation about principal axes
    displaced = []
    for sign in (1.0, -1.0):
        surfaces.position[:], surfaces.rotation[:] = start
        for i in range(2):
            move(surfaces, i, sign * motions[i, :3], sign * start[1][i] @ motions[i, 3:])
        at = []
        for block in (points.block_a, points.block_b):
            arm = points.point - start[0][block]
            local = np.einsum("kij,ki->kj", start[1][block], arm)
            turned = np.einsum("kij,kj->ki", surfaces.rotation[block], local)
            at.append(surfaces.position[block] + turned)
        displaced.append(at[0] - at[1])
    relative = 0.5 * (displaced[0] - displaced[1])  # of a to b at the points
    expected = np.einsum("kci,ki->kc", axes, relative) * [-1.0, 1.0, 1.0]
    both = np.concatenate([motions[points.block_a], motions[points.block_b]], axis=1)
    assert np.einsum("kcm,km->kc", rows.kinematics, both) == pytest.approx(expected, abs=1e-15)


def test_axis_2_of_both_sides_of_a_plane():
    """The dip line turned counter-clockwise seen from above; horizontal planes from the north."""
    dip = np.radians(40.0)
    normal = np.array([[np.sin(dip), 0.0, np.cos(dip)]])  # dips to the east
    assert dip_line(normal)[0] == pytest.approx([np.cos(dip), 0.0, -np.sin(dip)])
    assert turned_from_dip(normal, np.array([90.0]))[0] == pytest.approx([0.0, 1.0, 0.0])
    flat = np.array([[0.0, 0.0, 1.0]])
    assert turned_from_dip(flat, np.array([90.0]))[0] == pytest.approx([-1.0, 0.0, 0.0])
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((20, 3))
    normals[10:, 2] = 0.0  # vertical planes
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    angles = rng.uniform(-180, 180, 20)
    one, alternative = turned_from_dip(normals, angles), turned_from_dip(-normals, angles)
    assert one == pytest.approx(alternative, abs=1e-12)
    assert np.einsum("ki,ki->k", one, normals) == pytest.approx(np.zeros(20), abs=1e-15)


def test_a_face_of_many_corners_is_refused():
    circle = np.linspace(0, 2 * np.pi, 66)[:-1]
    disc = prism(np.column_stack([np.cos(circle), np.sin(circle)]))
    with pytest.raises(ValueError, match="128 corners"):
        contacts_of(disc.moved(np.array([0.0, 0.0, -1.0])), disc)
    _, points = contacts_of(BASE, disc)
    area = Polygon(np.column_stack([np.cos(circle), np.sin(circle)])).area
    assert points.area.sum() == pytest.approx(area, rel=1e-12)
