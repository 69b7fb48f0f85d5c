"""A million joints, threads that each own joints, forked and spawned processes, two laws at once.

Arrays of any kind (read-only, strided, float32, integer, empty), pickling, states of the wrong law
and failed writes: tests/unit/test_batch.py, test_snapshot.py and test_files.py.
"""

import multiprocessing
import pickle

import numpy as np
import pytest
from extremes.checks import path
from extremes.laws import COMPILED, SCALE, build

import jointlaw as jl

pytestmark = pytest.mark.slow

FAST = jl.Resolution(1, 3, 1)


def go_on(batch):
    """A batch that came from another process takes a step."""
    return batch.update(np.full((len(batch), 3), 0.01 * SCALE), tangent=False)[0]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_batch_goes_on_in_another_process(method):
    """After the parent has used its threads, which a fork does not take along."""
    batch = build(resolution=FAST).joints(5000)
    for d in path(np.random.default_rng(1), 5000, 3, SCALE)[0]:
        batch.update(d)
    with multiprocessing.get_context(method).Pool(1) as pool:
        elsewhere = pool.apply(go_on, (batch,))
    np.testing.assert_array_equal(elsewhere, go_on(pickle.loads(pickle.dumps(batch))))


@pytest.mark.slow
def test_a_million_joints_are_a_million_single_joints():
    n = 1_000_000 if COMPILED else 100_000
    law = build(resolution=FAST)
    batch = law.joints(n, ledger=False)
    rng = np.random.default_rng(2)
    steps = [rng.normal(size=(n, 3)) * 0.1 * SCALE + [SCALE, 0.0, 0.0] for _ in range(2)]
    for d in steps:
        F, C = batch.update(d, tangent=False)
    assert C is None
    assert np.isfinite(F).all()
    for k in (0, 63, 64, n // 2 - 1, n - 1):
        joint = law.joint()
        for d in steps:
            one, _ = joint.update(d[k], tangent=False)
        # to the bit; but numpy's matrix product adds up one column in another order than many
        rounding = 0.0 if COMPILED else 1e-15 * np.abs(one).max()
        np.testing.assert_allclose(F[k], one, rtol=0.0, atol=rounding)
