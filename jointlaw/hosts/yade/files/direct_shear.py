"""Direct shear of two jointed blocks, in the manner of YADE's own testingJoint.py.

    yade -n -x direct_shear.py [live]

Two blocks of spheres, each a clump, meet at a horizontal plane. The contacts across it act as
pieces of one flat joint (`plane=`). The upper block is moved: it closes the joint, shears it
forward and back, opens it and closes it again. Writes direct_shear.csv. With `live` the law itself
runs behind the contacts (package `jointlaw` on PYTHONPATH), else the table.
"""

import os
import sys

import numpy as np
from yade import (
    Bo1_Sphere_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Sphere_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_FrictPhys,
    Law2_ScGeom_FrictPhys_CundallStrack,
    NewtonIntegrator,
    O,
    utils,
)  # fmt: skip

folder = os.path.dirname(os.path.abspath(sys.argv[0]))
sys.path.insert(0, folder)
from yade_joint import Joints, LiveLaw, TableLaw  # noqa: E402

if unknown := set(sys.argv[1:]) - {"live"}:
    sys.exit(
        f"direct_shear.py: {' '.join(unknown)} is unknown; write live, or nothing for the table"
    )
live = "live" in sys.argv[1:]
if live:
    from jointlaw import JointLaw

    law = LiveLaw(JointLaw.from_toml(os.path.join(folder, "law.toml")))
    end = law.law.closure_range
else:
    law = TableLaw(os.path.join(folder, "joint.txt"))
    end = law.un[-1]

# --- two blocks: 6 x 6 x 2 spheres each, face to face across z = 0
R, N = 0.1, 6
material = O.materials.append(FrictMat(young=1e9, poisson=0.3, frictionAngle=0.5, density=2600))
side = 2 * R * N


def block(layers):
    places = [(2 * R * (i + 0.5), 2 * R * (j + 0.5), R * z) for i in range(N) for j in range(N)
              for z in layers]  # fmt: skip
    return O.bodies.appendClumped([utils.sphere(x, R, material=material) for x in places])


lower, lower_members = block((-3, -1))
upper, upper_members = block((1, 3))
for clump in (lower, upper):
    O.bodies[clump].state.blockedDOFs = "xyzXYZ"
low = set(lower_members)

O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_FrictPhys_CundallStrack(neverErase=True)],  # keeps contacts that open
    ),
    NewtonIntegrator(damping=0),
]
joints = Joints(
    law, area=side**2 / N**2, select=lambda i: (i.id1 in low) != (i.id2 in low), plane=(0, 0, 1)
)  # fmt: skip
joints.attach()
O.dt = 1e-4  # the blocks are driven: no mass is accelerated, any step is stable

# --- the path: (closure, shear) corners, and the number of steps to reach each
corners = [(0.5, 0, 200), (0.5, 0.5, 200), (0.5, -0.25, 200), (-0.5, -0.25, 200), (0.5, -0.25, 200)]
rows, here = [], (0.0, 0.0)


def drive(steps, velocity):
    """Move the upper block and note the closure, shear and stresses of every step."""
    for _ in range(steps):
        O.bodies[upper].state.vel = velocity
        O.step()  # forces at this position, then the move
        force = sum((O.forces.f(k) for k in upper_members), O.forces.f(lower) * 0)
        rows.append((*displacement, *(np.array(force)[[2, 0]] / side**2)))
        displacement[:] += -velocity[2] * O.dt, velocity[0] * O.dt


displacement = np.zeros(2)
O.bodies[upper].state.vel = (0, 0, 0)
drive(1, (0, 0, 0))
for closure, shear, steps in corners:
    goal = (closure * end, shear * end)
    speed = (np.array(goal) - here) / (steps * O.dt)
    drive(steps, (speed[1], 0, -speed[0]))
    here = goal
drive(1, (0, 0, 0))

out = np.array(rows)
np.savetxt("direct_shear.csv", out, delimiter=",", comments="", fmt="%.17g",
           header="closure_m,shear_m,normal_stress_Pa,shear_stress_Pa")  # fmt: skip
print(f"{'live law' if live else 'table'}: {len(joints)} contacts, {len(out)} steps")
print(f"largest normal stress {out[:, 2].max():.5g} Pa, shear stress {-out[:, 3].min():.5g} Pa")
if not live:
    secant = law.at(np.maximum(out[:, 0], 0.0))[2]
    error = np.abs(out[:, 2] - secant * np.maximum(out[:, 0], 0.0)).max() / out[:, 2].max()
    print(f"normal stress against the table: largest error {error:.1e} of the peak")
print("wrote direct_shear.csv")
