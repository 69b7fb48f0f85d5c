"""The predicted critical time step is sharp: bounded at 0.95 of it, diverging at 1.05."""

import contextlib
import tomllib

import numpy as np
import pytest
from running import until
from scene_text import ROCK, block, coulomb, lines, on_base

from dem_demo import Refused, Simulation, parse
from dem_demo.contact import virgin_curve
from dem_demo.dynamics import simulation
from dem_demo.scene import Files, build_law


def column(blocks, zeta):
    """Blocks on each other with a linear law that neither slides nor differs by direction."""
    law = f"[laws.linear]\n{coulomb(np.inf, 1e8, 1e8)}"
    boxes = [block(f"{i}", box=[1.0, 0.6], at=[0.0, 0.3 + 0.6 * i]) for i in range(blocks)]
    base = block("base", box=[2.0, 1.0], at=[0.0, -0.5], fixed=True)
    run = lines(end=1.0, dashpot_normal=zeta, dashpot_shear=zeta)
    return parse(law + base + "".join(boxes) + "[run]\n" + run)


def ring(scene, share, steps):
    """Largest velocity after small pushes, per step, at a share of the predicted limit."""
    sim = Simulation(scene, step=1e-9)
    sim.limit.checked[:] = np.inf  # it would refuse what is tested here
    sim.dt = share * sim.limit.now
    rng = np.random.default_rng(3)
    sim.blocks.motion[3:] = (
        1e-7 * rng.standard_normal(sim.blocks.motion[3:].shape) * sim.blocks.mobile.T
    )
    sim.blocks.velocity[:] = sim.blocks.motion[3:] * sim.blocks.mobile.T
    size = []
    with contextlib.suppress(Refused):  # overlap or speed: it has diverged as far as it can
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
    size = ring(column(blocks, zeta), 0.95, 3000)
    assert len(size) == 3000
    assert size.max() < 10 * size[:50].max()
    if zeta:
        assert size[-1] < 0.5 * size[0]  # the slowest mode of ten blocks rings longest
    size = ring(column(blocks, zeta), 1.05, 300)
    assert size.max() > 1e4 * size[0]


def test_stiffness_at_stress_bounds_a_sheared_joint():
    """The time step takes stiffness from normal stress: the unsheared joint must be stiffest."""
    law = build_law(tomllib.loads(ROCK), "law", Files())
    curve, rng = virgin_curve(law), np.random.default_rng(5)
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
    on_base(ROCK, [1.0, 0.5], at=[0.0, 0.35], angle=3.0, end=0.4) + "seat = false\nlaw_steps = 4\n"
)


def test_a_chosen_step_is_halved_in_an_impact_and_time_goes_on(monkeypatch):
    """A step for 10 Pa, far too long for the fall of a block by 0.1 m: halved, the books close, and
    the block falls as it does with a short step, given or chosen. A long one that is given is
    refused instead."""
    monkeypatch.setattr(simulation, "IMPACT", 10.0)
    fast = Simulation(parse(FALL))
    first = fast.dt
    steps = np.diff(until(fast, 0.4, lambda: fast.time), prepend=0.0)
    assert fast.dt <= 0.5 * first
    assert steps.max() < first * (1 + 1e-6)  # no time is lost or told twice
    assert steps.min() > 0.999 * fast.dt
    assert abs(fast.ledger.error) < 5e-3
    slow = Simulation(parse(FALL), step=0.25 * fast.dt)
    until(slow, fast.time)
    assert fast.blocks.motion[:2, 1] == pytest.approx(slow.blocks.motion[:2, 1], abs=2e-3)
    monkeypatch.undo()
    chosen = Simulation(parse(FALL))
    assert chosen.dt < first
    until(chosen, fast.time)
    assert abs(chosen.ledger.error) < 1e-2  # a longer step
    assert chosen.blocks.motion[:2, 1] == pytest.approx(slow.blocks.motion[:2, 1], abs=2e-3)
    given = Simulation(parse(FALL), step=first)
    with pytest.raises(Refused, match="must stay below"):
        until(given, 0.4)


def test_a_scene_in_which_forces_move_nothing_asks_for_a_step():
    with pytest.raises(Refused, match=r"set run.step \(s\)"):
        Simulation(parse(FALL.replace("angle = 3.0", 'held = ["x", "y", "turn"]')))
