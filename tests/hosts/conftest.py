"""Runs the real YADE as a subprocess; tests are skipped where it is not installed."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from lammps_host import build, soft

import jointlaw
from jointlaw.hosts.yade.export import copy_adapter
from jointlaw.tables.table import JointTable

ROOT = Path(jointlaw.__file__).parents[1]
MARK = "RESULT "

PREAMBLE = f"""
import os, sys, json
sys.path.insert(0, os.getcwd())
import numpy as np
from math import *
def result(**values):
    def plain(v): return v.tolist() if hasattr(v, "tolist") else v
    print("\\n{MARK}" + json.dumps({{k: plain(v) for k, v in values.items()}}), flush=True)
from yade_joint import Joints, TableLaw, LiveLaw
import yade_joint

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
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
    O.bodies.append(utils.box((0, 0, -1), (20, 20, 1), fixed=True))
    O.bodies.append(utils.sphere((0, 0, R), R))

def drive(path, closed=0.0, R=0.5):
    \"\"\"Move the sphere along (closure, x, y), note the force on it (z, x, y) at each point.\"\"\"
    sphere, out = O.bodies[1], []
    sphere.state.blockedDOFs = "xyzXYZ"
    for u, x, y in path:
        sphere.state.pos = (x, y, R - u)
        O.step()
        f = O.forces.f(1)
        out.append((f[2], f[0], f[1]))
    return np.array(out)
"""


def pytest_collection_modifyitems(items):
    """Every test with a host is slow: hosts are installed apart, and start slowly."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def yade(tmp_path):
    """Run a script in YADE after the preamble; returns what it passed to `result(...)`."""
    program = shutil.which("yade")
    if program is None:
        pytest.skip("YADE is not installed (Debian: apt-get install yade)")

    def run(script, live=False, args=(), preamble=True, folder=tmp_path, name="scene.py"):
        path = Path(folder) / name
        if script is not None:
            path.write_text((PREAMBLE if preamble else "") + script)
            copy_adapter(Path(folder))
        env = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
        env |= {"OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
        if live:  # two versions of numba in one cache throw each other's kernels away
            cache = Path(tempfile.gettempdir()) / "jointlaw-yade-numba"
            env |= {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(cache)}
        done = subprocess.run(
            [program, "-n", "-x", str(path), *args],
            cwd=folder, env=env, capture_output=True, text=True, timeout=300,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        text = done.stdout + done.stderr
        if script is None:
            assert "Traceback" not in text, text
            return text
        found = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
        assert found, f"the scene gave no result:\n{text}"
        values = json.loads(found[-1][len(MARK) :])
        return {k: np.array(v) if isinstance(v, list) else v for k, v in values.items()}

    return run


@pytest.fixture
def make_table():
    """Tables with known answers: sn = kn un^(1 + eta), elastic-frictional shear."""

    def make(path, kn=1e8, ks=5e7, mu=0.4, eta=0.0, end=1e-2, uneven=0.0, uneven_mu=0.0):
        un = end * np.linspace(0, 1, 81) ** 2
        psi = np.arange(12) * np.pi / 12
        wave = np.cos(2 * psi)
        power = un[:, None] ** eta
        friction = np.repeat(mu * (1 + uneven_mu * wave)[None], 81, axis=0)
        table = JointTable(
            un, kn * un ** (1 + eta), kn * un**eta, (1 + eta) * kn * un**eta, psi,
            ks * power * (1 + uneven * wave), friction, friction, 0 * friction,
            {"shear_limit": end},
        )  # fmt: skip
        table.save(path)
        return table

    return make


@pytest.fixture(scope="session")
def plugin(tmp_path_factory):
    """A folder with LAMMPS' plug-in, built, and rock.jlaw, a soft joint in space."""
    return build(tmp_path_factory.mktemp("lammps"), soft())
