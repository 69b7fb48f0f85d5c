"""What a law leaves out under an assumption changes nothing while the assumption holds."""

from dataclasses import replace

import numpy as np
import pytest
from c_host import random_law

import jointlaw as jl

# The full law sums the same terms over all azimuths, a reduced one over one of them: what differs
# is the rounding of a few hundred sums, carried along the path.
EXACT = 1e-12


def closures(seed, n, steps=40):
    """Closure increments (steps, n): in and out, apart in the middle, in again."""
    rng = np.random.default_rng(seed)
    d = rng.normal(0.0, 0.3, (steps, n))
    d[0] = rng.uniform(0.2, 1.5, n)
    d[steps // 2] -= rng.uniform(0.0, 3.0, n)
    d[steps // 2 + 1] += rng.uniform(0.0, 3.0, n)
    return d


def followed(law, d):
    """F1, C11, measures and ledger of a batch along closure increments d (steps, n)."""
    batch, rows = law.joints(d.shape[1]), []
    for closing in d:
        step = np.zeros((d.shape[1], law.tables.dim))
        step[:, 0] = closing
        F, C = batch.update(step)
        rows.append([F[:, 0], C[:, 0, 0], *batch.measures(), batch.dissipated_energy])
    return np.array(rows)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 8, 12])
def test_closure_only_is_the_whole_law_on_a_path_of_closure(seed):
    """Traction, tangent, energies and shares, against the law in 3-D and in a plane."""
    d, law = 1e-6 * closures(seed, 7), random_law(seed)
    short = replace(law, plane=None, closure_only=True)
    assert len(short.facets.weight) == law.resolution.u
    found = followed(short, d)
    peak = np.abs(found).max(axis=(0, 2))
    for plane in (None, 0.9):
        full = followed(replace(law, plane=plane), d)
        gap = np.abs(found - full).max(axis=(0, 2)) / np.where(peak > 0, peak, 1.0)
        F1, C11, sliding, slipping, separated, stored, reach, lost = gap
        assert max(F1, sliding, slipping, separated, stored, reach, lost) < EXACT
        # C holds second differences of G in the few facets that hardly move: see test_kernels.py
        assert C11 < 2e-6
        assert np.median(np.abs(found - full)[:, 1]) < EXACT * peak[1]


def test_closure_only_is_refused_where_joints_shear():
    law = replace(random_law(2), plane=None, closure_only=True)
    for use in (
        lambda: replace(law, plane=0.0),
        lambda: jl.direct_shear(law.joint(), to=0.1, normal=0.1),
        lambda: jl.tabulate(law, shear_limit=1.0),
    ):
        with pytest.raises(ValueError, match="closure_only"):
            use()
