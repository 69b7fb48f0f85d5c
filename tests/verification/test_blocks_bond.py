"""Blocks that hang on tension or are kept by a bond: against strengths worked out by hand."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scene_text import ROCK, coulomb, on_base

import jointlaw as jl
from dem_demo import Simulation, load, parse
from dem_demo.studies.strength import factor_of_safety, weakened

G, RHO, T, C = 9.81, 2600.0, 2e5, 2e4  # m/s2, kg/m3, Pa
LAW = coulomb(0.6, 2e9, 2e9, tension=T, cohesion=4e5)


def under(law):
    """A block under a roof; the joint is 1 m2 per m of its width."""
    return parse(on_base(law, [1.0, 1.0], 180.0))


def test_a_block_that_hangs_holds_to_the_tension():
    """Loaded slowly: what it bears before it falls is tension times area."""
    sim = Simulation(under(LAW))
    weight = RHO * G
    assert sim.joints.traction[:, 0] == pytest.approx(-weight)
    held = 0.0
    for share in np.linspace(weight / T, 1.01, 4000):
        sim.blocks.loads[1, 1] = share * T - weight
        sim.step()
        if (sim.joints.damage < 1.0).all():
            held = share
    assert 0.99 < held <= 1.01
    while sim.joints.n:  # it falls out of reach
        sim.step()
    assert sim.ledger.error == pytest.approx(0.0, abs=1e-3)


def test_faces_that_meet_anew_have_no_cohesion():
    """A block that falls onto its base bounces off: nothing holds it."""
    scene = parse(on_base(LAW, [1.0, 1.0]))
    drawn = replace(scene.blocks[1], corners=np.add(scene.blocks[1].corners, [0.0, 0.05]))
    run = replace(scene.run, seat=False)
    sim = Simulation(replace(scene, blocks=(scene.blocks[0], drawn), run=run))
    while not (sim.joints.traction[:, 0] > 0.0).any():
        sim.step()
    assert (sim.joints.damage == 1.0).all()


@pytest.mark.slow
def test_slope_with_rock_bridges_fails_step_by_step_as_its_strength_falls():
    """The shipped scene, weakened slowly in a run: bridge after bridge breaks.

    It still stands a little below its factor of safety, which is found from equilibria of new
    joints, and fails a little above.
    """
    scene = load("bridges")
    assert Simulation(load("bridges-weathered")).loose.any()
    factor = factor_of_safety(scene)
    calm = replace(scene.run, fraction=0.5, law_steps=1, dashpot_normal=0.3, dashpot_shear=0.3)
    sim = Simulation(replace(weakened(scene, 1.15 * factor), reduction=1.0, run=calm))
    start, moved, broken = sim.blocks.motion[:2].copy(), [], [(sim.joints.damage == 1.0).sum()]
    for below, to in itertools.pairwise([1.0, 0.5 + 0.5 * factor, 0.96 * factor, 1.15 * factor]):
        for weaker in np.append(np.linspace(below, to, 1000), np.full(1000, to)):
            sim.joints.reduction[1] = weaker  # of the shear strength
            sim.step()
        moved.append(np.abs(sim.blocks.motion[:2] - start).max())
        broken.append((sim.joints.damage == 1.0).sum())
    assert moved[1] < 2e-3 < 1e-2 < moved[2]
    assert (np.diff(broken) > 0).all()


def test_factor_of_safety_of_a_rough_bonded_block():
    """Brittle bond and asperities that climb: the joint's own peak over the weight along it."""
    bond = f"normal_stiffness = 1e8, shear_stiffness = 1e8, tension = {T}, cohesion = {C}"
    rock = ROCK.replace("a = 3.0", "a = 6.0").replace("2e-3", "5e-3")
    law = f"{rock}resolution = {{ u = 3, phi = 4, depth = 1 }}\nbond = {{ {bond} }}\n"
    angle, wide, high = np.radians(35.0), 4.0, 0.2
    scene = parse(on_base(law, [wide, high], 35.0))
    weight = RHO * G * wide * high
    joint = scene.laws["rock"].joint()
    shear = jl.direct_shear(joint, 3e-4, weight * np.cos(angle) / wide, steps=600).shear_stress
    expected = shear.max() * wide / (weight * np.sin(angle))
    assert factor_of_safety(scene) == pytest.approx(expected, rel=0.01)
