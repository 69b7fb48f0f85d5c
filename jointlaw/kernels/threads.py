"""Threads that advance a large batch together."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import lru_cache


def thread_count() -> int:
    """Number of threads for a large batch: JOINTLAW_THREADS, or all processors of this process."""
    setting = os.environ.get("JOINTLAW_THREADS", "")
    if setting:
        if not setting.isdigit() or int(setting) < 1:
            raise ValueError(
                f"JOINTLAW_THREADS = {setting!r} is out of bounds: a whole number >= 1"
            )
        return int(setting)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_on_threads(work: Callable[[], object], threads: int) -> None:
    """Call `work()` on up to `threads` threads, this one included, and wait for all.

    One call of `work` must be able to do everything alone, as when it fetches parts until none is
    left: a thread that has not started when this one is done, on a busy machine, does not start.
    """
    futures = [_executor(os.getpid()).submit(work) for _ in range(1, threads)]
    try:
        work()
    finally:
        started = [future for future in futures if not future.cancel()]
        wait(started)
    for future in started:
        future.result()


@lru_cache(maxsize=1)
def _executor(process: int) -> ThreadPoolExecutor:
    """Threads of this process: a forked child starts its own."""
    return ThreadPoolExecutor(max(thread_count() - 1, 1), "jointlaw")
