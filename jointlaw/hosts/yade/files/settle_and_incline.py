"""A sphere settles on a joint; then the joint is tilted.

    yade -n -x settle_and_incline.py          # the table
    yade -n -x settle_and_incline.py live     # the law itself (package `jointlaw` on PYTHONPATH)

A sphere (rotation blocked, so that it is a slider) lies on a fixed box and is pressed on it. When
it is at rest, the normal stress that the joint has at its closure is compared with the load. Then
the load is tilted. With the table the sphere sticks 0.1 degree below the friction angle, and slides
0.1 degree above. The law itself slips at every tilt: slip and rise are compared with those of a
shear test on one joint.
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
from yade_joint import Joints, LiveLaw, TableLaw  # noqa: E402

R = 0.1
AREA = np.pi * R**2

if unknown := set(sys.argv[1:]) - {"live"}:
    sys.exit(
        f"settle_and_incline.py: {' '.join(unknown)} is unknown; write live, or nothing for the "
        "table"
    )
live = "live" in sys.argv[1:]
STEPS = 4000 if live else 1000  # of a change of load: shear makes the law itself soft, so slow
path = os.path.join(folder, "joint.txt")
table = TableLaw(path).table
stress = 0.1 * table.normal_stress[-1]
if live:
    from jointlaw import JointLaw, direct_shear

    law = JointLaw.from_toml(os.path.join(folder, "law.toml"))


def settle():
    """A sphere on a box, pressed slowly; returns the closure at rest."""
    O.reset()
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
            [Law2_ScGeom_FrictPhys_CundallStrack(neverErase=live)],
        ),
        NewtonIntegrator(damping=0.4),
    ]
    joints = Joints(LiveLaw(law) if live else TableLaw(path))
    joints.attach()
    O.dt = joints.time_step(safety=1)  # made for rolling and six contacts: here there is one
    pull((0, 0, 0), (0, 0, -stress * AREA))
    return R - O.bodies[1].state.pos[2]


def tilt(angle, azimuth):
    """Settle, tilt the load slowly (degrees; the normal force stays), and wait.

    The box is sheared along azimuth. Returns how far the sphere slides while it waits, how far it
    has slid in all, and how far it has risen.
    """
    z = R - settle()
    shear, psi = stress * AREA * np.tan(np.radians(angle)), np.radians(azimuth)
    start = np.array([0, 0, -stress * AREA])
    pull(start, start - shear * np.array([np.cos(psi), np.sin(psi), 0]))
    before = O.bodies[1].state.pos
    O.run(500, True)
    at = O.bodies[1].state.pos
    return (at - before).norm(), np.hypot(at[0], at[1]), at[2] - z


def pull(start, end):
    """Change the force on the sphere from start to end, without a jerk, and let it come to rest."""
    for share in (1 - np.cos(np.linspace(0, np.pi, STEPS + 1))) / 2:
        force = (1 - share) * np.array(start) + share * np.array(end)
        O.forces.setPermF(1, force.tolist())
        O.step()
    O.run(500, True)


closure = settle()
there = law.normal_stress(closure) if live else table.lookup(closure).normal_stress
off = abs(there / stress - 1)
print(f"settled: closure {closure:.12g} m, where the {'law' if live else 'table'} has the normal "
      f"stress {there:.12g} Pa; relative difference to the load {off:.1e}")  # fmt: skip
if live:
    test = direct_shear(law.joint(), law.closure_range, normal=stress, steps=1000)
    for angle in (15.0, 30.0):
        _, slip, rise = tilt(angle, 0.0)
        expected = np.interp(np.tan(np.radians(angle)), test.shear_stress / stress, test.shear)
        up = test.closure[0] - np.interp(expected, test.shear, test.closure)
        print(f"tilt {angle:.0f} deg: slip {slip:.5g} m, rise {rise:.5g} m; "
              f"shear test: {expected:.5g} m, {up:.5g} m")  # fmt: skip
else:
    for azimuth in (0.0, 45.0, 90.0):
        there = table.lookup(closure, np.radians(azimuth))
        angle = np.degrees(np.arctan(there.peak_friction))
        for more in (-0.1, 0.1):
            moved = tilt(angle + more, azimuth)[0] / closure
            print(f"azimuth {azimuth:.0f} deg: friction angle {angle:.4f} deg, {more:+.1f} deg: "
                  f"{'slides' if moved > 1e-3 else 'sticks'} ({moved:.1e} closures)")  # fmt: skip
