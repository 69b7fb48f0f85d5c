"""matplotlib, where it is installed (extra `plot`)."""

from pathlib import Path
from typing import Any

FORMATS = ("png", "svg", "pdf")  # of pictures; the first one unless another is asked for


def pyplot() -> Any:
    """The module matplotlib.pyplot. Raises ImportError with the remedy where it is missing."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install 'jointlaw[plot]'") from error
    return pyplot


def written(figure: Any, path: str | Path | None) -> Any:
    """The figure; with `path` it is written there and closed."""
    if path is not None:
        figure.savefig(path, dpi=150)
        pyplot().close(figure)
    return figure
