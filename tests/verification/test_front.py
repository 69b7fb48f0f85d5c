"""A front per facet: locked-in shear outlives small cycles, and every step is that of cells."""

from dataclasses import replace

import numpy as np
import pytest
from builders import law, random_corners
from exact_work import as_cells

import jointlaw as jl
from jointlaw.accuracy import cycles as small
from jointlaw.accuracy.cycles import CLOSURE, LOCKED, OPENINGS
from jointlaw.kernels import reference as kernel

SHEAR = LOCKED * np.array([0.0, 1.0])


def cycled(one, way):
    """Share of the locked-in shear that is left after openings (steps,) by shares of OPENINGS."""
    batch = one.joints(len(OPENINGS))
    batch.update(np.tile([CLOSURE, 0.0], (len(OPENINGS), 1)), tangent=False)
    before, _ = batch.update(np.tile(SHEAR, (len(OPENINGS), 1)), tangent=False)
    for step in np.diff([0.0, *way, 0.0]):
        after, _ = batch.update(
            -step * CLOSURE * OPENINGS[:, None] * np.array([1.0, 0.0]), tangent=False
        )
    return after[:, 1] / before[:, 1]


def ways():
    """Cycles of opening: in two steps, in twenty, of random size, and trembling all the way."""
    rng, turn = np.random.default_rng(0), 2 * np.pi * np.arange(600) / 20
    sine = 0.5 - 0.5 * np.cos(turn)
    return {
        "two steps": np.tile([1.0, 0.0], 60),
        "twenty steps": sine,
        "random": rng.uniform(0.0, 1.0, 120),
        "trembling": np.maximum(sine + rng.uniform(-0.1, 0.1, 600), 0.0),
    }


@pytest.mark.parametrize("way", ways())
@pytest.mark.parametrize("mu", [0.3, 0.8])
def test_small_cycles_leave_the_shear_that_springs_would_keep(way, mu):
    pytest.importorskip("numba")  # the same numbers without it, in minutes
    plain = law(mu=mu, plane=0.0, resolution=jl.Resolution(3, 6, 3))
    fronted = replace(plain, resolution=jl.Resolution(3, 6, 3, front=True))
    springs = small._crowded(plain, np.array([CLOSURE, 0.0]) + SHEAR)
    kept, exact, without = (cycled(one, ways()[way]) for one in (fronted, springs, plain))
    # the first fall takes from a whole cell, and errs by its share of the cell; the rest nothing
    assert (np.abs(kept - exact) < [0.002, 0.01, 0.05]).all()
    assert (exact - without)[1:].max() > 0.05  # what this page of tests is about


def test_nothing_more_is_forgotten_after_the_first_cycle():
    pytest.importorskip("numba")
    one = law(plane=0.0, resolution=jl.Resolution(3, 6, 3, front=True))
    once, often = (cycled(one, np.tile([1.0, 0.0], n)) for n in (2, 10_000))
    np.testing.assert_allclose(often, once, rtol=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_a_step_is_that_of_cells_cut_where_fronts_begin(seed):
    rng = np.random.default_rng(seed)
    damage = {"yield_interference": 0.3, "mu_residual": 0.2, "wear_slip": 0.5} if seed % 2 else {}
    k = law(
        damage=damage,
        eta=[0.5, 0.0, 1.0][seed % 3],
        formation=[None, "individual"][seed // 3],
        critical_slip=[np.inf, 0.4][seed // 2 % 2],
        resolution=jl.Resolution(2, 3, 3, front=True),
    ).tables
    state, lost, moved = np.zeros((k.rows, 1)), 2 * k.dim - 1, 0
    for leg in np.diff(random_corners(rng, 1)[0], axis=0, prepend=0.0):
        for share in rng.dirichlet(np.full(4, 0.5)):
            d = (leg * share)[:, None]
            cells, same = as_cells(k, state)
            assert cells.cells == k.cells + 1
            plain, F_plain, C_plain = kernel.step(cells, same, d, True)
            after, F, C = kernel.step(k, state, d, True)
            # the same arithmetic on the same limits
            np.testing.assert_allclose(F, F_plain, rtol=0, atol=1e-14 * k.area.sum())
            np.testing.assert_allclose(C, C_plain, rtol=0, atol=1e-9 * np.abs(C_plain).max())
            # moving a front changes no force and loses energy, which the ledger has
            traction = kernel.traction(k, after)
            np.testing.assert_allclose(traction, F, rtol=0, atol=1e-14 * k.area.sum())
            stored = [kernel.measures(t, s).stored[0] for t, s in ((k, after), (cells, plain))]
            gone = after[lost, 0] - plain[lost, 0]
            assert gone >= -1e-15 * after[lost, 0]
            assert stored[1] - stored[0] == pytest.approx(gone, abs=1e-12 * max(stored[1], 1e-9))
            fronts = [kernel.parts(k, s).front for s in (state, after)]
            moved += np.sum(fronts[0] != fronts[1])
            state = after
    assert moved > 20


def test_a_front_that_is_no_choice_is_refused():
    with pytest.raises(ValueError, match=r"resolution\.front = 1 must be True or False"):
        jl.Resolution(3, 6, 3, front=1)
    assert jl.Resolution(3, 6, 3, front=True) != jl.Resolution(3, 6, 3)
