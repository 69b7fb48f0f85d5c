"""A progress bar, or a line, on a terminal for work longer than two seconds; silent in a pipe."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from threading import Timer
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


@contextmanager
def explained(text: str) -> Iterator[None]:
    """Says on a terminal what takes so long, once, if it does."""
    timer = Timer(PATIENCE, sys.stderr.write, [f"{text}\n"])
    timer.daemon = True
    if sys.stderr.isatty():
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
