"""Regenerate how-accurate.md, accuracy-measured.md and only-what-is-needed.md: tables and pictures.

`python docs/make_accuracy.py [PART ...]`: every part prints what it took. A part is what stands
between its two marks in one of the pages, or the name of a scene, whose ablation goes to
docs/data/ablation-SCENE.csv. Times in the tables are those of this machine: let nothing else run
beside it. `docs/make_all.py` runs these parts and all others, two at a time where no time is kept.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import nodes  # noqa: E402
import numpy as np  # noqa: E402
import reductions  # noqa: E402
import tolerance  # noqa: E402
from _ablations import HEAD, by_ingredient  # noqa: E402
from _pages import DATA, HERE, fill, has, load, save, table  # noqa: E402

import dem_demo  # noqa: E402
import jointlaw as jl  # noqa: E402
from jointlaw.parameters.resolution import NAMED  # noqa: E402

PAGES = "how-accurate.md", "accuracy-measured.md", "only-what-is-needed.md"
PICTURES = HERE / "pictures"
SCENES = sorted(path.stem.partition("-")[2] for path in DATA.glob("ablation-*.csv"))
MACHINE = "time_step_s", "cpu_s"  # columns of an ablation that docs/data leaves out
STRESS = 10e6  # Pa
# The first and the last take up to 35 and 8 times the time of a scene
LEFT_OUT = "resolution reference", "resolution balanced", "not seated"
UNTIL = {"stack": 0.5, "slope": 0.5, "slope-azimuth": 0.6, "arch": 0.4}  # s
LAWS, SEED = 3, 31  # of the tolerances
DRAWN = 8  # random laws of the placing of nodes


def run(*command, **env):
    """What a command of this project prints."""
    done = subprocess.run([sys.executable, *command], cwd=ROOT, env=os.environ | env, check=True,
                          stdout=subprocess.PIPE)  # fmt: skip
    return done.stdout.decode()


def price_list():
    """The picture and the frontier of one preset."""
    command = ["-m", "jointlaw", "tradeoff", "westerly-smooth", "--plane", "0", "--out"]
    with tempfile.TemporaryDirectory() as folder:
        printed = run(*command, folder, JOINTLAW_THREADS="1")
        shutil.copy(Path(folder) / "tradeoff.png", PICTURES / "tradeoff.png")
    return f"```\n{printed.split('wrote ')[0]}```\n"


def peers(*options):
    """A run of benchmarks/peers.py in a process of its own: it wants one thread."""
    return run("benchmarks/peers.py", *options).split("\n\n")[-1]


def million():
    """A million joints."""
    return f"```\n{run('benchmarks/peers.py', '--million')}```\n"


def tolerances():
    """Whether tolerances are kept on random laws and paths."""
    return tolerance.table(tolerance.draw(LAWS, SEED, plane=True)) + "\n"


@cache
def laws():
    """Laws on which nodes are placed, with their standard paths."""
    return nodes.Laws.draw(DRAWN)


def ablation(scene):
    """The file of a scene without each of its ingredients in turn, to four digits."""
    with tempfile.TemporaryDirectory() as folder:
        until = ("--until", str(UNTIL[scene])) if scene in UNTIL else ()
        run("-m", "dem_demo", "ablate", scene, *until, "--out", folder, "--leave-out", *LEFT_OUT)
        rows = load(Path(folder) / "ablation.csv")
    save(data_of(scene), [{k: four(v) for k, v in row.items() if k not in MACHINE} for row in rows])


def data_of(scene):
    return DATA / f"ablation-{scene}.csv"


def four(cell):
    """A cell with four digits, if it holds a number."""
    try:
        return f"{float(cell):.4g}" if "." in cell else cell
    except ValueError:
        return cell


def ingredients():
    """Over all scenes."""
    return table(HEAD, by_ingredient([load(data_of(name)) for name in SCENES]))


def savings():
    """What each reduction saves, all timed in one run."""
    return reductions.table(reductions.measure()) + "\n"


def slip():
    """Sliders that slip in a closure test, where no asperity reaches its friction limit."""
    asperity = replace(reductions.WHOLE.asperity, mu=0.6)  # mu lam = 0.72, tan(pi/(2a)) = 0.58
    rows = []
    for name in NAMED:
        law = replace(reductions.WHOLE, asperity=asperity, resolution=name, closure_only=True)
        joint, steps = law.joint(), 200
        top, found = float(law.closure(STRESS)), []
        for closing in np.repeat([top / steps, -top / steps], steps):
            joint.update([closing], tangent=False)
            found.append(joint.slipping)
        shut, opened = np.array(found).reshape(2, steps)
        work = float(law.curve.energy(np.array(top)) * law.normal_stress(top))
        work /= float(law.curve.force(np.array(top))[0])
        lost = joint.dissipated_energy / work
        rows.append([name, f"{(shut > 0).mean():.0%}", f"{(opened > 0).mean():.0%}", f"{lost:.2%}"])
    return table(
        [
            "resolution",
            "closing steps with slip",
            "opening steps with slip",
            "loss / work of closing",
        ],
        rows,
    )


def plane():
    """A law with a plane against the law in 3-D on a path of shear in that plane."""
    rows, orientation = [], jl.Orientation(3.0, 0.0, 0.3)
    for degrees in (0.0, 22.5, 45.0, 67.5, 90.0):
        way, cells = np.radians(degrees), []
        for name in ("balanced", "fine", "reference"):
            law = replace(reductions.WHOLE, orientation=orientation, resolution=name)
            change, across = _planes_apart(law, way)
            cells.append(f"{change:.0e}")
        rows.append([f"{degrees:g}", *cells, f"{across:.1%}"])
    head = ["azimuth (deg)", "change at balanced", "fine", "reference", "shear across, dropped"]
    return table(head, rows)


def _planes_apart(law, way):
    """Largest change of the shear in the plane, and shear across it, as shares of the peak."""
    along, found = np.array([np.cos(way), np.sin(way)]), []
    space, flat = law.joint(), replace(law, plane=way).joint()
    for k in range(300):  # shut, shear, shear back
        d = [5e-7, 0.0] if k == 0 else [0.0, 1e-8 if k < 150 else -1e-8]
        F, _ = space.update([d[0], *(d[1] * along)], tangent=False)
        G, _ = flat.update(d, tangent=False)
        found.append([F[1:] @ along, G[1], F[1:] @ [-along[1], along[0]]])
    full, reduced, across = np.array(found).T
    peak = np.abs(full).max()
    return np.abs(full - reduced).max() / peak, np.abs(across).max() / peak


def angles():
    """Friction angle of the two laws of the tilt test, alone, by stress and resolution."""
    rows, laws = [], dem_demo.load("tilt").laws
    for u, phi, depth in ((2, 3, 1), (2, 4, 1), (2, 10, 1), (4, 6, 1), (4, 10, 1), (4, 10, 6),
                          (16, 24, 1)):  # fmt: skip
        found = []
        for stress in (26e3, 6e3):
            for name in ("along", "across"):
                law = replace(laws[name], resolution=jl.Resolution(u, phi, depth))
                # friction peaks where the contacts begin to be renewed
                way = [1.2 * law.critical_slip]
                record = jl.direct_shear(law.joint(), to=way, normal=stress, steps=120)
                found.append(f"{record.peak_friction_angle:.2f}")
        rows.append([f"{u}, {phi}, {depth}", *found])
    head = ["u, phi, depth", "along, 26 kPa", "across, 26 kPa", "along, 6 kPa", "across, 6 kPa"]
    return table(head, rows)


PARTS = {
    "price-list": price_list,
    "peers-smooth": peers,
    "peers-rough": partial(peers, "--preset", "westerly-rough"),
    "million": million,
    "tolerances": tolerances,
    "named": lambda: nodes.Laws.draw(0).named(),
    "frontier": lambda: laws().frontier(str(PICTURES / "frontier.png")),
    "slip-angles": lambda: run("benchmarks/slip.py"),
    "savings": savings,
    "slip": slip,
    "plane": plane,
    "angles": angles,
    "ingredients": ingredients,
}


def main():
    keys = sys.argv[1:] or (*SCENES, *PARTS)
    for key in keys:
        timed(ablation if key in SCENES else part, key)


def part(key):
    """Fill a part of a page."""
    fill(next(page for page in PAGES if has(page, key)), key, PARTS[key]())


def timed(make, key):
    """Make a part and print what it took."""
    begun = time.perf_counter()
    make(key)
    print(f"{key}: {time.perf_counter() - begun:.0f} s", flush=True)


if __name__ == "__main__":
    main()
