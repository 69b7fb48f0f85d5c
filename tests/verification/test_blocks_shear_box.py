"""Shear box of blocks against the law's own direct shear test, monotonic and reversed."""

import numpy as np
import pytest
from running import until

import jointlaw as jl
from dem_demo import Simulation, load

STRESS = 100e3


@pytest.fixture(scope="module")
def box():
    """Shear displacement, normal and shear stress, closure in every step of the scene."""
    scene = load("shear-box")
    sim = Simulation(scene)

    def row():
        closure, shear = sim.joints.delta.mean(axis=0)
        return [shear, *sim.joints.traction.mean(axis=0), closure]

    return scene, sim, np.array([row(), *until(sim, scene.run.end, row)]).T


def test_stress_and_dilation_against_direct_shear(box):
    """Within 1 % of the largest shear stress and of the range of the closure, at equal stress."""
    scene, _, (u, _, tau, closure) = box
    first, second = int(u.argmax()), int(u.argmin())
    law = scene.laws["replica"]
    turns = [u[first], u[second], u[-1]]
    test = jl.direct_shear(law.joint(), to=turns, normal=STRESS, steps=800)
    at = np.abs(test.shear_2[:, None] - np.array(turns)).argmin(axis=0)
    legs = [(0, first, 0, at[0]), (first, second, at[0], at[1]), (second, len(u) - 1, at[1], None)]
    for start, stop, low, high in legs:
        part = slice(low, None if high is None else high + 1)
        way = np.sign(u[stop] - u[start])
        order = np.argsort(way * test.shear_2[part])
        x = way * test.shear_2[part][order]
        mine = way * u[start : stop + 1]
        stress = np.interp(mine, x, test.F2[part][order])
        depth = np.interp(mine, x, test.closure[part][order])
        assert np.abs(tau[start : stop + 1] - stress).max() < 0.01 * np.abs(test.F2).max()
        assert np.abs(closure[start : stop + 1] - depth).max() < 0.01 * np.ptp(test.closure)


def test_normal_stress_stays_and_energy_balances(box):
    """Load and weight on a constant area: inertia of the rising half is the only disturbance."""
    _, sim, (_, sigma, _, _) = box
    assert sigma == pytest.approx(STRESS, rel=5e-3)
    assert abs(sim.ledger.error) < 1e-4
