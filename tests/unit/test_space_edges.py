"""Contacts of blocks in space along edges, at corners, and of edges that cross."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem_demo.space.contacts import Surfaces, contact_axes, contact_rows, find_contacts
from dem_demo.space.solids import box, convex_hull

FLOOR = box([6.0, 6.0, 1.0], [0.0, 0.0, -0.5])
REACH = 1e-3
STRIP = 0.05
WIDER = 5e-3  # strips: their lowest line is a mean along the border of a polygon, ends included


def placed(solid, rotation, lowest=0.0):
    """A solid rotated by a rotation vector (3,) in degrees, its lowest vertex at a height (m)."""
    turned = solid.rotated(Rotation.from_rotvec(np.radians(rotation)).as_matrix())
    return turned.moved(np.array([0.0, 0.0, lowest - turned.vertices[:, 2].min()]))


def contacts_of(*solids):
    surfaces = Surfaces(solids, np.ones(len(solids), bool))
    reach = np.full(len(solids), REACH)
    return surfaces, find_contacts(surfaces, reach, 0.1, corner_length=STRIP)


def both_orders(solid, other):
    """Surfaces and contacts of two solids in both orders, and the number of the second one."""
    return [(*contacts_of(solid, other), 1), (*contacts_of(other, solid), 0)]


@pytest.mark.parametrize("depth", [-3e-4, 0.0, 2e-4])
@pytest.mark.parametrize("tilt", [6.0, 30.0, 44.0])
def test_an_edge_on_a_face(tilt, depth):
    """Both ends of the edge carry the strip along it, in the direction of the face."""
    block = placed(box([1.0, 2.0, 1.5]), [0.0, tilt, 0.0], -depth)
    for surfaces, points, number in both_orders(FLOOR, block):
        assert (points.plane_is_of_a == (number == 1)).all()
        normal = points.normal_to_a * (1.0 if number == 0 else -1.0)
        assert normal == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(normal), 1)), abs=1e-15)
        touches = points.closure > depth - 1e-9
        assert points.closure[touches] == pytest.approx([depth] * 2, abs=1e-15)
        assert sorted(points.point[touches, 1]) == pytest.approx([-1.0, 1.0])
        assert points.area.sum() == pytest.approx(2 * STRIP * 2.0, rel=WIDER)
        assert points.area[touches] == pytest.approx([STRIP * 2.0 / 2] * 2, rel=WIDER)
        raised = STRIP * np.tan(np.radians(tilt))
        assert points.closure[~touches] == pytest.approx(depth - raised, abs=WIDER * raised)
        assert (surfaces.block_of_face[points.face_a] == 0).all()


def test_the_strip_widens_from_five_to_two_degrees():
    """From the strip to the whole face, without a jump at either end."""
    areas = []
    for tilt in (1.999, 2.001, 2.5, 3.5, 4.5, 4.999, 5.001, 8.0):
        block = placed(box([1.0, 2.0, 1.5]), [0.0, tilt, 0.0])
        areas.append([points.area.sum() for _, points, _ in both_orders(FLOOR, block)])
    areas = np.array(areas)
    assert areas[:, 0] == pytest.approx(areas[:, 1], rel=2e-3)  # planes of the floor and the block
    assert areas[0] == pytest.approx([2.0] * 2, rel=2e-3)
    assert areas[1] == pytest.approx([2.0] * 2, rel=2e-3)
    assert (np.diff(areas[1:6], axis=0) < 0).all()
    assert areas[5:] == pytest.approx(np.full((3, 2), 4 * STRIP), rel=WIDER)


@pytest.mark.parametrize("shift", [0.05, 0.0])
@pytest.mark.parametrize("roll", [0.0, 0.01])
@pytest.mark.parametrize("tilt", [3.0, 8.0, 25.0])
def test_an_edge_on_a_block_with_flush_sides(tilt, roll, shift):
    """The edge ends at the sides of both blocks, and lies on the face, or along its border. A
    contact sees the deepest vertex, although edges cross there; a roll (degrees) about the other
    axis lifts one end."""
    low = box([1.0, 2.0, 1.0], [0.0, 0.0, -0.5])
    block = placed(box([1.0, 2.0, 1.5]), [0.0, tilt, 0.0], -2e-4)
    block = block.moved(
        np.array([0.5 - shift - block.vertices[block.vertices[:, 2].argmin(), 0], 0, 0])
    )
    block = block.rotated(Rotation.from_rotvec([np.radians(roll), 0.0, 0.0]).as_matrix())
    depth = -block.vertices[:, 2].min()
    for _, points, _ in both_orders(low, block):
        assert points.closure.max() == pytest.approx(depth, rel=0.1)
        touches = points.closure > 0
        if roll == 0:
            assert points.area[touches].sum() == pytest.approx(points.area.sum() / 2, rel=1e-6)
            assert points.area[touches].sum() >= STRIP * 2.0 * (1 - 1e-6)
        else:
            assert points.area[touches].sum() > 0.5 * STRIP


def test_a_corner_on_a_face():
    """One point of the triangle at the corner touches; it lies at the corner."""
    cube = placed(box([1.0, 1.0, 1.0]), [40.0, 30.0, 0.0], -1e-5)
    corner = cube.vertices[cube.vertices[:, 2].argmin()]
    for _, points, _ in both_orders(FLOOR, cube):
        assert len(points.area) == 3
        touching = points.closure.argmax()
        assert points.closure[touching] == pytest.approx(1e-5)
        assert points.point[touching] == pytest.approx(corner)
        assert sorted(points.closure)[1] < -0.1 * STRIP
        assert 0.1 * STRIP**2 < points.area[touching] < 10 * STRIP**2


@pytest.mark.parametrize("angle", [90.0, 35.0])
def test_edges_that_cross(angle):
    """Two bars on their edges, one across the other: one point where the edges cross, with the
    area of the overlap of two strips along them."""
    low = placed(box([3.0, 0.4, 0.4]), [45.0, 0.0, 0.0])
    low = low.moved(np.array([0.0, 0.0, -low.vertices[:, 2].max()]))
    high = placed(box([3.0, 0.4, 0.4]), [45.0, 0.0, 0.0])
    high = placed(high, [0.0, 0.0, angle], -2e-4).moved(np.array([0.3, 0.0, 0.0]))
    for _, points, number in both_orders(low, high):
        assert points.closure == pytest.approx([2e-4])
        assert points.normal_to_a[0, 2] == pytest.approx(1.0 if number == 0 else -1.0)
        assert points.point[0, :2] == pytest.approx([0.3, 0.0], abs=1e-12)
        sine = np.hypot(np.sin(np.radians(angle)), STRIP / 3.0)  # no longer than an edge
        assert points.area == pytest.approx([STRIP**2 / sine])


def test_blocks_that_meet_along_two_edges_have_no_joint():
    """Diagonal neighbours of a grid, flush and with a sharp edge over an edge, and at a vertex."""
    cube = box([1.0, 1.0, 1.0])
    for shift in ([1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, 0.4]):
        assert not len(contacts_of(cube, cube.moved(np.array(shift)))[1].area)
    x = [[0.5, 0.5], [1.5, 0.5], [2.5, 1.5], [1.5, 1.5]]
    wedge = convex_hull(np.array([[u, v, w] for u, w in x for v in (-0.5, 0.5)]))
    assert not len(contacts_of(cube, wedge)[1].area)


def test_blocks_beyond_the_range_have_no_contact():
    block = placed(box([1.0, 2.0, 1.5]), [0.0, 30.0, 0.0], 2.1 * REACH)
    assert not len(contacts_of(FLOOR, block)[1].area)


LOW = box([0.5, 1.0, 1.0], [-0.25, 0.0, -0.5])
POSES = {  # rotation vector in degrees, of a box on the floor, on a block, or across a bar
    "edge": (FLOOR, [1.0, 2.0, 1.5], [0.0, 25.0, 12.0]),
    "between": (FLOOR, [1.0, 2.0, 1.5], [0.0, 3.4, 12.0]),
    "corner": (FLOOR, [1.0, 1.0, 1.0], [40.0, 30.0, 5.0]),
    "across the border": (LOW, [0.5, 0.8, 1.5], [0.0, 15.0, 12.0]),
    "rolled across the border": (LOW, [0.5, 0.8, 1.5], [0.04, 15.0, 12.0]),
    "crossing": (None, [3.0, 0.4, 0.4], [45.0, 0.0, 0.0]),
}


def pose(name):
    low, size, rotation = POSES[name]
    solid = placed(box(size), rotation)
    if low is None:
        low = solid.moved(np.array([0.0, 0.0, -solid.vertices[:, 2].max()]))
        solid = placed(solid, [0.0, 0.0, 70.0])
    if low is LOW:
        solid = placed(placed(box(size), [0.0, rotation[1], 0.0]), [0.0, 0.0, rotation[2]])
        solid = placed(solid, [rotation[0], 0.0, 0.0], -2e-4)
        lowest = np.argsort(solid.vertices[:, 2])[:2]  # an edge, its middle next to the border
        solid = solid.moved(np.array([-solid.vertices[lowest, 0].mean(), 0.0, 0.0]))
    return low, solid.moved(np.array([0.01, 0.02, -2e-4]))


def place_moved(surfaces, position, rotation, motion, amount):
    """Place two blocks at these places, one of their twelve motions (m or rad) added."""
    block, axis = divmod(motion, 6)
    surfaces.position[:] = position
    surfaces.rotation[:] = rotation
    if axis < 3:
        surfaces.position[block, axis] += amount
    else:
        turn = Rotation.from_rotvec(amount * np.eye(3)[axis - 3]).as_matrix()
        surfaces.rotation[block] = rotation[block] @ turn
    surfaces.place()


@pytest.mark.parametrize("name", [*POSES])
@pytest.mark.parametrize("order", [0, 1])
def test_rates_of_closure_are_its_derivatives(name, order):
    """Rates of the closures of touching points by all twelve motions, against differences of the
    closures of contacts that are found anew: points that slide along an edge, such as crossings,
    change it in second order only."""
    low, high = pose(name)
    solids = (low, high) if order else (high, low)
    surfaces, points = contacts_of(*solids)
    axes = contact_axes(surfaces, points, np.tile([0.3, 1.0, 0.2], (len(points.area), 1)))
    rows = contact_rows(surfaces, points, axes)
    touches = points.closure > 0
    assert touches.any()
    position, rotation = surfaces.position.copy(), surfaces.rotation.copy()
    step = 1e-6
    for motion in range(12):
        closures = []
        for sign in (1.0, -1.0):
            place_moved(surfaces, position, rotation, motion, sign * step)
            reach = np.full(2, REACH)
            moved_points = find_contacts(surfaces, reach, 0.1, corner_length=STRIP)
            closures.append(moved_points.closure[touches])
        derivative = (closures[0] - closures[1]) / (2 * step)
        assert rows.kinematics[touches, 0, motion] == pytest.approx(derivative, abs=2e-6)


STIFFNESS = 1e9  # Pa/m


def energy_of(points):
    """Energy (J) of elastic joints of these points."""
    return float(points.area @ (0.5 * STIFFNESS * np.maximum(points.closure, 0.0) ** 2))


@pytest.mark.parametrize("name", [*POSES])
@pytest.mark.parametrize("order", [0, 1])
def test_forces_are_derivatives_of_the_stored_energy(name, order):
    """Forces and moments of elastic joints on both blocks, the change of areas included, against
    differences of the energy of contacts that are found anew."""
    low, high = pose(name)
    surfaces, points = contacts_of(*((low, high) if order else (high, low)))
    rows = contact_rows(
        surfaces,
        points,
        contact_axes(surfaces, points, np.tile([0.3, 1.0, 0.2], (len(points.area), 1))),
    )
    closure = np.maximum(points.closure, 0.0)
    joint_force = np.zeros((len(closure), 3))
    joint_force[:, 0] = points.area * STIFFNESS * closure
    force = rows.assemble_forces(2, joint_force, 0.5 * STIFFNESS * closure**2).ravel()
    position, rotation = surfaces.position.copy(), surfaces.rotation.copy()
    step = 1e-7
    derivative = np.zeros(12)
    for motion in range(12):
        energies = []
        for sign in (1.0, -1.0):
            place_moved(surfaces, position, rotation, motion, sign * step)
            points = find_contacts(surfaces, np.full(2, REACH), 0.1, corner_length=STRIP)
            energies.append(energy_of(points))
        derivative[motion] = (energies[0] - energies[1]) / (2 * step)
    assert force == pytest.approx(-derivative, abs=2e-5 * np.abs(force).max())
    if name not in ("corner", "crossing"):  # the change of areas matters
        fixed = rows.assemble_forces(2, joint_force).ravel()
        assert np.abs(fixed + derivative).max() > 1e-4 * np.abs(force).max()
