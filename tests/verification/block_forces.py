"""Forces of the joints on the blocks of `dem_demo`, as the tests add them up."""


def contact_forces(sim):
    """Forces and torques (n, 3) of the joints on the blocks, dashpots left out (N, N m)."""
    stress, shear = sim.now.traction.T
    stored = sim.joints.now["stored"] * sim.scene.thickness  # what a change of length costs
    push, shear = sim.now.area * stress, -sim.now.area * shear
    return sim.now.layout.assembly(sim.now.motion, sim.now.points, push, shear, stored)
