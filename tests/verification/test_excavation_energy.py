"""Energy that leaves with blocks which an excavation removes while they move."""

import pytest
from scene_text import block, coulomb, lines

from dem_demo import Simulation
from dem_demo.space import SpaceSimulation, parse

RUN = "[run]\nend = 1.0\nstep = 2e-5\nsettle = false\nskin = 0.01\n"
LAW = f"[laws.rock]\n{coulomb(0.6, 1e9, 5e8)}"


def in_the_plane(start):
    """A block slides on a base, and another one that spins falls on it until a stage removes it."""
    return Simulation(
        parse(
            lines(gravity=[0.0, -9.81])
            + LAW
            + block("base", box=[4.0, 1.0], at=[0.0, -0.5], fixed=True)
            + block("one", box=[1.0, 0.5], at=[0.0, 0.25], velocity=[0.4, 0.0])
            + block("top", box=[0.8, 0.4], at=[0.1, 0.7005], velocity=[0.5, -0.8], spin=0.05)
            + f"[[excavate]]\nstart = {start}\nrelease_time = 2e-3\n"
            + lines(corners=[[-0.4, 0.6], [0.6, 0.6], [0.6, 0.9], [-0.4, 0.9]])
            + RUN
        )
    )


def in_space(start):
    """The same in space, where the block also slides and spins out of the plane."""
    velocity = [0.5, 0.3, -0.8]
    spin = [0.02, 0.05, 0.4]
    return SpaceSimulation(
        parse(
            LAW
            + block("base", box=[4.0, 4.0, 1.0], at=[0.0, 0.0, -0.5], fixed=True)
            + block("one", box=[1.0, 1.0, 0.5], at=[0.0, 0.0, 0.25], velocity=[0.4, 0.1, 0.0])
            + block("top", box=[0.8, 0.6, 0.4], at=[0.1, 0.0, 0.7005], velocity=velocity, spin=spin)
            + f"[[excavate]]\nstart = {start}\nrelease_time = 2e-3\n"
            + lines(box=[1.0, 1.0, 0.3], at=[0.1, 0.0, 0.75])
            + RUN
        )
    )


@pytest.mark.parametrize("create", [in_the_plane, in_space])
def test_a_stage_that_removes_a_moving_block_keeps_the_balance_of_energy(create):
    """The kinetic energy of the block and the stored energy of its joints are discarded. Each is
    more than a tenth of the energy turned over; the step of the stage changes the error of the
    balance by less than 2e-6, and the release of the support by less than 5e-5."""
    start = 2e-3
    sim = create(start)
    balance = sim.energy_balance
    while sim.blocks.is_mobile[2]:
        before = balance.value
        error_before = balance.error
        sim.step()
    after = balance.value
    error_after = balance.error
    for name in ("kinetic", "stored"):
        assert before[name] - after[name] > 0.1 * after["turnover"]
    assert abs(error_before) < 5e-4
    assert abs(error_after - error_before) < 2e-6
    while sim.time < start + 2.1e-3:
        sim.step()
    assert not sim.blocks.support.any()
    assert abs(balance.error - error_after) < 5e-5
