"""Steps of blocks, and the forces of their joints as the tests add them up."""


def steps(sim, count, see=lambda: None):
    """Take so many steps; what `see` gives after each."""
    seen = []
    for _ in range(count):
        sim.step()
        seen.append(see())
    return seen


def until(sim, time, see=lambda: None):
    """Step on to a time (s); what `see` gives after each step."""
    seen = []
    while sim.time < time:
        seen += steps(sim, 1, see)
    return seen


def contact_forces(sim):
    """Forces and torques (n, 3) of the joints on the blocks, dashpots left out (N, N m)."""
    stress, shear = sim.joints.traction.T
    stored = sim.joints.stored * sim.scene.thickness  # what a change of length costs
    area = sim.ledger.area
    return sim.contacts.assemble(sim.blocks.motion, area * stress, -area * shear, stored)
