"""Factors of safety and critical tilts of many blocks: against slow tilts of the same blocks in a
run, against textbooks, and their order where strength, water and bolts change."""

import itertools
import math

import goodman_bray
import numpy as np
import pytest
from scene_text import block, coulomb, lines

from dem_demo import Simulation, parse
from dem_demo.dynamics.equilibrium import equilibrium_displacements
from dem_demo.output.record import RunRecord
from dem_demo.output.run import advance
from dem_demo.studies.limit_analysis import limit_factor
from dem_demo.studies.strength import LOG_FACTOR, critical_tilt, factor_of_safety, weakened

SEARCH_TOLERANCE = math.expm1(LOG_FACTOR.tolerance)
BRICK_LENGTH, BRICK_HEIGHT = 0.4, 0.2  # m
FAILED = 0.1 * BRICK_HEIGHT  # m, of any brick relative to the base
TILT_RATE = 0.5  # degrees/s


def dry_wall(columns, rows, stiffness, dip=0.0, end=0.1, turns=0.0):
    """A wall of bricks in stretcher bond, half bricks at its ends, friction 0.65 (33 degrees).

    dip (degrees): of the base as drawn; turns (degrees): by which the base turns until `end` (s).
    """
    gravity = 9.81 * np.array([math.sin(math.radians(dip)), -math.cos(math.radians(dip))])
    width = columns * BRICK_LENGTH
    text = lines(gravity=gravity, density=2000.0)
    text += f"[laws.joint]\n{coulomb(0.65, stiffness, stiffness)}"
    base = [[-1.0, -0.3], [width + 1.0, -0.3], [width + 1.0, 0.0], [-1.0, 0.0]]
    text += block("base", corners=base, fixed=True)
    for row in range(rows):
        inner = np.arange(BRICK_LENGTH if row % 2 == 0 else 0.5 * BRICK_LENGTH, width - 1e-9,
                          BRICK_LENGTH)  # fmt: skip
        low, high = row * BRICK_HEIGHT, (row + 1) * BRICK_HEIGHT
        for left, right in itertools.pairwise([0.0, *inner.tolist(), width]):
            corners = [[left, low], [right, low], [right, high], [left, high]]
            text += block(f"{row} {left:.1f}", corners=corners)
    if turns:
        text += "[[drive]]\n" + lines(
            block="base", motion="turn", times=[0.0, end], values=[0.0, -turns], ramp=0.3
        )
    return text + "[run]\n" + lines(end=end, record=0.05, dashpot_normal=0.3, dashpot_shear=0.3)


def tilt_in_a_run(columns, rows, stiffness, around):
    """Tilt (degrees) at which a brick has moved by FAILED, as the base turns slowly.

    around (degrees): the run begins 1.2 below it and ends 1 above it.
    """
    start = around - 1.2
    end = 2.2 / TILT_RATE
    text = dry_wall(columns, rows, stiffness, start, end, turns=TILT_RATE * end)
    sim = Simulation(parse(text))
    assert not sim.unstable.any()

    def moved(record):
        """Largest displacement (m) of a brick in the frame of the base."""
        angle = record.motion[-1][2, 0]
        back = np.exp(-1j * angle)
        place, first = (m[0] + 1j * m[1] for m in (record.motion[-1], record.initial))
        return np.abs((place - place[0]) * back - (first - first[0])).max()

    record = RunRecord(sim)
    advance(sim, record, stop=lambda record: moved(record) > FAILED)
    assert moved(record) > FAILED
    return start - math.degrees(record.motion[-1][2, 0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("columns", "rows", "stiffness"), [(4, 12, 1e9), (8, 12, 1e9), (8, 12, 1e10)]
)
def test_critical_tilt_of_a_dry_wall_is_the_tilt_at_which_it_falls_in_a_run(
    columns, rows, stiffness
):
    """Within 0.5 degrees: the run needs some time to move a brick by 2 cm, in which the tilt grows,
    and its joints have the history of the tilt."""
    computed = critical_tilt(parse(dry_wall(columns, rows, stiffness)))
    assert tilt_in_a_run(columns, rows, stiffness, computed) == pytest.approx(computed, abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ratio", "expected"), [(1.0, 1.002), (0.3, 0.996), (0.1, 0.967), (0.01, 0.942)]
)
def test_toppling_columns_of_goodman_and_bray_depend_on_the_shear_stiffness(ratio, expected):
    """At the friction of the textbook's limit equilibrium; ratio: shear over normal stiffness."""
    text = goodman_bray.scene_text(goodman_bray.limit_friction(), 1e10, ratio * 1e10)
    scene = parse(text)
    assert factor_of_safety(scene) == pytest.approx(expected, rel=0.01)
    assert limit_factor(scene) > 1.0


# ------------------------------------------------------------------ the order of factors


def cut_slope(seed, cohesion=0.0, water=None, anchored=None, spacing=(1.1, 1.5)):
    """A random slope 8 m high of two joint sets: their dips, spacings and friction follow the seed.

    cohesion in Pa; water (m): level of the table behind the slope; anchored (N): capacity and
    pretension of a bolt from the block next to the toe into the rock behind the slope.
    """
    rng = np.random.default_rng(seed)
    dip, cross = rng.uniform(24, 34), rng.uniform(-75, -55)
    friction = rng.uniform(0.6, 0.9)
    along = rng.uniform(*spacing)
    text = 'law = "joint"\n[laws.joint]\n' + coulomb(friction, 5e9, 2e9, cohesion=cohesion)
    outline = [[-14, -1], [6, -1], [6, 0], [0, 0], [-5, 8], [-14, 8]]
    text += "[[rock]]\n" + lines(name="slope", outline=outline, seed=seed)
    text += "[[rock.set]]\n" + lines(dip=dip, spacing=along, scatter=0.2, through=[-0.2, 0.3])
    text += "[[rock.set]]\n" + lines(dip=cross, spacing=1.4 * along, scatter=0.3, persistence=0.8)
    fixed = [[-20, -3], [7, -3], [7, 0.2], [0.2, 0.2], [-11, 6.5], [-12, 9], [-20, 9]]
    text += "[[rock.fixed]]\n" + lines(corners=fixed)
    if water is not None:
        text += "[water]\n" + lines(table=[[-20, water], [-8, water], [0.5, 0.0], [7, 0.0]])
    if anchored:
        blocks = parse(text + "[run]\nend = 0.1\n").blocks
        toe = max((one for one in blocks if not one.fixed), key=lambda one: one.centroid[0])
        into_rock = np.array([-math.cos(0.35), -math.sin(0.35)])
        ends = (toe.centroid + length * into_rock for length in np.arange(2.0, 14.0, 0.5))
        anchor = next(p for p in ends if any(one.fixed and contains(one, p) for one in blocks))
        keys = {"stiffness": 5e7, "capacity": anchored, "pretension": 0.5 * anchored}
        text += "[[bolt]]\n" + lines(**{"from": toe.centroid, "to": anchor}, **keys)
    return parse(text + "[run]\nend = 0.1\n")


def contains(one, point):
    """Whether a convex block contains a point."""
    side = np.roll(one.corners, -1, axis=0) - one.corners
    to_point = point - one.corners
    return (side[:, 0] * to_point[:, 1] > side[:, 1] * to_point[:, 0]).all()


def require_order(seed, variants, **keys):
    """Require that factors do not fall from each variant of a slope to the next one, by more than
    the tolerance of two searches, and that none exceeds its upper bound. Returns the factors."""
    factors = []
    for variant in variants:
        scene = cut_slope(seed, **variant, **keys)
        factor = factor_of_safety(scene)
        bound = limit_factor(scene)
        assert bound is None or factor <= bound * (1 + 1e-9)
        factors.append(math.inf if factor is None else factor)  # above 64
    for lower, higher in itertools.pairwise(factors):
        assert higher >= lower * (1 - SEARCH_TOLERANCE)
    return factors


COHESION = [{"cohesion": cohesion} for cohesion in (0.0, 5e3, 2e4)]
DRAWDOWN = [{"water": level} for level in (6.0, 4.5, 3.0, None)]
BOLT = [{"anchored": capacity} for capacity in (0.0, 5e4, 2e5)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 5])
def test_factor_of_safety_is_monotone_in_random_slopes(seed):
    """It rises with cohesion, as the water falls, and with a bolt."""
    cohesive = require_order(seed, COHESION)
    assert cohesive[-1] > 1.1 * cohesive[0]
    drained = require_order(seed, DRAWDOWN)
    assert drained[-1] > 1.05 * drained[0]
    require_order(seed, BOLT)


def test_drainage_cohesion_and_a_bolt_stabilise_a_slope():
    """Three blocks: each change lets them stand with strengths divided by a factor at which they
    have no equilibrium without it."""
    changes = ({"water": 6.0}, {}, {"cohesion": 5e3}, {"cohesion": 5e3, "anchored": 2e5})
    scenes = [cut_slope(1, **change, spacing=(2.5, 3.0)) for change in changes]
    for factor, (weaker, stronger) in zip(
        (1.0, 1.25, 1.5), itertools.pairwise(scenes), strict=True
    ):
        assert equilibrium_displacements(weakened(weaker, factor)) is None
        assert equilibrium_displacements(weakened(stronger, factor)) is not None
