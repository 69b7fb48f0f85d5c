"""Ctrl-C during a run: the first stops it between two steps, the second quits at once."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

STATUS = 130  # exit code of a command that Ctrl-C ended, as shells have it


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Gives a function that says whether Ctrl-C was pressed, instead of an exception anywhere.

    pymunk swallows exceptions of its callbacks, so one could be lost, or leave half a step. A
    thread other than the main one gets no signals, and a process that was told to ignore Ctrl-C,
    as one in the background of a script, goes on ignoring it.
    """
    asked = threading.Event()

    def take(_signal, _frame) -> None:
        if asked.is_set():
            sys.stderr.write("\ndem_demo: stopped at once; nothing more is written\n")
            os._exit(STATUS)
        asked.set()
        sys.stderr.write("\nCtrl-C: stopping after this step; once more quits at once\n")

    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    if ignored or threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    before = signal.signal(signal.SIGINT, take)
    try:
        yield asked.is_set
    finally:
        signal.signal(signal.SIGINT, before)
