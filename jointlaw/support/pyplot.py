"""matplotlib, where it is installed (extra `plot`), and the one style of all pictures."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: Formats of pictures; the first one unless another is requested
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
    "savefig.dpi": 300,
}


def escape_math(text: str) -> str:
    """Escape the $ of a text for matplotlib, which would read mathematics between two of them.

    For titles and names that a user gives. Mathematics cannot be switched off as a whole
    (`text.parse_math`), because matplotlib writes the powers of ten of a logarithmic axis with it.
    """
    return text.replace("$", r"\$")


def pyplot() -> Any:
    """Import and return the module matplotlib.pyplot.

    Raises ImportError with the remedy where it is missing.
    """
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install 'jointlaw[plot]'") from error
    return pyplot


@contextmanager
def style() -> Iterator[Any]:
    """Apply `STYLE` and return matplotlib.pyplot: `with style() as plt:`.

    The user's own style is restored at the end. As `@style()` it decorates a function that draws.

    Raises ImportError with the remedy where matplotlib is missing.
    """
    plt = pyplot()
    with plt.rc_context(STYLE):
        yield plt


def written(figure: Any, path: str | Path | None) -> Any:
    """Save a figure to `path` and close it, or leave it open without a path; returns the figure.

    In a notebook it is closed too: a cell shows the figure that it returns, and would show an open
    one a second time.
    """
    if path is not None:
        figure.savefig(path, dpi=STYLE["savefig.dpi"])
    if path is not None or "inline" in pyplot().get_backend():
        pyplot().close(figure)
    return figure
