"""Snapshots whose writing is killed, or happens twice at once."""

import multiprocessing
import time

import numpy as np
import pytest
from extremes.laws import SCALE, build

import jointlaw as jl

pytestmark = pytest.mark.slow

FAST = jl.Resolution(1, 3, 1)


def one_of_two(k, n=2000):
    """State of n joints, all 0.1 or all 0.2 closed: any mixture shows."""
    joints = build(resolution=FAST).joints(n, ledger=False)
    joints.update(np.tile([0.1 * SCALE * (1 + k % 2), 0.0, 0.0], (n, 1)), tangent=False)
    return joints.snapshot()


def whole(path):
    """Whether the file is one of the two states."""
    closures = jl.load_state(path).values[:, 0]
    return len(closures) == 2000 and np.ptp(closures) == 0.0 and closures[0] > 0.0


def write_for_ever(path):
    states = one_of_two(0), one_of_two(1)
    while True:
        for state in states:
            state.save(path)


def test_a_process_killed_while_it_writes_leaves_a_whole_file(tmp_path):
    path = tmp_path / "state.npz"
    one_of_two(0).save(path)
    for wait in (0.02, 0.051, 0.083):
        writer = multiprocessing.get_context("fork").Process(target=write_for_ever, args=(path,))
        before = path.stat().st_mtime_ns
        writer.start()
        while path.stat().st_mtime_ns == before:  # until it writes
            time.sleep(0.001)
        time.sleep(wait)
        writer.kill()
        writer.join()
        assert whole(path)
