"""Cost per contact and step in the real YADE: its own laws, a joint table, the live joint law.

    python docs/measure/yade.py [--contacts 20000] [--runs 60] [--preset jing-replica]

One thread; minima of several runs; prints a table. `loop` is the whole step of YADE's
InteractionLoop with its own law and the geometry; `adapter` is what a joint adds to it, torque
included; `law` is the share of the law inside.
"""

import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

from tables import asked, table

import jointlaw as jl
from jointlaw.hosts.yade.export import export_yade
from jointlaw.parameters.resolution import NAMED

COLUMNS = {"loop": "law and geometry of YADE", "adapter": "time that the adapter adds",
           "law": "part of it in our law"}  # fmt: skip
SCENE = """
import json, sys, time
sys.path.insert(0, ".")
import numpy as np
from yade_joint import Joints, LiveLaw, TableLaw
contacts, runs, steps = {contacts}, {runs}, 1
OWN = "cundall", "hertz"
N = round((contacts / 3) ** (1 / 3)) + 1
R = 0.5

def build(law):
    O.reset()
    O.materials.append(FrictMat(young=1e7, poisson=.3, frictionAngle=.5, density=2600))
    gap = 2 * R - {overlap}
    rng = np.random.default_rng(1)
    for k in range(N**3):
        x = gap * np.array([k % N, k // N % N, k // N**2])
        O.bodies.append(utils.sphere(x.tolist(), R))
        O.bodies[-1].state.vel = Vector3(*(1e-3 * rng.uniform(-1, 1, 3)).tolist())
        O.bodies[-1].state.angVel = Vector3(*(1e-3 * rng.uniform(-1, 1, 3)).tolist())
    ip2, law2 = Ip2_FrictMat_FrictMat_FrictPhys(), Law2_ScGeom_FrictPhys_CundallStrack()
    if law == "hertz":
        ip2, law2 = Ip2_FrictMat_FrictMat_MindlinPhys(), Law2_ScGeom_MindlinPhys_Mindlin()
    if law not in OWN: law2.neverErase = True
    O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=.01),
                 InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [ip2], [law2]),
                 NewtonIntegrator(damping=.2)]
    O.dt = 1e-8
    O.timingEnabled = True

def loop():
    best = 1e9
    for _ in range(runs):
        O.engines[2].execTime = 0
        for _ in range(steps): O.step()
        best = min(best, O.engines[2].execTime / steps)
    return best                                   # ns per step

def adapter(joints):
    whole, inner, real = 1e9, 1e9, joints.law.step
    spent = [0.0]
    def timed(*arguments):
        start = time.perf_counter()
        out = real(*arguments)
        spent[0] += time.perf_counter() - start
        return out
    joints.law.step = timed
    for _ in range(runs):
        O.engines[3].execTime, spent[0] = 0, 0.0
        for _ in range(steps): O.step()
        whole = min(whole, O.engines[3].execTime / steps)
        inner = min(inner, spent[0] / steps * 1e9)
    return whole, inner

out = {{}}
for law in {kinds}:
    build(law)
    if law not in OWN:
        if law == "table": joints = Joints(TableLaw("joint.txt"))
        else: joints = Joints(LiveLaw(law + ".toml"))
        joints.attach()
    for _ in range(3): O.step()
    n = O.interactions.countReal()
    if law not in OWN:
        whole, inner = adapter(joints)
        assert len(joints) == n and np.isfinite(joints.F).all() and joints.F[0].min() > 0
        out[law] = dict(contacts=n, adapter=whole / n, law=inner / n)
    else:
        out[law] = dict(contacts=n, loop=loop() / n)
print("RESULT " + json.dumps(out), flush=True)
"""


def measure(law, kinds, contacts=20_000, runs=60):
    """By kind of contact: how many contacts, and nanoseconds per contact and step."""
    program = shutil.which("yade")
    if program is None:
        raise SystemExit("YADE is not installed (Debian: apt-get install yade)")
    with tempfile.TemporaryDirectory() as folder:
        export_yade(law, folder)
        for resolution in set(kinds) & set(NAMED):
            replace(law, resolution=resolution).to_toml(Path(folder) / f"{resolution}.toml")
        scene = SCENE.format(contacts=contacts, runs=runs, kinds=kinds,
                              overlap=0.2 * law.closure_range)  # fmt: skip
        (Path(folder) / "scene.py").write_text(scene)
        env = os.environ | {
            "OMP_NUM_THREADS": "1",
            "JOINTLAW_THREADS": "1",
            "PYTHONPATH": str(Path(jl.__file__).parents[1]),
        }
        done = subprocess.run(
            [program, "-n", "-x", "scene.py"], cwd=folder, env=env, text=True,
            capture_output=True, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    for line in done.stdout.splitlines():
        if line.startswith("RESULT "):
            return json.loads(line.removeprefix("RESULT "))
    raise SystemExit(done.stdout + done.stderr)


def main():
    """Print the table."""
    options = asked(__doc__, contacts=20_000, runs=60, preset="jing-replica")
    law = jl.presets.load(options.preset)
    names = {"cundall": "Cundall-Strack", "hertz": "Hertz-Mindlin", "table": "table mode"}
    for name in ("fast", "balanced", "fine"):
        size = 8 * replace(law, resolution=name).state_size
        names[name] = f"live mode, {name} in space: {size} bytes of state"
    found = measure(law, list(names), options.contacts, options.runs)
    rows = [
        [name, *(f"{found[kind][k]:.0f}" if k in found[kind] else "" for k in COLUMNS)]
        for kind, name in names.items()
    ]
    print(table(["", *COLUMNS.values()], rows))


if __name__ == "__main__":
    main()
