"""The threads that share the work on a large batch."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import lru_cache


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
    others = [_pool(os.getpid()).submit(work) for _ in range(1, threads)]
    try:
        work()
    finally:
        wait(others)
    for other in others:
        other.result()


@lru_cache(maxsize=1)
def _pool(process: int) -> ThreadPoolExecutor:
    """Threads of this process: a forked child starts its own."""
    return ThreadPoolExecutor(max(thread_count() - 1, 1), "jointlaw")
