"""Blocks that hang on a bond or are kept by one: against strengths worked out by hand."""

import numpy as np
import pytest

from dem_demo import Simulation, parse
from dem_demo.studies.strength import factor_of_safety

G, RHO, T, C = 9.81, 2600.0, 2e5, 2e4  # m/s2, kg/m3, Pa
LAW = """
kind = "coulomb"
normal_stiffness = 2e9
shear_stiffness = 2e9
friction = {mu}
bond = {{ {bond} }}
"""


def block(law, gravity=(0.0, -G), at=0.5, box=(1.0, 1.0)):
    """A block under a roof (at = -0.5) or on a base (0.5); the joint is 1 m2 per m of its width."""
    return parse(f"""
gravity = [{gravity[0]}, {gravity[1]}]
[laws.joint]
{law}
[[block]]
name = "rock"
box = [8.0, 1.0]
at = [0.0, {-np.sign(at) * 0.5}]
fixed = true
[[block]]
name = "block"
box = [{box[0]}, {box[1]}]
at = [0.0, {np.sign(at) * 0.5 * box[1]}]
[run]
end = 1.0
""")


def test_a_block_that_hangs_holds_to_the_tension():
    """Loaded slowly: what it bears before it falls is tension times area."""
    bond = f"normal_stiffness = 2e9, shear_stiffness = 1e9, tension = {T}, cohesion = 4e5"
    sim = Simulation(block(LAW.format(mu=0.6, bond=bond), at=-0.5))
    weight = RHO * G
    assert sim.balanced
    assert sim.joints.traction[:, 0] == pytest.approx(-weight)
    held = 0.0
    for share in np.linspace(weight / T, 1.01, 4000):
        sim.blocks.loads[1, 1] = weight - share * T
        sim.step()
        if (sim.joints.damage < 1.0).all():
            held = share
    assert 0.99 < held <= 1.01
    while sim.joints.n:  # it falls out of reach
        sim.step()
    # the bond gives back what it stored, but for its energy of fracture
    assert sim.ledger.error == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("cohesion", [0.0, C, 3 * C])
def test_factor_of_safety_of_a_bonded_block(cohesion):
    """Flat joint and ductile bond: (c A + W cos tan(phi))/(W sin)."""
    angle, mu, wide, high = np.radians(35.0), 0.5, 2.0, 0.8
    elastic = cohesion**2 / (2 * 1e8)
    bond = (
        f"normal_stiffness = 1e8, shear_stiffness = 1e8, tension = {T}, cohesion = {cohesion}, "
        f"energy_II = {30 * elastic}"
    )
    law = LAW.format(mu=mu, bond=bond)
    scene = block(law, (G * np.sin(angle), -G * np.cos(angle)), box=(wide, high))
    weight = RHO * G * wide * high
    expected = (cohesion * wide + weight * np.cos(angle) * mu) / (weight * np.sin(angle))
    assert factor_of_safety(scene) == pytest.approx(expected, rel=0.01)
