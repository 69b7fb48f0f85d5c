"""Loss of interlock with slip, asperity degradation, yielding asperities, in closed forms (against
the spring-slider model: test_spring_slider.py). No step of such a law, or of elastic asperities,
creates energy by the work along the step's own geometry (docs/theory-incremental.md, "Dissipation
is non-negative along the geometry of the step").
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from builders import law, random_corners
from work import degraded, states_along, work_on_step_geometry

import jointlaw as jl
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.cells import evaluate_cells
from jointlaw.kernels.degradation import slope_energy_rate
from jointlaw.kernels.interlock import effective_closure
from jointlaw.kernels.plasticity import subtract_plastic

PRESETS = "westerly-rough", "jing-replica"
FINE = jl.Resolution(12, 12, 12)


@pytest.mark.slow
@pytest.mark.parametrize("stress", [0.1e6, 1e6, 3e6, 30e6])
@pytest.mark.parametrize("name", PRESETS)
def test_friction_angle_is_the_angle_of_the_asperities_plus_dilation(name, stress):
    """At and after the peak, where some asperities still stick, the more the higher the stress.
    Sheared back to its origin the joint is interlocked."""
    for mating_ratio in (12.0, 100.0):
        law = jl.presets.load(name)
        rows = []
        D = mating_ratio * law.closure_range
        joint = replace(law, mating_length=D, plane=0.0, resolution=FINE).joint()
        slips = D * np.concatenate([np.geomspace(1e-3, 1.0, 60), np.linspace(1.05, 10.0, 60)])
        for slip in (*slips, *slips[::-1], 0.0):
            record = jl.direct_shear(joint, [slip - joint.delta[1]], normal=stress, steps=1)
            rows.append([record.friction_angle[-1], joint.delta[0]])
        friction, closure = np.array(rows).T
        rise = closure[0] - closure
        assert abs(rise[-1]) < (0.04 if stress > 3e6 else 0.01) * rise.max()
        forward = slice(len(slips))
        friction = friction[forward]
        dilation = np.degrees(np.arctan(-np.gradient(closure[forward], slips)))
        difference = np.abs(friction - np.degrees(np.arctan(law.asperity.mu)) - dilation)
        peak = int(np.argmax(friction))
        assert difference[peak:-1].max() < (4.2 if stress > 3e6 else 3.3)
        if stress <= 3e6:
            assert difference[slips > slips[peak] + D][:-1].max() < 1.2


@pytest.mark.slow
@pytest.mark.parametrize("mated", [True, False])
@pytest.mark.parametrize("stress", [0.1e6, 1e6, 30e6])
@pytest.mark.parametrize("name", PRESETS)
def test_far_from_interlock_only_the_friction_of_the_asperities_remains(name, stress, mated):
    law = replace(jl.presets.load(name), resolution="fine")
    law = replace(law, mating_length=12.0 * law.closure_range)
    slip = 100.0 * law.mating_length if mated else 3.0 * law.closure_range
    for azimuth in np.arange(8) * np.pi / 4:
        joint = law.joint(mated=mated)
        direction = np.array([np.cos(azimuth), np.sin(azimuth)])
        jl.direct_shear(joint, [slip], normal=stress, azimuth=azimuth, steps=40)
        angle = np.degrees(np.arctan2(joint.F[1:] @ direction, joint.F[0]))
        assert angle == pytest.approx(np.degrees(np.arctan(law.asperity.mu)), abs=0.3)


@pytest.mark.parametrize("interference", [1e-12, 0.05, 0.3])
@pytest.mark.parametrize(
    ("formation", "eta"), [(None, 0.0), ("population", 0.5), ("individual", 1)]
)
def test_closure_of_yielding_asperities_has_a_closed_form(formation, eta, interference):
    one = law(formation=formation, eta=eta, mu=0.0, resolution=jl.Resolution(2, 4, 3),
              damage={"yield_interference": interference})  # fmt: skip
    joint = one.joint()
    k = one.tables.asperities

    def phi(y):
        return k.curve.force(np.asarray(y, float))[0]

    yield_closure = interference / k.c1
    closure = 0.0
    largest = 0.0
    for target in np.random.default_rng(0).uniform(-0.2, 1.2, 40):
        F, C = joint.update([target - closure, 0.0, 0.0])
        closure = target
        largest = max(largest, target)
        indentation = np.maximum(largest - yield_closure, 0.0)
        touches = target > indentation
        stress = np.sum(k.area * k.c1 * np.where(touches, phi(target) - phi(indentation), 0.0))
        plastic_work = np.sum(k.area * k.c1 * yield_closure * phi(indentation))
        scale = np.sum(k.area * k.c1) * phi(largest)
        # rounding of Phi, in a small difference
        assert abs(F[0] - stress) <= 1e-12 * scale
        assert abs(joint.plastic_work - plastic_work) <= 1e-12 * scale
        assert joint.plastic_work <= joint.dissipated_energy
        if target < largest:  # unloading and reloading are elastic
            slope = k.curve.force(np.array(target))[1]
            stiffness = np.sum(k.area * k.c1 * np.where(touches, slope, 0.0))
            assert C[0, 0] == pytest.approx(stiffness, rel=1e-12, abs=1e-300)
    assert joint.stored_energy >= 0.0


def test_a_joint_closed_beyond_its_highest_asperity_gives_a_warning():
    """99.99 % of the heights of this preset end at a closure of 17.1 mm."""
    stiff = jl.presets.load("jing-replica")
    asperity = replace(stiff.asperity, yield_interference=0.1 * stiff.closure_range)
    weak = replace(stiff, asperity=asperity)
    with pytest.warns(UserWarning, match="closure = 0.0176 m: 99.99 % .* law ends"):
        weak.joint(30e6)
    with pytest.warns(UserWarning, match="100.00 % of the asperities touch"):
        stiff.joint(4e9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        weak.joint(10e6)
        stiff.joint(30e6)


@pytest.mark.parametrize(
    ("mu", "path"),
    [(0.0, 2 * [[0.0, 0.5]]), (0.4, 20 * [[0.6, 0.0], [0.6, 0.0], [-0.6, 0.0], [-0.6, 0.0]])],
)
def test_shear_without_friction_and_closing_do_not_degrade_asperities(mu, path):
    """Facets slide where a joint closes; real joints keep their roughness without shear."""
    joint = law(mu=mu, mating_length=3.0, slope_wear=1e-3, plane=0.0).joint(0.3)
    for d in path:
        joint.update(d)
    assert max(joint.F[1], joint.dissipated_energy) > 1e-3  # it climbs, or friction dissipates
    assert joint.slope_retention == 1.0


def test_a_step_that_reverses_the_shear_stress_degrades_asperities():
    """From side to side in one step or in many: the mean of the stresses at both ends vanishes."""
    lost = []
    for count in (1, 4, 64):
        joint = law(mu=0.4, mating_length=3.0, slope_wear=1.0, plane=0.0).joint()
        for d in ([0.6, 0.0], [0.0, 0.25], *(5 * (count * [[0.0, -0.5]] + count * [[0.0, 0.5]]))):
            joint.update([d[0], d[1] / (count if abs(d[1]) == 0.5 else 1)])
        lost.append(1 - joint.slope_retention)
    assert lost[2] > 0.1
    assert lost[0] == pytest.approx(lost[2], rel=0.4)
    assert lost[1] == pytest.approx(lost[2], rel=0.1)


def test_asperities_degrade_by_the_work_of_shear():
    """slopes = s + (1 - s) exp(-work/slope_wear), of the step before; the dilation decreases with
    them."""
    one = law(mu=0.4, mating_length=3.0, slope_wear=0.2, slope_residual=0.25, plane=0.0)
    joint = one.joint()
    joint.update([0.6, 0.0])
    for _ in range(80):
        before = kernel.state_parts(one.tables, joint.snapshot().values.T).shear_work[0]
        joint.update([0.0, 0.05])
        assert joint.slope_retention == pytest.approx(
            0.25 + 0.75 * np.exp(-before / 0.2), rel=1e-12
        )
    now = kernel.state_parts(one.tables, joint.snapshot().values.T)
    y = effective_closure(one.tables.asperities, now.delta, now.slope_retention)[:, 0]
    climbed = 4.0 / np.hypot(1.0, 4.0 / 3.0)
    expected = 0.6 + joint.slope_retention * climbed * one.tables.asperities.m[1]
    assert joint.slope_retention < 0.9
    np.testing.assert_allclose(y, expected, rtol=1e-12)


PATHS = 34  # of each of six kinds of law; docs/measure/energy_gain.py searches on 60
CYCLES = 10
SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, PATHS))]


def random_joint(rng, fades, wears, yields=True, flattens=False):
    """Any law of few facets, and the state (rows, 1) of a new joint.

    fades: with a mating length, which degradation by work (wears) and by stress (flattens) imply;
    one of three such joints starts unmated.
    """
    a = float(rng.choice([1.0, rng.uniform(1.0, 1.6), rng.uniform(1.6, 5.0), 10.0]))
    b = rng.uniform(-1.0, 2.0)
    mu = rng.choice([0.0, rng.uniform(0.0, 1.2), rng.uniform(1.2, 4.0)])
    formation = [None, "population", "individual"][rng.integers(3)]
    # the printed heights are convex as a population from eta = 0.287
    eta = rng.uniform(0.3, 1.0) if formation == "population" else rng.choice([0.0, 0.5, 1.0])
    damage = {"yield_interference": 10.0 ** rng.uniform(-2.5, 0.5)} if yields else {}
    fades = fades or wears or flattens
    more = {"mating_length": 10.0 ** rng.uniform(-1.0, 1.0)} if fades else {}
    if wears:
        more |= {"slope_wear": 10.0 ** rng.uniform(-2.0, 1.0), "slope_residual": 0.5 * rng.random()}
    if flattens:
        more["degradation_stress"] = 10.0 ** rng.uniform(-2.0, 1.0)
    one = law(
        a=a, b=b, c=rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6), lam=rng.uniform(0.3, 2.0),
        eta=float(eta), mu=float(mu), damage=damage, formation=formation,
        resolution=jl.Resolution(int(rng.integers(1, 4)), int(rng.integers(3, 5)), 3),
        plane=[None, None, 0.7][rng.integers(3)], **more,
    )  # fmt: skip
    state = np.zeros((one.tables.rows, 1))
    if one.tables.interlock_decays and rng.random() < 1 / 3:
        state[: one.dim, 0] = one.unmated_start
    return one, state


def stored(k, states):
    """Stored energies (n,) in J/m2."""
    return kernel.measures(k, states).stored_energy


def energy_scale(k, states):
    """Largest energy (J/m2) in the springs of a joint on its path if none yields.

    The stored energy is a small difference of such energies, and has their rounding.
    """
    state = kernel.state_parts(k, states)
    facets = k.asperities
    y = effective_closure(facets, state.delta, state.slope_retention)
    elastic = (facets.area * facets.c1) @ facets.curve.energy(y)
    return max(np.max(elastic), stored(k, states).max())


def energy_gains(k, states, d):
    """Energy (n,) that steps d (n, dim) between states (rows, n + 1) create, over `energy_scale`.

    Also returns its rounding: of the energies of tabulated first-loading curves, and of sums.
    """
    scale = energy_scale(k, states)
    rounding = 1e-9 if len(k.asperities.curve.S) > 1 else 1e-11
    start = degraded(k, states[:, :-1])
    energy = stored(k, states)
    degradation = stored(k, start) - energy[:-1]  # by asperity degradation, without work
    end_slopes = kernel.state_parts(k, states[:, 1:]).slope_retention
    exact = np.full(len(d), 1e-3 * rounding * scale)
    work = work_on_step_geometry(k, start, d.T, end_slopes, exact)
    gain = energy[1:] - energy[:-1] - degradation - work
    return np.maximum(np.maximum(gain, gain + degradation), degradation) / scale, rounding


def slope_energy_rates(k, states):
    """Derivative (n,) in J/m2 of the stored energy by the slope retention, at fixed displacement.

    It is not negative, so a decrease of the slopes dissipates.
    """
    state = kernel.state_parts(k, states)
    facets = k.asperities
    closures = effective_closure(facets, state.delta, state.slope_retention)
    indented = evaluate_cells(facets, state.indentation) if facets.yields else None
    cells = subtract_plastic(evaluate_cells(facets, closures), indented)
    return np.sum(slope_energy_rate(facets, state.delta, cells), axis=0)


@pytest.mark.parametrize("yields", [False, True])
@pytest.mark.parametrize(
    ("fades", "wears", "flattens"),
    [
        (False, False, False),
        (True, False, False),
        (True, True, False),
        (True, False, True),
        (True, True, True),
    ],
)
@pytest.mark.parametrize("seed", SEEDS)
def test_no_step_of_a_random_path_creates_energy(seed, fades, wears, flattens, yields):
    """Steps of a hundredth of the closure range to ten mating lengths, opened and closed again."""
    rng = np.random.default_rng(seed)
    one, state = random_joint(rng, fades, wears, yields, flattens)
    k = one.tables
    corners = random_corners(rng, 1)[0][:, : one.dim]
    corners[:, 1:] *= 10.0 ** rng.uniform(-0.5, 1.5)
    legs = np.diff(corners, axis=0, prepend=0.0)
    d = np.concatenate([leg * rng.dirichlet(np.full(3, 0.5))[:, None] for leg in legs])
    states = states_along(k, state, d)
    gains, rounding = energy_gains(k, states, d)
    assert gains.max() <= rounding
    if fades:
        assert slope_energy_rates(k, states).min() >= -1e-12 * energy_scale(k, states)
    dissipation = np.diff(kernel.state_parts(k, states).dissipated_energy)
    assert dissipation.min() >= -1e-12 * energy_scale(k, states)


@pytest.mark.parametrize("mu", [0.0, 0.05, 0.3])
def test_dissipated_energy_converges_from_above_and_is_zero_without_friction(mu):
    """Legs of 1, 10 and 100 steps."""
    rough = replace(jl.presets.load("westerly-rough"), plane=0.0)
    one = replace(rough, asperity=replace(rough.asperity, mu=mu))
    dissipated = []
    legs = one.closure_range * np.array([[0.5, 0.5], [0.0, -1.0], [0.3, 0.5]])
    for count in (1, 10, 100):
        joint = one.joint()
        for d in np.repeat(legs / count, count, axis=0):
            joint.update(d, tangent=False)
        dissipated.append(joint.dissipated_energy)
    coarse, fine, finest = dissipated
    assert (finest > 0.0) == (mu > 0.0)
    assert finest <= fine <= 1.03 * finest
    assert fine <= coarse <= 1.3 * finest


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(CYCLES))
def test_no_cycle_of_a_search_returns_work(seed):
    """Search many triangles from one state for the smallest dissipation, and vary the best."""
    rng = np.random.default_rng(seed)
    flattens = bool(seed // 4 % 2)
    one, state = random_joint(rng, bool(seed % 2), bool(seed // 2 % 2), flattens=flattens)
    first = random_corners(rng, 1, legs=3)[0][:, : one.dim]
    first[-1, 0] = rng.uniform(0.2, 0.8)  # in touch
    approach = np.diff(first, axis=0, prepend=0.0)
    k = one.tables
    n = 60
    start = np.tile(states_along(k, state, approach)[:, -1:], (1, n))
    legs = rng.normal(size=(n, 2, one.dim)) * 10.0 ** rng.uniform(-2, 0, (n, 1, 1))
    size = 1.0
    best = legs[0]
    smallest = np.inf
    for _ in range(6):
        states = start
        work = 0.0
        squares = np.sum(legs**2, axis=(1, 2))  # elastic energies are proportional to them
        for leg in (legs[:, 0], legs[:, 1], -legs.sum(axis=1)):
            start_of_leg = degraded(k, states)
            states = kernel.step(k, states, leg.T, False)[0]
            end_slopes = kernel.state_parts(k, states).slope_retention
            exact = 1e-4 * squares
            work = work + work_on_step_geometry(k, start_of_leg, leg.T, end_slopes, exact)
        dissipation = (work - stored(k, states) + stored(k, start)) / squares
        if dissipation.min() < smallest:
            best = legs[dissipation.argmin()]
            smallest = dissipation.min()
        size *= 0.6
        legs = best * (1.0 + size * rng.normal(size=legs.shape))
    cycle = np.vstack([best, -best.sum(axis=0)])
    d = np.vstack([approach, cycle, cycle, cycle])
    gains, rounding = energy_gains(k, states_along(k, state, d), d)
    assert max(gains) <= rounding
    assert sum(gains[3:]) <= rounding
