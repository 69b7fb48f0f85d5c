"""Water on blocks in space: forces on faces against integrals over the wet part of a block, and
wedges with water against the formula of Hoek and Bray."""

from dataclasses import replace
from math import asin, atan, cos, degrees, radians, sin, tan

import numpy as np
import pytest
from scene_text import block, coulomb, lines
from wedges import WEDGES, line_of, wedge_text

from dem_demo.cli import main
from dem_demo.dynamics.relaxation import Verdict
from dem_demo.space.contacts import Surfaces
from dem_demo.space.cutting import plane_normal
from dem_demo.space.loads import SpaceStress, stress_on_faces
from dem_demo.space.read import parse
from dem_demo.space.solids import convex_hull
from dem_demo.space.statics import Statics
from dem_demo.space.strength import factor_of_safety

UNIT_WEIGHT = 9810.0
FRICTION = tan(radians(35.0))


def wet_part(solid, level):
    """The part of a solid below z = level . (1, x, y), None without any."""
    normal = np.array([-level[1], -level[2], 1.0])
    length = np.linalg.norm(normal)
    return solid.split(normal / length, level[0] / length, -1, 1e-12)[0]


@pytest.mark.parametrize("seed", range(6))
def test_the_stress_on_the_faces_of_a_block_adds_up_to_an_integral_over_its_wet_part(seed):
    """Gauss' theorem: with a profile u, the force is -S grad u times the volume below the level,
    and acts at the centroid of this part. For water this is the buoyancy. At rounding."""
    rng = np.random.default_rng(seed)
    solid = convex_hull(rng.normal(size=(12, 3)) * [3.0, 2.0, 1.0] + 10.0)
    level = np.array([0.0, *rng.normal(size=2) * 0.3])
    level[0] = rng.uniform(*np.quantile(solid.vertices @ [-level[1], -level[2], 1.0], [0.3, 0.7]))
    tensor = rng.normal(size=(3, 3)) if seed % 2 else np.eye(3)
    tensor = tensor + tensor.T
    surfaces = Surfaces([solid], np.ones(1))
    stress = SpaceStress(tensor, level, 7.0, 0.0, np.ones(len(solid.faces), bool))
    part = wet_part(solid, level)
    assert 0.1 < part.volume / solid.volume < 0.9
    force = -tensor @ (7.0 * np.array([level[1], level[2], -1.0])) * part.volume
    moment = np.cross(part.centroid - solid.centroid, force) @ surfaces.rotation[0]
    result = stress_on_faces(stress, surfaces)[0]
    assert result == pytest.approx(np.concatenate([force, moment]), abs=1e-11 * abs(force).max())
    # a level above the block, and one below it
    height = 100.0 * np.array([1.0, 0.0, 0.0])
    result = stress_on_faces(replace(stress, level=level + height), surfaces)[0]
    force *= solid.volume / part.volume
    assert result[:3] == pytest.approx(force, rel=1e-10)
    assert result[3:] == pytest.approx(np.zeros(3), abs=1e-10 * abs(force).max())
    assert not stress_on_faces(replace(stress, level=level - height), surfaces).any()


def test_faces_that_carry_no_stress_are_left_out():
    solid = convex_hull(np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)]))
    up = solid.face_normals[:, 2] < -0.5
    stress = SpaceStress(np.eye(3), np.array([3.0, 0.0, 0.0]), 10.0, 0.0, up)
    result = stress_on_faces(stress, Surfaces([solid], np.ones(1)))
    assert result[0, :3] == pytest.approx([0.0, 0.0, 3.0 * 10.0 * 2.0])


def angle(one, other):
    """Angle between two lines, 0 to 90 degrees, in rad."""
    cosine = abs(one @ other) / np.linalg.norm(one) / np.linalg.norm(other)
    return np.arccos(min(cosine, 1.0))


def hoek_and_bray(wedge, unit_weight, water_weight, friction, cohesion):
    """Factor of safety of a wedge whose planes carry the mean water pressure water_weight H / 6,
    with H the height of the wedge (Rock Slope Engineering, 3rd edition, chapter 8).

    The lines 1 to 5 of the book: planes a and b with the face (1, 2) and the upper slope (3, 4),
    and with each other (5).
    """
    normal_a, normal_b, face, top = (
        plane_normal(*p) for p in (wedge.a, wedge.b, wedge.face, wedge.top)
    )
    line = {
        1: np.cross(normal_a, face), 2: np.cross(normal_b, face), 3: np.cross(normal_a, top),
        4: np.cross(normal_b, top), 5: np.cross(normal_a, normal_b),
    }  # fmt: skip
    x = np.sin(angle(line[2], line[4])) / np.sin(angle(line[4], line[5]))
    x /= abs(line[2] @ normal_a) / np.linalg.norm(line[2])
    y = np.sin(angle(line[1], line[3])) / np.sin(angle(line[3], line[5]))
    y /= abs(line[1] @ normal_b) / np.linalg.norm(line[1])
    between = np.arccos(normal_a @ normal_b)
    plunge = asin(abs(line_of(wedge)[2]))
    dips = radians(wedge.a[0]), radians(wedge.b[0])
    a, b = (
        (cos(one) - cos(other) * cos(between)) / (sin(plunge) * sin(between) ** 2)
        for one, other in (dips, dips[::-1])
    )
    height = wedge_height(wedge)
    water = water_weight / (2 * unit_weight)
    return 3 / (unit_weight * height) * cohesion * (x + y) + friction * (
        (a - water * x) + (b - water * y)
    )


def wedge_height(wedge):
    """Height (m) of the line of intersection, from the toe to the upper slope."""
    statics = Statics(parse(wedge_text(wedge, coulomb())))
    free = int(np.flatnonzero(statics.is_free)[0])
    return float(np.ptp(statics.surfaces.solids[free].vertices @ [0, 0, 1]))


def with_water(wedge, share, cohesion, more=""):
    """A wedge with a share of the pressure of a wedge full of water in its joints."""
    pressure = share * UNIT_WEIGHT * wedge_height(wedge) / 6
    law = coulomb(FRICTION, cohesion=cohesion) + lines(pressure=pressure)
    return Statics(parse(wedge_text(wedge, law) + more))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0], ids=["dry", "half", "full"])
@pytest.mark.parametrize(
    ("number", "cohesion"), [(0, 4e4), pytest.param(3, 2e4, marks=pytest.mark.slow)]
)
def test_a_wedge_with_water_pressure_in_its_joints(number, cohesion, share):
    """Within 0.5 % of the formula of Hoek and Bray: dry, at half and at the full pressure."""
    wedge = WEDGES[number]
    statics = with_water(wedge, share, cohesion)
    expected = hoek_and_bray(wedge, 2600 * 9.81, share * UNIT_WEIGHT, FRICTION, cohesion)
    assert factor_of_safety(statics, tolerance=5e-4) == pytest.approx(expected, rel=5e-3)


def below_a_table(wedge, share):
    """A wedge with a water table that rises from the toe, by a share of the way from the lowest
    plane through the toe to the face; and its factor by hand."""
    text = wedge_text(wedge, coulomb(FRICTION))
    dry = Statics(parse(text))
    free = int(np.flatnonzero(dry.is_free)[0])
    solid = dry.surfaces.solids[free]
    plunge = tan(asin(-line_of(wedge)[2]))
    slope = plunge + share * (tan(radians(wedge.face[0])) - plunge)
    azimuth = radians(wedge.face[1])
    rise = -slope * np.array([sin(azimuth), cos(azimuth)])  # of the table, to the east and north
    points = [[0, 0, 0], [1, 0, rise[0]], [0, 1, rise[1]]]
    statics = Statics(parse(text + "[water]\n" + lines(table=points)))
    part = wet_part(solid, np.array([0.0, *rise]))
    water = UNIT_WEIGHT * np.array([*-rise, 1.0]) * (part.volume if part else 0.0)
    load = water - [0.0, 0.0, 2600 * 9.81 * solid.volume]
    axes = np.column_stack([plane_normal(*wedge.a), plane_normal(*wedge.b), line_of(wedge)])
    normal_a, normal_b, drive = np.linalg.solve(axes, -load)
    assert min(normal_a, normal_b) > 0
    return statics, (normal_a + normal_b) * FRICTION / -drive


@pytest.mark.parametrize("share", [0.0, 0.15, 0.3])
def test_a_wedge_below_a_water_table(share):
    """Within 0.5 % of the equilibrium along the line of intersection, with the water pressure on
    the wet parts of both planes. The table is a plane from the toe: along the line of intersection
    (dry), and above it."""
    statics, expected = below_a_table(WEDGES[2], share)
    dry = below_a_table(WEDGES[2], 0.0)[1]
    assert expected <= dry * (1.0 - 0.1 * (share > 0))
    assert factor_of_safety(statics, tolerance=5e-4) == pytest.approx(expected, rel=5e-3)


def on_floor(density=2600.0, water="", law="", top=""):
    text = top + "[laws.joint]\n" + coulomb(0.6) + law
    text += block("floor", box=[4, 4, 1], at=[0, 0, -0.5], fixed=True)
    return text + block("block", box=[1, 1, 2], at=[0, 0, 1], density=density) + water


def normal_force(statics):
    result = statics.solve()
    assert result.verdict is Verdict.EQUILIBRIUM
    return float(statics.points.area @ result.traction[:, 0])


def test_joints_carry_effective_stresses():
    """A block on a floor: under water it is lighter by the water that it displaces, also where the
    water cannot be above it; water in its joint alone lifts it by pressure times area."""
    weight = 2600 * 9.81 * 2
    assert normal_force(Statics(parse(on_floor()))) == pytest.approx(weight)
    for height, wet in ((5.0, 2.0), (1.5, 1.5), (-0.2, 0.0)):
        table = f"[water]\ntable = [[0, 0, {height}]]\nunit_weight = 10000\n"
        statics = Statics(parse(on_floor(water=table)))
        assert normal_force(statics) == pytest.approx(weight - 10000 * wet)
        assert statics.loads[1, :3] == pytest.approx([0, 0, 1e4 * wet], abs=1e-8)
    statics = Statics(parse(on_floor(law="pressure = 2e4\n")))
    assert normal_force(statics) == pytest.approx(weight - 2e4)
    assert statics.scene.wet


def test_the_water_table_in_time():
    """Levels change linearly; an equilibrium after all stages is found with the last one."""
    at = "[[water.at]]\ntime = 2\ntable = [[0, 0, 1], [1, 0, 3], [0, 1, 1]]\n"
    at += "[[water.at]]\ntime = 4\ntable = [[0, 0, -1]]\n"
    scene = parse(on_floor(water="[water]\ntable = [[0, 0, 1.5]]\n" + at))
    for time, level in ((0, [1.5, 0, 0]), (1, [1.25, 1, 0]), (2, [1, 2, 0]), (3, [0, 1, 0]),
                        (9, [-1, 0, 0])):  # fmt: skip
        assert scene.water_at(time).level == pytest.approx(level)
    assert scene.excavated.water.level == pytest.approx([-1, 0, 0])
    assert not scene.excavated.water_changes


def test_check_reports_floating_blocks_and_later_tables(tmp_path, capsys):
    file = tmp_path / "scene.toml"
    at = "[[water.at]]\ntime = 3\ntable = [[0, 0, 4]]\n"
    file.write_text(on_floor(900.0, "[water]\ntable = [[0, 0, 1]]\n" + at))
    assert main(["check", str(file)]) == 0
    printed = capsys.readouterr().out
    assert "initial state: in equilibrium" in printed
    assert "floats" not in printed
    later = printed.partition("with the water table of 3 s")[2]
    assert "without equilibrium" in later
    file.write_text(on_floor(900.0, "[water]\ntable = [[0, 0, 4]]\n"))
    main(["check", str(file)])
    assert "1 block floats: the water lifts more" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (on_floor(water="[water]\ntable = [[0, 0]]\n"), r"water.table.*must be three numbers"),
        (on_floor(water="[water]\ntable = [[0, 0, 0], [1, 0, 0]]\n"), "one point.*or three"),
        (
            on_floor(water="[water]\ntable = [[0, 0, 0], [1, 1, 0], [3, 3, 1]]\n"),
            "on one line seen from above",
        ),
        (on_floor(water="[water]\nunit_weight = 1e4\n"), "'water.table' is missing"),
        (on_floor(water="[water]\ntable = [[0, 0, 0]]\nunit_weight = 0\n"), "unit_weight"),
        (
            on_floor(water="[water]\ntable = [[0, 0, 0]]\n", top="gravity = [1.0, 0, -9.0]\n"),
            r"gravity = \[1.0, 0.0, -9.0\] must point down",
        ),
        (on_floor(law="pressure = -1\n"), "laws.joint.pressure"),
        (
            on_floor(
                water="[water]\ntable = [[0, 0, 0]]\n"
                + "[[water.at]]\ntime = 2\ntable = [[0, 0, 1]]\n" * 2
            ),
            "must increase",
        ),
    ],
)
def test_input_that_water_refuses(text, message):
    with pytest.raises(ValueError, match=message):
        parse(text)


def test_the_dry_formula_is_the_equilibrium_along_the_line():
    """The two ways to the factor of a wedge agree; planes 40/150 and 40/210 by their angles."""
    wedge = WEDGES[2]
    dry = hoek_and_bray(wedge, 2600 * 9.81, 0.0, FRICTION, 0.0)
    _, expected = below_a_table(wedge, 0.0)
    assert dry == pytest.approx(expected, rel=1e-9)
    assert degrees(asin(-line_of(wedge)[2])) == pytest.approx(
        degrees(atan(tan(radians(40)) * cos(radians(30))))
    )
