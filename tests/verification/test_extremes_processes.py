"""A batch goes on in forked and spawned processes.

Arrays of any kind (read-only, strided, float32, integer, empty), pickling, states of the wrong law
and failed writes: tests/unit/test_batch.py, test_snapshot.py and test_files.py.
"""

import multiprocessing
import pickle

import numpy as np
import pytest
from extremes.checks import path
from extremes.laws import SCALE, build

import jointlaw as jl

pytestmark = pytest.mark.slow

FAST = jl.Resolution(1, 3, 1)


def go_on(batch):
    """A batch that came from another process takes a step."""
    return batch.update(np.full((len(batch), 3), 0.01 * SCALE), tangent=False)[0]


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_batch_goes_on_in_another_process(method):
    """After the parent has used its threads, which a fork does not take along."""
    batch = build(resolution=FAST).joints(5000)
    for d in path(np.random.default_rng(1), 5000, 3, SCALE)[0]:
        batch.update(d)
    with multiprocessing.get_context(method).Pool(1) as pool:
        elsewhere = pool.apply(go_on, (batch,))
    np.testing.assert_array_equal(elsewhere, go_on(pickle.loads(pickle.dumps(batch))))
