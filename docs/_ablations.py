"""What each ingredient does over all scenes, read from their ablation tables in a page."""

import re
from collections import defaultdict

NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")


def rows_of(text):
    """The rows of a table in Markdown as dicts by title; notes after it are left out."""
    lines = [line.strip().strip("|").split(" | ") for line in text.splitlines() if "|" in line[:1]]
    head, _, *rows = [[cell.strip() for cell in line] for line in lines]
    return [dict(zip(head, row, strict=True)) for row in rows]


def by_ingredient(tables):
    """Rows of a table: ingredient, scenes, and the largest changes over all scenes.

    tables: text of each scene's ablation table. A change of an angle is in degrees, that of the
    work of friction a share of the whole scene's, "otherwise" counts rocks that end in another
    state or slabs that never slip, times are those over the whole scene's.
    """
    found = defaultdict(lambda: defaultdict(list))
    for text in tables.values():
        whole, *others = rows_of(text)
        for row in others:
            name = re.sub(r" \(\d+\)$", "", row["without"])
            if name == "whole scene again":
                continue
            mine = found[name]
            mine["scenes"].append(1)
            if row["time"] == "-":
                mine["refused"].append(1)
                continue
            mine["time"].append(float(row["time"]))
            for title, value in row.items():
                was = whole[title]
                if title.endswith("(deg)") and NUMBER.fullmatch(value):
                    mine["angle"].append(abs(float(value)))
                elif title.endswith(", state") or title.endswith("(deg)"):
                    mine["otherwise"].append(value != was)
                elif title == "friction (kJ)":
                    mine["friction"].append(abs(float(value) / float(was)))
                elif title == "end, apart (mm)":
                    mine["apart"].append(float(value))
    return [_row(name, mine) for name, mine in found.items()]


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


HEAD = ["without", "scenes", "slip or peak angle (deg)", "work of friction", "ends apart (mm)",
        "end otherwise", "time"]  # fmt: skip
