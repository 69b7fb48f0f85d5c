"""No step creates energy, elastic or while slopes fade and wear and asperities yield: by the work
along the step's own geometry (docs/theory-incremental.md, "No step creates energy").
"""

from dataclasses import replace

import numpy as np
import pytest
from builders import law, random_corners
from work import begun, step_work, walk

import jointlaw as jl
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.asperities import effective_closure

PATHS, CYCLES = 34, 10  # of each of six kinds of law; docs/measure/gains.py searches on 60
SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, PATHS))]


def random_law(rng, fades, wears, yields=True):
    """Any law of few facets; slopes that wear fade, too."""
    a = float(rng.choice([1.0, rng.uniform(1.0, 1.6), rng.uniform(1.6, 5.0), 10.0]))
    b, mu = rng.uniform(-1.0, 2.0), rng.choice([0.0, rng.uniform(0.0, 1.2), rng.uniform(1.2, 4.0)])
    formation = [None, "population", "individual"][rng.integers(3)]
    # the printed heights are convex as a population from eta = 0.287
    eta = rng.uniform(0.3, 1.0) if formation == "population" else rng.choice([0.0, 0.5, 1.0])
    damage = {"yield_interference": 10.0 ** rng.uniform(-2.5, 0.5)} if yields else {}
    more = {"mating_length": 10.0 ** rng.uniform(-1.0, 1.0)} if fades or wears else {}
    if wears:
        more |= {"slope_wear": 10.0 ** rng.uniform(-2.0, 1.0), "slope_residual": 0.5 * rng.random()}
    return law(
        a=a, b=b, c=rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6), lam=rng.uniform(0.3, 2.0),
        eta=float(eta), mu=float(mu), damage=damage, formation=formation,
        resolution=jl.Resolution(int(rng.integers(1, 4)), int(rng.integers(3, 5)), 3),
        plane=[None, None, 0.7][rng.integers(3)], **more,
    )  # fmt: skip


def start_of(one, rng):
    """State (rows, 1) of a new joint; where slopes fade one of three has never been mated."""
    state = np.zeros((one.tables.rows, 1))
    if one.tables.fades and rng.random() < 1 / 3:
        state[: one.dim, 0] = one.unmated_start
    return state


def stored(k, states):
    """Stored energies (n,) in J/m2."""
    return kernel.measures(k, states).stored


def scale(k, states):
    """Largest energy (J/m2) in the springs of a joint on its way, had none yielded: what is stored
    is a small difference of such energies, and has their rounding."""
    now, facets = kernel.parts(k, states), k.asperities
    y = effective_closure(facets, now.delta, now.slopes)
    return max(np.max((facets.area * facets.c1) @ facets.curve.energy(y)), stored(k, states).max())


def gains(k, states, d):
    """Energy (n,) that steps d (n, dim) between states (rows, n + 1) make, as a share of `scale`,
    and what of it is rounding: of the energies of virgin curves that are tabulated, and of sums."""
    most, rounding = scale(k, states), 1e-9 if len(k.asperities.curve.S) > 1 else 1e-11
    begin, held = begun(k, states[:, :-1]), stored(k, states)
    lowered = stored(k, begin) - held[:-1]  # by slopes that wear: no work is done
    work = step_work(k, begin, d.T, np.full(len(d), 1e-3 * rounding * most))
    made = held[1:] - held[:-1] - lowered - work
    return np.maximum(np.maximum(made, made + lowered), lowered) / most, rounding


@pytest.mark.parametrize("yields", [False, True])
@pytest.mark.parametrize(("fades", "wears"), [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize("seed", SEEDS)
def test_no_step_of_a_random_path_makes_energy(seed, fades, wears, yields):
    """Steps of a hundredth of the closure range to ten mating lengths, apart and shut again."""
    rng = np.random.default_rng(seed)
    one = random_law(rng, fades, wears, yields)
    k, corners = one.tables, random_corners(rng, 1)[0][:, : one.dim]
    state = start_of(one, rng)
    corners[:, 1:] *= 10.0 ** rng.uniform(-0.5, 1.5)
    legs = np.diff(corners, axis=0, prepend=0.0)
    d = np.concatenate([leg * rng.dirichlet(np.full(3, 0.5))[:, None] for leg in legs])
    states = walk(k, state, d)
    made, rounding = gains(k, states, d)
    assert made.max() <= rounding
    assert np.diff(kernel.parts(k, states).dissipated).min() >= -1e-12 * scale(k, states)


@pytest.mark.parametrize("mu", [0.0, 0.05, 0.3])
def test_the_ledger_tends_to_the_loss_and_is_nothing_without_friction(mu):
    """Legs of 1, 10 and 100 steps: at most so many times the loss of 100 steps, and no less."""
    rough = replace(jl.presets.load("westerly-rough"), plane=0.0)
    one, lost = replace(rough, asperity=replace(rough.asperity, mu=mu)), []
    legs = one.closure_range * np.array([[0.5, 0.5], [0.0, -1.0], [0.3, 0.5]])
    for count in (1, 10, 100):
        joint = one.joint()
        for d in np.repeat(legs / count, count, axis=0):
            joint.update(d, tangent=False)
        lost.append(joint.dissipated_energy)
    assert (lost[2] > 0.0) == (mu > 0.0)
    assert lost[2] <= lost[1] <= 1.03 * lost[2]
    assert lost[1] <= lost[0] <= 1.3 * lost[2]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(CYCLES))
def test_no_cycle_that_is_searched_for_returns_work(seed):
    """An adversary: of many triangles from one state that with the least loss, and its children."""
    rng = np.random.default_rng(seed)
    one = random_law(rng, bool(seed % 2), bool(seed // 2 % 2))
    dim, state = one.dim, start_of(one, rng)
    first = random_corners(rng, 1, legs=3)[0][:, :dim]
    first[-1, 0] = rng.uniform(0.2, 0.8)  # in touch
    d, k, n = np.diff(first, axis=0, prepend=0.0), one.tables, 60
    begin = np.tile(walk(k, state, d)[:, -1:], (1, n))
    legs, size = rng.normal(size=(n, 2, dim)) * 10.0 ** rng.uniform(-2, 0, (n, 1, 1)), 1.0
    best, least = legs[0], np.inf
    for _ in range(6):
        states, work = begin, 0.0
        squares = np.sum(legs**2, axis=(1, 2))  # elastic energies go with them
        for leg in (legs[:, 0], legs[:, 1], -legs.sum(axis=1)):
            work = work + step_work(k, begun(k, states), leg.T, 1e-4 * squares)
            states = kernel.step(k, states, leg.T, False)[0]
        lost = (work - stored(k, states) + stored(k, begin)) / squares
        if lost.min() < least:
            best, least = legs[lost.argmin()], lost.min()
        size *= 0.6
        legs = best * (1.0 + size * rng.normal(size=legs.shape))
    cycle = np.vstack([best, -best.sum(axis=0)])
    d = np.vstack([d, cycle, cycle, cycle])
    made, rounding = gains(k, walk(k, state, d), d)
    assert max(made) <= rounding
    assert sum(made[3:]) <= rounding
