"""What each ingredient does over all scenes, from the ablation.csv of each of them."""

from collections import defaultdict

HEAD = ["change", "scenes", "slip or peak angle (deg)", "work of friction",
        "distance of the ends (mm)", "other results", "time"]  # fmt: skip


def by_ingredient(scenes):
    """Rows of a table: ingredient, scenes, and the largest changes over all scenes.

    scenes: rows of each scene's ablation.csv. A change of an angle is in degrees, that of the
    work of friction a share of the whole scene's, "otherwise" counts rocks that end in another
    state or slabs that never slip, times are those over the whole scene's.
    """
    found = defaultdict(lambda: defaultdict(list))
    for whole, *others in scenes:
        for row in others[:-1]:  # the last is the whole scene again
            _note(found[row["without"]], row, whole)
    return [_row(name, mine) for name, mine in found.items()]


def _note(mine, row, whole):
    mine["scenes"].append(1)
    if row["time_ratio"] == "nan":
        mine["refused"].append(1)
        return
    mine["time"].append(float(row["time_ratio"]))
    for key, value in row.items():
        change = row.get(f"change of {key}")
        if key.endswith("_deg") and change:
            mine["angle"].append(abs(float(change)))
        elif key.endswith((", state", "_deg")) and change is not None:
            mine["otherwise"].append(value != whole[key])
        elif key == "friction_kJ":
            mine["friction"].append(abs(float(change) / float(whole[key])))
        elif key == "end, apart_mm":
            mine["apart"].append(float(value))


def _row(name, mine):
    count = f"{len(mine['scenes'])}"
    if mine["refused"]:
        count += f", refused in {len(mine['refused'])}"
    cells = [f"{max(mine['angle']):.2f}" if mine["angle"] else "-",
             f"{max(mine['friction']):.0%}" if mine["friction"] else "-",
             _range(mine["apart"], "{:.2g}"),
             str(sum(mine["otherwise"])) if mine["otherwise"] else "-",
             _range(mine["time"], "{:.2f}")]  # fmt: skip
    return [name, count, *cells]


def _range(values, form):
    if not values:
        return "-"
    low, high = (form.format(value) if value < 100 else f"{value:.0f}"
                 for value in (min(values), max(values)))  # fmt: skip
    return low if low == high else f"{low} to {high}"
