"""Make the tables and pictures of README and docs anew: `python docs/make_all.py [TASK ...]`.

Tasks of which no time is kept run two at a time, on one thread each; those that measure times come
last, one by one: let nothing else run beside them. Each prints what it took. `EXTREMES`, `PICTURES`
and `ACCURACY` are parts of the scripts make_*.py in this folder, which take them by name as well;
`PRINTED` are tables that a command prints, and the page where they stand between marks of that
name. Tables of YADE and LAMMPS need these installed. A task that fails does not stop the others.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import make_accuracy
import make_pictures
from _pages import HERE, fill

ROOT = HERE.parent
TIMES = "price-list", "peers-smooth", "peers-rough", "million", "savings"
LAST = ("ingredients",)  # of what other tasks write
ACCURACY = (*make_accuracy.SCENES, *make_accuracy.PARTS)
EXTREMES = ("matrix", "fuzz", "drift", "dynamics", "impact", "exact", "control",
            "forgetting")  # fmt: skip
PICTURES = tuple(make_pictures.RUNS)
PRINTED = {
    "intervals": ("fits-measured.md", "docs/measure/intervals.py --draws 25 --workers 1"),
    "held-out-few": ("fits-measured.md", "docs/measure/held_out.py --draws 20 --few --workers 1"),
    "held-out-narrow": (
        "fits-measured.md",
        "docs/measure/held_out.py --draws 20 --few --prior full_contact_stress=2e7,2e10 "
        "--workers 1",
    ),
    "peak-residual": ("fits-measured.md", "docs/measure/peak_residual.py"),
}
PRINTED_TIMES = {
    "update": ("speed.md", "benchmarks/update.py --rounds 3 --seconds 0.05"),
    "native": ("native.md", "benchmarks/native.py"),
    "yade": ("yade.md", "benchmarks/yade.py"),
    "lammps": ("lammps.md", "benchmarks/lammps.py FOLDER --rounds 2 --steps 60 --settle 60"),
}


def script(name, key):
    """A part of another script of this folder."""
    _run([str(HERE / name), key], alone=key in TIMES)


def printed(key):
    """The first table that a command prints, in its page."""
    page, command = (PRINTED | PRINTED_TIMES)[key]
    with tempfile.TemporaryDirectory() as folder:
        out = _run(command.replace("FOLDER", folder).split(), alone=key in PRINTED_TIMES)
    table = re.search(r"^\|.*?(?=^[^|]|\Z)", out, re.DOTALL | re.MULTILINE)
    if table is None:
        raise ValueError(f"{command} printed no table:\n{out}")
    fill(page, key, table[0])


def _run(command, alone):
    env = os.environ | ({} if alone else {"JOINTLAW_THREADS": "1"})
    done = subprocess.run([sys.executable, *command], cwd=ROOT, env=env, text=True,
                          capture_output=True)  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


TASKS = {  # short ones last, so that both processors have work to the end
    **{key: partial(printed, key) for key in (*PRINTED, *PRINTED_TIMES)},
    **{key: partial(script, "make_pictures.py", key) for key in PICTURES},
    **{key: partial(script, "make_extremes.py", key) for key in EXTREMES},
    **{key: partial(script, "make_accuracy.py", key) for key in ACCURACY},
}


def main():
    keys = sys.argv[1:] or list(TASKS)
    timed = [key for key in keys if key in (*TIMES, *PRINTED_TIMES)]
    last = [key for key in keys if key in LAST]
    with ThreadPoolExecutor(2) as pool:  # each waits for a process of its own
        done = list(pool.map(task, [key for key in keys if key not in (*timed, *last)]))
    done += [task(key) for key in (*last, *timed)]
    sys.exit(0 if all(done) else "not all tasks were done")


def task(key):
    """Whether it was done."""
    begun, error = time.perf_counter(), None
    try:
        TASKS[key]()
    except (RuntimeError, ValueError) as fault:
        error = fault
    print(f"{key}: {time.perf_counter() - begun:.0f} s", error or "", flush=True)
    return error is None


if __name__ == "__main__":
    main()
