"""A small jointed assembly: boulders fall into a box; every contact among them is a joint.

    yade -n -x assembly.py

Contacts come and go all the time; forces balance when the heap has come to rest. Gravity is scaled
to the table, so that the heap uses its lower part.
"""

import os
import random
import sys

import numpy as np
from yade import (
    Bo1_Facet_Aabb,
    Bo1_Sphere_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Facet_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_FrictPhys,
    Law2_ScGeom_FrictPhys_CundallStrack,
    NewtonIntegrator,
    O,
    geom,
    utils,
)  # fmt: skip

folder = os.path.dirname(os.path.abspath(sys.argv[0]))
sys.path.insert(0, folder)
from yade_joint import Joints, TableLaw  # noqa: E402

law = TableLaw(os.path.join(folder, "joint.txt"))
random.seed(1)
R = max(0.1, 50 * law.un[-1])
O.materials.append(FrictMat(young=1e9, poisson=0.3, frictionAngle=0.5, density=2600))
O.bodies.append(geom.facetBox((0, 0, 4 * R), (3.6 * R, 3.6 * R, 4 * R), wallMask=31))
for k in range(2):  # layers of 3 x 3 and 2 x 2, in the hollows of the one below
    places = (-2.4 * R, 0.0, 2.4 * R) if k % 2 == 0 else (-1.2 * R, 1.2 * R)
    for x in places:
        for y in places:
            at = [p + 0.1 * R * random.uniform(-1, 1) for p in (x, y)]
            O.bodies.append(utils.sphere((*at, R * (1.2 + 1.6 * k)), R * random.uniform(0.9, 1.05)))
# the weight of four spheres presses the lowest contacts to a tenth of the table's end
weight = 4 * 2600 * 4 / 3 * np.pi * R**3
gravity = 0.02 * law.sn[-1] * np.pi * R**2 / weight
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    NewtonIntegrator(damping=0.7, gravity=(0, 0, -gravity)),
]
joints = Joints(law)
joints.attach()
O.dt = joints.time_step(safety=0.5)
for k in range(1, 21):
    O.run(1500, True)
    joints.write_back()  # so that YADE's own measures see the joint forces
    unbalanced = utils.unbalancedForce()
    if k % 4 == 0 or unbalanced < 0.01:
        print(f"step {O.iter}: {len(joints)} joints, kinetic energy {utils.kineticEnergy():.3e} J, "
              f"unbalanced force {unbalanced:.1e}")  # fmt: skip
    if unbalanced < 0.01:
        break
floor = -sum(O.forces.f(b.id)[2] for b in O.bodies if not b.dynamic)
heap = sum(b.state.mass for b in O.bodies if b.dynamic) * gravity
print(f"force on the box {floor:.6g} N, weight of the heap {heap:.6g} N")
