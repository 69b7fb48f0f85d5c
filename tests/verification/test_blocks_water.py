"""Water in joints and on faces: forces by quadrature, energy, and factors of safety by hand."""

from math import atan, cos, hypot, radians, sin, tan

import numpy as np
import pytest
from running import until
from scene_text import block, coulomb
from shapely import Polygon

from dem_demo import Simulation
from dem_demo.scene import parse, turn
from dem_demo.studies.strength import factor_of_safety

WATER = 9810.0  # N/m3
RUN = "[run]\nend = 1.0\n"


def law(name, friction, cohesion=0.0):
    return f"[laws.{name}]\n{coulomb(friction, cohesion=cohesion)}"


FLOOR = block("floor", corners=[(-9, -3), (9, -3), (9, -2), (-9, -2)], fixed=True)
STONE = [(-0.8, -0.7), (1.1, -0.5), (0.9, 0.8), (-0.5, 0.6)]


def test_pressure_on_edges_is_that_of_a_sum_over_short_pieces():
    """A table with kinks that crosses edges; 2e5 pieces an edge leave 1e-9 of the force."""
    table = np.array([[-1.0, 0.3], [0.2, 0.9], [0.7, -0.4], [2.0, 0.5]])
    text = (
        law("j", 0.5)
        + f"[water]\ntable = {table.tolist()}\n"
        + block("stone", corners=STONE)
        + FLOOR
    )
    scene = parse(text + RUN + "seat = false\nstep = 1e-5\n")
    centre, total = scene.blocks[0].centroid, np.zeros(3)
    for p, q in zip(np.array(STONE), np.roll(STONE, -1, axis=0), strict=True):
        at = p + (np.arange(200000)[:, None] + 0.5) / 200000 * (q - p)
        u = WATER * np.maximum(np.interp(at[:, 0], *table.T) - at[:, 1], 0.0) / len(at)
        force, arm = u[:, None] * [-(q - p)[1], (q - p)[0]], at - centre
        total += [*force.sum(axis=0), (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum()]
    loads = Simulation(scene).blocks.loads
    assert loads[0] == pytest.approx(total, rel=1e-8)
    assert not loads[1].any()  # of the floor, which does not move


def test_a_sinking_block_gets_from_the_water_what_its_potential_loses():
    """The energy of a block in water is the integral of u over it; of a straight table that is u at
    the centroid of the part below it times its area. The block begins above the table and turns.

    The pressure is brought up to date when the block has moved by a quarter of its skin, 1 mm.
    """
    text = law("j", 0.5) + "[water]\ntable = [[-9.0, -1.2], [9.0, 0.6]]\n" + FLOOR
    text += block("stone", corners=STONE, velocity=[1.0, 2.0], spin=-1.5)
    sim = Simulation(parse(text + "[run]\nend = 1.0\nseat = false\nstep = 1e-4\nskin = 4e-3\n"))
    below = Polygon([(-9, -9), (9, -9), (9, 0.6), (-9, -1.2)])

    def potential():
        x, y, angle = sim.blocks.motion[:3, 1]
        wet = Polygon(sim.scene.blocks[1].local @ turn(angle).T + [x, y]).intersection(below)
        at = wet.centroid
        return WATER * wet.area * (0.1 * (at.x + 9) - 1.2 - at.y) if wet.area else 0.0

    start = potential()
    seen = until(sim, 0.7, lambda: (sim.ledger.value["work"], start - potential()))
    work, gained = np.array(seen).T
    assert abs(sim.ledger.error) < 1e-12
    assert np.ptp(gained) > 1e4  # J: 2.2 m2 of water lifted by a metre
    assert work == pytest.approx(gained, abs=3e-3 * np.ptp(gained))


HEIGHT, FACE, PLANE, CRACK = 20.0, radians(60), radians(35), 6.0  # m; Hoek and Bray's slide
CREST = -HEIGHT / tan(FACE)
BACK = -(HEIGHT - CRACK) / tan(PLANE)  # x of the crack; the toe is at 0, 0
SLIDE = [(0, 0), (CREST, HEIGHT), (BACK, HEIGHT), (BACK, HEIGHT - CRACK)]


def planar(friction, cohesion, depth):
    """The slide with water in its crack, whose pressure falls in a line along the plane to 0."""
    level = HEIGHT - CRACK + depth
    table = f"[water]\ntable = [[-99.0, {level}], [{BACK}, {level}], [0.0, 0.0]]\n"
    base = [(-60, -1), (0, -1), (0, 0), (BACK, HEIGHT - CRACK), (-60, HEIGHT - CRACK)]
    behind = [(-60, HEIGHT - CRACK), SLIDE[3], SLIDE[2], (-60, HEIGHT)]
    text = law("j", friction, cohesion) + law("crack", 0.0) + (table if depth else "")
    text += block("base", corners=base, fixed=True) + block("behind", corners=behind, fixed=True)
    joint = '[[joint]]\nbetween = ["slide", "behind"]\nlaw = "crack"\n'
    return parse(text + block("slide", corners=SLIDE) + joint + RUN)


@pytest.mark.parametrize("depth", [0.0, 0.5 * CRACK, CRACK])
@pytest.mark.parametrize(("phi", "cohesion"), [(40, 0.0), (30, 5e4), (40, 3e4)])
def test_a_planar_slide_with_a_tension_crack(phi, cohesion, depth):
    """F = (c A + (W cos p - U - V sin p) tan phi) / (W sin p + V cos p) (Hoek and Bray 1981, 7):
    U lifts the slide from its plane, V pushes it out of the crack. The search finds F to 0.6 %."""
    length = hypot(BACK, HEIGHT - CRACK)
    weight = 2600 * 9.81 * Polygon(SLIDE).area
    up, out = 0.5 * WATER * depth * length, 0.5 * WATER * depth**2
    presses = weight * cos(PLANE) - up - out * sin(PLANE)
    bears = cohesion * length + presses * tan(radians(phi))
    factor = bears / (weight * sin(PLANE) + out * cos(PLANE))
    found = factor_of_safety(planar(tan(radians(phi)), cohesion, depth))
    assert found == pytest.approx(factor, rel=0.01)


def test_pressure_given_for_a_law_is_taken_from_the_stress_of_its_joints():
    """20 kPa under a slab of 1 m on a slope of 3 in 4: of its 25.5 kPa x 0.8 0.4 are left."""
    text = "gravity = [5.886, -7.848]\n" + law("wet", 0.9) + "pressure = 2e4\n"
    text += block("floor", corners=[(-9, -3), (9, -3), (9, 0), (-9, 0)], fixed=True)
    text += block("slab", corners=[(-2, 0), (2, 0), (2, 1), (-2, 1)], held=["x", "turn"])
    sim = Simulation(parse(text + RUN))
    area = sim.contacts.length
    left = sim.joints.traction[:, 0] @ area / area.sum()
    assert left == pytest.approx(2600 * 7.848 - 2e4, rel=1e-6)
    free = parse((text + RUN).replace('held = ["x", "turn"]', "").replace("2e4", "1e4"))
    factor = 0.9 * (1 - 1e4 / (2600 * 7.848)) / tan(atan(0.75))
    assert factor_of_safety(free) == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    ("law_keys", "wrong", "told"),
    [
        ("", "[water]\ntable = [[0.0, 1.0], [0.0, 2.0]]", "x increasing"),
        ("", "[water]\ntable = []", "must be points"),
        ("", "[water]\nunit_weight = 1e4", "water.table"),
        ("", "[water]\ntable = [[0.0, 1.0]]\n[gone]", "unknown"),
        ("pressure = -1.0\n", "", r"laws\.j\.pressure = -1\.0"),
    ],
)
def test_wrong_water_is_refused(law_keys, wrong, told):
    with pytest.raises(ValueError, match=told):
        parse(law("j", 0.5) + law_keys + block("stone", corners=STONE) + RUN + wrong)


def test_a_table_needs_gravity_that_points_down():
    text = "gravity = [1.0, -9.0]\n" + law("j", 0.5) + block("stone", corners=STONE) + RUN
    with pytest.raises(ValueError, match="must point down"):
        parse(text + "[water]\ntable = [[0.0, 0.0]]\n")
