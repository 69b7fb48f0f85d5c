"""A sphere settles on a joint; then the load is inclined.

    yade -n -x settle_and_incline.py          # the table
    yade -n -x settle_and_incline.py live     # the law (package `jointlaw` on PYTHONPATH)

A sphere with blocked rotation lies on a fixed box under a normal load. At static equilibrium the
normal stress of the joint at its closure is compared with the load. Then the load is inclined. With
the table the sphere sticks 0.1 degree below the friction angle and slides 0.1 degree above it. The
law slips at every inclination: slip and dilation are compared with a shear test on one joint.
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
STEPS = (
    4000 if live else 1000
)  # of a change of load; more for the law, whose shear stiffness decreases
path = os.path.join(folder, "joint.txt")
table = TableLaw(path).table
stress = 0.1 * table.normal_stress[-1]
if live:
    from jointlaw import JointLaw, direct_shear

    law = JointLaw.from_toml(os.path.join(folder, "law.toml"))


def settle():
    """Load a sphere on a box slowly; returns the closure at static equilibrium."""
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
    O.dt = joints.time_step(safety=1)  # it allows for rolling and six contacts; this sphere has one
    change_load((0, 0, 0), (0, 0, -stress * AREA))
    return R - O.bodies[1].state.pos[2]


def tilt(angle, azimuth):
    """Settle, incline the load slowly (degrees; constant normal force), and continue at rest.

    The box is sheared along azimuth. Returns the slip of the sphere at constant load, its total
    slip and its rise.
    """
    z = R - settle()
    shear = stress * AREA * np.tan(np.radians(angle))
    psi = np.radians(azimuth)
    start = np.array([0, 0, -stress * AREA])
    change_load(start, start - shear * np.array([np.cos(psi), np.sin(psi), 0]))
    before = O.bodies[1].state.pos
    O.run(500, True)
    at = O.bodies[1].state.pos
    return (at - before).norm(), np.hypot(at[0], at[1]), at[2] - z


def change_load(start, end):
    """Change the force on the sphere smoothly from start to end, then continue at constant load."""
    for fraction in (1 - np.cos(np.linspace(0, np.pi, STEPS + 1))) / 2:
        force = (1 - fraction) * np.array(start) + fraction * np.array(end)
        O.forces.setPermF(1, force.tolist())
        O.step()
    O.run(500, True)


closure = settle()
normal_stress = law.normal_stress(closure) if live else table.lookup(closure).normal_stress
error = abs(normal_stress / stress - 1)
print(f"settled: closure {closure:.12g} m, where the {'law' if live else 'table'} has the normal "
      f"stress {normal_stress:.12g} Pa; relative difference to the load {error:.1e}")  # fmt: skip
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
        friction = table.lookup(closure, np.radians(azimuth)).peak_friction
        angle = np.degrees(np.arctan(friction))
        for offset in (-0.1, 0.1):
            relative_slip = tilt(angle + offset, azimuth)[0] / closure
            motion = "slides" if relative_slip > 1e-3 else "sticks"
            print(f"azimuth {azimuth:.0f} deg: friction angle {angle:.4f} deg, {offset:+.1f} deg: "
                  f"{motion} ({relative_slip:.1e} closures)")  # fmt: skip
