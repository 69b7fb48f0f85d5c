"""No step creates energy, elastic or while asperities yield and wear: by the work along the path.

JOINTLAW_PATHS=50 in the environment takes as many paths of each kind, an hour or so.
"""

import os

import numpy as np
import pytest
from builders import law, random_corners
from exact_work import step_work, stored
from work import WorkMeter

import jointlaw as jl
from jointlaw.kernels import reference as kernel

PATHS = int(os.environ.get("JOINTLAW_PATHS", 2))
SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, PATHS))]


def random_law(rng, held, wears, yields=True):
    """Any law of few facets; `held` has a critical slip."""
    a = float(rng.choice([1.0, rng.uniform(1.0, 1.6), rng.uniform(1.6, 5.0), 10.0]))
    b, mu = rng.uniform(-1.0, 2.0), rng.uniform(0.0, 1.2) * (rng.random() < 0.8)
    formation = [None, "population", "individual"][rng.integers(3)]
    # the printed heights are convex as a population from eta = 0.287
    eta = rng.uniform(0.3, 1.0) if formation == "population" else rng.choice([0.0, 0.5, 1.0])
    damage = {"yield_interference": 10.0 ** rng.uniform(-2.5, 0.5)} if yields else {}
    if wears and mu > 0.0:
        damage |= {"mu_residual": mu * rng.random(), "wear_slip": 10.0 ** rng.uniform(-2.0, 0.5)}
    return law(
        a=a, b=b, c=rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6), lam=rng.uniform(0.3, 2.0),
        eta=float(eta), mu=mu, damage=damage, formation=formation,
        resolution=jl.Resolution(int(rng.integers(1, 4)), int(rng.integers(3, 5)), 3),
        critical_slip=rng.uniform(0.1, 0.6) if held else np.inf,
    )  # fmt: skip


def gain(k, state, d):
    """Energy (J/m2) that a step d of one joint makes, and the state after it."""
    after = kernel.step(k, state, d[:, None], False)[0]
    return stored(k, after)[0] - stored(k, state)[0] - step_work(k, state, d), after


def scale(k, state):
    """Energy (J/m2) in the springs of one joint had none yielded: what is stored is a small
    difference of such energies, and has their rounding."""
    now = kernel.parts(k, state)
    y = kernel.effective_closure(k, now.delta[0], now.offset)
    return max(np.sum(k.area * k.c1 * k.curve.energy(y)[:, 0]), stored(k, state)[0])


@pytest.mark.parametrize("yields", [False, True])
@pytest.mark.parametrize("wears", [False, True])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_no_step_of_a_closed_path_makes_energy(seed, held, wears, yields):
    rng = np.random.default_rng(seed)
    k = random_law(rng, held, wears, yields).tables
    corners = random_corners(rng, 1)[0]
    corners[-1] = 0.0
    state, gains, peak = np.zeros((k.rows, 1)), [], 0.0
    for leg in np.diff(corners, axis=0, prepend=0.0):
        for share in rng.dirichlet(np.full(3, 0.5)):
            made, state = gain(k, state, leg * share)
            gains.append(made)
            peak = max(peak, scale(k, state))
    print(f"{max(gains) / peak:.1e} {sum(gains) / peak:.1e} of the peak")
    # Gauss rules of 16 points between kinks: rounding of the path's largest energy is left
    assert max(gains) <= 1e-12 * peak
    assert sum(gains) <= 1e-12 * peak


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(PATHS))
def test_no_cycle_that_is_searched_for_returns_work(seed):
    """An adversary: of many triangles from one state that with the least loss, and its children."""
    rng = np.random.default_rng(seed)
    one = random_law(rng, bool(seed % 2), bool(seed // 2 % 2))
    first = random_corners(rng, 1, legs=3)[0]
    first[-1, 0] = rng.uniform(0.2, 0.8)  # in touch
    d = np.diff(first, axis=0, prepend=0.0)
    meter, n = WorkMeter(one, 60, panels=16), 60
    for step in d:
        meter.step(np.tile(step, (n, 1)))
    begin, start = meter.copies.snapshot(), meter.stored
    legs, size = rng.normal(size=(n, 2, 3)) * 10.0 ** rng.uniform(-2, 0, (n, 1, 1)), 1.0
    best, least = legs[0], np.inf
    for _ in range(6):
        meter.copies.restore(begin)
        work = sum(meter.step(step) for step in (legs[:, 0], legs[:, 1], -legs.sum(axis=1)))
        lost = (work - meter.stored + start) / np.sum(
            legs**2, axis=(1, 2)
        )  # elastic: as the square
        if lost.min() < least:
            best, least = legs[lost.argmin()], lost.min()
        size *= 0.6
        legs = best * (1.0 + size * rng.normal(size=legs.shape))
    k, made, peak = one.tables, [], 0.0
    state, cycle = np.zeros((k.rows, 1)), [*best, -best.sum(axis=0)]
    for step in [*d, *cycle, *cycle, *cycle]:
        more, state = gain(k, state, step)
        made.append(more)
        peak = max(peak, scale(k, state))
    print(f"{max(made) / peak:.1e} {sum(made[3:]) / peak:.1e} of the peak")
    assert max(made) <= 1e-12 * peak
    assert sum(made[3:]) <= 1e-12 * peak


# flattened springs keep the friction limit from growing
@pytest.mark.parametrize(("wear_slip", "interference"), [(0.5, np.inf), (0.01, 0.3)])
def test_wear_of_one_to_fifty_per_cent_in_a_step_makes_no_energy(wear_slip, interference):
    """Slide, then close while shearing slowly: sliders above their new limit would gain work."""
    damage = {"mu_residual": 0.2, "wear_slip": wear_slip, "yield_interference": interference}
    k = law(mu=0.4, eta=0.0, a=8.0, damage=damage, resolution=jl.Resolution(1, 3, 1)).tables
    state = kernel.step(k, np.zeros((k.rows, 1)), np.array([[0.5], [0.0], [0.0]]), False)[0]
    state = kernel.step(k, state, np.array([[0.0], [0.3], [0.0]]), False)[0]
    fallen = 1.0 - kernel.friction(k, kernel.parts(k, state).slip)[0] / k.mu
    assert 0.01 < fallen <= 0.5
    for closing in (0.01, 0.1, 0.4):
        for slow in (0.0, 0.01, 0.1):
            made = gain(k, state, np.array([closing, slow * closing, 0.0]))[0]
            assert made <= 1e-12 * stored(k, state)[0]
