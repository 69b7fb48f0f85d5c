"""Blocks against what is not the demo: limit analysis, and strengths calculated by hand."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from running import until
from scene_text import ROCK, block, coulomb, dipping, on_base
from scipy.optimize import bisect, linprog
from scipy.sparse import diags, hstack

from dem_demo import Simulation, load, parse
from dem_demo.contact import ContactManager
from dem_demo.dynamics.blocks import Blocks
from dem_demo.dynamics.timestep import opening_and_sliding_rates
from dem_demo.output.run import to_failure
from dem_demo.studies.strength import FACTOR, factor_of_safety, seated, weakened

FOUND = FACTOR[2]  # to which a factor is found

SLOPE = """
[[rock]]
name = "slope"
outline = [[-22, -2], [12, -2], [12, 0], [0, 0], [-9, 12], [-22, 12]]
seed = {seed}
[[rock.set]]
dip = 30.0
spacing = {spacing}
scatter = 0.2
through = [-0.2, 0.6]
[[rock.set]]
dip = {dip}
spacing = {across}
scatter = 0.3
persistence = {persistence}
[[rock.fixed]]
corners = [[-40, -5], [13, -5], [13, 0.2], [0.3, 0.31], [-34, 20.12], [-40, 20]]
[run]
end = 1.0
"""


def upper_factor(scene, low=0.25, high=4.0, exact=1e-3):
    """Largest factor by which Coulomb's friction can be divided, by bisection; no cohesion.

    A scene holds only if there are forces in its joints, pressing and within the friction cone,
    that balance every block. Whether there are any is a linear program, whatever the joints'
    stiffnesses. So no scene that is held by friction has a higher factor than this, the largest at
    which there are some. It is also what the joints would have that dilate by their friction angle
    (associated flow); joints without dilation may fail before, because they cannot choose among the
    forces.
    """
    blocks = Blocks(scene)
    manager = ContactManager(scene, blocks.motion)
    manager.rebuild(blocks.motion, blocks.neighbour_pairs())
    contacts = manager.contacts
    carries = np.flatnonzero(contacts.length > 0)
    k, free = len(contacts.length), blocks.is_free.ravel()
    ways = opening_and_sliding_rates(blocks, contacts)[
        np.concatenate([carries, k + carries])
    ].T  # of N, and of shear
    friction = np.array([law.friction for law in scene.laws.values()])[manager.law[carries]]
    n = len(carries)
    press, shear = ways[:, :n], ways[:, n:]
    load = ((blocks.gravity + blocks.loads) * blocks.inverse_sqrt_inertia).ravel()[free]
    scale = np.abs(load).max()

    def holds(factor):
        # What a joint bears is a sum, with no negative part, of forces along its normal and along
        # the two edges of its cone.
        across = press @ diags(factor / friction)
        balance = hstack([press, across + shear, across - shear]).tocsr()
        found = linprog(np.zeros(3 * n), A_eq=balance, b_eq=-load / scale, bounds=(0, None))
        return 1.0 if found.status == 0 else -1.0

    return bisect(holds, low, high, xtol=exact)


def slope(**keys):
    scene = parse(f"[laws.rock]\n{coulomb(0.7002, 5e9, 2e9)}" + SLOPE.format(**keys))
    assert len(scene.rocks[0].free) >= 100
    return scene


def turning(scene):
    """How far the blocks turn that move far, arm times angle over distance: their median."""
    record, _ = to_failure(seated(scene), 0.3)
    far = record.moved > 0.5 * record.moved.max()
    arms = np.array([block.reach for block in scene.blocks])
    turned = np.abs(record.motion[-1][2] - record.motion[0][2]) * arms
    return np.median(turned[far] / record.moved[far])


@pytest.mark.slow
def test_a_slope_that_slides_has_the_factor_of_limit_analysis():
    """Steep cross joints with bridges: beds slide. tan(35 degrees)/tan(30 degrees) by hand."""
    scene = slope(spacing=0.45, dip=-75.0, across=1.3, persistence=0.8, seed=2)
    most, found = upper_factor(scene), factor_of_safety(scene)
    assert most == pytest.approx(0.7002 / np.tan(np.radians(30)), rel=2e-3)
    assert found == pytest.approx(most, rel=0.02)
    assert found < most * (1 + FOUND)
    assert turning(weakened(scene, 1.05 * found)) < 0.01


@pytest.mark.slow
def test_a_slope_whose_columns_lean_has_less_than_limit_analysis_says():
    """Columns across the beds turn before the mass slides. Limit analysis may choose the forces
    that hold them best; joints that do not dilate have those that come of their displacements."""
    scene = slope(spacing=0.7, dip=-60.0, across=1.0, persistence=1.0, seed=1)
    most, found = upper_factor(scene), factor_of_safety(scene)
    assert most < 0.9 * 0.7002 / np.tan(np.radians(30))
    assert 0.85 * most < found < 0.98 * most
    assert turning(weakened(scene, 1.05 * found)) > 0.05


def test_limit_analysis_of_one_block_is_that_by_hand():
    """A block of 3 m by 1.5 m on a plane of 25 degrees; a narrow one turns for any friction."""
    text = on_base(coulomb(0.7002), [3.0, 1.5], 25.0)
    by_hand = 0.7002 / np.tan(np.radians(25.0))
    assert upper_factor(parse(text)) == pytest.approx(by_hand, rel=2e-3)
    with pytest.raises(ValueError, match="different signs"):  # it is held by no friction at all
        upper_factor(parse(text.replace("box = [3.0, 1.5]", "box = [0.6, 1.5]")))


@pytest.mark.parametrize(
    ("height", "phi", "fails"),
    [
        (10.0, 40.1, "not"),  # phi above the dip, and 10/10 above tan(40 degrees) = 0.839
        (5.0, 24.0, "slides"),  # width over height above tan(24 degrees) = 0.445
        (20.0, 24.0, "slides"),  # 0.5: it would turn if it stuck, but it slides away below itself
        (25.0, 24.0, "turns"),  # 0.4
        (40.0, 24.0, "turns"),  # 0.25
    ],
)
def test_a_block_on_a_slope_stands_slides_or_turns(height, phi, fails):
    """3DEC's sliding block: 10 m wide, on a slope of 40 degrees, joint of 10 MPa/m."""
    friction, (down, on) = np.tan(np.radians(phi)), dipping(40.0)
    text = on_base(coulomb(friction, 1e7, 1e7), [10.0, height], 40.0, [80.0, 20.0], end=1.5)
    sim = Simulation(parse(text + "dashpot_normal = 1.0\ncorner_length = 4.0\n"))
    x, _, turn = sim.blocks.motion[:3, 1].copy()
    until(sim, sim.scene.run.end)
    slid, turned = sim.blocks.motion[0, 1] - x, np.degrees(sim.blocks.motion[2, 1] - turn)
    if fails == "not":
        assert abs(slid) < 1e-6
        assert abs(turned) < 1e-6
    elif fails == "slides":  # as a mass point does; it rocks by what the joint closes under its toe
        gain = down + friction * on
        assert slid == pytest.approx(0.5 * gain * sim.time**2, rel=0.1)
        assert abs(turned) < 1.0
    else:
        assert turned < -5.0


WEDGE = """
[[block]]
name = "left"
corners = [[-6.0, 0.0], [-1.5, 0.0], [0.0, {height}], [-6.0, {height}]]
fixed_motions = ["y", "turn"]
load = [{push}, 0.0]
[[block]]
name = "right"
corners = [[1.5, 0.0], [6.0, 0.0], [6.0, {height}], [0.0, {height}]]
fixed_motions = ["y", "turn"]
load = [-{push}, 0.0]
[[block]]
name = "wedge"
corners = [[-1.5, 0.0], [1.5, 0.0], [0.0, {height}]]
[run]
end = 0.2
"""


@pytest.mark.parametrize(
    ("half_angle", "phi", "push"),
    [
        (20, 35, 1e5),
        pytest.param(30, 35, 4e5, marks=pytest.mark.slow),
        pytest.param(30, 45, 2e5, marks=pytest.mark.slow),
        pytest.param(40, 45, 1e6, marks=pytest.mark.slow),
        pytest.param(25, 30, 3e5, marks=pytest.mark.slow),
    ],
)
def test_a_roof_wedge_drawn_with_its_apex(half_angle, phi, push):
    """Three blocks meet in a point, where the walls press on nothing: they press the wedge."""
    angle, mu = np.radians(half_angle), np.tan(np.radians(phi))
    height = 1.5 / np.tan(angle)
    half = 0.5 * 2600.0 * 9.81 * 1.5 * height  # of its weight, N
    law = f"[laws.j]\n{coulomb(mu)}"
    scene = parse(law + WEDGE.format(height=height, push=push))
    normal, shear = (
        push * np.cos(angle) - half * np.sin(angle),
        push * np.sin(angle) + half * np.cos(angle),
    )
    assert factor_of_safety(scene) == pytest.approx(mu * normal / shear, rel=FOUND)


@pytest.mark.parametrize("energy", ["", "energy_I = 200.0, energy_II = 200.0, "])
@pytest.mark.parametrize("times", [1.05, 2.0, 4.0, 10.0])
def test_a_block_hangs_from_a_bond(times, energy):
    """At W/kn, with its bond whole, though the asperities beside it are a hundred times softer."""
    weight = 2600 * 9.81
    strength = f"tension = {times * weight}, cohesion = {times * weight}, {energy}"
    law = f"{ROCK}bond = {{ {strength}normal_stiffness = 1e9, shear_stiffness = 5e8 }}\n"
    roof = block("roof", box=[4.0, 1.0], at=[0.0, 1.0], fixed=True)
    text = f"[laws.j]\n{law}{roof}{block('b', box=[1.0, 1.0])}[run]\nend = 1.0\n"
    sim = Simulation(parse(text))
    assert not sim.unstable.any()
    assert not sim.joints.damage.any()
    assert sim.blocks.motion[1, 1] == pytest.approx(-weight / 1e9, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("brittle", [False, True], ids=["kept", "lost"])
@pytest.mark.parametrize(
    ("dip", "phi", "cohesion"),
    [(35, 30, 10e3), (45, 35, 20e3), (60, 30, 40e3), (60, 0, 40e3)],
)
def test_a_block_held_by_cohesion(dip, phi, cohesion, brittle):
    """Cohesion that stays adds to friction: (c A + W cos tan phi)/(W sin). Where it is lost after
    the peak, the block holds while its upper end is below its peak, or while the lower end and what
    is left at the upper one bear it, whichever is more; the load turns the block onto its lower
    end."""
    mu, (down, on) = np.tan(np.radians(phi)), dipping(dip)
    residual = {"residual_cohesion": 0.0} if brittle else {}
    law = coulomb(mu, cohesion=cohesion, tension=cohesion, **residual)
    normal, shear = -2600.0 * 1.5 * on, 2600.0 * 1.5 * down  # Pa, means over the base
    upper, lower = normal - shear * np.array([0.5, -0.5])  # 2 (1.5 m / 2) over 3 m
    expected = (cohesion + mu * normal) / shear
    if brittle:
        peak = (cohesion + mu * upper) / shear
        expected = max(peak, 0.5 * (cohesion + mu * lower + mu * upper) / shear)
    assert factor_of_safety(parse(on_base(law, [3.0, 1.5], dip))) == pytest.approx(
        expected, rel=0.01
    )


@pytest.mark.slow
def test_slope_with_rock_bridges_fails_step_by_step_as_its_strength_falls():
    """The shipped scene, weakened slowly in a run: bridge after bridge breaks.

    It still stands a little below its factor of safety, which is found from equilibria of new
    joints, and fails a little above.
    """
    scene = load("bridges")
    assert Simulation(load("bridges-weathered")).unstable.any()
    factor = factor_of_safety(scene)
    calm = replace(scene.run, fraction=0.5, law_steps=1, dashpot_normal=0.3, dashpot_shear=0.3)
    sim = Simulation(replace(weakened(scene, 1.15 * factor), reduction=1.0, run=calm))
    start, moved, broken = sim.blocks.motion[:2].copy(), [], [(sim.joints.damage == 1.0).sum()]
    for below, to in itertools.pairwise([1.0, 0.5 + 0.5 * factor, 0.96 * factor, 1.15 * factor]):
        for weaker in np.append(np.linspace(below, to, 1000), np.full(3000, to)):
            sim.joints.reduction[1] = weaker  # of the shear strength
            sim.step()
        moved.append(np.abs(sim.blocks.motion[:2] - start).max())
        broken.append((sim.joints.damage == 1.0).sum())
    assert moved[1] < 2e-3 < 1e-2 < moved[2]
    assert (np.diff(broken) > 0).all()
