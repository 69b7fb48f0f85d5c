"""Equilibrium by relaxation: its forces, three dimensions, verdicts, and limits of closed form."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scene_text import block, coulomb, lines, on_base
from scipy.sparse import csc_array

import jointlaw as jl
from dem_demo import Simulation, load, parse
from dem_demo.contact import ContactManager, Joints
from dem_demo.dynamics import relaxation
from dem_demo.dynamics.blocks import Blocks
from dem_demo.dynamics.equilibrium import (
    _search_as_drawn,
    create_joints,
    drawn_blocks,
    equilibrium_displacements,
    static_system,
)
from dem_demo.dynamics.relaxation import Relaxation, Verdict, is_plain_friction
from dem_demo.dynamics.search import EquilibriumSearch, factorise
from dem_demo.studies.strength import alone, factor_of_safety, weakened


def search_of(scene):
    blocks = Blocks(scene)
    joints = Joints(scene)
    manager = ContactManager(scene, blocks.motion)
    sliding = create_joints(scene, blocks, manager, joints)
    return EquilibriumSearch(static_system(scene, blocks, manager, joints, sliding))


@pytest.mark.parametrize(
    ("name", "kernel"),
    [("slope", ""), ("wet-slope", ""), ("tunnel", ""), ("bridges", ""), ("bridges", "numpy")],
)
def test_compiled_forces_are_the_assembled_ones(name, kernel, monkeypatch):
    """C sums over rows of contact points, Python multiplies by a sparse matrix."""
    monkeypatch.setenv("JOINTLAW_KERNEL", kernel)
    search = search_of(weakened(load(name).excavated, 1.3))
    y = search.stick_predictor()
    rng = np.random.default_rng(0)
    y = y + 0.1 * np.abs(y).max() * rng.standard_normal(len(y))
    expected = search.expand(search._unbalanced(y)[0])
    result = search._relaxation().unbalanced(search.expand(y))
    assert result == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def test_assembled_stiffness_is_the_derivative_of_the_forces():
    """Along a random motion, by central differences; some joints are open, others slide."""
    search = search_of(weakened(load("wet-slope").excavated, 1.3))
    y = search.stick_predictor()
    rng = np.random.default_rng(0)
    direction = rng.standard_normal(len(y)) * np.abs(y).max()
    stiffness = search._unbalanced(y)[1]
    assert 0 < np.count_nonzero(stiffness.joints.any(axis=(1, 2))) < search.k
    step = 1e-7
    ends = [search._unbalanced(y + sign * step * direction)[0] for sign in (-1.0, 1.0)]
    expected = (ends[0] - ends[1]) / (2 * step)
    result = search._assemble_stiffness(stiffness) @ direction
    assert result == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


def test_factorisation_keeps_its_accuracy_without_entries_on_the_diagonal():
    """Entries of the diagonal that vanish or are tiny cannot be pivots; a singular matrix has no
    factors."""
    rng = np.random.default_rng(1)
    m = 40
    near = np.abs(np.subtract.outer(np.arange(m), np.arange(m))) <= 3
    matrix = rng.standard_normal((m, m)) * near
    np.fill_diagonal(matrix, rng.choice([0.0, 1e-14, 1.0], m))
    exact = rng.standard_normal(m)
    result = factorise(csc_array(matrix)).solve(matrix @ exact)
    assert result == pytest.approx(exact, abs=1e-11 * np.linalg.cond(matrix))
    matrix[3] = 0.0
    assert factorise(csc_array(matrix)) is None


def test_scenes_that_differ_in_their_laws_share_blocks_and_contacts():
    """In-situ stress closes the joints of each law by its own closure, so nothing of one scene may
    be left for the next."""
    text = on_base(coulomb(0.7), [3.0, 0.75], 10.0)
    stress = lines(stress=[0.0, 1e6, 0.0])
    scene = parse(text + "[in_situ]\n" + stress)
    drawn = drawn_blocks(scene)
    starts = []
    for factor in (1.0, 2.0):
        law = scene.laws["rock"]
        stiffer = replace(law, normal_stiffness=factor * law.normal_stiffness)
        changed = replace(scene, laws={"rock": stiffer})
        shared, _ = _search_as_drawn(changed, None, drawn)
        single = search_of(changed)
        for name in ("start", "force", "area"):
            assert np.array_equal(getattr(shared, name), getattr(single, name)), name
        starts.append(shared.start)
    assert np.abs(starts[0] - starts[1]).max() > 0.4 * np.abs(starts[0]).max()


def test_an_error_of_a_law_in_python_passes_through_the_compiled_iterations(monkeypatch):
    monkeypatch.setenv("JOINTLAW_KERNEL", "numpy")
    text = on_base(coulomb(0.8, cohesion=2e4, tension=1e3), [2.0, 1.0], 20.0)  # not plain friction
    search = search_of(parse(text))
    relaxing = search._relaxation()

    def fail(step):
        raise ZeroDivisionError("in the law")

    for batch, _, _ in relaxing.steps:
        monkeypatch.setattr(batch, "advance", fail)
    with pytest.raises(ZeroDivisionError, match="in the law"):
        relaxing.unbalanced(search.expand(search.zero))


def block_in_space(dip, friction, azimuth=0.3):
    """A cube of 1 m on a plane through the origin, four contact points; motions x, y, z and turns
    about them. Axis 1 of the joint is z, axes 2 and 3 are turned by an azimuth in the plane."""
    law = jl.CoulombLaw(1e9, 6e8, friction)
    weight = 26e3
    angle = math.radians(dip)
    load = np.zeros((2, 6))
    load[1, 0] = weight * math.sin(angle)
    load[1, 2] = -weight * math.cos(angle)
    normal = np.array([0.0, 0.0, 1.0])
    rough = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    axes = np.stack([normal, rough, np.cross(normal, rough)])
    kinematics = np.zeros((4, 3, 12))
    for i, (x, y) in enumerate([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]):
        arm = np.array([x, y, -0.5])
        for c, (axis, sign) in enumerate(zip(axes, (-1.0, 1.0, 1.0), strict=True)):
            kinematics[i, c, 6:] = sign * np.concatenate([axis, np.cross(arm, axis)])
            kinematics[i, c, :6] = -sign * np.concatenate([axis, np.cross(arm, axis)])
    is_free = np.array([[0.0] * 6, [1.0] * 6])
    stiffness = np.full(4, 1e9)
    problem = Relaxation(
        [law], np.zeros(4, int), np.zeros(4, int), np.ones(4, int), kinematics, np.full(4, 0.25),
        np.full((4, 3), [1e-5, 0.0, 0.0]), load, is_free, lambda closure: stiffness, stiffness,
    )  # fmt: skip
    return problem, load


@pytest.mark.parametrize(("dip", "verdict"), [(34.9, "EQUILIBRIUM"), (35.1, "NO_EQUILIBRIUM")])
def test_a_block_in_space_stands_up_to_its_friction_angle(dip, verdict):
    """Six motions and three components of the law; without Newton's method."""
    problem, load = block_in_space(dip, math.tan(math.radians(35.0)))
    result = problem.relax(np.zeros((2, 6)), lambda y: None)
    assert result.verdict is Verdict[verdict]
    if result.verdict is Verdict.EQUILIBRIUM:
        assert np.abs(problem.unbalanced(result.y)).max() < 1e-10 * np.abs(load).max()
    else:
        x, y, z = result.growth[1, :3]
        assert abs(y) < 1e-6 * x  # straight down the dip, whatever the azimuth of axis 2
        assert abs(z) < 1e-6 * x


def test_a_search_that_decides_nothing_says_so(monkeypatch):
    """It counts as no equilibrium in strength reduction."""
    monkeypatch.setattr(relaxation, "MAX_ITERATIONS", 2 * relaxation.RAMP_ITERATIONS)
    scene = weakened(alone(load("slope"), "rough"), 1.45)
    search = search_of(scene)
    none = np.zeros(len(scene.blocks), bool)
    solution = search.solve(search.stick_predictor(), none, name_unstable=False)
    assert solution.verdict is Verdict.NOT_DECIDED
    assert equilibrium_displacements(scene) is None


def test_iterations_that_diverge_go_on_with_larger_masses(monkeypatch):
    """Masses of a tenth are unstable; the search finds the same equilibrium."""
    scene = alone(load("slope"), "rough")
    expected = equilibrium_displacements(scene)
    monkeypatch.setattr(relaxation, "MASS_FACTOR", 0.028)
    result = equilibrium_displacements(scene)
    assert result == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def arch(thickness, voussoirs, radius=5.0, friction=5.0):
    """A semicircular arch on fixed springings; thickness over radius."""
    inner = radius * (1 - thickness / 2)
    outer = radius * (1 + thickness / 2)
    angles = np.linspace(0.0, math.pi, voussoirs + 1)
    text = "gravity = [0.0, -9.81]\n[laws.joint]\n" + coulomb(friction, 1e10, 1e10)
    points = [(np.array([math.cos(a), math.sin(a)])) for a in angles]
    for i, (p, q) in enumerate(itertools.pairwise(points)):
        text += block(f"voussoir {i}", corners=[inner * p, outer * p, outer * q, inner * q])
    text += block("right", corners=[(inner, -1), (outer, -1), (outer, 0), (inner, 0)], fixed=True)
    text += block(
        "left", corners=[(-outer, -1), (-inner, -1), (-inner, 0), (-outer, 0)], fixed=True
    )
    return parse(text + "[run]\nend = 0.1\n")


@pytest.mark.slow
@pytest.mark.parametrize("voussoirs", [16, 32, 64, 96])
def test_least_thickness_of_a_semicircular_arch(voussoirs):
    """Milankovitch (1907): 0.1075 of the radius."""
    assert equilibrium_displacements(arch(0.1085, voussoirs)) is not None
    assert equilibrium_displacements(arch(0.1063, voussoirs)) is None


@pytest.mark.slow
def test_slopes_near_failure_stand_below_their_factor_and_fall_above():
    """94 blocks whose columns lean, friction alone: at 3 % below the factor none is unstable, and
    the run stays at rest; at 3 % above blocks move away."""
    scene = parse(LEANING)
    factor = factor_of_safety(scene)
    below = Simulation(weakened(scene, 0.97 * factor))
    start = below.blocks.motion[:2].copy()
    assert not below.unstable.any()
    while below.time < 0.2:
        below.step()
    assert np.abs(below.blocks.motion[:2] - start).max() < 1e-9
    above = Simulation(weakened(scene, 1.03 * factor))
    start = above.blocks.motion[:2].copy()
    assert above.unstable.any()
    while above.time < 0.5:
        above.step()
    assert np.abs(above.blocks.motion[:2] - start).max() > 1e-3


LEANING = f"""
gravity = [0.0, -9.81]
law = "joint"
[laws.joint]
{coulomb(0.7002, 5e9, 2e9)}
[[rock]]
name = "slope"
outline = [[-30, -2], [12, -2], [12, 0], [0, 0], [-12, 20], [-30, 20]]
seed = 1
[[rock.set]]
dip = 30.0
spacing = 1.2
scatter = 0.2
through = [-0.2, 0.6]
[[rock.set]]
dip = -60.0
spacing = 1.68
scatter = 0.3
persistence = 0.8
[[rock.fixed]]
corners = [[-40,-5],[13,-5],[13,0.2],[0.3,0.31],[-24,14.28],[-28,19],[-28,22],[-40,22]]
[run]
end = 1.0
fraction = 0.7
dashpot_normal = 0.2
dashpot_shear = 0.2
"""


def test_a_block_under_a_load_that_opens_its_joint_is_unstable():
    text = on_base(coulomb(0.5), [1.0, 0.5])
    text = text.replace('name = "block"\n', 'name = "block"\n' + lines(load=[0.0, 2e4]))
    sim = Simulation(parse(text))
    assert [b.name for b, u in zip(sim.scene.blocks, sim.unstable, strict=True) if u] == ["block"]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("reduction", [1.0, 1.3])
@pytest.mark.parametrize(("friction", "cohesion"), [(0.6, 0.0), (0.3, 2e4), (np.inf, 0.0)])
def test_plain_friction_has_the_tractions_of_the_law(dim, reduction, friction, cohesion):
    """Contact points that are open, stick and slide; the closed form in C against steps of the
    law's batch, which a residual friction below the peak by rounding calls."""
    dof = {2: 3, 3: 6}[dim]
    random = np.random.default_rng(1)
    k = 60
    block_a, block_b = random.integers(0, 5, k), 5 + random.integers(0, 5, k)
    kinematics = random.normal(size=(k, dim, 2 * dof))
    start = 1e-4 * random.normal(size=(k, dim))
    y = 1e-5 * random.normal(size=(10, dof))
    plane = 0.0 if dim == 2 else None
    forces = []
    for residual in (None, friction * (1 - 1e-14)):
        if residual == np.inf:
            residual = None
        law = jl.CoulombLaw(1e9, 4e8, friction, cohesion, residual_friction=residual, plane=plane)
        relaxation = Relaxation(
            [law], np.zeros(k, int), block_a, block_b, kinematics, np.ones(k), start,
            np.zeros((10, dof)), np.ones((10, dof)), lambda closure: 0.0 * closure, np.ones(k),
            reduction,
        )  # fmt: skip
        forces.append(relaxation.unbalanced(y))
        assert bool(relaxation.laws[0].is_friction) == is_plain_friction(law)
    by_hand = np.zeros((10, dof))
    both = np.concatenate([y[block_a], y[block_b]], axis=1)
    u = start + np.einsum("kcm,km->kc", kinematics, both)
    closed = u[:, 0] > 0
    normal = 1e9 * u[:, 0] * closed
    shear = 4e8 * u[:, 1:] / reduction * closed[:, None]
    size = np.maximum(np.linalg.norm(shear, axis=1), 1e-300)
    with np.errstate(invalid="ignore"):
        limit = cohesion + np.where(closed, friction * normal, 0.0)
    limit = np.where(closed, limit, 0.0)
    slides = closed & (size > limit)
    assert closed.any()
    assert not closed.all()
    assert slides.any() == (friction < np.inf)
    shear *= np.minimum(1.0, limit / size)[:, None] / reduction
    traction = np.concatenate([normal[:, None], shear], axis=1)
    force = np.einsum("kc,kcm->km", traction, kinematics)
    np.add.at(by_hand, block_a, -force[:, :dof])
    np.add.at(by_hand, block_b, -force[:, dof:])
    scale = np.abs(by_hand).max()
    for result in forces:
        np.testing.assert_allclose(result, by_hand, atol=1e-11 * scale)
