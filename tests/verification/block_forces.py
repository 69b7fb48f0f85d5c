"""Forces of the joints on the blocks of `dem_demo`, as the tests add them up."""


def contact_forces(sim):
    """Forces and torques (n, 3) of the joints on the blocks, dashpots left out (N, N m)."""
    stress, shear = sim.joints.traction.T
    stored = sim.joints.stored * sim.scene.thickness  # what a change of length costs
    area = sim.ledger.area
    return sim.contacts.assemble(sim.blocks.motion, area * stress, -area * shear, stored)
