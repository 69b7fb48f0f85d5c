"""A water table that changes in time: loads, energies, the time at which a wall slides; convergence
of the walls of an opening."""

import numpy as np
import pytest
from running import until
from scene_text import block, coulomb, lines

from dem_demo import Simulation, parse
from dem_demo.cli import main
from dem_demo.dynamics.blocks import apply_loads
from dem_demo.output.run import run
from dem_demo.studies.limit_analysis import limit_factor

WATER = 9810.0  # N/m3
DENSITY = 2400.0
WIDTH, HEIGHT = 2.0, 3.0  # m, of the wall
FRICTION = 0.3


def dam(levels, end=1.0, step=1e-4):
    """A wall on a floor, with water on its left; levels: times (s), the first 0, and depths (m)."""

    def table(depth):
        return [[-9.0, depth], [-WIDTH / 2, depth], [WIDTH / 2, 0.0], [9.0, 0.0]]

    text = lines(density=DENSITY) + f"[laws.joint]\n{coulomb(FRICTION, 1e9, 1e9)}"
    text += block("floor", box=[20.0, 1.0], at=[0.0, -0.5], fixed=True)
    text += block("wall", box=[WIDTH, HEIGHT], at=[0.0, HEIGHT / 2])
    text += "[water]\n" + lines(table=table(levels[0][1]))
    for time, depth in levels[1:]:
        text += "[[water.at]]\n" + lines(time=time, table=table(depth))
    return text + f"[run]\nend = {end}\nstep = {step}\nrecord = 0.02\n"


def factor(depth):
    """Friction over thrust at a depth (m) of water; the uplift falls to zero below the wall."""
    normal = DENSITY * 9.81 * WIDTH * HEIGHT - WATER * depth * WIDTH / 2
    return FRICTION * normal / (WATER * depth**2 / 2)


def critical_depth():
    return float(np.roots([WATER / 2, FRICTION * WATER * WIDTH / 2,
                           -FRICTION * DENSITY * 9.81 * WIDTH * HEIGHT]).max())  # fmt: skip


def test_loads_are_those_of_a_scene_with_the_table_of_that_time():
    """Also between two times, and where the two tables bend at other places."""
    text = dam([(0.0, 1.0), (0.4, 2.0), (0.6, 0.5)])
    scene = parse(text.replace("[-9.0, 0.5]", "[-9.0, 0.5], [-5.0, 0.5]"))
    for time, depth in ((0.0, 1.0), (0.1, 1.25), (0.4, 2.0), (0.5, 1.25), (0.6, 0.5), (9.0, 0.5)):
        still = parse(dam([(0.0, depth)]))
        sim = Simulation(still)
        loads = sim.blocks.loads.copy()
        apply_loads(scene, sim.blocks, sim.manager, time)
        assert sim.blocks.loads == pytest.approx(loads, rel=1e-12, abs=1e-6)


def path_of_wall(low, high):
    """Displacement (m) of a rigid wall in 0.3 s, by small steps of Newton's second law."""
    mass = DENSITY * WIDTH * HEIGHT
    displaced = speed = 0.0
    dt = 1e-4
    for i in range(3000):
        level = min(low + (high - low) * i * dt / 0.1, high)
        depth = level * (1 - displaced / WIDTH)  # at the wall, where the table falls to the right
        normal = mass * 9.81 - WATER * depth * (WIDTH - displaced) / 2
        force = WATER * depth**2 / 2 - FRICTION * normal
        speed = max(speed + dt * force / mass, 0.0)
        displaced += dt * speed
    return displaced


def test_a_wall_slides_when_the_thrust_exceeds_friction():
    """Below the critical depth of the water the wall rests, above it slides.

    The water rises from `low` to `high` within 0.1 s; the table does not follow the wall.
    """
    critical = critical_depth()
    assert factor(critical) == pytest.approx(1.0)
    low, high = 0.96 * critical, 1.05 * critical
    sim = Simulation(parse(dam([(0.0, low - 0.3), (0.3, low), (0.5, low), (0.6, high)])))
    start = sim.blocks.motion[0, 1]
    until(sim, 0.5)
    assert sim.blocks.motion[0, 1] - start < 1e-4
    assert np.abs(sim.blocks.velocity[:, 1]).max() < 1e-3
    until(sim, 0.8)
    displaced = sim.blocks.motion[0, 1] - start
    assert displaced == pytest.approx(path_of_wall(low, high), rel=0.03)
    assert abs(sim.energy_balance.error) < 1e-3


def test_a_drawdown_leaves_the_state_of_the_last_table():
    """Damped, the wall comes back to the equilibrium with the lower water, but for friction."""
    text = dam([(0.0, 1.5), (0.2, 0.5)]).replace("step = 0.0001", "dashpot_normal = 0.5\n"
                                                 "dashpot_shear = 0.5")  # fmt: skip
    sim = Simulation(parse(text))
    until(sim, 0.6)
    still = Simulation(parse(dam([(0.0, 0.5)])))
    scale = np.abs(still.blocks.loads[1]).max()
    assert sim.blocks.loads[1] == pytest.approx(still.blocks.loads[1], abs=1e-5 * scale)
    assert sim.blocks.motion[:3, 1] == pytest.approx(still.blocks.motion[:3, 1], abs=1e-7)
    push = (sim.joints.traction[:, 0] * sim.contacts.length).sum()
    assert push == pytest.approx(DENSITY * 9.81 * 6.0 - WATER * 0.5, rel=1e-4)


def test_strength_reduction_and_check_use_the_later_tables(tmp_path, capsys):
    text = dam([(0.0, 1.0), (0.4, 1.2 * critical_depth()), (0.8, 1.5)])
    scene = parse(text)
    assert limit_factor(scene) == pytest.approx(factor(1.0), rel=1.5e-3)
    assert limit_factor(scene.excavated) == pytest.approx(factor(1.5), rel=1.5e-3)
    path = tmp_path / "dam.toml"
    path.write_text(text)
    assert main(["check", str(path)]) == 0
    first, second, third = capsys.readouterr().out.split("with the water table of ")
    assert "initial state: in equilibrium" in first
    assert second.startswith("0.4 s")
    assert "without equilibrium" in second
    assert "no equilibrium exists: proved" in second
    assert third.startswith("0.8 s")
    assert "initial state: in equilibrium" in third


def test_times_of_water_tables_increase():
    with pytest.raises(ValueError, match=r"water.at: times \[0.4, 0.2\] s must increase"):
        parse(dam([(0.0, 1.0), (0.4, 2.0), (0.2, 1.0)]))


# ------------------------------------------------------------------ convergence


def opening(convergence):
    """Two walls that drives move towards each other, by 2 mm and by 1 mm."""
    text = lines(gravity=[0.0, 0.0]) + f"[laws.joint]\n{coulomb()}"
    text += block("floor", box=[9.0, 1.0], at=[0.0, -5.0], fixed=True)
    text += block("left", box=[1.0, 1.0], at=[-2.0, 0.0])
    text += block("right", box=[1.0, 1.0], at=[2.0, 0.0])
    for name, value in (("left", 2e-3), ("right", -1e-3)):
        text += "[[drive]]\n" + lines(block=name, motion="x", times=[0.0, 0.1], values=[0.0, value])
    text += "[[block]]\n" + lines(name="free", box=[1.0, 1.0], at=[0.0, 5.0])
    return text + "[monitor]\n" + lines(convergence=convergence) + (
        "[run]\nend = 0.25\nrecord = 0.05\nstep = 1e-3\nsettle = false\n"
    )  # fmt: skip


def test_convergence_of_walls():
    """Of the faces that look at each other, of points inside, and of a wall and the fixed floor."""
    pairs = [[[-1.5, 0.0], [1.5, 0.0]], [[-2.0, 0.3], [2.0, 0.3]], [[2.0, 0.0], [2.0, -5.0]]]
    record, _ = run(Simulation(parse(opening(pairs))))
    for number, drawn, expected in ((1, 3.0, 3e-3), (2, 4.0, 3e-3)):
        closing = record.series(f"convergence {number}: convergence_m")
        distance = record.series(f"convergence {number}: distance_m")
        assert closing[0] == pytest.approx(0.0, abs=1e-12)
        assert closing[-1] == pytest.approx(expected, rel=1e-6)
        assert distance == pytest.approx(drawn - closing, abs=1e-12)
    shifted = 5.0 - np.hypot(5.0, 1e-3)
    assert record.series("convergence 3: convergence_m")[-1] == pytest.approx(shifted, rel=1e-5)


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ([[-1.5, 0.0], [0.0, 0.0]], r"convergence\[0\]: \[0.0, 0.0\] lies in no block that stays"),
        ([[-1.5, 0.0], [-2.0, 0.0]], "its points lie in 'left' and 'left'"),
        ([[0.0, -5.0], [1.0, -5.0]], "its points lie in 'floor' and 'floor'"),
        ([[-1.5, 0.0]], "must be two different points"),
        ([[-1.5, 0.0], [-1.5, 0.0]], "must be two different points"),
    ],
)
def test_invalid_convergences_are_named(pair, message):
    with pytest.raises(ValueError, match=message):
        parse(opening([pair]))
