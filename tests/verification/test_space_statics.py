"""Blocks in space against closed forms: incline, toppling, wedges, anisotropy, symmetries; and
against the same scenes in the plane."""

from dataclasses import replace
from math import atan, cos, degrees, radians, sin, sqrt, tan

import numpy as np
import pytest
from scene_text import ROCK, block, coulomb, lines
from wedges import WEDGES, factor_by_hand, line_of, wedge_text

import jointlaw as jl
from dem_demo.dynamics.relaxation import Verdict
from dem_demo.output.record import list_blocks
from dem_demo.scene import load
from dem_demo.space.contacts import find_contacts
from dem_demo.space.cutting import plane_normal
from dem_demo.space.read import parse
from dem_demo.space.scene import SpaceBlock, SpaceScene
from dem_demo.space.solids import extruded
from dem_demo.space.statics import Statics
from dem_demo.space.strength import factor_of_safety, strength_reduction
from dem_demo.studies import strength

FRICTION = tan(radians(30.0))
TOLERANCE = 5e-4  # of the factor of safety in a search


def on_incline(dip, size, law, azimuth=0.0):
    """A block on a fixed slab, with gravity as on a slope that dips to the azimuth (degrees)."""
    tilt, direction = radians(dip), radians(azimuth)
    down = np.array([sin(tilt) * sin(direction), sin(tilt) * cos(direction), -cos(tilt)])
    text = lines(gravity=9.81 * down) + "[laws.joint]\n" + law
    slab = [4 * size[0], 4 * size[0], size[0]]
    text += block("slab", box=slab, at=[0, 0, -0.5 * size[0]], fixed=True)
    return Statics(parse(text + block("block", box=size, at=[0, 0, 0.5 * size[2]])))


def is_stable(statics):
    result = statics.solve()
    assert result.verdict is not Verdict.NOT_DECIDED
    return result.verdict is Verdict.EQUILIBRIUM


@pytest.mark.parametrize("azimuth", [0.0, 37.0])
def test_a_block_slides_beyond_its_friction_angle(azimuth):
    """atan 0.6 = 30.964 degrees, along the edges of the block and across them."""
    assert is_stable(on_incline(30.96, (1, 1, 0.5), coulomb(0.6), azimuth))
    assert not is_stable(on_incline(30.97, (1, 1, 0.5), coulomb(0.6), azimuth))


def test_a_block_topples_where_its_weight_passes_the_edge():
    """Beyond atan(b/h) = 26.565 degrees, from any numbers of points and springs."""
    limit = degrees(atan(0.5))
    assert is_stable(on_incline(limit - 0.01, (1, 1, 2), coulomb(0.9)))
    assert not is_stable(on_incline(limit + 0.01, (1, 1, 2), coulomb(0.9)))


@pytest.mark.parametrize(
    ("height", "friction_angle", "stable"),
    [(10, 40.1, True), (5, 20, False), (25, 40.1, False), (11.9, 45, True), (12.0, 45, False)],
)
def test_sliding_and_toppling_of_3decs_block(height, friction_angle, stable):
    """10 m wide on a slope of 40 degrees: it slides below 40 degrees of friction, and topples
    above 10/tan 40 = 11.918 m."""
    law = coulomb(tan(radians(friction_angle)))
    assert is_stable(on_incline(40.0, (10, 10, height), law)) == stable


def test_forces_of_an_equilibrium():
    """Tractions balance the weight; the settlement is that of the springs of the joint."""
    statics = on_incline(20.0, (1, 2, 0.5), coulomb(0.6))
    result = statics.solve()
    area = statics.points.area
    weight = 2600 * 9.81 * 1.0
    assert area @ result.traction[:, 0] == pytest.approx(weight * cos(radians(20)), rel=1e-9)
    shear = (result.traction[:, 1:, None] * statics.axes[:, 1:]).sum(axis=1)
    # shear of block a, the slab, against block b: up the slope
    assert area @ shear == pytest.approx([0, -weight * sin(radians(20)), 0], abs=1e-6)
    stress = weight * cos(radians(20)) / 2.0
    assert result.displacement[1, 2] == pytest.approx(-stress / 1e10, rel=1e-9)
    assert result.displacement[0].tolist() == [0, 0, 0]
    assert result.unbalanced_ratio < 1e-11


@pytest.mark.parametrize("cohesion", [0.0, 2e4])
@pytest.mark.parametrize(
    "number", [0, *(pytest.param(i, marks=pytest.mark.slow) for i in (1, 2, 3))]
)
def test_wedges_of_hoek_and_bray(number, cohesion):
    """Factor of safety of a wedge on two planes, with and without cohesion, within 0.1 %."""
    wedge = WEDGES[number]
    statics = Statics(parse(wedge_text(wedge, coulomb(FRICTION, cohesion=cohesion))))
    assert statics.is_free.sum() == 1
    free = int(np.flatnonzero(statics.is_free)[0])
    areas = [statics.points.area.sum()]
    by_hand = factor_by_hand(wedge, statics.mass[free] * 9.81, areas, FRICTION, cohesion)
    assert factor_of_safety(statics, tolerance=TOLERANCE) == pytest.approx(by_hand, rel=1e-3)


def rough_law(c):
    return ROCK.replace("a = 3.0", f"a = 3.0, b = -1.0, c = {c}") + (
        'resolution = "balanced"\nclosure_range = 2e-4\n'
    )


def rough_factor(number, c, rough, **more):
    statics = Statics(parse(wedge_text(WEDGES[number], rough_law(c), rough, **more)))
    return factor_of_safety(statics, tolerance=0.002)


@pytest.mark.slow
def test_the_rough_direction_decides_whether_a_wedge_stands():
    """Planes 40/150 and 40/210: the factor is flat for c = 0 (up to the azimuths of the table), and
    falls from the line of intersection to across it for c = 0.3."""
    angles = (0.0, 45.0, 90.0)
    isotropic = [rough_factor(2, 0.0, angle) for angle in angles]
    assert np.ptp(isotropic) < 0.01
    along, between, across = (rough_factor(2, 0.3, angle) for angle in angles)
    assert along == pytest.approx(1.19, abs=0.01)
    assert across == pytest.approx(0.996, abs=0.01)
    assert across + 0.02 < between < along - 0.02


TRANSFORMED = {
    "turned": {"turn": 73.0},
    "mirrored": {"mirror": True},
    "small": {"scale": 1e-2, "gravity": 981.0},
    "large": {"scale": 1e2, "gravity": 0.0981},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*TRANSFORMED])
def test_the_factor_does_not_depend_on_the_axes(name):
    """Turned about z, mirrored, and at equal stress in other sizes."""
    same = rough_factor(0, 0.3, 20.0)
    assert rough_factor(0, 0.3, 20.0, **TRANSFORMED[name]) == pytest.approx(same, rel=0.004)


def scene_of(scene, law, depth=1.0):
    """A scene of the plane, extruded along y."""
    blocks = [
        SpaceBlock(
            one.name, extruded(one.corners, 0.0, depth), one.density, one.fixed,
            face_laws=(None,) * (len(one.corners) + 2),
            face_axes=np.zeros((len(one.corners) + 2, 3)),
        )
        for one in scene.blocks
    ]  # fmt: skip
    gravity = np.array([scene.gravity[0], 0.0, scene.gravity[1]])
    return SpaceScene(scene.title, tuple(blocks), {"joint": law}, "joint", gravity=gravity)


@pytest.mark.slow
@pytest.mark.parametrize("angle", [39.0, 35.0])
def test_a_scene_of_the_plane_extruded(angle):
    """Factor within 0.5 % (both searches have that tolerance), and the same unstable blocks."""
    in_plane = strength.alone(load("slope"), "rough")
    law = jl.CoulombLaw(2e9, 1e9, tan(radians(angle)), plane=0.0)
    in_plane = replace(in_plane, laws=dict.fromkeys(in_plane.laws, law))
    in_space = scene_of(in_plane, replace(law, plane=None))
    statics = Statics(in_space)
    factor = strength.factor_of_safety(in_plane)
    assert factor_of_safety(statics, tolerance=0.003) == pytest.approx(factor, rel=0.005)
    if angle == 35.0:
        unstable = strength._unstable_blocks(in_plane)
        result = list_blocks(in_space, statics.solve().unstable)
        assert len(unstable) > 20
        assert [one["block"] for one in result] == [one["block"] for one in unstable]


def test_the_numbers_of_blocks_do_not_matter():
    """Tractions of a heap of blocks in two orders: roles a and b swap."""
    law = jl.CoulombLaw(1e9, 5e8, 0.6)
    text = "[laws.joint]\n" + coulomb(0.6, 1e9, 5e8)
    parts = [
        block("slab", box=[4, 4, 1], at=[0, 0, -0.5], fixed=True),
        block("low", box=[2, 1, 1], at=[0, 0, 0.5]),
        block("left", box=[0.9, 1.2, 1], at=[-0.5, 0.1, 1.5]),
        block("right", box=[0.8, 0.7, 1], at=[0.5, 0.0, 1.5], load=[500.0, 900.0, 0.0]),
    ]
    orders = [0, 1, 2, 3], [3, 1, 0, 2]
    results = []
    for order in orders:
        scene = parse(text + "".join(parts[i] for i in order))
        assert isinstance(scene.laws["joint"], type(law))
        displaced = Statics(scene).solve()
        assert displaced.verdict is Verdict.EQUILIBRIUM
        results.append(
            dict(zip([b.name for b in scene.blocks], displaced.displacement, strict=True))
        )
    for name, displacement in results[0].items():
        assert results[1][name] == pytest.approx(displacement, abs=1e-15)


def test_unstable_blocks_are_named_and_the_others_carry_themselves():
    """A block over a void, one that rests on it, and a stable one."""
    text = "[laws.joint]\n" + coulomb(0.6)
    text += block("slab", box=[4, 4, 1], at=[0, 0, -0.5], fixed=True)
    text += block("stable", box=[1, 1, 1], at=[0, 0, 0.5])
    text += block("falls", box=[1, 1, 1], at=[2.4, 0, 0.5])
    text += block("rider", box=[1, 1, 1], at=[2.4, 0, 1.5])
    scene = parse(text)
    result = Statics(scene).solve()
    assert result.verdict is Verdict.NO_EQUILIBRIUM
    listed = list_blocks(scene, result.unstable)
    assert [one["block"] for one in listed] == ["falls", "rider"]
    assert (listed[0]["x_m"], listed[0]["z_m"]) == pytest.approx((2.4, 0.5))
    assert result.unbalanced_ratio < 1e-9


def test_strength_reduction_names_the_blocks_that_fail(tmp_path):
    """Of two blocks on an incline, the one on the smoother joint; a finished search continues."""
    tilt = radians(20.0)
    text = lines(gravity=[0, 9.81 * sin(tilt), -9.81 * cos(tilt)])
    text += f"[laws.joint]\n{coulomb(0.6)}[laws.smooth]\n{coulomb(0.5)}"
    text += block("slab", box=[6, 4, 1], at=[0, 0, -0.5], fixed=True)
    text += block("one", box=[1, 1, 1], at=[-2, 0, 0.5]) + block(
        "two", box=[1, 1, 1], at=[2, 0, 0.5]
    )
    text += '[[joint]]\nbetween = ["slab", "two"]\nlaw = "smooth"\n'
    messages = []
    row = strength_reduction(parse(text), tmp_path, messages.append)
    assert row["factor_of_safety"] == pytest.approx(0.5 / tan(tilt), rel=0.006)
    assert [one["block"] for one in row["initiating_blocks"]] == ["two"]
    assert row["unstable"] == row["excluded"] == []
    assert strength_reduction(parse(text), tmp_path, messages.append) == row


def test_the_seismic_coefficient_of_a_block_on_a_plane():
    """It slides where k = (mu cos - sin)/(cos + mu sin) on a slope of 20 degrees."""
    tilt = radians(20.0)
    critical = (0.6 * cos(tilt) - sin(tilt)) / (cos(tilt) + 0.6 * sin(tilt))
    statics = on_incline(20.0, (1, 1, 0.3), coulomb(0.6))
    for share, stable in ((0.99, True), (1.01, False)):
        level = share * critical * np.array([0.0, cos(tilt), sin(tilt)])
        scene = replace(statics.scene, seismic=level)
        assert is_stable(Statics(scene)) == stable


def test_the_seismic_coefficients_of_a_wedge():
    """Factor of safety of a wedge under pseudo-static forces out of the slope, along the slope and
    upwards, within 0.1 % of the equilibrium along the line of intersection."""
    wedge = WEDGES[2]
    coefficients = [0.03, -0.12, 0.06]
    seismic = lines(seismic=coefficients)
    statics = Statics(parse(seismic + wedge_text(wedge, coulomb(FRICTION))))
    axes = np.column_stack([plane_normal(*wedge.a), plane_normal(*wedge.b), line_of(wedge)])
    normal_a, normal_b, drive = np.linalg.solve(axes, np.array([0.0, 0.0, 1.0]) - coefficients)
    assert min(normal_a, normal_b) > 0
    expected = (normal_a + normal_b) * FRICTION / -drive
    assert expected < 0.85 * factor_by_hand(wedge, 1.0, [0.0], FRICTION)
    assert factor_of_safety(statics, tolerance=TOLERANCE) == pytest.approx(expected, rel=1e-3)


def test_the_line_of_intersection_of_symmetric_planes():
    """Planes 40/150 and 40/210 meet in a line that plunges to the south."""
    line = line_of(WEDGES[2])
    assert line[0] == pytest.approx(0.0, abs=1e-15)
    plunge = atan(tan(radians(40)) * cos(radians(30)))
    assert -line[2] == pytest.approx(sin(plunge))
    assert sqrt(line @ line) == pytest.approx(1.0)
    statics = Statics(parse(wedge_text(WEDGES[2], coulomb(FRICTION))))
    points = find_contacts(statics.surfaces, statics.scene.skins, 0.1)
    assert len(points.area) == 6


PLAIN = "[laws.joint]\n" + coulomb()
GLUED = "[laws.joint]\n" + coulomb(0.6, cohesion=1e6, tension=1e6)


@pytest.mark.parametrize(
    ("gravity", "laws", "height", "stable"),
    [
        (-9.81, PLAIN, 3.0, False),
        (0.0, PLAIN, 1.0, True),
        (9.81, PLAIN, 1.0, False),
        (9.81, GLUED, 1.0, True),
        (-9.81, PLAIN, 1.005, True),
    ],
    ids=["in the air", "weightless", "pulled off", "glued", "above a gap"],
)
def test_a_block_with_little_or_no_support(gravity, laws, height, stable):
    """A gap within the range of detection closes."""
    text = lines(gravity=[0, 0, gravity]) + laws + block("free", box=[1, 1, 1], at=[0, 0, height])
    statics = Statics(parse(text + block("base", box=[1, 1, 1], fixed=True)))
    assert is_stable(statics) == stable
    if not stable:
        assert statics.solve().unstable.tolist() == [True, False]
