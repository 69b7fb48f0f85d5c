"""A progress bar on a terminal for work longer than two seconds; silent in a pipe."""

from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")


def track(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """`items`, with a bar if tqdm is installed (extra `plot`)."""
    try:
        from tqdm import tqdm
    except ImportError:
        return items
    bar: Iterable[T] = tqdm(items, desc=label, total=total, delay=2.0, disable=None, leave=False)
    return bar
