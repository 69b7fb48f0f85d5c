"""A progress bar on a terminal for work longer than two seconds; silent in a pipe."""

from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")
PATIENCE = 2.0  # s of silence


def track(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """`items`, with a bar if tqdm is installed (extra `plot`)."""
    try:
        from tqdm import tqdm
    except ImportError:
        return items
    return tqdm(items, desc=label, total=total, delay=PATIENCE, disable=None, leave=False)
