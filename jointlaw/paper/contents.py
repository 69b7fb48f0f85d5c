"""The paper as reproduced: its figures as files, and the table of its claims with our numbers."""

import csv
import io
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..support.files import replace_file, write_json
from ..support.progress import track
from ..support.pyplot import FORMATS, pyplot
from . import closure, elastic, shear, sliding, strength, surface
from .section import Figure

_SECTIONS = [module.SECTION for module in (surface, elastic, sliding, closure, shear, strength)]
FIGURES = {
    number: figure
    for section in _SECTIONS
    for figure in section.figures
    for number in figure.numbers  # Figures 4 and 6 are one picture here
}
CLAIMS = {claim.key: claim for section in _SECTIONS for claim in section.claims}
_STYLE: dict[Any, Any] = {
    "font.size": 9, "font.family": "sans-serif", "figure.titlesize": 9, "axes.titlesize": 9,
    "axes.labelsize": 9, "xtick.labelsize": 9, "ytick.labelsize": 9, "legend.fontsize": 9,
    "legend.framealpha": 0.85, "lines.linewidth": 1.4, "lines.markersize": 3.5, "savefig.dpi": 130,
    "figure.titleweight": "bold",
    "axes.grid": True, "grid.alpha": 0.3, "grid.linewidth": 0.5, "axes.xmargin": 0,
}  # fmt: skip


def write_figures(
    folder: str | Path, numbers: Sequence[int] = (), picture_format: str = FORMATS[0]
) -> list[Path]:
    """Write figures (all if none are named) and their CSV, and `summary.json` with the captions.

    Returns the files. Raises ValueError for a number that is no figure of the paper or one without
    content to compute (1 and 2), and ImportError without matplotlib.
    """
    for number in numbers:
        if number not in FIGURES:
            known = ", ".join(str(n) for n in sorted(FIGURES))
            raise ValueError(f"figure {number} is not one of {known} (1 and 2 are sketches)")
    wanted = sorted({FIGURES[number].numbers[0] for number in numbers or FIGURES})
    out, files, captions = Path(folder), [], {}
    for number in track(wanted, "figures", len(wanted)):
        figure = FIGURES[number]
        picture, curves = rendered(figure, picture_format)
        out.mkdir(parents=True, exist_ok=True)
        for ending, data in ((f".{picture_format}", picture), (".csv", curves.encode())):
            files.append(out / f"{figure.name}{ending}")
            replace_file(files[-1], data)
        captions[figure.name] = {"title": figure.title, "caption": figure.caption}
    names = [path.name for path in files]
    write_json(out / "summary.json", {"figures": captions, "files": names})
    return [*files, out / "summary.json"]


def claims_table(keys: Sequence[str] = ()) -> str:
    """The claims table (Markdown): all claims, or those of these keys in the order given.

    Raises ValueError for an unknown key, before anything is computed.
    """
    for key in keys:
        if key not in CLAIMS:
            raise ValueError(f"claim {key!r} is unknown; choose one of {', '.join(CLAIMS)}")
    head = (
        "| Place | The paper says | Verdict | We find | Command |\n| --- | --- | --- | --- | --- |"
    )
    chosen = keys or list(CLAIMS)
    return "\n".join([head, *(CLAIMS[key].row() for key in track(chosen, "claims", len(chosen)))])


def rendered(figure: Figure, picture_format: str = FORMATS[0]) -> tuple[bytes, str]:
    """The figure as a file, and its curves as CSV (needs matplotlib: extra `plot`)."""
    out = io.BytesIO()
    with pyplot().rc_context(_STYLE):
        page = drawn(figure)
        page.savefig(out, format=picture_format)
    return out.getvalue(), points(page)


def drawn(figure: Figure) -> Any:
    """The matplotlib figure with its panels, legends and, below, its caption."""
    from matplotlib.figure import Figure as Page
    from matplotlib.ticker import MaxNLocator

    columns = min(figure.panels, 3 if figure.panels != 4 else 2)
    rows = -(-figure.panels // columns)
    width = 5.2 * columns if columns > 1 else 7.0
    caption = textwrap.fill(figure.caption, int(width * 15))
    below = 0.19 * (caption.count("\n") + 1) + 0.2
    height = 4.3 * rows + below + 0.4
    page: Any = Page(figsize=(width, height), layout="constrained")
    page.get_layout_engine().set(rect=(0, below / height, 1, 1 - below / height))
    kind = {"polar": figure.polar}
    panels = page.subplots(rows, columns, squeeze=False, subplot_kw=kind).ravel()
    figure.draw(*panels)
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)} if figure.polar else {}
    for panel in panels:
        if figure.polar:
            panel.set_thetagrids(range(0, 360, 30))
            panel.yaxis.labelpad = 32
            panel.yaxis.set_major_locator(MaxNLocator(4))
            for label in panel.get_yticklabels():
                label.set_bbox({"color": "white", "alpha": 0.8, "pad": 0.5})
        if panel.get_legend_handles_labels()[1]:
            panel.legend(**place)
    shown = "Figure " if len(figure.numbers) == 1 else "Figures "
    page.suptitle(f"{shown}{' and '.join(map(str, figure.numbers))}: {figure.title}")
    page.text(0.02, 0.1 / height, caption, va="bottom")
    return page


def points(page: Any) -> str:
    """Every point of every curve as CSV: panel, curve, the two axes with their units, x and y.

    Angles in degrees. A curve whose label begins with "_" is here, but not in the legend.
    """
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["panel", "curve", "x_axis", "y_axis", "x", "y"])
    for panel in page.axes:
        axes = (panel.get_xlabel(), panel.get_ylabel())
        for line in panel.get_lines():
            x = np.degrees(line.get_xdata()) if panel.name == "polar" else line.get_xdata()
            for point in zip(x, line.get_ydata(), strict=True):
                curve = line.get_label().lstrip("_")
                rows.writerow([panel.get_title(), curve, *axes, *(f"{v:.8g}" for v in point)])
    return out.getvalue()
