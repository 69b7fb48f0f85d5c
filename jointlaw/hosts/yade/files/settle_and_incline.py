"""A sphere settles on a joint; then the joint is tilted until it slides.

    yade -n -x settle_and_incline.py

A sphere (rotation blocked, so that it is a slider) lies on a fixed box. Its weight closes the joint
to a tenth of the table; the closure is compared with the table's inverse. Then the weight is tilted
to 0.1 degree below and above the friction angle of that normal stress.
"""

import os
import sys

import numpy as np
from yade import (
    Bo1_Box_Aabb,
    Bo1_Sphere_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Box_Sphere_ScGeom,
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
from yade_joint import Joints, TableLaw  # noqa: E402

R = 0.1


def scene():
    """Sphere on a box, joined by the table."""
    O.reset()
    law = TableLaw(os.path.join(folder, "joint.txt"))
    O.materials.append(FrictMat(young=1e9, poisson=0.3, frictionAngle=0.5, density=2600))
    O.bodies.append(utils.box((0, 0, -0.1), (10, 10, 0.1), fixed=True))
    O.bodies.append(utils.sphere((0, 0, R), R))
    O.bodies[1].state.blockedDOFs = "XYZ"
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
        InteractionLoop(
            [Ig2_Box_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0.4),
    ]
    joints = Joints(law)
    joints.attach()
    O.dt = joints.time_step(safety=1)  # made for rolling and six contacts: here there is one
    return law, joints


def inverse(law, stress):
    """Closure (m) at which the table gives this normal stress."""
    low, high = 0.0, law.un[-1]
    for _ in range(200):
        middle = (low + high) / 2
        if middle * law.at(np.array([middle]))[2][0] < stress:
            low = middle
        else:
            high = middle
    return middle


area = np.pi * R**2
law, joints = scene()
stress = 0.1 * law.sn[-1]
closure = inverse(law, stress)
O.forces.setPermF(1, (0, 0, -stress * area))
O.run(2000, True)
found = R - O.bodies[1].state.pos[2]
print(f"settled: closure {found:.12g} m, table's inverse {closure:.12g} m, "
      f"relative difference {abs(found / closure - 1):.1e}")  # fmt: skip

for azimuth in (0.0, 45.0, 90.0):
    direction = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
    row, w, _ = law.at(np.array([closure]))
    # the sphere's side is id2 of box and sphere: it moves against the box by the same azimuth
    angle = np.degrees(np.arctan(law.friction(-direction[:, None], row, w)[0]))
    for off in (-0.1, 0.1):
        law, joints = scene()
        pull = stress * area * np.tan(np.radians(angle + off))
        O.forces.setPermF(1, (0, 0, -stress * area))
        O.run(500, True)
        for k in range(1, 101):  # tilt slowly: the normal force stays, the shear force grows
            share = min(1.0, k / 80)
            fx, fy = (pull * share * direction).tolist()
            O.forces.setPermF(1, (fx, fy, -stress * area))
            for _ in range(8):  # O.run(..., True) polls: slow for a few steps
                O.step()
        x, y, _ = O.bodies[1].state.pos
        before = np.hypot(x, y)
        O.run(500, True)
        x, y, _ = O.bodies[1].state.pos
        moved = np.hypot(x, y) - before
        says = "slides" if moved > 1e-3 * closure else "sticks"
        print(f"azimuth {azimuth:.0f} deg: friction angle {angle:.4f} deg, {off:+.1f} deg: {says} "
              f"({moved / closure:.1e} closures)")  # fmt: skip
