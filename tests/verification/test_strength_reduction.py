"""Factor of safety and critical tilt against calculations by hand, with the strength of the law; in
water too, whose forces are held against quadrature and energy."""

import json
import math
import re
from dataclasses import replace
from math import atan, cos, hypot, radians, sin, tan

import numpy as np
import pytest
from running import until
from scene_text import ROCK, block, coulomb, dipping, lines, on_base
from scipy.optimize import brentq
from shapely import Polygon

import jointlaw as jl
from dem_demo import Simulation
from dem_demo.cli import main
from dem_demo.output.monitors import friction_angle
from dem_demo.scene import load, parse, rotation
from dem_demo.studies import strength
from dem_demo.studies.strength import alone, critical_tilt, factor_of_safety, weakened

DIP = 32.0
LAW = ROCK.replace("a = 3.0", "a = 4.0, b = 0.0, c = 0.3")
LAW += "plane = 0.0\nresolution = { u = 4, phi = 10, depth = 1 }\n"
SCENE = on_base(LAW, [5.0, 1.0], DIP, end=0.2, at=[-1.0, 0.5]) + "fraction = 0.7\n"
FOUND = 0.01  # share to which both are found
PLAIN = {
    "coulomb": jl.CoulombLaw(3e9, 2e9, 0.8, plane=0.0),
    "cohesion": jl.CoulombLaw(3e9, 2e9, 0.8, 1e4, plane=0.0),
}


def bears(law, stress):
    """Peak shear stress (Pa) of direct shear at a normal stress (Pa), by fine steps up to the slip
    at which a brittle bond breaks."""
    bond = getattr(law, "bond", None)
    to = [1.01 * bond.cohesion / bond.shear_stiffness, 3e-3] if bond else [3e-3]
    record = jl.direct_shear(law.joint(), to=to, normal=stress, steps=150)
    return float(record.shear_stress.max())


@pytest.mark.slow
@pytest.mark.parametrize("bonded", [False, True], ids=["joint", "bond"])
def test_factor_of_safety_of_a_block_on_a_plane(bonded):
    """Strength of the joint at its normal stress over the shear stress of the weight.

    A brittle bond beside asperities keeps its stiffness in a reduction as they do. It then breaks
    at a smaller slip, where the asperities bear less, so the peak of their sum falls by more than
    the factor. Coulomb's joint: test_blocks_limit.py.
    """
    scene = parse(SCENE)
    law = scene.laws["rock"]
    if bonded:
        bond, few = jl.Bond(1e8, 1e8, 2e5, 2e4), jl.Resolution(3, 4, 1)
        law = replace(law, mating_length=5e-3, bond=bond, resolution=few)
    dip, weight = math.radians(DIP), 2600.0 * 9.81
    found = factor_of_safety(replace(scene, laws={"rock": law}))
    normal_stress, shear_stress = weight * math.cos(dip), weight * math.sin(dip)
    if not bonded:
        by_hand = bears(law, normal_stress) / shear_stress
        assert found == pytest.approx(by_hand, rel=FOUND)
        return

    def surplus(factor):
        return bears(law.strength_reduced(factor), normal_stress) / factor - shear_stress

    by_hand = brentq(surplus, 1.5, 2.5, xtol=1e-3)
    assert by_hand < 0.95 * bears(law, normal_stress) / shear_stress
    # The search loads the joint in one step, in which asperities that still stick bear less than
    # where they were closed before they are sheared.
    assert 0.85 * by_hand < found < by_hand


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["joint", "coulomb", "cohesion"])
def test_factor_of_safety_of_a_toppling_column(kind):
    """A column 4 m high tips on its lower corner and pushes the top of a block that slides.

    The side between them is smooth, so the push is that of moments about the corner; the block's
    weight and the push give the normal stresses at its two ends.
    """
    tilt, height, wide, top, load = math.radians(25.0), 4.0, 3.0, 1.2, 2600.0 * 9.81
    plain = {
        "free": jl.CoulombLaw(3e9, 2e9, 0.0, plane=0.0),
        "foot": jl.CoulombLaw(3e9, 2e9, 5.0, plane=0.0),
    }
    law = PLAIN.get(kind, parse(SCENE).laws["rock"])
    text = "".join(f"[laws.{name}]\n{LAW}" for name in ("rock", "free", "foot"))
    text += block("base", box=[13.0, 1.0], at=[1.5, -0.5], fixed=True)
    text += block("column", box=[1.0, height], at=[-0.5, height / 2])
    text += block("toe", box=[wide, top], at=[wide / 2, top / 2])
    for other, name in (("toe", "free"), ("base", "foot")):
        text += "[[joint]]\n" + lines(between=["column", other], law=name)
    scene = parse(lines(gravity=dipping(25.0)) + text + "[run]\nend = 0.2\n")
    push = load * height * (math.sin(tilt) * height / 2 - math.cos(tilt) / 2) / top
    weight = load * wide * top
    normal = weight * math.cos(tilt)
    far = normal / 2 + (weight * math.sin(tilt) * top / 2 + push * top) / wide
    ends = [2 * part / wide for part in (far, normal - far)]
    strong = wide / 2 * sum(bears(law, stress) for stress in ends)
    found = factor_of_safety(replace(scene, laws={"rock": law, **plain}))
    assert found == pytest.approx(strong / (weight * math.sin(tilt) + push), rel=FOUND)


@pytest.mark.slow
def test_factor_of_safety_of_a_column_that_tension_keeps_from_toppling():
    """It tips on its lower corner, and its heel is torn off.

    That end stands for half of the base, with the whole base as its arm: the moment is that of the
    tension all over the base, tension * width^2 / 2. The weight is not divided by F.
    """
    tilt, high, wide, load = math.radians(25.0), 4.0, 1.0, 2600.0 * 9.81
    law = jl.CoulombLaw(3e9, 2e9, 0.8, cohesion=2e6, tension=1.2e5, plane=0.0)
    scene = replace(parse(on_base(LAW, [1.0, 4.0], 25.0)), laws={"rock": law})
    tips = load * wide * high * (math.sin(tilt) * high / 2 - math.cos(tilt) * wide / 2)
    by_hand = law.tension * wide**2 / 2 / tips
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=FOUND)


@pytest.mark.slow
def test_factor_of_safety_of_a_slope_is_that_of_coulomb_of_the_same_strength():
    """124 blocks; each pair of them gets the friction of the law at its pressure near failure."""
    one = alone(load("slope-full"), "rough", seed=3)
    law, found = one.laws["rough"], factor_of_safety(one)
    sim = Simulation(weakened(one, 0.97 * found))
    laws, pairs, pressed = dict(one.laws), {}, {}
    c = sim.contacts
    contacts = zip(
        c.block_a.tolist(), c.block_b.tolist(), sim.joints.traction[:, 0], c.length, strict=True
    )
    for one_block, other, stress, length in contacts:
        sums = pressed.setdefault(frozenset((one_block, other)), [0.0, 0.0])
        sums[0] += stress * length
        sums[1] += length * (stress > 0)
    for pair, (force, length) in pressed.items():
        eighths = round(8 * np.log10(max(force / length, 1e3) if length else 1e3))
        stress = 10.0 ** (eighths / 8)  # Pa: few laws
        if (name := f"coulomb {eighths}") not in laws:
            stiff = stress / law.closure(stress)
            friction = math.tan(math.radians(friction_angle(law, stress)))
            laws[name] = jl.CoulombLaw(stiff, stiff / law.asperity.lam, friction, plane=0.0)
        pairs[pair] = name
    alike = factor_of_safety(replace(one, laws=laws, pairs=pairs))
    assert not sim.unstable.any()
    assert found == pytest.approx(alike, rel=0.03)


def test_a_stopped_search_goes_on(tmp_path, monkeypatch, capsys):
    """After Ctrl-C the same command asks only for what was not finished, and ends the same: it
    tells factor and tilt, and draws the failure."""
    scene, out, asked = tmp_path / "slab.toml", tmp_path / "out", []
    scene.write_text(SCENE)
    real = strength.equilibrium_displacements

    def stops_at_the_fourth(*given):
        asked.append(given)
        if len(asked) == 4:
            raise KeyboardInterrupt
        return real(*given)

    monkeypatch.setattr(strength, "equilibrium_displacements", stops_at_the_fourth)
    words = ["strength-reduction", str(scene), "--out", str(out), "--until", "0.01"]
    assert main(words) == 130
    assert "the same command continues" in capsys.readouterr().err
    assert (
        len(json.loads((out / "trials.json").read_text())["trials"]) == 5
    )  # with the search for unstable blocks and limit analysis
    assert main(words) == 0
    told = capsys.readouterr().out
    found = re.search(r"scene: factor of safety ([\d.]+), critical tilt ([\d.]+)", told)
    factor, tilt = map(float, found.groups())
    pressed = 2600.0 * 9.81 * math.cos(math.radians(DIP))  # Pa, by the slab's weight
    steepest = friction_angle(parse(SCENE).laws["rock"], pressed)
    by_hand = math.tan(math.radians(steepest)) / math.tan(math.radians(DIP))
    # FOUND, and three printed digits
    assert (factor, DIP + tilt) == pytest.approx((by_hand, steepest), rel=0.015)
    assert (out / "failing-scene.png").stat().st_size > 10_000
    (row,) = json.loads((out / "strength.json").read_text())["rows"]
    trials = json.loads((out / "trials.json").read_text())["trials"]
    # The stopped one twice; the picture, limit analysis and the search for unstable blocks are no
    # equilibria.
    assert len(asked) == len(trials) - 2
    assert row["factor_of_safety"] == factor_of_safety(parse(SCENE))
    scene.write_text(SCENE.replace("mu = 0.4", "mu = 0.5"))
    (out / "strength.json").unlink()
    assert main(words) == 2
    assert "trials of another scene" in capsys.readouterr().err


@pytest.mark.parametrize("degrees", [58.0, 62.0])
def test_a_tilt_near_the_steepest_is_found(degrees):
    """A flat slab slides at its friction angle, also where the last step of the search is short."""
    plain = jl.CoulombLaw(1e9, 1e9, math.tan(math.radians(degrees)), plane=0.0)
    found = critical_tilt(replace(parse(on_base(LAW, [3.0, 0.1])), laws={"rock": plain}))
    assert found is None if degrees > 60 else found == pytest.approx(degrees, rel=FOUND)


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
    scene = parse(text + RUN + "settle = false\nstep = 1e-5\n")
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
    sim = Simulation(parse(text + "[run]\nend = 1.0\nsettle = false\nstep = 1e-4\nskin = 4e-3\n"))
    below = Polygon([(-9, -9), (9, -9), (9, 0.6), (-9, -1.2)])

    def potential():
        x, y, angle = sim.blocks.motion[:3, 1]
        wet = Polygon(sim.scene.blocks[1].local @ rotation(angle).T + [x, y]).intersection(below)
        at = wet.centroid
        return WATER * wet.area * (0.1 * (at.x + 9) - 1.2 - at.y) if wet.area else 0.0

    start = potential()
    seen = until(sim, 0.7, lambda: (sim.energy_balance.value["work"], start - potential()))
    work, gained = np.array(seen).T
    assert abs(sim.energy_balance.error) < 1e-12
    assert np.ptp(gained) > 1e4  # J: 2.2 m2 of water lifted by a metre
    assert work == pytest.approx(gained, abs=3e-3 * np.ptp(gained))


HEIGHT, FACE, PLANE, CRACK = 20.0, radians(60), radians(35), 6.0  # m; Hoek and Bray's slide
CREST = -HEIGHT / tan(FACE)
BACK = -(HEIGHT - CRACK) / tan(PLANE)  # x of the crack; the toe is at 0, 0
SLIDE = [(0, 0), (CREST, HEIGHT), (BACK, HEIGHT), (BACK, HEIGHT - CRACK)]


@pytest.mark.parametrize("depth", [0.0, 0.5 * CRACK, CRACK])
@pytest.mark.parametrize(("phi", "cohesion"), [(40, 0.0), (30, 5e4), (40, 3e4)])
def test_a_planar_slide_with_a_tension_crack(phi, cohesion, depth):
    """F = (c A + (W cos p - U - V sin p) tan phi) / (W sin p + V cos p) (Hoek and Bray 1981, 7):
    U lifts the slide from its plane, V pushes it out of the crack, in which water stands; its
    pressure falls in a line along the plane to 0. The search finds F to 0.6 %."""
    length = hypot(BACK, HEIGHT - CRACK)
    weight = 2600 * 9.81 * Polygon(SLIDE).area
    up, out = 0.5 * WATER * depth * length, 0.5 * WATER * depth**2
    presses = weight * cos(PLANE) - up - out * sin(PLANE)
    bears = cohesion * length + presses * tan(radians(phi))
    factor = bears / (weight * sin(PLANE) + out * cos(PLANE))
    level = HEIGHT - CRACK + depth
    table = f"[water]\ntable = [[-99.0, {level}], [{BACK}, {level}], [0.0, 0.0]]\n"
    base = [(-60, -1), (0, -1), (0, 0), (BACK, HEIGHT - CRACK), (-60, HEIGHT - CRACK)]
    behind = [(-60, HEIGHT - CRACK), SLIDE[3], SLIDE[2], (-60, HEIGHT)]
    text = law("j", tan(radians(phi)), cohesion) + law("crack", 0.0) + (table if depth else "")
    text += block("base", corners=base, fixed=True) + block("behind", corners=behind, fixed=True)
    text += block("slide", corners=SLIDE)
    text += '[[joint]]\nbetween = ["slide", "behind"]\nlaw = "crack"\n'
    found = factor_of_safety(parse(text + RUN))
    assert found == pytest.approx(factor, rel=0.01)


def test_pressure_given_for_a_law_is_taken_from_the_stress_of_its_joints():
    """20 kPa under a slab of 1 m on a slope of 3 in 4: of its 25.5 kPa x 0.8 0.4 are left."""
    text = "gravity = [5.886, -7.848]\n" + law("wet", 0.9) + "pressure = 2e4\n"
    text += block("floor", corners=[(-9, -3), (9, -3), (9, 0), (-9, 0)], fixed=True)
    text += block("slab", corners=[(-2, 0), (2, 0), (2, 1), (-2, 1)], fixed_motions=["x", "turn"])
    sim = Simulation(parse(text + RUN))
    area = sim.contacts.length
    left = sim.joints.traction[:, 0] @ area / area.sum()
    assert left == pytest.approx(2600 * 7.848 - 2e4, rel=1e-6)
    free = parse((text + RUN).replace('fixed_motions = ["x", "turn"]', "").replace("2e4", "1e4"))
    factor = 0.9 * (1 - 1e4 / (2600 * 7.848)) / tan(atan(0.75))
    assert factor_of_safety(free) == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    ("keys", "wrong", "told"),
    [
        ("", "[water]\ntable = [[0.0, 1.0], [0.0, 2.0]]", "x increasing"),
        ("", "[water]\ntable = []", "must be points"),
        ("", "[water]\nunit_weight = 1e4", "water.table"),
        ("", "[water]\ntable = [[0.0, 1.0]]\n[gone]", "unknown"),
        ("", "[laws.wet]\n" + coulomb(pressure=-1.0), r"laws\.wet\.pressure = -1\.0"),
        ("gravity = [1.0, -9.0]\n", "[water]\ntable = [[0.0, 0.0]]", "must point down"),
    ],
)
def test_wrong_water_is_refused(keys, wrong, told):
    with pytest.raises(ValueError, match=told):
        parse(keys + law("j", 0.5) + block("stone", corners=STONE) + RUN + wrong)
