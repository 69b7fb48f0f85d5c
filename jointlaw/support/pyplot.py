"""matplotlib, where it is installed (extra `plot`)."""

from __future__ import annotations

from typing import Any


def pyplot() -> Any:
    """The module matplotlib.pyplot. Raises ImportError with the remedy where it is missing."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install 'jointlaw[plot]'") from error
    return pyplot
