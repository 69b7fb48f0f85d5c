"""Pseudo-static seismic coefficients: planar slides against their closed form, with water and
in-situ stress; the acceleration of a sliding block; invalid coefficients."""

import math
from dataclasses import replace

import numpy as np
import pytest
from running import until
from scene_text import block, coulomb, lines, on_base

from dem_demo import Simulation, parse
from dem_demo.output.monitors import predict_slip
from dem_demo.studies.limit_analysis import limit_factor
from dem_demo.studies.strength import factor_of_safety

UNIT_WEIGHT = 2600.0 * 9.81
WATER_UNIT_WEIGHT = 9810.0
SEARCH_TOLERANCE = 6e-3  # of the factor of safety
BISECTION_TOLERANCE = 1.5e-3  # of limit analysis
HEIGHT = 20.0
PLANE = math.radians(36.0)
FRICTION = 0.7


def planar_slide(seismic, cohesion, water_depth):
    """A slide on a plane that daylights at (0, 0), with a vertical, free back, and its factor.

    seismic: coefficients [kx, ky], kx > 0 out of the slope. cohesion in Pa. water_depth (m): of the
    uniform water pressure on the plane. Factor of safety: strength over shear force of the weight,
    the coefficients and the uplift.
    """
    back = -HEIGHT
    foot = (back, HEIGHT * math.tan(PLANE))
    top = (back, foot[1] + 4.0)
    crest = (-5.0, top[1])
    corners = [(0.0, 0.0), crest, top, foot]
    edges = zip(corners, [*corners[1:], corners[0]], strict=True)
    weight = UNIT_WEIGHT * 0.5 * abs(sum(p[0] * q[1] - q[0] * p[1] for p, q in edges))
    length = math.hypot(*foot)
    kx, ky = seismic
    down = weight * (1 - ky)
    out = weight * kx
    text = 'law = "plane"\n' + lines(seismic=list(seismic))
    text += "[laws.plane]\n" + coulomb(FRICTION, cohesion=cohesion)
    uplift = 0.0
    if water_depth:
        text = text + lines(pressure=water_depth * WATER_UNIT_WEIGHT)
        uplift = water_depth * WATER_UNIT_WEIGHT * length
    base = [(-60, -2), (0, -2), (0, 0), foot, (-60, foot[1])]
    text += block("base", corners=base, fixed=True) + block("slide", corners=corners)
    scene = parse(text + "[run]\nend = 0.1\n")
    normal = down * math.cos(PLANE) - out * math.sin(PLANE) - uplift
    shear = down * math.sin(PLANE) + out * math.cos(PLANE)
    return scene, (cohesion * length + normal * FRICTION) / shear


@pytest.mark.parametrize("seismic", [(0.0, 0.0), (0.2, 0.0), (0.15, -0.1), (-0.1, 0.05)])
@pytest.mark.parametrize(("cohesion", "water_depth"), [(0.0, 0.0), (3e4, 0.0), (3e4, 3.0)])
def test_planar_slide(seismic, cohesion, water_depth):
    scene, by_hand = planar_slide(seismic, cohesion, water_depth)
    assert limit_factor(scene) == pytest.approx(by_hand, rel=BISECTION_TOLERANCE)
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)


def test_water_and_in_situ_stress_follow_from_the_weight():
    """The profiles of both and the loads on the edges are the same with coefficients; the forces
    of the coefficients are added to them."""
    text = "[laws.j]\n" + coulomb(FRICTION)
    text += block("floor", box=[6.0, 1.0], at=[0.0, -0.5], fixed=True)
    text += block("left", box=[1.0, 2.0], at=[-2.5, 1.0], fixed=True)
    text += block("slab", box=[4.0, 2.0], at=[0.0, 1.0], density=2400.0)
    text += "[water]\ntable = [[0.0, 1.5]]\n[in_situ]\nk0 = 0.5\n[run]\nend = 0.1\n"
    still = Simulation(parse(text))
    shaken = Simulation(parse("seismic = [0.1, -0.05]\n" + text))
    assert shaken.scene.in_situ.weight == still.scene.in_situ.weight == UNIT_WEIGHT
    assert shaken.blocks.steady_loads == pytest.approx(still.blocks.steady_loads)
    scale = np.abs(still.blocks.loads).max()
    assert shaken.blocks.loads == pytest.approx(still.blocks.loads, abs=1e-3 * scale)
    weight = 2400.0 * 9.81 * 8.0
    added = shaken.blocks.gravity - still.blocks.gravity
    assert added[2] == pytest.approx([0.1 * weight, -0.05 * weight, 0.0], abs=1e-9 * weight)
    assert not added[:2].any()  # fixed blocks


def test_a_slide_with_in_situ_stress():
    """In-situ stress of the joint at the start does not change the forces at limit equilibrium."""
    scene, by_hand = planar_slide((0.2, 0.0), 3e4, 0.0)
    scene = parse(scene.text + "[in_situ]\nk0 = 0.5\n")
    assert limit_factor(scene) == pytest.approx(by_hand, rel=BISECTION_TOLERANCE)
    assert factor_of_safety(scene) == pytest.approx(by_hand, rel=SEARCH_TOLERANCE)


def test_a_block_slides_with_the_acceleration_of_its_closed_form():
    """On a plane of friction 0.3 at 20 degrees: (sin + k cos - 0.3 (cos - k sin)) g."""
    dip = math.radians(20.0)
    k = 0.25
    out_of_slope = [k * math.cos(dip), k * math.sin(dip)]
    text = lines(seismic=out_of_slope) + on_base(coulomb(0.3, 1e9, 1e9), [3.0, 0.5], 20.0, end=0.3)
    sim = Simulation(parse(text))
    start = sim.blocks.motion[:, 1].copy()
    time = sim.time
    until(sim, 0.2)
    acceleration = 9.81 * (
        math.sin(dip) + k * math.cos(dip) - 0.3 * (math.cos(dip) - k * math.sin(dip))
    )
    speed = sim.blocks.motion[3, 1] - start[3]
    assert speed == pytest.approx(acceleration * (sim.time - time), rel=0.01)
    assert abs(sim.energy_balance.error) < 1e-3


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("0.1", r"seismic = 0.1: must be two numbers"),
        ("[0.1]", r"seismic = \[0.1\]: must be two numbers"),
        ("[15, 0]", r"seismic = 15.*must be from -2 to 2 \(shares of the weight"),
        ("[0.1, nan]", r"seismic.*nan"),
        ('[0.1, "up"]', r"seismic.*'up'"),
    ],
)
def test_invalid_coefficients_are_named(value, message):
    text = on_base(coulomb(0.3), [3.0, 0.5])
    with pytest.raises(ValueError, match=message):
        parse(f"seismic = {value}\n{text}")


def test_coefficients_without_gravity_are_named():
    text = on_base(coulomb(0.3), [3.0, 0.5])
    text = text.replace(text.splitlines()[0], "gravity = [0.0, 0.0]")
    with pytest.raises(ValueError, match=r"seismic = \[0.1, 0.0\].*give gravity"):
        parse(f"seismic = [0.1, 0.0]\n{text}")


def test_monitored_slip_is_not_predicted_with_coefficients():
    scene = parse(on_base(coulomb(0.3), [3.0, 0.5]))
    assert predict_slip(scene, "rock", 1, 3.0)["predicted_angle"] is not None
    shaken = replace(scene, seismic=(0.1, 0.0))
    assert predict_slip(shaken, "rock", 1, 3.0)["predicted_angle"] is None
