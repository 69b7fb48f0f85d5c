"""Two blocks on a slope with plain Coulomb: answers known without any code."""

import numpy as np
import pytest
from block_forces import contact_forces
from scene_text import block, coulomb, dipping, lines

from dem_demo import Simulation, parse

G, RHO, MU = 9.81, 2600.0, 0.6


def slope(angle, mu=MU, end=1.0, stiffness=2e9):
    """Two 1 m blocks on a base, gravity turned by `angle` degrees instead of the base."""
    law = f"[laws.rock]\n{coulomb(mu, stiffness, stiffness)}"
    boxes = block("lower", box=[1.0, 1.0], at=[0.0, 0.5]) + block(
        "upper", box=[1.0, 1.0], at=[1.5, 0.5]
    )
    base = block("base", box=[12.0, 1.0], at=[2.0, -0.5], fixed=True)
    run = f"[run]\nend = {end}\nfraction = 0.3\n"
    return parse(lines(gravity=dipping(angle)) + law + base + boxes + run)


def test_base_shear_at_20_degrees():
    """The joints carry the blocks' weight along the slope, from step 0 on."""
    sim = Simulation(slope(20.0))
    assert not sim.loose.any()
    shear = []
    for _ in range(1000):
        sim.step()
        shear.append(contact_forces(sim)[0, 0])
    expected = 2 * RHO * G * np.sin(np.radians(20.0))
    assert expected == pytest.approx(17447.132, abs=5e-4)
    # At rest from step 0
    assert np.array(shear) == pytest.approx(expected, rel=1e-9)


def test_sliding_acceleration_at_35_degrees():
    """g (sin - mu cos), once the shear springs are wound up."""
    sim = Simulation(slope(35.0))
    assert sim.loose.any()
    speed = []
    for _ in range(1200):
        sim.step()
        speed.append(sim.blocks.motion[3, 1:].copy())
    a = (speed[-1] - speed[400]) / ((len(speed) - 401) * sim.dt)
    angle = np.radians(35.0)
    expected = G * (np.sin(angle) - MU * np.cos(angle))
    assert expected == pytest.approx(0.805256, abs=1e-6)
    assert a == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("angle", "slides"), [(30.92, False), (31.02, True)])
def test_threshold_is_the_friction_angle(angle, slides):
    """atan 0.6 = 30.964 degrees; the edges of a 1 m cube carry unequal loads and still agree."""
    sim = Simulation(slope(angle))
    start = sim.blocks.motion[0].copy()
    for _ in range(2500):
        sim.step()
    moved = (sim.blocks.motion[0] - start)[1:]
    # Sliding for this long at 0.1 degrees beyond the threshold: millimetres; sticking: nanometres.
    assert (moved > 2e-3).all() if slides else (np.abs(moved) < 1e-8).all()
