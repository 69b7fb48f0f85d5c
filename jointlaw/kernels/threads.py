"""The threads that share the work on a large batch."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait


def thread_count() -> int:
    """Threads that a large batch may use: JOINTLAW_THREADS, or all processors of this process."""
    asked = os.environ.get("JOINTLAW_THREADS", "")
    if asked:
        if not asked.isdigit() or int(asked) < 1:
            raise ValueError(f"JOINTLAW_THREADS = {asked!r} is out of bounds: a whole number >= 1")
        return int(asked)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def share_out(part: Callable[[int], None], threads: int) -> None:
    """Run part(0) here and part(1), ... part(threads - 1) on other threads; wait for all."""
    waiting = [_pool().submit(part, k) for k in range(1, threads)]
    try:
        part(0)
    finally:
        wait(waiting)
    for one in waiting:
        one.result()


_pools: dict[int, ThreadPoolExecutor] = {}


def _pool() -> ThreadPoolExecutor:
    """Threads of this process: a forked child starts its own."""
    process = os.getpid()
    if process not in _pools:
        _pools.clear()
        _pools[process] = ThreadPoolExecutor(max(thread_count() - 1, 1), "jointlaw")
    return _pools[process]
