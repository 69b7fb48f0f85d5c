"""Cost per contact and step in the real YADE: its own laws, a joint table, the live joint law.

    python docs/measure/yade.py [--contacts 20000] [--runs 60] [--preset jing-replica]

One thread; minima of several runs; prints a table and JSON. `loop` is the whole step of YADE's
InteractionLoop with its own law and the geometry; `adapter` is what a joint adds to it, torque
included; `law` is the share of the law inside.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import jointlaw as jl
from jointlaw.hosts.yade.export import export_yade

SCENE = """
import json, sys, time
sys.path.insert(0, ".")
import numpy as np
from yade_joint import Joints, LiveLaw, TableLaw
contacts, runs, steps = {contacts}, {runs}, 1
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
    if law in ("table", "live"): law2.neverErase = True
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
for law in ("cundall", "hertz", "table", "live"):
    build(law)
    if law in ("table", "live"):
        if law == "table": joints = Joints(TableLaw("joint.txt"))
        else:
            from jointlaw import JointLaw
            joints = Joints(LiveLaw(JointLaw.from_toml("law.toml")))
        joints.attach()
    for _ in range(3): O.step()
    n = O.interactions.countReal()
    if law in ("table", "live"):
        whole, inner = adapter(joints)
        assert len(joints) == n and np.isfinite(joints.F).all() and joints.F[0].min() > 0
        out[law] = dict(contacts=n, adapter=whole / n, law=inner / n)
    else:
        out[law] = dict(contacts=n, loop=loop() / n)
print("RESULT " + json.dumps(out), flush=True)
"""


def main() -> int:
    """Run the scene and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--contacts", type=int, default=20000)
    parser.add_argument("--runs", type=int, default=60, help="single steps; the minimum counts")
    parser.add_argument("--preset", default="jing-replica")
    options = parser.parse_args()
    yade = shutil.which("yade")
    if yade is None:
        print("YADE is not installed (Debian: apt-get install yade)", file=sys.stderr)
        return 1
    law = jl.presets.load(options.preset)
    with tempfile.TemporaryDirectory() as folder:
        export_yade(law, folder)
        scene = SCENE.format(
            contacts=options.contacts, runs=options.runs, overlap=0.2 * law.closure_range
        )
        (Path(folder) / "scene.py").write_text(scene)
        env = os.environ | {
            "OMP_NUM_THREADS": "1",
            "JOINTLAW_THREADS": "1",
            "NUMBA_CACHE_DIR": str(Path(tempfile.gettempdir()) / "jointlaw-yade-numba"),
            "PYTHONPATH": str(Path(jl.__file__).parents[1]),
        }
        done = subprocess.run(
            [yade, "-n", "-x", "scene.py"], cwd=folder, env=env, text=True, capture_output=True,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not lines:
        print(done.stdout + done.stderr, file=sys.stderr)
        return 1
    result = json.loads(lines[-1][len("RESULT ") :])
    result["resolution"] = str(law.resolution)
    r = law.resolution
    live = f"live mode, `{r}` in space, numba"
    names = {"cundall": "Cundall-Strack", "hertz": "Hertz-Mindlin", "table": "table mode",
             "live": live}  # fmt: skip
    print("| | law and geometry of YADE | time that the adapter adds | part of it in our law |")
    print("|---|---:|---:|---:|")
    for name, row in result.items():
        if isinstance(row, dict):
            cells = [f"{row[k]:.0f}" if k in row else "" for k in ("loop", "adapter", "law")]
            print(f"| {names[name]} | {' | '.join(cells)} |")
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
