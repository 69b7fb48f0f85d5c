"""What steps of blocks do: all forces against plain numpy, which knows no frame; that rounding of
the drawing does not matter; and the critical time step, which is sharp: bounded at 0.95 of it,
diverging at 1.05."""

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
from dem_demo.compiled import LawJointArrays, StepArrays
from dem_demo.contact import tabulate_first_loading
from dem_demo.dynamics import simulation
from dem_demo.native import build, layout
from dem_demo.scene import Files, build_law

PLAIN = coulomb(0.5, 1e9, 1e9)


def test_critical_damping_is_that_of_the_block_on_all_its_joints():
    """2 sqrt(K m), shared by the two ends of the face."""
    sim = Simulation(parse(on_base(PLAIN, [1.0, 0.5])))
    stiffness = np.full(sim.joints.n, 1e8)
    critical = 2 * np.sqrt(stiffness.sum() * sim.blocks.inertia[1, 0])
    assert sim.joints.n == 2
    assert sim.blocks.critical_damping(sim.contacts, stiffness).sum() == pytest.approx(critical)


# a block that falls on its corner, at tilts at which its lower edge is raised in part
ROCKING = on_base(coulomb(0.5, 1e9, 8e8), [1.0, 0.5], at=[0.0, 0.279], angle=3.5)
ROCKING += "settle = false\nstep = 1e-4\n"
# a block that flies up from its seat: dashpots never pull
FLYING = on_base(PLAIN, [1.0, 0.5], velocity=[0.0, 0.05]) + "step = 1e-4\ndashpot_normal = 0.3\n"
GEOMETRY = (
    "position",
    "normal",
    "closure",
    "length",
    "length_gradient",
    "length_per_rotation",
    "opening_rate",
    "sliding_rate",
    "tilt_sine",
    "overlap_length",
    "range_margin",
)


@pytest.mark.parametrize(
    ("name", "steps"),
    [("slope", (1, 40)), ("tilt", (1, 30)), ("stack", (1200, 30)), ("bridges-weathered", (20, 40)),
     ("shear-box", (300, 300)), pytest.param(ROCKING, (5, 200, 200), id="rocking"),
     pytest.param(FLYING, (1, 1), id="flying")],
)  # fmt: skip
def test_a_compiled_step_is_that_of_plain_numpy(name, steps):
    """Geometry, forces with their torques, energies and velocities of steps on the way of a scene.

    Places of 20 m are known to 4e-15 m; what is divided by a length of 1 mm or so loses three
    digits. Forces on the scale of those of the contacts: at rest their sum is almost nothing.
    """
    sim = Simulation(parse(name) if "[run]" in name else load(name))
    for steps_on in steps:
        for _ in range(steps_on):
            before = sim.energy_balance.value
            sim.step()
        c, drives, dt = sim.contacts, sim.blocks.drives, sim.dt
        plain = PlainContacts(sim.manager.outlines, c.corner, c.edge, sim.blocks.motion)
        for part in GEOMETRY:
            ours, theirs = getattr(c, part), getattr(plain, part)
            size = max(float(np.abs(theirs).max(initial=0.0)), 1e-3)
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-11 * size, err_msg=part)
        assert (c.corner_takes_over == plain.corner_takes_over).all()
        force, booked, velocity = plain_step(sim, drives.aim, dt)
        scale = np.abs(c.length[:, None] * sim.joints.traction).max(initial=0.0)
        scale = max(scale, float(np.abs(sim.blocks.gravity).max()))
        np.testing.assert_allclose(sim.energy_balance.forces, force, rtol=0, atol=1e-12 * scale)
        tiny = 1e-12 * scale * dt / sim.blocks.inertia.min()
        np.testing.assert_allclose(sim.blocks.velocity, velocity, rtol=0, atol=tiny)
        for entry, now in sim.energy_balance.value.items():
            if entry in booked:
                gained = now - before[entry] * (entry not in ("kinetic", "stored"))
                turned = max(sim.energy_balance.value["turned"], 1e-9)
                assert gained == pytest.approx(booked[entry], abs=1e-13 * turned), entry


def test_python_and_c_have_the_same_structures():
    """The built header is made of the present declaration, without padding; C uses every field."""
    header = (build.BUILT / "layout.h").read_text(encoding="utf-8")
    source = (build.HERE / "blocks.c").read_text(encoding="utf-8")
    assert header == layout.layout_h()
    for pointer, structure in (("law", LawJointArrays), ("sim", StepArrays)):
        fields = [name for name, _ in structure._fields_]
        assert ctypes.sizeof(structure) == 8 * len(fields)
        assert set(re.findall(rf"\b{pointer}->(\w+)", source)) <= {*fields}
        assert all(re.search(rf"(->|\.){name}\b", source) for name in fields)


def test_rounding_of_the_drawing_does_not_choose_between_equal_corners():
    """Corners of the scene slope moved by a last digit or two: where joints cross, corners of four
    blocks meet, and which is over which edge is a tie. Coordinates of 20 m are known to 4e-15 m."""
    scene, rng = load("slope"), np.random.default_rng(1)

    def start(digits):
        def moved(corners):
            return corners * (1 + 2e-16 * rng.integers(-digits, digits + 1, corners.shape))

        blocks = tuple(replace(block, corners=moved(block.corners)) for block in scene.blocks)
        sim = Simulation(replace(scene, blocks=blocks))
        return sim.blocks.motion[:3], list(zip(sim.contacts.corner, sim.contacts.edge, strict=True))

    place, contacts = start(0)
    other, also = start(2)
    assert also == contacts
    assert other == pytest.approx(place, abs=1e-12)


def ring(scene, share, steps):
    """Largest velocity after small pushes, per step, at a share of the predicted limit."""
    sim = Simulation(scene, step=1e-9)
    sim.limit.checked_stiffness[:] = np.inf  # it would refuse what is tested here
    sim.dt = share * sim.limit.current
    rng = np.random.default_rng(3)
    sim.blocks.motion[3:] = (
        1e-7 * rng.standard_normal(sim.blocks.motion[3:].shape) * sim.blocks.is_mobile.T
    )
    sim.blocks.velocity[:] = sim.blocks.motion[3:] * sim.blocks.is_mobile.T
    size = []
    with contextlib.suppress(SceneError):  # overlap or speed: it has diverged as far as it can
        for _ in range(steps):
            sim.step()
            size.append(np.abs(sim.blocks.motion[3:]).max())
    return np.array(size)


@pytest.mark.parametrize("zeta", [0.0, 0.1])
@pytest.mark.parametrize("blocks", [1, 10])
def test_bounded_below_the_limit_and_not_above(blocks, zeta):
    """Energy of the leapfrog at 0.95 of the limit lets velocities grow by 1/sqrt(1 - 0.95^2) = 3.2
    over the pushes, times a few modes that add up. Without dashpots the growth per step is 1.88 at
    1.05 of the limit: 1e4 within 30 steps."""
    # blocks on each other with a linear law that neither slides nor differs by direction
    text = f"[laws.linear]\n{coulomb(np.inf, 1e8, 1e8)}"
    for i in range(blocks):
        text += block(f"{i}", box=[1.0, 0.6], at=[0.0, 0.3 + 0.6 * i])
    text += block("base", box=[2.0, 1.0], at=[0.0, -0.5], fixed=True)
    run = lines(end=1.0, dashpot_normal=zeta, dashpot_shear=zeta)
    column = parse(f"{text}[run]\n{run}")
    size = ring(column, 0.95, 3000)
    assert len(size) == 3000
    assert size.max() < 10 * size[:50].max()
    if zeta:
        assert size[-1] < 0.5 * size[0]  # the slowest mode of ten blocks rings longest
    size = ring(column, 1.05, 300)
    assert size.max() > 1e4 * size[0]


def test_stiffness_at_stress_bounds_a_sheared_joint():
    """The time step takes stiffness from normal stress: the unsheared joint must be stiffest."""
    law = build_law(tomllib.loads(ROCK), "law", Files())
    curve, rng = tabulate_first_loading(law), np.random.default_rng(5)
    batch, closure = law.joints(40), law.closure(np.geomspace(5e3, 3e5, 40))
    batch.update(np.column_stack([closure, np.zeros(40)]), tangent=False)
    worst = 0.0
    for _ in range(150):
        d = np.column_stack([rng.normal(0, 0.02, 40) * closure, rng.normal(2e-5, 1e-4, 40)])
        d[:, 0] = np.maximum(d[:, 0], 0.05 * closure - batch.delta[:, 0])
        F, C = batch.update(d, tangent=True)
        bound = np.interp(F[:, 0], curve["stress"], curve["stiffness"])
        share = np.linalg.norm(C, ord=2, axis=(1, 2)) / bound
        worst = max(worst, float(share[F[:, 0] > 1e3].max()))
    assert 0.3 < worst < 1.0


FALL = (
    on_base(ROCK, [1.0, 0.5], at=[0.0, 0.35], angle=3.0, end=0.4)
    + "settle = false\nlaw_steps = 4\n"
)


def test_a_chosen_step_is_halved_in_an_impact_and_time_goes_on(monkeypatch):
    """A step for 10 Pa, far too long for the fall of a block by 0.1 m: halved, the books close, and
    the block falls as it does with a short step, given or chosen. A long one that is given is
    refused instead."""
    monkeypatch.setattr(simulation, "IMPACT_STRESS", 10.0)
    fast = Simulation(parse(FALL))
    first = fast.dt
    steps = np.diff(until(fast, 0.4, lambda: fast.time), prepend=0.0)
    assert fast.dt <= 0.5 * first
    assert steps.max() < first * (1 + 1e-6)  # no time is lost or told twice
    assert steps.min() > 0.999 * fast.dt
    assert abs(fast.energy_balance.error) < 5e-3
    slow = Simulation(parse(FALL), step=0.25 * fast.dt)
    until(slow, fast.time)
    assert fast.blocks.motion[:2, 1] == pytest.approx(slow.blocks.motion[:2, 1], abs=2e-3)
    monkeypatch.undo()
    chosen = Simulation(parse(FALL))
    assert chosen.dt < first
    until(chosen, fast.time)
    assert abs(chosen.energy_balance.error) < 1e-2  # a longer step
    assert chosen.blocks.motion[:2, 1] == pytest.approx(slow.blocks.motion[:2, 1], abs=2e-3)
    given = Simulation(parse(FALL), step=first)
    with pytest.raises(SceneError, match="must stay below"):
        until(given, 0.4)


def test_a_scene_in_which_forces_move_nothing_asks_for_a_step():
    with pytest.raises(SceneError, match=r"set run.step \(s\)"):
        Simulation(parse(FALL.replace("angle = 3.0", 'fixed_motions = ["x", "y", "turn"]')))
