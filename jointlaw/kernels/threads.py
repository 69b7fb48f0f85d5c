"""The threads that share the work on a large batch."""

import os
from collections.abc import Callable
from functools import lru_cache
from queue import SimpleQueue
from threading import Thread
from typing import Any


def thread_count() -> int:
    """Threads that a large batch may use: JOINTLAW_THREADS, or all processors of this process."""
    asked = os.environ.get("JOINTLAW_THREADS", "")
    if asked:
        if not asked.isdigit() or int(asked) < 1:
            raise ValueError(f"JOINTLAW_THREADS = {asked!r} is out of bounds: a whole number >= 1")
        return int(asked)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def share_out(work: Callable[[], object], threads: int) -> None:
    """Call work() on this thread and on others, `threads` in all; wait for all."""
    ends: SimpleQueue[BaseException | None] = SimpleQueue()
    for _ in range(1, threads):
        _others(os.getpid()).put((work, ends))
    try:
        work()
    finally:
        errors = [ends.get() for _ in range(1, threads)]
    for error in filter(None, errors):
        raise error


@lru_cache(maxsize=1)
def _others(process: int) -> SimpleQueue[Any]:
    """What the threads of this process wait for: a forked child starts its own."""
    calls: SimpleQueue[Any] = SimpleQueue()
    for _ in range(max(thread_count() - 1, 1)):
        Thread(target=_serve, args=(calls,), name="jointlaw", daemon=True).start()
    return calls


def _serve(calls: SimpleQueue[Any]) -> None:
    """Answer calls, one after the other, 20 us sooner than a ThreadPoolExecutor does."""
    while True:
        work, ends = calls.get()
        try:
            work()
            ends.put(None)
        except BaseException as error:
            ends.put(error)
