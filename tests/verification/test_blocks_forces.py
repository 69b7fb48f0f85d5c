"""Steps of blocks: geometry, forces and energies against plain numpy; independence of the rounding
of coordinates; the critical time step, bounded at 0.95 of the limit and divergent at 1.05.
"""

import contextlib
import ctypes
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from plain_blocks import PlainContacts, plain_step
from running import until
from scene_text import ROCK, block, coulomb, lines, on_base

from dem_demo import SceneError, Simulation, load, parse
from dem_demo.compiled import CornerArrays, LawJointArrays, StepArrays
from dem_demo.contact import Contacts, tabulate_first_loading
from dem_demo.dynamics import simulation
from dem_demo.native import build, layout
from dem_demo.scene import Files, build_law

PLAIN = coulomb(0.5, 1e9, 1e9)


def test_critical_damping_of_all_joints_of_a_block_adds_up():
    """2 sqrt(K m), half of it at either end of the face."""
    sim = Simulation(parse(on_base(PLAIN, [1.0, 0.5])))
    stiffness = np.full(sim.joints.n, 1e8)
    critical = 2 * np.sqrt(stiffness.sum() * sim.blocks.inertia[1, 0])
    assert sim.joints.n == 2
    assert sim.blocks.critical_damping(sim.contacts, stiffness).sum() == pytest.approx(critical)


# a block that falls on its corner, at tilts of its lower edge between lying and raised
ROCKING = on_base(coulomb(0.5, 1e9, 8e8), [1.0, 0.5], at=[0.0, 0.279], angle=3.5)
ROCKING += "settle = false\nstep = 1e-4\n"
# a block that stands on the end of an equal one, tilted by 25 degrees
ON_AN_END = f"[laws.j]\n{coulomb(1.5, 1e9, 8e8)}"
ON_AN_END += block("base", box=[0.8, 1.0], at=[-0.4, -0.5], fixed=True)
ON_AN_END += block("block", box=[0.8, 1.0], at=[-0.1512, 0.6217], angle=-25.0)
ON_AN_END += "[run]\nend = 1.0\nsettle = false\nstep = 1e-4\n"
# a block that flies up from its base: dashpots never pull
FLYING = on_base(PLAIN, [1.0, 0.5], velocity=[0.0, 0.05]) + "step = 1e-4\ndashpot_normal = 0.3\n"
# a block that lands on its base without slip, with unequal damping in closure and in shear
DAMPED_SHEAR = on_base(PLAIN, [1.0, 0.5], velocity=[0.002, -0.01]) + "settle = false\nstep = 1e-4\n"
DAMPED_SHEAR += "dashpot_normal = 0.3\ndashpot_shear = 0.1\n"
GEOMETRY = (
    "position",
    "normal",
    "closure",
    "length",
    "area",
    "rates",
    "tilt_sine",
    "overlap_length",
    "range_margin",
)


@pytest.mark.parametrize("tilt", [8.0, 22.0, 25.0, 29.0, 40.0])
def test_area_at_the_end_of_an_edge_follows_its_derivatives(tilt):
    """Of the upper corner on the lower block and the lower corner on the upper block."""
    sim = Simulation(parse(ON_AN_END))
    motion = sim.blocks.motion.copy()
    outlines = sim.manager.outlines
    lower, upper = 2, 5  # corners: of the base at the origin; the lowest of the block
    width = sim.scene.run.soft

    def contacts(motion):
        return Contacts(outlines, np.array([upper, lower]), np.array([lower, upper - 1]), motion)

    motion[2, 1] -= np.radians(tilt - 25.0)
    contacts(motion)  # locates the corners
    corner = outlines.corner_position[upper]
    motion[:2, 1] += [-0.3 * width - corner.real, -1.2 * width - corner.imag]
    steps = 1e-7 * np.array([width, width, 1.0])
    by_difference = np.empty((2, 3))
    for axis, step in enumerate(steps):
        change = np.zeros_like(motion)
        change[axis, 1] = step
        ahead, behind = contacts(motion + change).area, contacts(motion - change).area
        by_difference[:, axis] = (ahead - behind) / (2 * step)
    actual = contacts(motion)
    largest = 0.1 * 0.8  # m2, at a tilt of up to 20 degrees
    assert ((actual.area > 0) & (actual.area < (1 + 1e-12) * largest)).all()
    assert (actual.area == pytest.approx(largest)) == (tilt < 20)
    scale = largest / width * np.array([1.0, 1.0, width])
    np.testing.assert_allclose(
        actual.area_gradient[:, 3:] / scale, by_difference / scale, atol=2e-5
    )


@pytest.mark.parametrize(
    ("name", "steps"),
    [("slope", (1, 40)), ("tilt", (1, 30)), ("stack", (1200, 30)), ("bridges-weathered", (20, 40)),
     ("shear-box", (300, 300)), pytest.param(ROCKING, (5, 200, 200), id="rocking"),
     pytest.param(ON_AN_END, (1, 100, 300), id="on-an-end"),
     pytest.param(FLYING, (1, 1), id="flying"),
     pytest.param(DAMPED_SHEAR, (2, 5), id="unequal-dashpots")],
)  # fmt: skip
def test_a_compiled_step_agrees_with_plain_numpy(name, steps):
    """Geometry, forces and torques, energies and velocities of some steps of a scene.

    Tolerances: coordinates of 20 m have a rounding of 4e-15 m, and quotients by lengths of 1 mm
    lose three digits. Errors of forces are relative to the contact forces, as their sum vanishes at
    rest.
    """
    sim = Simulation(parse(name) if "[run]" in name else load(name))
    for n_steps in steps:
        for _ in range(n_steps):
            before = sim.energy_balance.value
            sim.step()
        c = sim.contacts
        dt = sim.dt
        plain = PlainContacts(sim.manager.outlines, c.corner, c.edge, sim.blocks.motion)
        for part in GEOMETRY:
            expected = getattr(plain, part)
            size = max(float(np.abs(expected).max(initial=0.0)), 1e-3)
            compiled = getattr(c, part)
            np.testing.assert_allclose(compiled, expected, rtol=0, atol=1e-11 * size, err_msg=part)
        assert (c.corner_takes_over == plain.corner_takes_over).all()
        force, energies, velocity = plain_step(sim, sim.blocks.drives.aim, dt)
        scale = np.abs(c.area[:, None] * sim.joints.traction).max(initial=0.0)
        scale = max(scale, float(np.abs(sim.blocks.gravity).max()))
        np.testing.assert_allclose(sim.energy_balance.forces, force, rtol=0, atol=1e-12 * scale)
        tiny = 1e-12 * scale * dt / sim.blocks.inertia.min()
        np.testing.assert_allclose(sim.blocks.velocity, velocity, rtol=0, atol=tiny)
        for entry, now in sim.energy_balance.value.items():
            if entry in energies:
                is_sum = entry not in ("kinetic", "stored")
                change = now - before[entry] * is_sum
                turned = max(sim.energy_balance.value["turnover"], 1e-9)
                assert change == pytest.approx(energies[entry], abs=1e-13 * turned), entry


def test_python_and_c_have_the_same_structures():
    """The built header is made of the present declaration, without padding; C uses every field."""
    header = (build.BUILT / "layout.h").read_text(encoding="utf-8")
    assert header == layout.layout_h()
    for file, pointer, structure in (
        ("blocks.c", "law", LawJointArrays),
        ("blocks.c", "sim", StepArrays),
        ("corners.c", "plane", CornerArrays),
    ):
        source = (build.HERE / file).read_text(encoding="utf-8")
        fields = [name for name, _ in structure._fields_]
        assert ctypes.sizeof(structure) == 8 * len(fields)
        assert set(re.findall(rf"\b{pointer}->(\w+)", source)) <= {*fields}
        assert all(re.search(rf"(->|\.){name}\b", source) for name in fields)


def test_rounding_of_coordinates_does_not_choose_between_equal_corners():
    """Corners of the scene slope changed by one or two last digits. Where joints cross, corners of
    four blocks meet, and which one belongs to which edge is a tie. Coordinates of 20 m have a
    rounding of 4e-15 m."""
    scene = load("slope")
    rng = np.random.default_rng(1)

    def start(digits):
        def perturb(corners):
            return corners * (1 + 2e-16 * rng.integers(-digits, digits + 1, corners.shape))

        blocks = tuple(replace(block, corners=perturb(block.corners)) for block in scene.blocks)
        sim = Simulation(replace(scene, blocks=blocks))
        return sim.blocks.motion[:3], list(zip(sim.contacts.corner, sim.contacts.edge, strict=True))

    position, contacts = start(0)
    perturbed_position, perturbed_contacts = start(2)
    assert perturbed_contacts == contacts
    assert perturbed_position == pytest.approx(position, abs=1e-12)


def vibrate(scene, fraction, steps):
    """Largest velocity per step after small random pushes, at a fraction of the predicted limit."""
    sim = Simulation(scene, step=1e-9)
    sim.limit.checked_stiffness[:] = np.inf  # no check of the time step that is tested here
    sim.dt = fraction * sim.limit.current
    rng = np.random.default_rng(3)
    sim.blocks.motion[3:] = (
        1e-7 * rng.standard_normal(sim.blocks.motion[3:].shape) * sim.blocks.is_mobile.T
    )
    sim.blocks.velocity[:] = sim.blocks.motion[3:] * sim.blocks.is_mobile.T
    size = []
    with contextlib.suppress(SceneError):  # refused overlap or speed: it has diverged
        for _ in range(steps):
            sim.step()
            size.append(np.abs(sim.blocks.motion[3:]).max())
    return np.array(size)


@pytest.mark.parametrize("zeta", [0.0, 0.1])
@pytest.mark.parametrize("blocks", [1, 10])
def test_bounded_below_the_limit_and_not_above(blocks, zeta):
    """At 0.95 of the limit, the energy that the leapfrog scheme conserves lets velocities grow by
    1/sqrt(1 - 0.95^2) = 3.2, times a few modes in superposition. Without dashpots the growth per
    step at 1.05 of the limit is 1.88: a factor of 1e4 within 30 steps."""
    # blocks on each other with a linear law that neither slides nor differs by direction
    text = f"[laws.linear]\n{coulomb(np.inf, 1e8, 1e8)}"
    for i in range(blocks):
        text += block(f"{i}", box=[1.0, 0.6], at=[0.0, 0.3 + 0.6 * i])
    text += block("base", box=[2.0, 1.0], at=[0.0, -0.5], fixed=True)
    run = lines(end=1.0, dashpot_normal=zeta, dashpot_shear=zeta)
    column = parse(f"{text}[run]\n{run}")
    size = vibrate(column, 0.95, 3000)
    assert len(size) == 3000
    assert size.max() < 10 * size[:50].max()
    if zeta:
        assert size[-1] < 0.5 * size[0]  # the slowest mode of ten blocks decays last
    size = vibrate(column, 1.05, 300)
    assert size.max() > 1e4 * size[0]


def test_first_loading_stiffness_bounds_a_sheared_joint():
    """The time step follows from it: at equal normal stress the unsheared joint is stiffest."""
    law = build_law(tomllib.loads(ROCK), "law", Files())
    curve = tabulate_first_loading(law)
    rng = np.random.default_rng(5)
    batch = law.joints(40)
    closure = law.closure(np.geomspace(5e3, 3e5, 40))
    batch.update(np.column_stack([closure, np.zeros(40)]), tangent=False)
    largest = 0.0
    for _ in range(150):
        d = np.column_stack([rng.normal(0, 0.02, 40) * closure, rng.normal(2e-5, 1e-4, 40)])
        d[:, 0] = np.maximum(d[:, 0], 0.05 * closure - batch.delta[:, 0])
        F, C = batch.update(d, tangent=True)
        bound = np.interp(F[:, 0], curve["stress"], curve["stiffness"])
        ratio = np.linalg.norm(C, ord=2, axis=(1, 2)) / bound
        largest = max(largest, float(ratio[F[:, 0] > 1e3].max()))
    assert 0.3 < largest < 1.0


FALL = (
    on_base(ROCK, [1.0, 0.5], at=[0.0, 0.35], angle=3.0, end=0.4)
    + "settle = false\nlaw_steps = 4\n"
)


def test_an_automatic_step_is_halved_in_an_impact(monkeypatch):
    """A step for an impact of 10 Pa is far too long for a block that falls by 0.1 m. It is halved:
    the energy balance holds, and the block falls as with a short step. A long step that the user
    sets is refused instead."""
    monkeypatch.setattr(simulation, "IMPACT_STRESS", 10.0)
    fast = Simulation(parse(FALL))
    first = fast.dt
    steps = np.diff(until(fast, 0.4, lambda: fast.time), prepend=0.0)
    assert fast.dt <= 0.5 * first
    assert steps.max() < first * (1 + 1e-6)  # time is continuous
    assert steps.min() > 0.999 * fast.dt
    assert abs(fast.energy_balance.error) < 5e-3
    slow = Simulation(parse(FALL), step=0.25 * fast.dt)
    until(slow, fast.time)
    assert fast.blocks.motion[:2, 1] == pytest.approx(slow.blocks.motion[:2, 1], abs=2e-3)
    monkeypatch.undo()
    automatic = Simulation(parse(FALL))
    assert automatic.dt < first
    until(automatic, fast.time)
    assert abs(automatic.energy_balance.error) < 1e-2  # a longer step
    assert automatic.blocks.motion[:2, 1] == pytest.approx(slow.blocks.motion[:2, 1], abs=2e-3)
    long = Simulation(parse(FALL), step=first)
    with pytest.raises(SceneError, match="must stay below"):
        until(long, 0.4)


def test_the_step_before_an_impact_is_for_joints_at_ten_kilopascals():
    """The automatic step of a block in the air, in closed form.

    Springs of stiffness k act along the outline P, in shear too, half of every edge at either end,
    and are counted twice for contacts with blocks that move. The corners lie at the square root of
    (a^2 + b^2) / 4 from the centre, so that the turn has the largest eigenvalue, 6 k P / m.
    k is interpolated on the curve of the law, whose cells are 3 % wide.
    """
    sim = Simulation(parse(FALL + "fraction = 0.5\n"))
    (law,) = sim.scene.laws.values()
    stiffness = law.first_loading_stiffness(law.closure(1e4))
    outline = 2 * (1.0 + 0.5)
    mass = 2600 * 1.0 * 0.5
    limit = 2 / np.sqrt(6 * stiffness * outline / mass)
    assert sim.dt == pytest.approx(0.5 * limit, rel=0.02)


def test_a_scene_in_which_forces_move_no_block_needs_a_step():
    with pytest.raises(SceneError, match=r"set run.step \(s\)"):
        Simulation(parse(FALL.replace("angle = 3.0", 'fixed_motions = ["x", "y", "turn"]')))
