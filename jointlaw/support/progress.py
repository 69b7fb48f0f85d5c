"""A progress bar on a terminal for work that takes longer than two seconds; none in a pipe."""

from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")
DELAY = 2.0  # s before the bar appears


def track(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """`items`, with a progress bar if tqdm is installed (extra `plot`).

    label: text beside the bar. total: number of items, for iterables without a length.
    """
    try:
        from tqdm import tqdm
    except ImportError:
        return items
    return tqdm(items, desc=label, total=total, delay=DELAY, disable=None, leave=False)
