"""Factor of safety and critical tilt against calculations by hand, with the strength of the law.
Water pressure against quadrature and energy."""

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
from dem_demo.studies.limit_analysis import limit_factor
from dem_demo.studies.strength import alone, critical_tilt, factor_of_safety, weakened

DIP = 32.0
LAW = ROCK.replace("a = 3.0", "a = 4.0, b = 0.0, c = 0.3")
LAW += "plane = 0.0\nresolution = { u = 4, phi = 10, depth = 1 }\n"
SCENE = on_base(LAW, [5.0, 1.0], DIP, end=0.2, at=[-1.0, 0.5]) + "fraction = 0.7\n"
SEARCH_TOLERANCE = 0.01  # of factor of safety and critical tilt, relative
UNIT_WEIGHT = 2600.0 * 9.81  # N/m3, of the rock
COULOMB_LAWS = {
    "coulomb": jl.CoulombLaw(3e9, 2e9, 0.8, plane=0.0),
    "cohesion": jl.CoulombLaw(3e9, 2e9, 0.8, 1e4, plane=0.0),
}


def peak_shear_stress(law, stress):
    """Peak shear stress (Pa) of direct shear at a normal stress (Pa), by fine steps up to the slip
    at which a brittle bond breaks."""
    bond = getattr(law, "bond", None)
    slips = [1.01 * bond.cohesion / bond.shear_stiffness, 3e-3] if bond else [3e-3]
    record = jl.direct_shear(law.joint(), to=slips, normal=stress, steps=150)
    return float(record.shear_stress.max())


@pytest.mark.slow
@pytest.mark.parametrize("bonded", [False, True], ids=["joint", "bond"])
def test_factor_of_safety_of_a_block_on_a_plane(bonded):
    """Strength of the joint at its normal stress over the shear stress of the weight.

    A brittle bond in parallel with asperities keeps its stiffness in a reduction as they do. It
    then breaks at a smaller slip, where the stress of the asperities is smaller, so the peak of
    their sum decreases by more than the factor. Coulomb's joint: test_blocks_limit.py.
    """
    scene = parse(SCENE)
    law = scene.laws["rock"]
    if bonded:
        bond = jl.Bond(1e8, 1e8, 2e5, 2e4)
        law = replace(law, mating_length=5e-3, bond=bond, resolution=jl.Resolution(3, 4, 1))
    factor = factor_of_safety(replace(scene, laws={"rock": law}))
    dip = math.radians(DIP)
    normal_stress = UNIT_WEIGHT * math.cos(dip)  # the block is 1 m high
    shear_stress = UNIT_WEIGHT * math.sin(dip)
    if not bonded:
        by_hand = peak_shear_stress(law, normal_stress) / shear_stress
        assert factor == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)
        return

    def surplus(factor):
        return (
            peak_shear_stress(law.strength_reduced(factor), normal_stress) / factor - shear_stress
        )

    by_hand = brentq(surplus, 1.5, 2.5, xtol=1e-3)
    assert by_hand < 0.95 * peak_shear_stress(law, normal_stress) / shear_stress
    # The search loads the joint in one step, in which asperities that still stick have less shear
    # stress than where they were closed before they are sheared.
    assert 0.85 * by_hand < factor < by_hand


def peak_in_one_step(law, stress):
    """Largest shear stress (Pa) at a normal stress (Pa) that a slip in one step reaches, as in the
    search for the equilibrium: slopes degrade at the end of the step."""
    slips = np.geomspace(2e-4, 3e-3, 25)
    records = [jl.direct_shear(law.joint(), to=[u], normal=stress, steps=1) for u in slips]
    return max(float(record.shear_stress[-1]) for record in records)


def test_factor_of_safety_of_slopes_that_fall_with_stress():
    """A planar slide on a joint whose slopes are halved at its normal stress: with and without the
    degradation, the factor is the strength of the law alone over the shear stress of the weight.

    The moment of the weight makes the normal stress uneven, which matters where the strength is
    curved: the two contact points lie at the ends of the joint."""
    dip = math.radians(DIP)
    normal_stress = UNIT_WEIGHT * math.cos(dip)  # the block is 1 m high
    shear_stress = UNIT_WEIGHT * math.sin(dip)
    scene = parse(SCENE)
    length = np.ptp(scene.blocks[1].corners[:, 0])
    uneven = math.tan(dip) / length
    law = replace(scene.laws["rock"], mating_length=5e-3)
    factors = {}
    for degradation_stress in (math.inf, normal_stress):
        one = replace(law, degradation_stress=degradation_stress)
        factor = factor_of_safety(replace(scene, laws={"rock": one}))
        ends = [normal_stress * (1 + i * uneven) for i in (-1, 1)]
        by_hand = np.mean([peak_in_one_step(one, stress) for stress in ends]) / shear_stress
        assert factor == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)
        by_path = np.mean([peak_shear_stress(one, stress) for stress in ends]) / shear_stress
        assert factor == pytest.approx(by_path, rel=0.025)
        bound = limit_factor(replace(scene, laws={"rock": one}))
        assert factor < bound * (1 + SEARCH_TOLERANCE)  # its strength by hand has as many steps
        factors[degradation_stress] = factor
    assert factors[normal_stress] < 0.9 * factors[math.inf]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["joint", "coulomb", "cohesion"])
def test_factor_of_safety_of_a_toppling_column(kind):
    """A column 4 m high tips on its lower corner and pushes the top of a block that slides.

    The side between them is smooth, so the push follows from the moments about the corner; the
    weight of the block and the push give the normal stresses at its two ends.
    """
    tilt = math.radians(25.0)
    height = 4.0  # of the column, 1 m wide
    toe_width = 3.0
    toe_height = 1.2
    side_laws = {
        "free": jl.CoulombLaw(3e9, 2e9, 0.0, plane=0.0),
        "foot": jl.CoulombLaw(3e9, 2e9, 5.0, plane=0.0),
    }
    law = COULOMB_LAWS.get(kind, parse(SCENE).laws["rock"])
    text = "".join(f"[laws.{name}]\n{LAW}" for name in ("rock", "free", "foot"))
    text += block("base", box=[13.0, 1.0], at=[1.5, -0.5], fixed=True)
    text += block("column", box=[1.0, height], at=[-0.5, height / 2])
    text += block("toe", box=[toe_width, toe_height], at=[toe_width / 2, toe_height / 2])
    for neighbour, name in (("toe", "free"), ("base", "foot")):
        text += "[[joint]]\n" + lines(between=["column", neighbour], law=name)
    scene = parse(lines(gravity=dipping(25.0)) + text + "[run]\nend = 0.2\n")
    overturning = UNIT_WEIGHT * height * (math.sin(tilt) * height / 2 - math.cos(tilt) / 2)
    push = overturning / toe_height
    weight = UNIT_WEIGHT * toe_width * toe_height
    normal = weight * math.cos(tilt)
    toe_moment = weight * math.sin(tilt) * toe_height / 2 + push * toe_height
    lower_end = normal / 2 + toe_moment / toe_width
    stresses = [2 * force / toe_width for force in (lower_end, normal - lower_end)]
    strength = toe_width / 2 * sum(peak_shear_stress(law, stress) for stress in stresses)
    by_hand = strength / (weight * math.sin(tilt) + push)
    factor = factor_of_safety(replace(scene, laws={"rock": law, **side_laws}))
    assert factor == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)


@pytest.mark.slow
def test_factor_of_safety_of_a_column_that_tension_keeps_from_toppling():
    """It tips on its lower corner, and the joint at its heel breaks.

    This contact represents half of the base, with the whole base as its arm: its moment equals the
    moment of the tension all over the base, tension * width^2 / 2. The weight is not divided by F.
    """
    tilt = math.radians(25.0)
    height = 4.0
    width = 1.0
    law = jl.CoulombLaw(3e9, 2e9, 0.8, cohesion=2e6, tension=1.2e5, plane=0.0)
    scene = replace(parse(on_base(LAW, [1.0, 4.0], 25.0)), laws={"rock": law})
    arm = math.sin(tilt) * height / 2 - math.cos(tilt) * width / 2
    overturning = UNIT_WEIGHT * width * height * arm
    by_hand = law.tension * width**2 / 2 / overturning
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)


@pytest.mark.slow
def test_factor_of_safety_of_a_slope_equals_the_factor_of_coulomb_of_the_same_strength():
    """124 blocks; each pair has the friction of the law at its normal stress near failure."""
    slope = alone(load("slope-full"), "rough", seed=3)
    law = slope.laws["rough"]
    factor = factor_of_safety(slope)
    sim = Simulation(weakened(slope, 0.97 * factor))
    laws = dict(slope.laws)
    pairs = {}
    loads = {}  # pair: force and length under compression
    c = sim.contacts
    contacts = zip(
        c.block_a.tolist(), c.block_b.tolist(), sim.joints.traction[:, 0], c.length, strict=True
    )
    for block_a, block_b, stress, length in contacts:
        sums = loads.setdefault(frozenset((block_a, block_b)), [0.0, 0.0])
        sums[0] += stress * length
        sums[1] += length * (stress > 0)
    for pair, (force, length) in loads.items():
        eighths = round(8 * np.log10(max(force / length, 1e3) if length else 1e3))
        stress = 10.0 ** (eighths / 8)  # Pa, rounded for a small number of laws
        if (name := f"coulomb {eighths}") not in laws:
            stiffness = stress / law.closure(stress)
            friction = math.tan(math.radians(friction_angle(law, stress)))
            laws[name] = jl.CoulombLaw(stiffness, stiffness / law.asperity.lam, friction, plane=0.0)
        pairs[pair] = name
    coulomb_factor = factor_of_safety(replace(slope, laws=laws, pairs=pairs))
    assert not sim.unstable.any()
    assert factor == pytest.approx(coulomb_factor, rel=0.03)


def high_slope(spacing, seed):
    """A random slope 20 m high of two joint sets; spacing in m."""
    text = 'law = "joint"\n[laws.joint]\n' + coulomb(0.7002, 5e9, 2e9)
    outline = [[-30, -2], [12, -2], [12, 0], [0, 0], [-12, 20], [-30, 20]]
    text += "[[rock]]\n" + lines(name="slope", outline=outline, seed=seed)
    text += "[[rock.set]]\n"
    text += lines(dip=30.0, spacing=spacing, scatter=0.2, through=[-0.2, 0.6])
    text += "[[rock.set]]\n"
    text += lines(dip=-60.0, spacing=1.4 * spacing, scatter=0.3, persistence=0.8)
    fixed = [[-40, -5], [13, -5], [13, 0.2], [0.3, 0.31], [-24, 14.28], [-28, 19], [-28, 22]]
    text += "[[rock.fixed]]\n" + lines(corners=[*fixed, [-40, 22]])
    return parse("gravity = [0.0, -9.81]\n" + text + "[run]\nend = 1.0\n")


def displacement_in_a_run(sim, end):
    """Largest displacement in m from step 0 to a time `end` in s."""
    first = sim.blocks.motion[:2].copy()
    until(sim, end)
    return np.abs(sim.blocks.motion[:2] - first).max()


@pytest.mark.parametrize("reduction", [0.98, pytest.param(0.983, marks=pytest.mark.slow)])
def test_a_slope_near_failure_starts_in_equilibrium(reduction):
    """Near failure a search is slow. A second round starts near its end, so displacements since
    then double while the motion decays: that is no sign of blocks without equilibrium."""
    sim = Simulation(weakened(high_slope(1.2, 2), reduction))
    assert not sim.unstable.any()


@pytest.mark.slow
def test_runs_of_929_blocks_agree_with_their_factor_of_safety():
    """At rest at 3 % less than the factor of safety, falling at 3 % more."""
    slope = high_slope(0.35, 1)
    factor = factor_of_safety(slope)
    stable = Simulation(weakened(slope, 0.97 * factor))
    assert not stable.unstable.any()
    assert displacement_in_a_run(stable, 0.05) < 1e-9
    failing = Simulation(weakened(slope, 1.03 * factor))
    assert failing.unstable.any()
    assert displacement_in_a_run(failing, 0.05) > 1e-4


def test_an_interrupted_search_continues(tmp_path, monkeypatch, capsys):
    """After Ctrl-C the same command computes only the unfinished trials, with the same results: it
    prints factor and tilt, and draws the failure."""
    scene = tmp_path / "slab.toml"
    out = tmp_path / "out"
    calls = []
    scene.write_text(SCENE)
    original = strength.equilibrium_displacements

    def interrupt_fourth_call(*arguments):
        calls.append(arguments)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return original(*arguments)

    monkeypatch.setattr(strength, "equilibrium_displacements", interrupt_fourth_call)
    command = ["strength-reduction", str(scene), "--out", str(out), "--until", "0.01"]
    assert main(command) == 130
    assert "the same command continues" in capsys.readouterr().err
    trials = json.loads((out / "trials.json").read_text())["trials"]
    assert len(trials) == 5  # with the search for unstable blocks and limit analysis
    assert main(command) == 0
    pattern = r"scene: factor of safety ([\d.]+) .*critical tilt ([\d.]+)"
    factor, tilt = map(float, re.search(pattern, capsys.readouterr().out).groups())
    normal_stress = UNIT_WEIGHT * math.cos(math.radians(DIP))  # Pa, by the slab's weight
    friction = friction_angle(parse(SCENE).laws["rock"], normal_stress)
    by_hand = math.tan(math.radians(friction)) / math.tan(math.radians(DIP))
    # SEARCH_TOLERANCE, and three printed digits
    assert (factor, DIP + tilt) == pytest.approx((by_hand, friction), rel=0.015)
    assert (out / "failing-scene.png").stat().st_size > 10_000
    (row,) = json.loads((out / "strength.json").read_text())["rows"]
    trials = json.loads((out / "trials.json").read_text())["trials"]
    # The interrupted trial twice; the picture, limit analysis and the search for unstable blocks
    # are no equilibria.
    assert len(calls) == len(trials) - 2
    assert row["factor_of_safety"] == factor_of_safety(parse(SCENE))
    scene.write_text(SCENE.replace("mu = 0.4", "mu = 0.5"))
    (out / "strength.json").unlink()
    assert main(command) == 2
    assert "trials of another scene" in capsys.readouterr().err


@pytest.mark.parametrize("degrees", [58.0, 62.0])
def test_critical_tilt_is_found_near_its_upper_bound(degrees):
    """A flat slab slides at its friction angle, also where the last step of the search is short."""
    law = jl.CoulombLaw(1e9, 1e9, math.tan(math.radians(degrees)), plane=0.0)
    tilt = critical_tilt(replace(parse(on_base(LAW, [3.0, 0.1])), laws={"rock": law}))
    assert tilt is None if degrees > 60 else tilt == pytest.approx(degrees, rel=SEARCH_TOLERANCE)


WATER_UNIT_WEIGHT = 9810.0  # N/m3
RUN = "[run]\nend = 1.0\n"


def law(name, friction, cohesion=0.0):
    """Text of a Coulomb law of a scene."""
    return f"[laws.{name}]\n{coulomb(friction, cohesion=cohesion)}"


FLOOR = block("floor", corners=[(-9, -3), (9, -3), (9, -2), (-9, -2)], fixed=True)
STONE = [(-0.8, -0.7), (1.1, -0.5), (0.9, 0.8), (-0.5, 0.6)]


def test_pressure_on_edges_equals_a_sum_over_short_pieces():
    """A table with kinks that crosses edges; 2e5 pieces an edge leave 1e-9 of the force."""
    table = np.array([[-1.0, 0.3], [0.2, 0.9], [0.7, -0.4], [2.0, 0.5]])
    text = (
        law("j", 0.5)
        + f"[water]\ntable = {table.tolist()}\n"
        + block("stone", corners=STONE)
        + FLOOR
    )
    scene = parse(text + RUN + "settle = false\nstep = 1e-5\n")
    centre = scene.blocks[0].centroid
    total = np.zeros(3)
    for p, q in zip(np.array(STONE), np.roll(STONE, -1, axis=0), strict=True):
        points = p + (np.arange(200000)[:, None] + 0.5) / 200000 * (q - p)
        depth = np.maximum(np.interp(points[:, 0], *table.T) - points[:, 1], 0.0)
        pressure = WATER_UNIT_WEIGHT * depth / len(points)
        force = pressure[:, None] * [-(q - p)[1], (q - p)[0]]
        arm = points - centre
        moment = (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum()
        total += [*force.sum(axis=0), moment]
    loads = Simulation(scene).blocks.loads
    assert loads[0] == pytest.approx(total, rel=1e-8)
    assert not loads[1].any()  # the fixed floor has no loads


def test_work_of_water_on_a_sinking_block_equals_the_loss_of_potential():
    """The potential energy of a block in water is the integral of the pressure over it; below a
    straight table the pressure at the centroid of the wet part times its area. The block starts
    above the table and rotates.

    The pressure is updated when the block has moved by a quarter of its skin, 2 mm.
    """
    text = law("j", 0.5) + "[water]\ntable = [[-9.0, -1.2], [9.0, 0.6]]\n" + FLOOR
    text += block("stone", corners=STONE, velocity=[1.0, 2.0], spin=-1.5)
    sim = Simulation(parse(text + "[run]\nend = 1.0\nsettle = false\nstep = 2e-4\nskin = 8e-3\n"))
    below = Polygon([(-9, -9), (9, -9), (9, 0.6), (-9, -1.2)])

    def potential():
        x, y, angle = sim.blocks.motion[:3, 1]
        wet = Polygon(sim.scene.blocks[1].local @ rotation(angle).T + [x, y]).intersection(below)
        if not wet.area:
            return 0.0
        depth = 0.1 * (wet.centroid.x + 9) - 1.2 - wet.centroid.y
        return WATER_UNIT_WEIGHT * wet.area * depth

    start = potential()
    rows = until(sim, 0.7, lambda: (sim.energy_balance.value["external_work"], start - potential()))
    work, loss = np.array(rows).T
    assert abs(sim.energy_balance.error) < 1e-12
    assert np.ptp(loss) > 1e4  # J: 2.2 m2 of water lifted by a metre
    assert work == pytest.approx(loss, abs=3e-3 * np.ptp(loss))


# Hoek and Bray's planar slide; lengths in m
HEIGHT = 20.0
FACE = radians(60)
PLANE = radians(35)
CRACK = 6.0
CREST = -HEIGHT / tan(FACE)
BACK = -(HEIGHT - CRACK) / tan(PLANE)  # x of the crack; the toe is at 0, 0
SLIDE = [(0, 0), (CREST, HEIGHT), (BACK, HEIGHT), (BACK, HEIGHT - CRACK)]


@pytest.mark.parametrize("depth", [0.0, 0.5 * CRACK, CRACK])
@pytest.mark.parametrize(("phi", "cohesion"), [(40, 0.0), (30, 5e4), (40, 3e4)])
def test_a_planar_slide_with_a_tension_crack(phi, cohesion, depth):
    """F = (c A + (W cos p - U - V sin p) tan phi) / (W sin p + V cos p) (Hoek and Bray 1981, 7):
    U is the uplift on the plane, V the thrust of the water in the crack; the pressure decreases
    linearly along the plane to 0. The search computes F to 0.6 %."""
    length = hypot(BACK, HEIGHT - CRACK)
    weight = 2600 * 9.81 * Polygon(SLIDE).area
    uplift = 0.5 * WATER_UNIT_WEIGHT * depth * length
    thrust = 0.5 * WATER_UNIT_WEIGHT * depth**2
    normal_force = weight * cos(PLANE) - uplift - thrust * sin(PLANE)
    strength = cohesion * length + normal_force * tan(radians(phi))
    by_hand = strength / (weight * sin(PLANE) + thrust * cos(PLANE))
    level = HEIGHT - CRACK + depth
    table = f"[water]\ntable = [[-99.0, {level}], [{BACK}, {level}], [0.0, 0.0]]\n"
    base = [(-60, -1), (0, -1), (0, 0), (BACK, HEIGHT - CRACK), (-60, HEIGHT - CRACK)]
    behind = [(-60, HEIGHT - CRACK), SLIDE[3], SLIDE[2], (-60, HEIGHT)]
    text = law("j", tan(radians(phi)), cohesion) + law("crack", 0.0) + (table if depth else "")
    text += block("base", corners=base, fixed=True) + block("behind", corners=behind, fixed=True)
    text += block("slide", corners=SLIDE)
    text += '[[joint]]\nbetween = ["slide", "behind"]\nlaw = "crack"\n'
    assert factor_of_safety(parse(text + RUN)) == pytest.approx(by_hand, rel=0.01)


def test_pressure_of_a_law_reduces_the_stress_of_its_joints():
    """20 kPa under a slab of 1 m on a slope of 3 in 4: 0.4 of 25.5 kPa x 0.8 remain."""
    text = "gravity = [5.886, -7.848]\n" + law("wet", 0.9) + "pressure = 2e4\n"
    text += block("floor", corners=[(-9, -3), (9, -3), (9, 0), (-9, 0)], fixed=True)
    text += block("slab", corners=[(-2, 0), (2, 0), (2, 1), (-2, 1)], fixed_motions=["x", "turn"])
    sim = Simulation(parse(text + RUN))
    area = sim.contacts.length
    effective_stress = sim.joints.traction[:, 0] @ area / area.sum()
    assert effective_stress == pytest.approx(2600 * 7.848 - 2e4, rel=1e-6)
    free = parse((text + RUN).replace('fixed_motions = ["x", "turn"]', "").replace("2e4", "1e4"))
    factor = 0.9 * (1 - 1e4 / (2600 * 7.848)) / tan(atan(0.75))
    assert factor_of_safety(free) == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    ("keys", "water", "message"),
    [
        ("", "[water]\ntable = [[0.0, 1.0], [0.0, 2.0]]", "x increasing"),
        ("", "[water]\ntable = []", "must be points"),
        ("", "[water]\nunit_weight = 1e4", "water.table"),
        ("", "[water]\ntable = [[0.0, 1.0]]\n[gone]", "unknown"),
        ("", "[laws.wet]\n" + coulomb(pressure=-1.0), r"laws\.wet\.pressure = -1\.0"),
        ("gravity = [1.0, -9.0]\n", "[water]\ntable = [[0.0, 0.0]]", "must point down"),
    ],
)
def test_invalid_water_is_refused(keys, water, message):
    with pytest.raises(ValueError, match=message):
        parse(keys + law("j", 0.5) + block("stone", corners=STONE) + RUN + water)
