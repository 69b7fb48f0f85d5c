"""Limit analysis against closed forms: a block on a plane with cohesion and tension, a planar slide
with a tension crack and water, and a law whose strength envelope is curved."""

import math

import numpy as np
import pytest
from scene_text import ROCK, block, coulomb, lines, on_base
from scipy.optimize import linprog
from scipy.sparse import csr_array, eye, hstack, vstack

import jointlaw as jl
from dem_demo import parse
from dem_demo.studies.limit_analysis import (
    force_balance,
    least_imbalance,
    limit_factor,
    peak_strength,
    strength_of,
)

EXACT = 1.5e-3  # more than the search leaves, 1e-3
UNIT_WEIGHT = 2600.0 * 9.81


@pytest.mark.parametrize("cohesion", [0.0, 2e4])
@pytest.mark.parametrize("dip", [20.0, 40.0])
def test_block_on_a_plane(cohesion, dip):
    scene = parse(on_base(coulomb(0.7, cohesion=cohesion), [3.0, 0.75], dip))
    weight = UNIT_WEIGHT * 3.0 * 0.75
    angle = math.radians(dip)
    strength = weight * math.cos(angle) * 0.7 + cohesion * 3.0
    assert limit_factor(scene) == pytest.approx(strength / (weight * math.sin(angle)), rel=EXACT)


def test_column_that_tension_keeps_from_toppling():
    """Its heel carries tension over half of the base: the moment about the toe is that of the
    tension over the base, as in the discretised joint (two contact points)."""
    dip = 25.0
    height = 4.0
    width = 1.0
    tension = 1.2e5
    law = coulomb(0.8, cohesion=2e6, tension=tension)
    scene = parse(on_base(law, [width, height], dip))
    angle = math.radians(dip)
    overturning = UNIT_WEIGHT * width * height * (
        math.sin(angle) * height / 2 - math.cos(angle) * width / 2
    )  # fmt: skip
    by_hand = tension * width**2 / 2 / overturning
    assert limit_factor(scene) == pytest.approx(by_hand, rel=EXACT)


def planar_slide(filled, friction=0.7, cohesion=4e4):
    """A planar slide of 30 m with a tension crack, and its factor of safety by Hoek and Bray."""
    height = 30.0
    face = math.radians(65)
    plane = math.radians(38)
    behind = 8.0
    crest = (-height / math.tan(face), height)
    x = crest[0] - behind
    top = (x, height)
    bottom = (x, -x * math.tan(plane))
    crack = top[1] - bottom[1]
    length = math.hypot(*bottom)
    level = bottom[1] + filled * crack
    corners = [(0, 0), crest, top, bottom]
    edges = zip(corners, [*corners[1:], corners[0]], strict=True)
    area = 0.5 * abs(sum(p[0] * q[1] - q[0] * p[1] for p, q in edges))
    weight = UNIT_WEIGHT * area
    uplift = 0.5 * 9810 * filled * crack * length
    thrust = 0.5 * 9810 * (filled * crack) ** 2
    sin = math.sin(plane)
    cos = math.cos(plane)
    normal = weight * cos - uplift - thrust * sin
    shear = weight * sin + thrust * cos
    text = "[laws.joint]\n" + coulomb(friction, cohesion=cohesion)
    text += "[laws.crack]\n" + coulomb(0.0)
    if filled:
        text += "[water]\n" + lines(table=[[-500, level], [x, level], [0, 0]])
    text += block(
        "base", corners=[(-60, -2), (0, -2), (0, 0), bottom, (-60, bottom[1])], fixed=True
    )
    text += block("behind", corners=[(-60, bottom[1]), bottom, top, (-60, top[1])], fixed=True)
    text += block("slide", corners=corners)
    text += "[[joint]]\n" + lines(between=["slide", "behind"], law="crack")
    text = 'law = "joint"\n' + text + "[run]\nend = 0.1\n"
    return parse(text), (cohesion * length + normal * friction) / shear


@pytest.mark.parametrize("filled", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("cohesion", [0.0, 4e4])
def test_planar_slide_with_water(filled, cohesion):
    scene, by_hand = planar_slide(filled, cohesion=cohesion)
    assert limit_factor(scene) == pytest.approx(by_hand, rel=EXACT)


def test_excluded_blocks_need_no_balance():
    """A block in the air has no equilibrium; without its equations the other decides."""
    text = on_base(coulomb(0.7), [3.0, 0.75], 30.0)
    text = text.replace("[run]", block("falling", box=[0.5, 0.5], at=[0.0, 5.0]) + "[run]")
    scene = parse(text)
    assert limit_factor(scene) == 0.0
    excluded = np.array([block.name == "falling" for block in scene.blocks])
    by_hand = 0.7 / math.tan(math.radians(30.0))
    assert limit_factor(scene, excluded) == pytest.approx(by_hand, rel=EXACT)


def test_tangents_of_a_rough_law_lie_above_its_strength():
    law = parse(on_base(ROCK, [3.0, 0.75])).laws["rock"]
    strength = strength_of(law, 1e5)
    stresses = np.geomspace(1e3, 1e6, 9)
    above = (strength.cohesion + np.outer(stresses, strength.friction)).min(axis=1)
    peaks = peak_strength(law, stresses)
    assert (above > 0.998 * peaks).all()
    inside = (stresses > 1e2) & (stresses < 3e5)
    assert (above[inside] < 1.05 * peaks[inside]).all()


def test_block_on_a_rough_joint():
    """Its bound is the strength of the law at its normal stress over its shear stress."""
    dip = math.radians(40.0)
    height = 0.75
    scene = parse(on_base(ROCK, [3.0, height], 40.0))
    law: jl.JointLaw = scene.laws["rock"]
    normal, shear = (UNIT_WEIGHT * height * f(dip) for f in (math.cos, math.sin))

    def uneven(share):  # the two ends of the joint bear different stresses
        return peak_strength(law, normal * (1 + share)) + peak_strength(law, normal * (1 - share))

    arm = height * shear / (3.0 * normal)  # two points, 3 m apart, balance the moment of the weight
    by_hand = uneven(arm) / (2 * shear)
    assert limit_factor(scene) == pytest.approx(by_hand, rel=0.01)


TOP = 'gravity = [0.0, -9.81]\nlaw = "joint"\n[laws.joint]\n'
SLOPE = """
[[rock]]
name = "slope"
outline = [[-12, -1], [5, -1], [5, 0], [0, 0], [-5, 8], [-12, 8]]
seed = 1
[[rock.set]]
dip = 30.0
spacing = 1.5
through = [-0.2, 0.6]
[[rock.set]]
dip = -60.0
spacing = 2.0
[[rock.fixed]]
corners = [[-16, -2], [6, -2], [6, 0.1], [0.2, 0.2], [-9.6, 5.7], [-11, 7.5], [-11, 9], [-16, 9]]
[run]
end = 1.0
"""
BOLT = "[[bolt]]\n" + lines(
    **{"from": [-2.6, 3.0], "to": [-11.5, -0.7]},
    stiffness=1e8,
    capacity=1e5,
    pretension=0.0,
)
LAWS = {
    "friction": coulomb(0.7),
    "cohesion and tension": coulomb(0.5, cohesion=2e3, tension=5e2),
    "no friction": coulomb(0.0, cohesion=1e4),
    "no strength": coulomb(0.0),
    "strong bonds": coulomb(1.0, 1e12, 1e12, cohesion=1e11, tension=1e10),
    "rough": ROCK,
}


def solve_by_linprog(balance, factor):
    """Least unbalanced forces by a general solver, from the balance and the lines as they are."""
    scale = np.abs(balance.load).max()
    m, n = balance.normal.shape
    area = balance.area / scale
    bolts = balance.bolts.shape[1]
    one = eye(m)
    equations = hstack([balance.normal, balance.shear, balance.bolts, one, -one])
    bounds = [(None, None)] * (2 * n)
    rows = []
    limits = []
    for i, strength in enumerate(balance.strengths):
        k = np.flatnonzero(balance.law == i)
        pick = csr_array((np.ones(len(k)), (np.arange(len(k)), k)), shape=(len(k), n))
        rest = csr_array((len(k), bolts + 2 * m))
        for cohesion, friction in zip(strength.cohesion, strength.friction, strict=True):
            for sign in (1.0, -1.0):
                rows.append(hstack([-friction / factor * pick, sign * pick, rest]))
                limits.append(cohesion * area[k] / factor)
        rows.append(hstack([-pick, 0.0 * pick, rest]))
        limits.append(strength.tension * area[k] / factor)
    bounds += [(0.0, capacity / scale) for capacity in balance.capacity]
    bounds += [(0.0, None)] * (2 * m)
    cost = np.repeat([0.0, 1.0], [2 * n + bolts, 2 * m])
    solution = linprog(
        cost, vstack(rows), np.concatenate(limits), equations, -balance.load / scale, bounds
    )
    assert solution.status == 0
    return solution.fun


QUICK_LAWS = ("cohesion and tension", "no strength")
SLOW_LAWS = [pytest.param(law, marks=pytest.mark.slow) for law in LAWS if law not in QUICK_LAWS]


@pytest.mark.parametrize("law", [*QUICK_LAWS, *SLOW_LAWS])
def test_the_interior_point_method_finds_the_minimum_of_a_general_solver(law):
    """Least unbalanced forces of a cut slope with a bolt, below and above its limit, and their
    derivative by the inverse of the factor."""
    balance = force_balance(parse(TOP + LAWS[law] + SLOPE + BOLT))
    for factor in (0.7, 3.0):
        imbalance = least_imbalance(balance, factor)
        by_linprog = solve_by_linprog(balance, factor)
        # the lower bound lies below the minimum by a share of 1e-3 at most
        assert imbalance.force == pytest.approx(by_linprog, rel=1.1e-3, abs=1e-6)
        assert imbalance.force <= by_linprog * (1.0 + 1e-6) + 1e-6
        if by_linprog > 0.01:  # above its limit
            weaker, stronger = (solve_by_linprog(balance, factor * s) for s in (1.001, 0.999))
            slope = (stronger - weaker) * factor / 2e-3
            assert imbalance.derivative == pytest.approx(slope, rel=0.02, abs=1e-3)
