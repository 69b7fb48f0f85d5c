"""Make the tables and pictures of README and docs anew: `python docs/make_all.py [TASK ...]`.

A task is a table that a command prints, and takes its place between the marks of that name in a
page; or a picture of docs/pictures that a command draws; or a shipped scene, whose ablation goes to
docs/data. `--list` prints all of them: key, page or file that the command writes, command. Tasks of
which no time is kept run two at a time, on one thread each; those that measure times come last, one
by one: let nothing else run beside them. Each prints what it took. Tables of YADE and LAMMPS need
these installed. `timed` makes all that measure times, the tables of costs. A task that fails does
not stop the others.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock

HERE = Path(__file__).parent
# key: where it goes, and the command; the first table that it prints goes to a page
TABLES = {
    "intervals": ("validation.md", "docs/measure/intervals.py"),
    "held-out-few": ("validation.md", "docs/measure/held_out.py"),
    "peak-residual": ("validation.md", "docs/measure/peak_residual.py"),
    "baselines": ("validation.md", "docs/measure/baselines.py"),
    "small-loads": ("accuracy.md", "docs/measure/tolerance.py --small --laws 4 --seed 5"),
}
TIMED = {
    "price-list": ("accuracy.md", "docs/measure/price_list.py"),
    "native": ("native.md", "docs/measure/native.py"),
    "joints": ("native.md", "docs/measure/native.py --joints"),
    "blocks-price": ("blocks.md", "docs/measure/blocks.py"),
    "yade": ("particles.md", "docs/measure/yade.py"),
    "lammps": ("particles.md", "docs/measure/lammps.py FOLDER"),
    "lammps-scale": ("particles.md", "docs/measure/lammps_scale.py FOLDER"),
}
# the file that a command writes into FOLDER becomes the picture
PICTURES = {
    "moving.gif": ("moving.gif", "docs/draw/moving.py FOLDER"),
    **{
        f"{name}.png": (f"{name}.png", "docs/draw/why.py FOLDER")
        for name in ("three-laws", "along-across", "jrc", "strength-surface")
    },
    "axes.png": ("axes.png", "docs/draw/axes.py FOLDER"),
    "shear.png": (
        "shear.png",
        "-m jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse=-2um "
        "--resolution fine --out FOLDER",
    ),
    "tilt.png": ("tilt.png", "docs/draw/tilt.py FOLDER"),
    "slope.png": ("final.png", "-m dem_demo slope --out FOLDER"),
    "slope.gif": ("motion.gif", "-m dem_demo slope --out FOLDER"),
    "shear-box.png": ("curves.png", "-m dem_demo shear-box --out FOLDER"),
    "strength.png": (
        "failing-rough.png",
        "-m dem_demo strength-reduction slope --out FOLDER",
    ),
    "wet-slope.png": ("final.png", "-m dem_demo wet-slope --out FOLDER"),
    "tunnel.png": ("final.png", "-m dem_demo tunnel --out FOLDER"),
    "shaken-slope.png": ("shaken-slope.png", "docs/draw/shaken_slope.py FOLDER"),
    "fit.png": ("fit.png", "-m jointlaw fit grimsel_vd1_closure --up-to 5.3MPa --out FOLDER"),
}
SCENES = {  # the command writes to docs/data itself
    scene: ("docs/data", f"docs/measure/ablations.py --scene {scene}")
    for scene in sorted(path.stem.partition("-")[2] for path in HERE.glob("data/ablation-*.csv"))
}
TASKS = TABLES | PICTURES | SCENES | TIMED
LOCK = Lock()  # of the pages: two tasks may fill the same one


def make(key):
    """Run the command of a task and store what it makes."""
    place, command = TASKS[key]
    with tempfile.TemporaryDirectory() as folder:
        printed = run(command, folder, key)
        if key in PICTURES:
            shutil.copy(Path(folder) / place, HERE / "pictures" / key)
        elif key not in SCENES:
            fill(place, key, first_table(printed))


def run(command, folder, key):
    """What it prints."""
    words = command.replace("FOLDER", folder).split()
    env = os.environ | ({} if key in TIMED else {"JOINTLAW_THREADS": "1"})
    done = subprocess.run([sys.executable, *words], cwd=HERE.parent, env=env, text=True,
                          capture_output=True)  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{command} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def first_table(text):
    """What goes to the page."""
    table = re.search(r"^\|.*?(?=^[^|]|\Z)", text, re.DOTALL | re.MULTILINE)
    if table is None:
        raise ValueError(f"no table was printed: {text}")
    return table[0].strip()


def fill(page, key, text):
    """Put text between the marks `key` and `end of key` of the page."""
    path = HERE / page
    with LOCK:
        old = path.read_text(encoding="utf-8")
        before, found, rest = old.partition(f"<!-- {key} -->\n")
        if not found:
            raise ValueError(f"{page} has no place for {key}")
        after = rest[rest.index(f"<!-- end of {key} -->") :]
        path.write_text(f"{before}{found}{text}\n{after}", encoding="utf-8")


def task(key):
    """Whether it was done."""
    begun, error = time.perf_counter(), None
    try:
        make(key)
    except (RuntimeError, ValueError) as fault:
        error = fault
    print(f"{key}: {time.perf_counter() - begun:.0f} s", error or "", flush=True)
    return error is None


def main():
    if "--list" in sys.argv:
        for key, (place, command) in TASKS.items():
            print(f"{key}\t{place}\t{command}")
        return
    keys = TIMED if sys.argv[1:] == ["timed"] else sys.argv[1:] or TASKS
    if unknown := set(keys).difference(TASKS):
        sys.exit(f"no task {', '.join(sorted(unknown))}; --list prints all")
    last = [key for key in keys if key in TIMED]
    with ThreadPoolExecutor(2) as pool:  # each waits for a process of its own
        done = list(pool.map(task, [key for key in keys if key not in last]))
    done += [task(key) for key in last]
    sys.exit(0 if all(done) else "not all tasks were done")


if __name__ == "__main__":
    main()
