"""Rock bolts and pressures on faces against closed forms: slides, toppling columns, an oscillator
that makes its bolt yield; invalid input."""

import math
import re

import goodman_bray
import numpy as np
import pytest
from running import until
from scene_text import block, coulomb, lines, on_base

from dem_demo import Simulation, parse
from dem_demo.output.run import run
from dem_demo.scene import TEMPLATE
from dem_demo.studies.limit_analysis import limit_factor
from dem_demo.studies.strength import alone, factor_of_safety

SEARCH_TOLERANCE = 6e-3  # of the factor of safety
BISECTION_TOLERANCE = 1.5e-3  # of limit analysis
DIP = math.radians(40.0)
PLUNGE = math.radians(45.0)  # of the bolt below the plane
BOX = [3.0, 0.75]
WEIGHT = 2600.0 * 9.81 * BOX[0] * BOX[1]
FRICTION = 0.5
STIFFNESS = 1e7  # N/m, of the bolt


def bolt(start, end, **keys):
    return "[[bolt]]\n" + lines(**{"from": start, "to": end}, **keys)


def pressure(start, end, value):
    return "[[pressure]]\n" + lines(**{"from": start, "to": end}, value=value)


def slide(support="", end=0.2, **more):
    """A block on a plane of 40 degrees; its bottom is y = 0, from x = -1.5 to 1.5."""
    return on_base(coulomb(FRICTION, 1e9, 5e8), BOX, 40.0, end=end, **more) + support


def bolted_slide(capacity, pretension=0.0, stiffness=STIFFNESS):
    keys = {"stiffness": stiffness, "capacity": capacity, "pretension": pretension}
    return slide(bolt([0.0, 0.3], [-1.0, -0.7], **keys))


def factor_of_bolted_slide(force):
    """Strength over shear force on the plane, with the bolt at its capacity (N)."""
    normal = WEIGHT * math.cos(DIP) + force * math.sin(PLUNGE)
    return FRICTION * normal / (WEIGHT * math.sin(DIP) - force * math.cos(PLUNGE))


@pytest.mark.parametrize("pretension", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("capacity", [8e3, 2e4])
def test_bolted_slide(capacity, pretension):
    scene = parse(bolted_slide(capacity, pretension * capacity))
    by_hand = factor_of_bolted_slide(capacity)
    assert by_hand > 1.3 * factor_of_bolted_slide(0.0)
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)
    assert limit_factor(scene) == pytest.approx(by_hand, rel=BISECTION_TOLERANCE)


@pytest.mark.parametrize(
    ("friction", "plunge", "height"),
    [
        (0.65, 0.0, 3.9),
        (0.7, math.radians(20.0), 2.0),
        pytest.param(0.7, 0.0, 3.9, marks=pytest.mark.slow),
        pytest.param(0.65, math.radians(20.0), 2.0, marks=pytest.mark.slow),
    ],
)
def test_anchor_force_of_goodman_and_bray(friction, plunge, height):
    """Toppling columns are at limit equilibrium with the anchor force of the closed form.

    The bolt is tensioned to that force. Joints as stiff in shear as in compression, where the
    factor without anchors is 1.002.
    """
    force = goodman_bray.anchor_force(friction, plunge, height)
    anchor = {"plunge": plunge, "height": height, "stiffness": 5e7}
    text = goodman_bray.scene_text(
        friction, anchor=anchor | {"capacity": force, "pretension": force}
    )
    scene = parse(text)
    assert factor_of_safety(scene) == pytest.approx(1.0, abs=0.01)
    assert limit_factor(scene) > 1.0
    half = {"capacity": 0.5 * force, "pretension": 0.5 * force}
    weaker = parse(goodman_bray.scene_text(friction, anchor=anchor | half))
    assert factor_of_safety(weaker) < 0.97


def test_support_pressure_of_a_slide():
    """On its top, and along a part of its lower end."""
    on_top = 2e3
    scene = parse(slide(pressure([-1.5, 0.75], [1.5, 0.75], on_top)))
    normal = WEIGHT * math.cos(DIP) + on_top * BOX[0]
    by_hand = FRICTION * normal / (WEIGHT * math.sin(DIP))
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)
    assert limit_factor(scene) == pytest.approx(by_hand, rel=BISECTION_TOLERANCE)
    at_end = 3e4
    scene = parse(slide(pressure([1.5, 0.0], [1.5, 0.3], at_end)))
    shear = WEIGHT * math.sin(DIP) - at_end * 0.3
    by_hand = FRICTION * WEIGHT * math.cos(DIP) / shear
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)


def test_pressure_in_a_joint_acts_on_both_faces():
    """A pressure on the joint below a block carries a part of its weight, as pore pressure does."""
    value = 5e3
    scene = parse(slide(pressure([-1.5, 0.0], [1.5, 0.0], value)))
    normal = WEIGHT * math.cos(DIP) - value * BOX[0]
    by_hand = FRICTION * normal / (WEIGHT * math.sin(DIP))
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)
    blocks = {part[0] for part in scene.face_pressures[0].parts}
    assert blocks == {0, 1}


def test_pressure_turns_with_its_face():
    """On a block that spins in the air it does no work per turn, and stays normal to the face."""
    text = lines(gravity=[0.0, 0.0]) + f"[laws.rock]\n{coulomb()}"
    text += block("far", box=[1.0, 1.0], at=[50.0, 0.0], fixed=True)
    text += block("wheel", box=[1.0, 1.0], at=[0.0, 0.0], spin=10.0)
    text += "[run]\nend = 0.2\nstep = 1e-4\nskin = 0.02\nsettle = false\n"
    sim = Simulation(parse(text + pressure([-0.5, 0.5], [0.5, 0.5], 1e3)))
    until(sim, 0.15)
    angle = sim.blocks.motion[2, 1]
    assert angle == pytest.approx(1.5, rel=1e-6)
    force = sim.blocks.loads[1]
    # loads are renewed once a block has moved by a quarter of its skin
    turned = 1e3 * np.array([math.sin(angle), -math.cos(angle)])
    assert force[:2] == pytest.approx(turned, abs=1e3 * 0.25 * 0.02 / math.sqrt(0.5))
    assert abs(force[2]) < 1e-9
    assert abs(sim.energy_balance.error) < 1e-3


def pulled(velocity):
    """A block on a smooth floor that moves away from a wall, to which a bolt holds it."""
    text = lines(gravity=[0.0, -9.81]) + f"[laws.rock]\n{coulomb(0.0, 1e9, 1e9)}"
    text += block("floor", box=[9.0, 1.0], at=[0.0, -0.5], fixed=True)
    text += block("wall", box=[1.0, 1.0], at=[-3.0, 0.5], fixed=True)
    text += block("block", box=[1.0, 1.0], at=[0.0, 0.5], velocity=[velocity, 0.0])
    text += bolt([-3.0, 0.5], [0.0, 0.5], stiffness=1e7, capacity=1e5)
    return text + "[run]\nend = 1.0\nstep = 2e-5\ndashpot_normal = 0.0\n"


def test_a_bolt_yields_and_unloads_by_its_closed_form():
    """Elastic up to the capacity, plastic until the block stops, elastic back to zero, then slack.

    Of the kinetic energy m v^2/2 the bolt stores T^2/(2 k), which the block gets back; the rest is
    T times the plastic elongation.
    """
    velocity = 1.5
    sim = Simulation(parse(pulled(velocity)))
    bolts = sim.blocks.bolts
    mass = sim.blocks.inertia[2, 0]
    elastic = 1e5**2 / 1e7 / 2
    yielding = (0.5 * mass * velocity**2 - elastic) / 1e5
    until(sim, 0.4)
    assert bolts.yielding[0] == pytest.approx(yielding, rel=2e-3)
    assert bolts.tension[0] == 0.0
    back = sim.blocks.velocity[0, 2]
    assert back == pytest.approx(-math.sqrt(2 * elastic / mass), rel=2e-3)
    assert sim.energy_balance.value["bolts"] == pytest.approx(1e5 * yielding, rel=2e-3)
    assert abs(sim.energy_balance.error) < 1e-3


def test_bolt_below_its_capacity_vibrates_without_loss():
    """Half a period later the block comes back with its velocity, and the bolt has not yielded."""
    sim = Simulation(parse(pulled(0.05)))
    mass = sim.blocks.inertia[2, 0]
    half_period = math.pi * math.sqrt(mass / 1e7)
    until(sim, 0.5 * half_period)
    assert sim.blocks.bolts.tension[0] == pytest.approx(0.05 * math.sqrt(1e7 * mass), rel=1e-3)
    until(sim, 1.2 * half_period)
    assert sim.blocks.velocity[0, 2] == pytest.approx(-0.05, rel=1e-4)
    assert sim.blocks.bolts.yielding[0] == 0.0
    assert abs(sim.energy_balance.error) < 1e-5


def test_bolted_slide_in_a_run():
    """Stable with the force that statics gives; on a weak bolt at its capacity the block slides."""
    strong = Simulation(parse(bolted_slide(2e4)))
    assert strong.verdict == "in equilibrium"
    start = strong.blocks.motion.copy()
    until(strong, 0.1)
    assert np.abs(strong.blocks.motion - start)[:3].max() < 1e-11
    assert 0.0 < strong.blocks.bolts.tension[0] < 2e4
    weak = Simulation(parse(bolted_slide(5e3)))
    assert weak.verdict == "without equilibrium"
    until(weak, 0.1)
    assert weak.blocks.bolts.tension[0] == 5e3
    drive = WEIGHT * math.sin(DIP) - 5e3 * math.cos(PLUNGE)
    friction = FRICTION * (WEIGHT * math.cos(DIP) + 5e3 * math.sin(PLUNGE))
    acceleration = (drive - friction) / (WEIGHT / 9.81)
    assert weak.blocks.velocity[0, 1] == pytest.approx(acceleration * weak.time, rel=0.02)


def test_pretension_presses_a_joint():
    """A bolt across a joint, much softer than the joint, keeps its pretension."""
    text = slide(bolt([0.0, 0.375], [0.0, -0.5], stiffness=1e5, capacity=9e4, pretension=6e4))
    sim = Simulation(parse(text))
    normal = WEIGHT * math.cos(DIP) + 6e4
    push = (sim.joints.traction[:, 0] * sim.contacts.length).sum()
    assert push == pytest.approx(normal, rel=1e-4)
    assert sim.verdict == "in equilibrium"


def test_a_stiff_bolt_shortens_the_time_step():
    def limit(stiffness):
        scene = parse(bolted_slide(1e5, stiffness=stiffness))
        return Simulation(scene).limit.current

    free = Simulation(parse(slide("")))
    assert limit(1e4) == pytest.approx(free.limit.current, rel=1e-3)
    stiff = limit(1e12)
    mass = WEIGHT / 9.81
    assert stiff == pytest.approx(2 / math.sqrt(1e12 / mass), rel=0.3)
    assert stiff < 2 / math.sqrt(1e12 / mass)  # the bolt is not at the centroid


def test_forces_of_bolts_in_history_and_summary(tmp_path):
    record, summary = run(Simulation(parse(bolted_slide(5e3))), tmp_path, until=0.1)
    forces = record.series("bolt 1: force_N")
    assert forces[-1] == summary["bolts"][0]["force_N"] == 5e3
    assert summary["bolts"][0]["yielding_m"] == record.series("bolt 1: yielding_m")[-1] > 0.0
    assert (tmp_path / "final.png").stat().st_size > 1000


def test_rocks_alone_keep_their_own_supports():
    text = 'law = "rock"\n' + f"[laws.rock]\n{coulomb()}"
    for name, x in (("left", 0.0), ("right", 10.0)):
        text += "[[rock]]\n" + lines(name=name, outline=[[0, 0], [2, 0], [2, 2], [0, 2]], at=[x, 0])
        text += '[[rock.set]]\ndip = 0.0\nspacing = 5.0\nthrough = [0.0, 1.0]\nlaw = "rock"\n'
        text += "[[rock.fixed]]\ncorners = [[-1, -1], [3, -1], [3, 0.9], [-1, 0.9]]\n"
        text += bolt([x + 1.0, 1.5], [x + 1.0, 0.5], stiffness=1e7, capacity=1e4 + x)
        text += pressure([x, 2.0], [x + 2.0, 2.0], 1e3 + x)
    scene = parse(text + "[run]\nend = 0.1\n")
    assert len(scene.bolts) == len(scene.face_pressures) == 2
    for name, x in (("left", 0.0), ("right", 10.0)):
        rock = alone(scene, name)
        assert [b.capacity for b in rock.bolts] == [1e4 + x]
        assert [p.value for p in rock.face_pressures] == [1e3 + x]


KEYS = {"stiffness": 1e7, "capacity": 1e4}
DUG = (
    block("two", box=[1.0, 0.5], at=[0.0, 1.0])
    + "[[excavate]]\nrelease_time = 0.1\n"
    + lines(corners=[[-0.5, 0.75], [0.5, 0.75], [0.5, 1.25], [-0.5, 1.25]])
)


@pytest.mark.parametrize(
    ("support", "message"),
    [
        (bolt([0, 0.3], [0.5, 0.3], **KEYS), "both ends are anchored in block 'block'"),
        (bolt([0, 0.3], [0, 5], **KEYS), r"to = \[0.0, 5.0\]: lies in no block"),
        (bolt([0, 0], [0, -0.5], **KEYS), "from = .*between blocks 'base', 'block'"),
        (bolt([0, 0.3], [0, -0.5], **KEYS, pretension=2e4), "must not exceed the capacity"),
        (bolt([0, 0.3], [0, -0.5], stiffness=0.0, capacity=1.0), "stiffness = 0.*must be > 0"),
        (bolt([0, 0.3], [0, -0.5], stiffness=1.0, capacity=-1.0), "capacity = -1.*must be > 0"),
        (DUG + bolt([0, 1.0], [0, 0.3], **KEYS), r"excavate\[0\] removes block 'two'"),
        (
            block("other", box=[1.0, 1.0], at=[0.0, 9.0], fixed=True)
            + bolt([0, 9.0], [0, -0.5], **KEYS),
            "neither of its blocks can move",
        ),
        (pressure([-1.5, 2.0], [1.5, 2.0], 1e3), "meets no face of a block"),
        (pressure([-1.5, 0.75], [2.5, 0.75], 1e3), "meets faces on 3.* m only"),
        (pressure([-1.5, 0.75], [1.5, 0.5], 1e3), "meets no face of a block"),
        (pressure([1.5, 0.75], [1.5, 0.75], 1e3), "from and to are the same point"),
        (pressure([-6.0, -1.0], [6.0, -1.0], 1e3), "fixed blocks only"),
        (pressure([-1.5, 0.75], [1.5, 0.75], -1.0), "value = -1.*must be >= 0"),
    ],
)
def test_invalid_supports_are_named(support, message):
    with pytest.raises(ValueError, match=message):
        parse(slide(support))


def test_supports_of_the_template_are_valid():
    """They are comments there."""
    text = TEMPLATE.read_text()
    active = re.sub(r"(?m)^# (\[\[|(from|to|stiffness|capacity|pretension|value) =)", r"\1", text)
    scene = parse(active)
    assert len(scene.bolts) == len(scene.face_pressures) == 1
    assert not parse(text).bolts


def test_factor_rises_with_cohesion_and_with_a_bolt():
    """Toppling columns; the factor is below the bound of limit analysis each time."""
    anchor = {"plunge": 0.0, "height": 3.9, "stiffness": 5e7, "capacity": 1e6, "pretension": 1e6}
    plain = goodman_bray.scene_text(0.65)
    cohesive = plain.replace("friction = 0.65", "friction = 0.65\ncohesion = 50000.0")
    anchored = goodman_bray.scene_text(0.65, anchor=anchor)
    stronger = goodman_bray.scene_text(
        0.65, anchor=anchor | {"capacity": 1.5e6, "pretension": 1.5e6}
    )
    assert cohesive != plain
    scenes = {name: parse(text) for name, text in locals().items() if isinstance(text, str)}
    factors = {name: factor_of_safety(scene) for name, scene in scenes.items()}
    for name, scene in scenes.items():
        assert factors[name] < limit_factor(scene)
    assert factors["plain"] < factors["anchored"] < factors["stronger"]
    assert factors["plain"] < factors["cohesive"]
