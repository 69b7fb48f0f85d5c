"""Many fits: every executor gives the same numbers."""

import numpy as np
import pytest

from jointlaw.calibration import datasets
from jointlaw.calibration.fit import fit_closure, fit_many
from jointlaw.calibration.measured import first_loading


@pytest.fixture(scope="module")
def curves():
    stress, closure, _, _ = first_loading(*datasets.load("grimsel_vd1_closure"))
    rng = np.random.default_rng(0)
    return [(stress * (1 + 0.01 * rng.standard_normal(stress.size)), closure) for _ in range(3)]


@pytest.fixture(scope="module")
def here(curves):
    return [fit_closure(*curve, fixed={"alpha": 3.8}).parameters for curve in curves]


def test_process_pool_gives_the_same(curves, here):
    fits = fit_many(curves, workers=2, fixed={"alpha": 3.8})
    assert [fit.parameters for fit in fits] == here


def test_dask_cluster_gives_the_same(curves, here):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        fits = fit_many(curves, client.get_executor(), fixed={"alpha": 3.8})
    assert [fit.parameters for fit in fits] == here
    assert [fit.covariance.tolist() for fit in fits] == [
        fit.covariance.tolist() for fit in fit_many(curves, workers=1, fixed={"alpha": 3.8})
    ]
