"""matplotlib, where it is installed (extra `plot`), and the one style of all pictures."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: Formats of pictures; the first one unless another is asked for
FORMATS = ("png", "svg", "pdf")

# Settings of matplotlib for every picture of the project, 7.5 inches wide or less: letters are
# then 8 pixels high on a phone, 390 pixels wide. Each axis has a label with its unit in
# brackets; a ratio is in % or is named as "... over ..." without a unit.
STYLE: dict[str, Any] = {
    "figure.constrained_layout.use": True,
    "figure.titlesize": 12,
    "font.size": 11,
    "axes.titlesize": 11,
    "axes.linewidth": 0.6,
    "legend.fontsize": 10,
    "legend.title_fontsize": 10,
    "legend.framealpha": 0.9,
    "lines.linewidth": 1.5,
    "lines.markersize": 4,
    "savefig.dpi": 150,
    "text.parse_math": False,  # titles and names are the user's, and may hold $
}


def pyplot() -> Any:
    """The module matplotlib.pyplot. Raises ImportError with the remedy where it is missing."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install 'jointlaw[plot]'") from error
    return pyplot


@contextmanager
def style() -> Iterator[Any]:
    """matplotlib.pyplot with `STYLE`, as in `with style() as plt:`; the user's own style returns.

    As `@style()` it gives a function that draws this style.

    Raises ImportError with the remedy where matplotlib is missing.
    """
    plt = pyplot()
    with plt.rc_context(STYLE):
        yield plt


def written(figure: Any, path: str | Path | None) -> Any:
    """The figure; with `path` it is written there and closed.

    In a notebook it is closed too: a cell shows what it returns, and would show it twice.
    """
    if path is not None:
        figure.savefig(path, dpi=STYLE["savefig.dpi"])
    if path is not None or "inline" in pyplot().get_backend():
        pyplot().close(figure)
    return figure
