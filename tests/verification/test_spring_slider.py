"""The promised accuracy: tractions on random paths against the spring-slider model, tolerances.
Small cycles: many cells against a closed form, errors of named resolutions, loss of locked-in
shear."""

from dataclasses import replace

import numpy as np
import pytest
from builders import increments, law, random_corners
from extremes.laws import SCALE, build
from scipy.integrate import trapezoid
from spring_slider import SpringSliderModel

import jointlaw as jl
from jointlaw.accuracy.suite import reference_resolution, relative_errors, standard_suite, tractions
from jointlaw.accuracy.tolerance import find_coarsest_resolution

pytestmark = pytest.mark.slow


# model: its inclinations, azimuths and springs; bounds: the promises of "fine" and "reference", and
# the model's own error is 0.05 %; separates: whether joints separate wholly and touch again
USUAL = {"paths": 5, "steps": 30, "model": (8, 24, 200), "bounds": (1e-2, 3e-3), "separates": True}
LAW = {"a": 3.0, "b": 0.5, "c": 0.1, "mu": 0.4, "formation": "population"}
# indented facets touch all at once: a coarser model errs more than `reference`; on 20 paths with
# yield interferences of 0.05, 0.1 and 0.3 ranges: 2.7, 1.4 and 1.3 %, 0.41, 0.27 and 0.18 %
YIELDS = USUAL | {"paths": 2, "model": (24, 60, 60), "bounds": (3e-2, 5e-3)}
LOSES_INTERLOCK = YIELDS | {"paths": 1, "steps": 200}
CASES = {
    "population": (USUAL, LAW | {"mu": 0.3}, 0),
    "individual": (
        USUAL, {"a": 1.4, "b": 0.0, "c": 0.2, "mu": 0.5, "formation": "individual"}, 1,
    ),
    "uniform": (USUAL, {"a": 2.0, "b": 1.0, "c": -0.1, "mu": 0.6, "lam": 1.0, "eta": 0.3}, 2),
    "smooth": (USUAL, {"a": 6.0, "b": -0.5, "c": 0.3, "mu": 0.7, "formation": "population"}, 3),
    # near 90 degrees the closure grows as the tangent: more inclinations; facets close far beyond
    # the depth nodes, and never all separate
    "wild": (
        USUAL | {"model": (20, 32, 200), "bounds": (3e-2, 9e-3), "separates": False},
        {"a": 1.0, "b": -0.5, "c": -0.2, "mu": 0.4, "lam": 0.8, "formation": "individual"}, 4,
    ),
    "yields late": (YIELDS, LAW | {"damage": {"yield_interference": 0.3}}, 30),
    "yields": (YIELDS, LAW | {"damage": {"yield_interference": 0.1}}, 10),
    "yields soon": (YIELDS, LAW | {"formation": None, "damage": {"yield_interference": 0.05}}, 5),
    "yields and loses interlock": (
        LOSES_INTERLOCK, LAW | {"damage": {"yield_interference": 0.1}, "mating_length": 0.6}, 10,
    ),
    "loses interlock": (
        LOSES_INTERLOCK | {"bounds": (1.5e-2, 3e-3)}, LAW | {"mating_length": 0.6}, 50,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_tractions_agree_with_the_spring_slider_model(name):
    case, parameters, seed = CASES[name]
    d = increments(random_corners(np.random.default_rng(seed), case["paths"]), case["steps"])
    models = [
        SpringSliderModel(law(**parameters), path, *case["model"]) for path in np.cumsum(d, axis=1)
    ]
    results = [model.follow() for model in models]
    exact, energy = (np.array(part) for part in zip(*results, strict=True))
    peak = np.linalg.norm(exact, axis=2).max(axis=1)
    for resolution, bound in zip(("fine", "reference"), case["bounds"], strict=True):
        joints = law(**parameters, resolution=resolution).joints(len(d))
        rows = []
        for step in np.moveaxis(d, 1, 0):
            F, _ = joints.update(step, tangent=False)
            rows.append((F, joints.stored_energy, joints.measures().separated > 1.0 - 1e-12))
        F, stored, separated = (np.stack(part, axis=1) for part in zip(*rows, strict=True))
        # the paths separate the joints, or not, as the case requires
        assert (separated[:, :-1] & ~separated[:, 1:]).any() == case["separates"]
        error = np.linalg.norm(F - exact, axis=2).max(axis=1) / peak
        assert error.max() < bound, (resolution, error)
        # energy is quadratic in the force: twice its error
        energy_error = np.abs(stored - energy).max(axis=1) / energy.max(axis=1)
        assert energy_error.max() < 2.0 * bound
        # the model takes the mean squeeze of a step: first order in the step
        plastic_work = [model.plastic_work for model in models]
        np.testing.assert_allclose(joints.plastic_work, plastic_work, rtol=0.05)


def test_reference_of_the_suite_agrees_with_the_spring_slider_model():
    law = jl.JointLaw(
        orientation=jl.Orientation(4.0, 0.5, 0.1),
        asperity=jl.Asperity(K=1.0, lam=1.2, eta=0.5, mu=0.5),
        asperity_density=1.0,
        closure_range=1.0,
    )
    suite = standard_suite(law)
    paths = np.moveaxis(np.cumsum(suite.d, axis=0), 1, 0)
    F = np.stack([SpringSliderModel(law, path, 6, 16, 120).follow()[0] for path in paths], axis=1)
    # the model's own orientations (0.12 % here) and springs, and the reference's uncertainty
    assert relative_errors(F, suite.F).max() < 2.5e-3
    assert suite.uncertainty[: len(paths)].max() < 5e-4
    # the paths keep the normal stress during shear, as their names say
    constant_stress = [
        i for i, name in enumerate(suite.names) if name.startswith(("shear", "reversal"))
    ]
    stress = float(law.normal_stress(1.0)) / 2
    np.testing.assert_allclose(suite.F[15:, constant_stress, 0], stress, rtol=2e-2)


def test_cells_converge_beyond_the_closure_range():
    """Cells that end with the range leave an error that no number of cells removes."""
    law = replace(jl.presets.load("biegel-rough"), plane=0.0)
    suite = standard_suite(law)
    far_path = suite.d[:, [suite.names.index("far")]]
    coarse_F, fine_F, finest_F = (
        tractions(replace(law, resolution=jl.Resolution(8, 7, depth)), far_path)
        for depth in (16, 32, 128)
    )
    fine_error = relative_errors(fine_F, finest_F)[0]
    coarse_error = relative_errors(coarse_F, finest_F)[0]
    assert fine_error < 6e-4
    assert coarse_error > 2.8 * fine_error  # second order: 4; 2 where the cells end with the range


def test_reference_is_refined_in_the_direction_of_the_largest_error():
    law = jl.JointLaw(  # nearly linear: all slip starts at once, and azimuths decide
        orientation=jl.Orientation(2.0, -0.4, -0.35),
        asperity=jl.Asperity(K=1.0, lam=1.4, eta=0.02, mu=0.36),
        asperity_density=1.0,
        closure_range=1.0,
        plane=0.0,
    )
    usual = reference_resolution(law)
    bound = 6e-4
    assert standard_suite(law).uncertainty.max() > bound  # the usual reference is too coarse
    resolution, error = find_coarsest_resolution(law, bound)
    fine = standard_suite(law, replace(usual, phi=2 * usual.phi))
    assert resolution is not None
    assert error <= bound
    # half of the bound may be the error of the reference itself
    assert fine.errors(replace(law, resolution=resolution)).traction.max() < 1.5 * bound


def test_an_unreachable_tolerance_is_refused_with_the_smallest_error():
    law = replace(jl.presets.load("linear-a6"), plane=0.0)
    with pytest.raises(ValueError, match=r"tolerance = 1e-07 cannot be met .* the smallest error"):
        law.at_tolerance(1e-7)


def error_ratios(adapted, law, count, tolerance):
    """Errors (paths,) of an adapted law on random paths within the closure range, over the
    tolerance."""
    corners = law.closure_range * random_corners(np.random.default_rng(2), count)[:, :, :2]
    d = np.ascontiguousarray(np.moveaxis(increments(corners, 20), 1, 0))
    exact = tractions(replace(law, resolution=reference_resolution(law)), d)
    return relative_errors(tractions(adapted, d), exact) / tolerance


@pytest.mark.parametrize("name", ["westerly-smooth", "biegel-rough", "nonlinear-a6"])
def test_tolerances_hold_on_paths_that_the_search_does_not_use(name):
    law = replace(jl.presets.load(name), plane=0.0)
    sliders = []
    for tolerance in (0.05, 0.02):
        adapted = law.at_tolerance(tolerance)
        assert replace(adapted, resolution=law.resolution) == law
        sliders.append(adapted.resolution.sliders)
        ratios = error_ratios(adapted, law, 6, tolerance)
        # never twice the tolerance, and on these six paths the tolerance but for one at most
        assert ratios.max() < 2.0
        assert np.sort(ratios)[-2] <= 1.0
    assert sliders == sorted(sliders)


def test_the_tolerance_holds_where_slopes_decrease_by_stress():
    """On random paths that reach a third of the slopes."""
    base = jl.presets.load("westerly-smooth")
    size = base.closure_range
    stress = 0.3 * float(base.normal_stress(size))
    changes = {"plane": 0.0, "mating_length": 10 * size, "closure_range": size}
    law = replace(base, degradation_stress=stress, **changes)
    joint = law.joint()
    joint.update([size, 0.0])
    assert joint.slope_retention < 0.35
    adapted = law.at_tolerance(0.02)
    assert adapted.resolution.sliders > law.at_tolerance(0.05).resolution.sliders
    assert 0.05 < error_ratios(adapted, law, 6, 0.02).max() <= 1.0


def test_closure_only_uses_paths_of_closure_alone():
    law = replace(jl.presets.load("westerly-rough"), closure_only=True)
    adapted = law.at_tolerance(0.01)
    assert adapted.closure_only
    assert adapted == law.at_tolerance(0.01)
    assert [row.traction_error.shape for row in law.tradeoff(["fast"], joints=0).rows] == [(4,)]


@pytest.mark.parametrize("name", ["westerly-smooth", "nonlinear-a6"])
def test_tolerances_hold_at_all_stresses_of_a_range(name):
    """Cells for the closure range alone err by up to 17 % within a hundredth of it."""
    law = replace(jl.presets.load(name), plane=0.0)
    stress = (1e4, 5e6)
    adapted = law.at_tolerance(0.02, stress=stress)
    assert adapted.closure_range == pytest.approx(law.closure(5e6), rel=1e-12)
    for largest_stress in np.geomspace(*stress, 5):
        limited = replace(law, closure_range=float(law.closure(largest_stress)))
        assert error_ratios(adapted, limited, 12, 0.02).max() <= 1.0


def test_tolerances_hold_on_dilated_joints():
    """Open joints pressed by their slopes, sheared to 15 closure ranges of their own stress.

    The paths of the suite end at 7. A resolution for closed joints errs by more on these paths.
    """
    law = replace(jl.presets.load("jing-replica"), plane=0.0)
    stress = (1e3, 5e6)
    adapted = law.at_tolerance(0.05, stress=stress)
    rng = np.random.default_rng(11)
    corners = np.zeros((96, 5, 2))
    corners[:, 1:, 1] = rng.normal(size=(96, 4)) * 10.0 ** rng.uniform(-2.5, 0.0, (96, 1))
    corners[:, 1:, 0] = -np.abs(corners[:, 1:, 1]) * rng.uniform(0.05, 0.4, (96, 1))
    corners *= adapted.closure_range
    d = np.ascontiguousarray(np.moveaxis(increments(corners, 48), 1, 0))
    lowest = adapted.resolution.lowest
    F = tractions(replace(adapted, resolution=jl.Resolution(24, 16, 40, lowest)), d)
    normal = F[:, :, 0].max(axis=0)
    own_range = law.closure(np.clip(normal, *stress))
    counts = (normal >= stress[0]) & (normal <= stress[1])
    counts &= np.abs(corners[:, :, 1]).max(axis=1) <= 15.0 * own_range
    assert counts.sum() >= 10
    assert relative_errors(tractions(adapted, d), F)[counts].max() <= 0.05
    for_closed = replace(adapted, resolution=jl.Resolution(2, 7, 16, lowest))
    assert relative_errors(tractions(for_closed, d), F)[counts].max() > 0.05


MU = 0.4
LAM = 1.2
CLOSURE = 0.7  # of the closure range
CYCLES = 4  # the last one is measured
STEPS = 8  # of a quarter cycle
LIMIT = MU * LAM * CLOSURE  # shear at which all asperities slip
AMPLITUDES = 10.0 ** np.linspace(-3.0, 0.0, 25)


def shear_cycles(one, amplitude):
    """Dissipation (J/m2), secant stiffness (Pa/m) of the fourth cycle at amplitudes (n,) in m."""
    batch = one.joints(len(amplitude))
    batch.update(np.tile([CLOSURE * one.closure_range, 0.0], (len(amplitude), 1)), tangent=False)
    quarter = amplitude[:, None] / STEPS * np.array([0.0, 1.0])

    def shear(sign, quarters):
        for _ in range(quarters * STEPS):
            F, _ = batch.update(sign * quarter, tangent=False)
        return F[:, 1]

    shear(1.0, 1)
    for _ in range(CYCLES):
        before = batch.dissipated_energy + batch.stored_energy
        low = shear(-1.0, 2)
        high = shear(1.0, 2)
    dissipation = batch.dissipated_energy + batch.stored_energy - before
    return dissipation, (high - low) / (2.0 * amplitude)


def test_cells_as_thin_as_the_cycle_keep_its_dissipation():
    """Hertz contacts of one orientation; docs/limits.md recommends more cells. The branches of a
    cycle are twice the first loading of Eq. 35 (Masing)."""
    remaining = np.maximum(1.0 - AMPLITUDES / LIMIT, 0.0)  # of the way to full slip
    end = 1.0 - remaining**1.5
    area = AMPLITUDES - LIMIT * 0.4 * (1.0 - remaining**2.5)
    exact = np.array([8.0 * area - 4.0 * AMPLITUDES * end, end / AMPLITUDES])
    coarse, fine, finest = (
        shear_cycles(one, AMPLITUDES) / (MU * one.normal_stress(CLOSURE) * exact) - 1.0
        for one in (
            law(a=1e9, b=0.0, c=0.0, mu=MU, lam=LAM, plane=0.0, resolution=jl.Resolution(1, 3, n))
            for n in (8, 100, 1000)
        )
    )
    is_large = AMPLITUDES > 0.3
    assert np.abs(coarse[0][is_large]).max() < 0.1
    assert np.abs(coarse[0][~is_large]).max() > 0.5
    assert np.abs(fine[0][AMPLITUDES > 0.02]).max() < 0.1
    assert np.abs(finest[0]).max() < 0.25
    assert np.abs(finest[1]).max() < 1e-3


# dissipation over the exact one at amplitudes 0.032, 0.1, 0.32 and 1; shear left after 100 openings
# by 0.01 and 0.1
PAGE = {
    "fast": (None, (0.70, 0.56)),
    "balanced": ((0.07, 1.20, 1.05, 1.01), (0.85, 0.79)),
    "fine": ((0.49, 1.11, 1.01, 1.00), (0.95, 0.88)),
    "reference": (None, (0.987, 0.922)),
    jl.Resolution(5, 7, 200): ((1.0, 1.0, 1.0, 1.0), (0.993, 0.928)),
}


def test_small_cycles_of_named_resolutions_are_as_the_page_says():
    """The figures of docs/limits.md, "Damping in small cycles", against the spring-slider model."""
    one = replace(jl.presets.load("westerly-rough"), plane=0.0)
    R = one.closure_range
    exact = []
    amplitudes = AMPLITUDES[[12, 16, 20, 24]] * R
    for amplitude in amplitudes:
        quarter = np.linspace(0.0, amplitude, 41)[1:]
        back = np.concatenate([quarter[::-1][1:], [0.0], -quarter])
        shear = np.concatenate([[0.0], quarter, np.tile([*back, *-back], CYCLES)])
        path = np.column_stack([np.full(len(shear), CLOSURE * R), shear, 0.0 * shear])
        F, _ = SpringSliderModel(one, path, 6, 16, 300).follow()
        last_cycle = slice(-2 * len(back) - 1, None)
        exact.append(trapezoid(F[last_cycle, 1], shear[last_cycle]))
    for name, (ratios, fractions) in PAGE.items():
        variant = replace(one, resolution=name)
        if ratios:
            # 300 springs, orientations and the trapezoids of 40 steps a quarter, each below 1 %
            dissipation, _ = shear_cycles(variant, amplitudes)
            np.testing.assert_allclose(dissipation / exact, ratios, rtol=2e-2, atol=5e-3)
        joints = variant.joints(2)
        joints.update(np.tile([CLOSURE * R, 0.0], (2, 1)))
        locked_in, _ = joints.update(np.tile([0.0, 0.1 * R], (2, 1)))
        opening = CLOSURE * R * np.array([[0.01, 0.0], [0.1, 0.0]])
        for _ in range(100):
            joints.update(-opening, tangent=False)
            F, _ = joints.update(opening, tangent=False)
        half_a_digit = 5e-3 if max(fractions) < 0.96 else 5e-4
        np.testing.assert_allclose(F[:, 1] / locked_in[:, 1], fractions, atol=half_a_digit)


@pytest.mark.parametrize(
    ("depth", "eta"),
    [(1, 0.0), (3, 0.0), (1, 1.0), (3, 1.0), *((n, 0.5) for n in (1, 2, 3, 10, 24))],
)
def test_small_normal_cycles_forget_locked_in_shear_at_a_known_rate(eta, depth, record):
    """A cell is one slider: unloading reduces the force of all its asperities, not only of the last
    to touch.

    With c = (zeta/y)^eta of the cell in which the closure y lies, this cell keeps kappa1/kappa0 =
    [(1 - amplitude)^eta - c]/(1 - c) of its part 1 - c each cycle; the cells above keep all.
    """
    amplitude = 1e-2
    counts = (1, 10, 100, 1000, 10_000)
    # flat faces that hardly slip
    one = build(resolution=jl.Resolution(1, 3, depth), a=1e6, mu=10.0, eta=eta)
    nodes = one.tables.asperities.cell_depth[0]
    zeta = nodes[nodes < SCALE * (1.0 - amplitude)].max() / SCALE
    c = zeta**eta if zeta > 0.0 else 0.0
    part = 1.0 - c if eta > 0.0 else 0.0  # at eta = 0 one spring has the whole force, and keeps it
    retention = ((1.0 - amplitude) ** eta - c) / (1.0 - c) if eta > 0.0 else 1.0
    expected = [1.0 - part + part * retention**n for n in counts]
    joint = one.joint()
    d = np.array([amplitude * SCALE, 0.0, 0.0])
    fractions = []
    joint.update([SCALE, 0.0, 0.0])
    locked_in = joint.update([0.0, 0.1 * SCALE, 0.0])[0]
    for cycles in np.diff(counts, prepend=0):
        for _ in range(cycles):
            joint.update(-d, tangent=False)
            F = joint.update(d, tangent=False)[0]
        fractions.append(F[1] / locked_in[1])
    # F has the rounding of each of 300 products; the facets of a = 1e6 lean by 1e-6; and sliders of
    # a cell are at their limits together where only the springs that touched last would be
    np.testing.assert_allclose(fractions, expected, atol=1e-5)
    if eta == 0.5:
        record("forgetting", depth, *fractions)
