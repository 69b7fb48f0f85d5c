"""Make tables, figures and pictures of README and docs anew: `python docs/make_all.py [PART ...]`.

A part is one command, which writes a table into a page, between the marks of the same name, or
pictures into docs/pictures, or an ablation of a shipped scene into docs/data. All other output of
the command is printed: it has the figures that a page quotes. It is stored in docs/data/printed,
too, below the command and its processor time: tests compare the pages with these files. `--list`
prints all parts: name, pages or files, command. `timed` names all parts that measure times, the
tables of costs.

Without a name all parts are made. Parts that measure no time run two at a time, on one thread each;
parts that measure times come last, one by one: let no other program run meanwhile. Some parts need
an hour, others YADE, LAMMPS, LMGC90 or CuPy. A part that fails does not stop the others.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

from PIL import Image

DOCS = Path(__file__).parent
PRINTED = DOCS / "data" / "printed"
MAX_WIDTH = 1600  # pixels of a picture on the site
PAGE_LOCK = Lock()  # two parts may write to the same page


@dataclass(frozen=True)
class Part:
    """A command, run in the root of the repository, and the places of its output.

    command: after the name of Python; FOLDER stands for a temporary folder.
    page: has the marks between which the first printed table goes.
    pictures: name in docs/pictures: name of the file that the command writes into FOLDER.
    quoted_in: pages that quote figures of the output.
    """

    command: str
    page: str | None = None
    pictures: dict[str, str] = field(default_factory=dict)
    quoted_in: str = ""
    is_timed: bool = False

    @property
    def places(self):
        """Pages and files that have its output."""
        page = [self.page] if self.page else []
        pictures = [f"pictures/{name}" for name in self.pictures]
        quoted_in = self.quoted_in.split()
        return ", ".join(dict.fromkeys([*page, *pictures, *quoted_in]))


PARTS = {
    # accuracy.md
    "named-resolutions": Part("docs/measure/resolutions.py named", quoted_in="accuracy.md"),
    "tolerance": Part(
        "docs/measure/random_laws.py tolerance --laws 3 --seed 31 --plane", quoted_in="accuracy.md"
    ),
    "tilt-friction": Part("docs/measure/resolutions.py tilt-friction", quoted_in="accuracy.md"),
    "small-loads": Part(
        "docs/measure/random_laws.py small-loads --laws 4 --seed 5", page="accuracy.md"
    ),
    "float-errors": Part("docs/measure/storage.py errors", page="accuracy.md"),
    "one-plane": Part("docs/measure/resolutions.py one-plane", quoted_in="accuracy.md"),
    "ablation-table": Part("docs/measure/blocks.py ablation-table", quoted_in="accuracy.md"),
    # validation.md
    "friction-angles": Part("docs/measure/random_laws.py angles", quoted_in="validation.md"),
    "empirical-laws": Part("docs/measure/fits.py empirical-laws", page="validation.md"),
    "closure-predictions": Part("docs/measure/fits.py closure-predictions", page="validation.md"),
    "extrapolation": Part("docs/measure/fits.py extrapolation", page="validation.md"),
    "intervals": Part("docs/measure/fits.py intervals", page="validation.md"),
    "coverage": Part("docs/measure/coverage.py", page="validation.md"),
    "sandstone": Part("docs/measure/fits.py sandstone", page="validation.md"),
    "extremes": Part("docs/measure/test_figures.py extremes", quoted_in="validation.md"),
    "exact-steps": Part("docs/measure/test_figures.py exact-steps", quoted_in="validation.md"),
    # limits.md, theory-incremental.md
    "forgetting": Part("docs/measure/test_figures.py forgetting", quoted_in="limits.md"),
    "impacts": Part("docs/measure/test_figures.py impacts", quoted_in="limits.md"),
    "angle-sum": Part("docs/measure/random_laws.py angle-sum", quoted_in="limits.md"),
    "step-sizes": Part("docs/measure/dissipation.py", quoted_in="theory-incremental.md"),
    "energy-gain": Part("docs/measure/energy_gain.py", quoted_in="limits.md theory-incremental.md"),
    # blocks.md
    "shaken-slab": Part("docs/measure/blocks.py shaken-slab", quoted_in="blocks.md"),
    # space.md
    "rough-direction": Part("docs/measure/space.py rough-direction", page="space.md"),
    # water.md, blocks.md
    "mean-gap": Part("docs/measure/aperture.py mean-gap", page="water.md"),
    "slide-flow": Part("docs/measure/aperture.py slide", quoted_in="water.md blocks.md"),
    # files of data: the command writes them itself
    "synthetic-shear": Part("docs/measure/synthetic_shear.py", quoted_in="tutorial-calibrate.md"),
    # pictures
    "moving": Part("docs/draw/moving.py FOLDER", pictures={"moving.gif": "moving.gif"}),
    "why": Part(
        "docs/draw/why.py FOLDER",
        pictures={
            "three-laws.png": "three-laws.png",
            "along-across.png": "along-across.png",
            "jrc.png": "jrc.png",
            "strength-surface.png": "strength-surface.png",
        },
        quoted_in="why.md",
    ),
    "space": Part(
        "docs/draw/space.py FOLDER",
        pictures={
            name: name
            for name in ("wedge.png", "slope-3d-joints.png", "face-contact.png", "veering.png")
        },
    ),
    "wedge-across": Part(
        "-m dem_demo wedge-across --out FOLDER", pictures={"wedge.gif": "motion.gif"}
    ),
    "envelopes": Part(
        "docs/draw/envelopes.py FOLDER",
        page="theory-incremental.md",
        pictures={"envelopes.png": "envelopes.png"},
        quoted_in="field.md",
    ),
    "axes": Part("docs/draw/axes.py FOLDER", pictures={"axes.png": "axes.png"}),
    "shear": Part(
        "-m jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse=-2um "
        "--resolution fine --out FOLDER",
        pictures={"shear.png": "shear.png"},
    ),
    "tilt": Part("docs/draw/tilt.py FOLDER", pictures={"tilt.png": "tilt.png"}),
    "tilt-scene": Part("-m dem_demo tilt --out FOLDER", quoted_in="validation.md"),
    "slope": Part(
        "-m dem_demo slope --out FOLDER",
        pictures={"slope.png": "final.png", "slope.gif": "motion.gif"},
    ),
    "shear-box": Part(
        "-m dem_demo shear-box --out FOLDER", pictures={"shear-box.png": "curves.png"}
    ),
    "strength": Part(
        "-m dem_demo strength-reduction slope --out FOLDER",
        pictures={"strength.png": "failing-rough.png"},
        quoted_in="blocks.md",
    ),
    "wet-slope": Part(
        "-m dem_demo wet-slope --out FOLDER", pictures={"wet-slope.png": "final.png"}
    ),
    "tunnel": Part("-m dem_demo tunnel --out FOLDER", pictures={"tunnel.png": "final.png"}),
    "shaken-slope-laws": Part("-m dem_demo compare shaken-slope --seeds 1", quoted_in="blocks.md"),
    "shaken-slope": Part(
        "docs/draw/shaken_slope.py FOLDER",
        pictures={"shaken-slope.png": "shaken-slope.png"},
        quoted_in="blocks.md",
    ),
    "fit": Part(
        "-m jointlaw fit grimsel_vd1_closure --up-to 5.3MPa --out FOLDER",
        pictures={"fit.png": "fit.png"},
    ),
    # docs/data: the command writes there itself
    **{
        path.stem: Part(
            f"docs/measure/blocks.py ablation {path.stem.removeprefix('ablation-')}",
            quoted_in=f"data/{path.name}",
        )
        for path in sorted(DOCS.glob("data/ablation-*.csv"))
    },
    # costs
    "cost-list": Part("docs/measure/resolutions.py cost-list", page="accuracy.md", is_timed=True),
    "float-cost": Part("docs/measure/storage.py cost", page="accuracy.md", is_timed=True),
    "reduced-models": Part(
        "docs/measure/resolutions.py reduced-models", quoted_in="accuracy.md", is_timed=True
    ),
    "native": Part("docs/measure/native.py updates", page="native.md", is_timed=True),
    "batch-size": Part("docs/measure/native.py batch-size", page="native.md", is_timed=True),
    "joint-lists": Part("docs/measure/native.py joint-lists", page="native.md", is_timed=True),
    "graphics": Part(
        "docs/measure/native.py graphics FOLDER",
        quoted_in="native.md",
        is_timed=True,
    ),
    "blocks-cost": Part("docs/measure/blocks.py step-cost", page="blocks.md", is_timed=True),
    "seam-cost": Part("docs/measure/blocks.py seam-cost", page="blocks.md", is_timed=True),
    "space-cost": Part("docs/measure/space.py cost", page="space.md", is_timed=True),
    "space-step-cost": Part("docs/measure/space.py step-cost", page="space.md", is_timed=True),
    "space-incline": Part("docs/measure/lmgc90.py incline", page="space.md", is_timed=True),
    "space-walls": Part("docs/measure/lmgc90.py walls", page="space.md", is_timed=True),
    "heap": Part("docs/measure/blocks.py heap FOLDER", quoted_in="blocks.md", is_timed=True),
    "yade": Part("docs/measure/hosts.py yade", page="particles.md", is_timed=True),
    "lammps": Part("docs/measure/hosts.py lammps FOLDER", page="particles.md", is_timed=True),
    "lammps-scale": Part(
        "docs/measure/hosts.py lammps-scale FOLDER", page="particles.md", is_timed=True
    ),
}


def make(name):
    """Run the command of a part and store its output; returns the text that it printed."""
    part = PARTS[name]
    with tempfile.TemporaryDirectory() as folder:
        printed, processor_time = run(part, folder)
        for picture, file in part.pictures.items():
            store_picture(Path(folder) / file, DOCS / "pictures" / picture)
    if part.page:
        write_table(part.page, name, first_table(printed))
    PRINTED.mkdir(exist_ok=True)
    head = f"python {part.command}  # {processor_time:.0f} s of processor time\n"
    (PRINTED / f"{name}.txt").write_text(f"{head}{printed.rstrip()}\n", encoding="utf-8")
    return printed


def store_picture(source, target):
    """Copy a picture; one for print is halved for the screen."""
    with Image.open(source) as image:
        if source.suffix == ".png" and image.width > MAX_WIDTH:
            half = image.convert("RGB").resize((image.width // 2, image.height // 2))
            half.save(target, optimize=True)
            return
    shutil.copy(source, target)


def run(part, folder):
    """Run the command of a part; returns the text that it prints, and its processor time (s).

    The text names the temporary folder FOLDER.
    """
    words = part.command.replace("FOLDER", folder).split()
    threads = {} if part.is_timed else {"JOINTLAW_THREADS": "1"}
    with tempfile.TemporaryFile("w+") as printed, tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen([sys.executable, *words], cwd=DOCS.parent, stdout=printed,
                                   stderr=errors, env=os.environ | threads)  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)  # with the time of its own processes
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for stream in (printed, errors):
            stream.seek(0)
            texts.append(stream.read().replace(folder, "FOLDER"))
    if process.returncode:
        raise RuntimeError(f"{part.command} ended with {process.returncode}:\n{''.join(texts)}")
    return texts[0], usage.ru_utime + usage.ru_stime


def first_table(text):
    """The first table in a text."""
    table = re.search(r"^\|.*?(?=^[^|]|\Z)", text, re.DOTALL | re.MULTILINE)
    if table is None:
        raise ValueError(f"no table was printed: {text}")
    return table[0].strip()


def write_table(page, name, table):
    """Replace the text between the marks `name` and `end of name` of a page."""
    path = DOCS / page
    with PAGE_LOCK:
        old = path.read_text(encoding="utf-8")
        before, mark, rest = old.partition(f"<!-- {name} -->\n")
        if not mark:
            raise ValueError(f"{page} has no mark <!-- {name} -->")
        after = rest[rest.index(f"<!-- end of {name} -->") :]
        path.write_text(f"{before}{mark}{table}\n{after}", encoding="utf-8")


def succeeds(name):
    """Make a part and print its output, or its error; returns whether it was made."""
    start = time.perf_counter()
    try:
        text = make(name)
        is_made = True
    except (RuntimeError, ValueError, OSError) as error:
        text = str(error)
        is_made = False
    print(f"== {name}, {time.perf_counter() - start:.0f} s\n{text}", flush=True)
    return is_made


def main():
    if "--list" in sys.argv:
        for name, part in PARTS.items():
            print(f"{name}\t{part.places}\t{part.command}")
        return
    if "--help" in sys.argv or "-h" in sys.argv:
        print(__doc__)
        return
    names = sys.argv[1:] or list(PARTS)
    timed = [name for name, part in PARTS.items() if part.is_timed]
    if "timed" in names:
        names = list(dict.fromkeys([name for name in names if name != "timed"] + timed))
    if unknown := set(names).difference(PARTS):
        sys.exit(f"no part {', '.join(sorted(unknown))}; --list prints all")
    with ThreadPoolExecutor(2) as pool:  # each waits for a process of its own
        results = list(pool.map(succeeds, [name for name in names if name not in timed]))
    results += [succeeds(name) for name in names if name in timed]
    sys.exit(0 if all(results) else "not all parts were made")


if __name__ == "__main__":
    main()
