"""A law with an element from outside the package in a block scene and in strength reduction."""

import math
from dataclasses import replace

import numpy as np
import pytest
from own_law import CLAY, ClayLaw
from scene_text import block, coulomb

import jointlaw as jl
from dem_demo import Simulation, parse
from dem_demo.output.monitors import friction_angle, shear_curve
from dem_demo.studies.strength import LOG_FACTOR, factor_of_safety

SLOPE = math.radians(35.0)
WEIGHT = 2600.0 * 9.81 * 2.0 * 0.4  # N/m


def slab_scene(law):
    """A slab 2 m long on a plane, gravity turned by the slope."""
    g = 9.81 * np.array([math.sin(SLOPE), -math.cos(SLOPE)])
    text = (
        f"gravity = [{g[0]}, {g[1]}]\ndensity = 2600.0\n[laws.joint]\n"
        + coulomb(0.6, 1e10, 5e9)
        + block("base", corners=[(-3, -1), (3, -1), (3, 0), (-3, 0)], fixed=True)
        + block("slab", corners=[(-1, 0), (1, 0), (1, 0.4), (-1, 0.4)])
        + "[run]\nend = 0.05\n"
    )
    scene = parse(text)
    return replace(scene, laws={"joint": law})


def test_blocks_step_a_law_from_outside_the_package():
    """At rest it bears the weight of the slab, whose joint alone would slide."""
    sim = Simulation(slab_scene(CLAY))
    for _ in range(50):
        sim.step()
    forces = np.array([WEIGHT * math.cos(SLOPE), WEIGHT * math.sin(SLOPE)])
    area = 1.0  # m2 of each of two contacts
    assert area * sim.joints.traction.sum(axis=0) == pytest.approx(forces, rel=1e-3)
    assert WEIGHT * math.sin(SLOPE) > CLAY.friction * WEIGHT * math.cos(SLOPE)


def test_factor_of_safety_is_the_sum_of_both_strengths_over_the_load():
    """Friction and the clay's strength, over the weight along the slope."""
    strength = CLAY.friction * WEIGHT * math.cos(SLOPE) + CLAY.clay_strength * 2.0
    expected = strength / (WEIGHT * math.sin(SLOPE))
    factor = factor_of_safety(slab_scene(CLAY))
    assert factor == pytest.approx(expected, rel=1.1 * LOG_FACTOR.tolerance)


def test_monitors_include_the_element():
    """Friction angle and shear curve have the strength of Coulomb's joint and of the clay."""
    stress = 1e4
    strength = CLAY.friction * stress + CLAY.clay_strength
    angle = math.degrees(math.atan(strength / stress))
    assert friction_angle(CLAY, stress) == pytest.approx(angle, rel=1e-9)
    record = shear_curve(CLAY, stress, np.array([0.0, 1e-3]))
    assert record.shear_stress.max() == pytest.approx(strength, rel=1e-9)


def test_a_scene_names_its_kind(monkeypatch):
    monkeypatch.setitem(jl.Law.kinds, "clay", ClayLaw)
    laws = CLAY.to_toml().replace("version = 1", "#")
    base = 'gravity = [0.0, -9.81]\n[[block]]\nname = "b"\nbox = [1.0, 1.0]\nat = [0.0, 0.0]\n'
    scene = parse(f"{base}[run]\nend = 0.1\n[laws.joint]\n{laws}")
    assert scene.laws["joint"] == CLAY
