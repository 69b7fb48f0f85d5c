"""Forces of the joints on the blocks of `dem_demo`, as the tests add them up."""


def contact_forces(sim):
    """Forces and torques (n, 3) of the joints on the blocks, dashpots left out (N, N m)."""
    stress, shear = sim.traction.T
    stored = sim.joints.now["stored"] * sim.scene.thickness  # what a change of length costs
    sim.assembly.move(sim.motion)
    return sim.assembly(sim.points, sim.area * stress, -sim.area * shear, stored)
