"""What each ingredient does to the shipped scenes.

python docs/measure/ablations.py                  the table over all scenes, from docs/data
python docs/measure/ablations.py --scene tilt     ablate this scene anew, into docs/data
"""

import csv
import tempfile
from collections import defaultdict
from pathlib import Path

from tables import ROOT, asked, table

from dem_demo.cli import main

DATA = ROOT / "docs" / "data"
SCENES = sorted(path.stem.partition("-")[2] for path in DATA.glob("ablation-*.csv"))
HEAD = ["change", "scenes", "slip or peak angle (deg)", "work of friction",
        "distance of the ends (mm)", "other results", "time"]  # fmt: skip
MACHINE = "time_step_s", "cpu_s"  # columns of an ablation that docs/data leaves out
UNTIL = {"stack": 0.5, "slope": 0.5, "slope-azimuth": 0.6, "arch": 0.4}  # s


def load(path):
    """Rows of a CSV file as dicts."""
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def data_of(scene):
    return DATA / f"ablation-{scene}.csv"


def ablate(scene):
    """Write the file of a scene without each of its ingredients in turn, to four digits."""
    with tempfile.TemporaryDirectory() as folder:
        until = ("--until", str(UNTIL[scene])) if scene in UNTIL else ()
        main(["ablate", scene, *until, "--out", folder])
        rows = load(Path(folder) / "ablation.csv")
    rows = [{key: four(cell) for key, cell in row.items() if key not in MACHINE} for row in rows]
    with data_of(scene).open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def four(cell):
    """A cell with four digits, if it holds a number."""
    try:
        return f"{float(cell):.4g}" if "." in cell else cell
    except ValueError:
        return cell


def by_ingredient(scenes):
    """Rows of a table: ingredient, scenes, and the largest changes over all scenes.

    scenes: rows of each scene's ablation.csv. A change of an angle is in degrees, that of the
    work of friction a share of the whole scene's, "otherwise" counts rocks that end in another
    state or slabs that never slip, times are those over the whole scene's.
    """
    found = defaultdict(lambda: defaultdict(list))
    for whole, *others in scenes:
        for row in others[:-1]:  # the last is the whole scene again
            note(found[row["without"]], row, whole)
    return [summary(name, mine) for name, mine in found.items()]


def note(mine, row, whole):
    """Add what one scene says of an ingredient."""
    refused = row["time_ratio"] == "nan"
    mine["refused"].append(refused)
    if refused:
        return
    mine["time"].append(float(row["time_ratio"]))
    for key, value in row.items():
        change = row.get(f"change of {key}")
        if key.endswith("_deg") and change:
            mine["angle"].append(abs(float(change)))
        elif key.endswith(", state") or (key.endswith("_deg") and change is not None):
            mine["otherwise"].append(value != whole[key])
        elif key == "friction_kJ":
            mine["friction"].append(abs(float(change) / float(whole[key])))
        elif key == "end, apart_mm":
            mine["apart"].append(float(value))


def summary(name, mine):
    """Cells of an ingredient."""
    refused = sum(mine["refused"])
    return [name, f"{len(mine['refused'])}" + f", refused in {refused}" * bool(refused),
            f"{max(mine['angle']):.2f}" if mine["angle"] else "-",
            f"{max(mine['friction']):.0%}" if mine["friction"] else "-",
            span(mine["apart"], "{:.2g}"),
            sum(mine["otherwise"]) if mine["otherwise"] else "-",
            span(mine["time"], "{:.2f}")]  # fmt: skip


def span(values, form):
    """Least and largest, or the one value."""
    ends = (min(values), max(values)) if values else ()
    told = [form.format(value) if value < 100 else f"{value:.0f}" for value in ends]
    return " to ".join(dict.fromkeys(told)) or "-"


if __name__ == "__main__":
    if scene := asked(__doc__, scene="").scene:
        ablate(scene)
    else:
        print(table(HEAD, by_ingredient([load(data_of(name)) for name in SCENES])))
