"""Scenes in the real YADE, run as a subprocess; tests are skipped where it is not installed."""

import json
import os
from pathlib import Path

import numpy as np
from programs import find_program, run_program

import jointlaw as jl
from jointlaw.hosts.yade.export import copy_files

MARK = "RESULT "

PREAMBLE = f"""
import os, sys, json
sys.path.insert(0, os.getcwd())
import numpy as np
from math import *
from yade_joint import Joints, TableLaw, LiveLaw
import yade_joint

def result(**values):
    print("\\n{MARK}" + json.dumps(values, default=lambda v: v.tolist()), flush=True)

def material():
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))

def engines(kn=0.0, ks=0.0, mu=0.5, damping=0.0, ratchet=True, keep=False, gravity=(0, 0, 0)):
    value = lambda v: MatchMaker(algo="val", val=v)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=ratchet), Ig2_Box_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys(
                kn=value(kn), ks=value(ks), frictAngle=value(atan(mu)))],
            [Law2_ScGeom_FrictPhys_CundallStrack(neverErase=keep)]),
        NewtonIntegrator(damping=damping, gravity=gravity),
    ]

def slab_and_sphere(R=0.5):
    material()
    O.bodies.append(utils.box((0, 0, -1), (20, 20, 1), fixed=True))
    O.bodies.append(utils.sphere((0, 0, R), R))

def attached(law, **options):
    joints = Joints(law, **options)
    joints.attach()
    return joints

def drive(path, R=0.5):
    \"\"\"Move the sphere along (closure, x, y), note the force on it (z, x, y) at each point.\"\"\"
    sphere, out = O.bodies[1], []
    sphere.state.blockedDOFs = "xyzXYZ"
    for u, x, y in path:
        sphere.state.pos = (x, y, R - u)
        O.step()
        f = O.forces.f(1)
        out.append((f[2], f[0], f[1]))
    return np.array(out)

told = {{}}
def attempt(name, action):
    \"\"\"Note what an action says that is to be refused.\"\"\"
    try:
        action()
        told[name] = ""
    except Exception as error:
        told[name] = str(error)
"""


def run_yade(folder, script, *args, live=False, code=0, threads="1"):
    """Run a script in its folder with YADE on some threads; returns the output."""
    env = os.environ | {"OMP_NUM_THREADS": threads, "MPLBACKEND": "Agg"}
    env["PYTHONPATH"] = str(Path(jl.__file__).parents[1]) if live else ""
    return run_program(
        find_program("yade"), f"-j{threads}", "-n", "-x", script, *args, code=code, cwd=folder,
        env=env,
    )  # fmt: skip


def run_scene(folder, script, live=False, preamble=PREAMBLE, threads="1"):
    """Run a scene; returns the values that it passes to `result(...)`, by name."""
    (folder / "scene.py").write_text(preamble + script)
    copy_files(folder)
    _, mark, rest = run_yade(folder, "scene.py", live=live, threads=threads).rpartition(MARK)
    assert mark, rest
    return json.loads(rest.splitlines()[0])


def make_table(path, kn=1e8, ks=5e7, mu=0.4, eta=0.0, end=1e-2, uneven=0.0, uneven_mu=0.0):
    """Write a table with known answers: sn = kn un^(1 + eta), elastic-frictional shear."""
    un = end * np.linspace(0, 1, 81) ** 2
    psi = np.arange(12) * np.pi / 12
    wave = np.cos(2 * psi)
    power = un[:, None] ** eta
    friction = np.repeat(mu * (1 + uneven_mu * wave)[None], 81, axis=0)
    table = jl.JointTable(
        un, kn * un ** (1 + eta), kn * un**eta, (1 + eta) * kn * un**eta, psi,
        ks * power * (1 + uneven * wave), friction, friction, 0 * friction, {"shear_limit": end},
    )  # fmt: skip
    table.save(path)
    return table
