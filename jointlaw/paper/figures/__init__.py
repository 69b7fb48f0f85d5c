"""The figures of Misra 1999, regenerated from the parameters that the paper prints.

Each figure is a `Sheet` (data and caption); `write` turns it into PNG and CSV. Only writing PNG
needs matplotlib (extra `plot`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ...support.files import replace_file, write_json
from ...support.progress import track
from .elastic import figure_8, figure_9
from .normal import figure_10, figure_11, figure_12, figure_13
from .render import png, require_matplotlib
from .shear import figure_14, figure_15, figure_16
from .sheet import Sheet
from .strength import figure_17, figure_18, figure_19
from .surface import figure_3, figure_4, figure_5, figure_7

FIGURES: dict[int, Callable[[], Sheet]] = {
    3: figure_3, 4: figure_4, 5: figure_5, 7: figure_7, 8: figure_8, 9: figure_9, 10: figure_10,
    11: figure_11, 12: figure_12, 13: figure_13, 14: figure_14, 15: figure_15, 16: figure_16,
    17: figure_17, 18: figure_18, 19: figure_19,
}  # fmt: skip
_SAME = {6: 4}  # Figures 4 and 6 are one picture here


def write(folder: str | Path, numbers: Sequence[int] = ()) -> list[Path]:
    """Write figures (all if none are named) as PNG and CSV, and `summary.json` with the captions.

    Returns the files. Raises ValueError for a number that is no figure of the paper or one without
    content to compute (1 and 2), and ImportError without matplotlib.
    """
    wanted = sorted({_SAME.get(number, number) for number in numbers or FIGURES})
    for number in wanted:
        if number not in FIGURES:
            known = ", ".join(str(n) for n in sorted({*FIGURES, *_SAME}))
            raise ValueError(f"figure {number} is not one of {known} (1 and 2 are sketches)")
    require_matplotlib()
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    files, captions = [], {}
    for number in track(wanted, "figures", len(wanted)):
        page = FIGURES[number]()
        replace_file(out / f"{page.name}.png", png(page))
        replace_file(out / f"{page.name}.csv", page.csv().encode())
        files += [out / f"{page.name}.png", out / f"{page.name}.csv"]
        captions[page.name] = {"title": page.title, "caption": page.caption}
    write_json(out / "summary.json", {"figures": captions})
    return [*files, out / "summary.json"]
