"""Accuracy that is promised is kept: the reference against the slow bed, tolerances elsewhere."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from slow_bed import SlowBed, cap_quadrature, reach_of

import jointlaw as jl
from jointlaw.accuracy.suite import errors, reference_resolution, standard_suite, tractions
from jointlaw.accuracy.tolerance import coarsest

pytest.importorskip("numba")  # the same numbers without it, in minutes

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def benchmark():
    """benchmarks/tolerance.py, of which this is the short form."""
    spec = importlib.util.spec_from_file_location("tolerance", ROOT / "benchmarks" / "tolerance.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_reference_of_the_suite_agrees_with_the_slow_bed():
    law = jl.JointLaw(
        orientation=jl.Orientation(4.0, 0.5, 0.1),
        asperity=jl.Asperity(K=1.0, lam=1.2, eta=0.5, mu=0.5),
        asperity_density=1.0,
        closure_range=1.0,
    )
    suite = standard_suite(law)
    n, w = cap_quadrature(4.0, 0.5, 0.1, 6, 16)
    F = np.zeros_like(suite.F)
    moved = range(F.shape[1])  # the others hold a stress
    for i in moved:
        path = np.cumsum(suite.d[:, i], axis=0)
        bed = SlowBed(n, w, reach_of(path, n), K=1.0, lam=1.2, eta=0.5, mu=0.5, density=1.0,
                      n_depth=120)  # fmt: skip
        F[:, i] = [bed.update(d) for d in suite.d[:, i]]
    # the bed's own orientations (0.12 % here) and springs, and the reference's uncertainty
    assert errors(F, suite.F)[0].max() < 2.5e-3
    assert suite.uncertainty[moved].max() < 5e-4
    # and the paths do what they say: the normal stress is kept while sheared
    held = [i for i, name in enumerate(suite.names) if name.startswith(("shear", "reversal"))]
    stress = float(law.normal_stress(1.0)) / 2
    np.testing.assert_allclose(suite.F[15:, held, 0], stress, rtol=2e-2)


def test_depth_cells_converge_beyond_the_closure_range():
    """Cells that end with the range leave an error that no number of them takes away."""
    law = replace(jl.presets.load("biegel-rough"), plane=0.0)
    suite = standard_suite(law)
    far = suite.d[:, [suite.names.index("far")]]
    found = [
        tractions(replace(law, resolution=jl.Resolution(8, 7, depth)), far)
        for depth in (16, 32, 128)
    ]
    coarse, fine = (errors(F, found[-1])[0][0] for F in found[:2])
    assert fine < 6e-4
    assert coarse > 2.8 * fine  # second order: 4; it is 2 where the cells end with the range


@pytest.mark.parametrize("seed", range(4))
def test_tolerances_are_kept_on_paths_never_seen(benchmark, seed):
    rng = np.random.default_rng(seed)
    law = benchmark.random_law(rng)
    while law.orientation.a < benchmark.SMALL_A:
        law = benchmark.random_law(rng)
    law = replace(law, plane=0.0)
    d = benchmark.random_paths(law, rng)
    truth = tractions(replace(law, resolution=reference_resolution(law)), d)
    sliders = []
    for tolerance in (0.05, 0.02):
        made = law.at_tolerance(tolerance)
        sliders.append(made.resolution.sliders)
        ratio = errors(tractions(made, d), truth)[0] / tolerance
        # never twice the tolerance, and on these six paths the tolerance but for one at most
        assert ratio.max() < 2.0
        assert np.sort(ratio)[-2] <= 1.0
    assert sliders == sorted(sliders)


def test_answer_is_the_same_again_and_keeps_the_law():
    law = jl.presets.load("westerly-smooth")
    made = law.at_tolerance(0.02)
    assert made == law.at_tolerance(0.02)
    assert replace(made, resolution=law.resolution) == law


def test_errors_that_add_up_ask_for_more_than_each_direction_alone(benchmark):
    law = jl.JointLaw(
        orientation=jl.Orientation(1.9186658847280933, 1.49203355976077, 0.008761543460804024),
        asperity=jl.Asperity(
            K=6023934.454440096, lam=0.989442676702933, eta=0.24647504034315013, mu=0.52448474274427
        ),
        asperity_density=1e10,
        heights=jl.GammaHeights(
            7.187562116553808, 1.1144834507488927e-06, 1.6284759080927048e-06,
            formation="individual",
        ),
        plane=0.0,
    )  # fmt: skip
    d = benchmark.random_paths(law, np.random.default_rng(5))
    truth = tractions(replace(law, resolution=reference_resolution(law)), d)
    assert errors(tractions(law.at_tolerance(0.01), d), truth)[0].max() < 0.01


def test_reference_is_refined_in_the_direction_that_errs():
    law = jl.JointLaw(  # nearly linear: all slip begins at once, and azimuths decide
        orientation=jl.Orientation(2.0, -0.4, -0.35),
        asperity=jl.Asperity(K=1.0, lam=1.4, eta=0.02, mu=0.36),
        asperity_density=1.0,
        closure_range=1.0,
        plane=0.0,
    )
    usual, bound = reference_resolution(law), 6e-4
    assert standard_suite(law).uncertainty.max() > bound  # too coarse a judge
    found, reached = coarsest(law, bound)
    fine = standard_suite(law, replace(usual, phi=2 * usual.phi))
    assert found is not None
    assert reached <= bound
    # half of the bound may be the judge's own error
    assert fine.errors(replace(law, resolution=found))[0].max() < 1.5 * bound


def test_what_cannot_be_met_is_refused_with_what_was_reached():
    law = replace(jl.presets.load("linear-a6"), plane=0.0)
    with pytest.raises(ValueError, match=r"tolerance = 1e-07 cannot be met .* was reached"):
        law.at_tolerance(1e-7)


def test_example_of_the_docs_prints_what_it_says(capsys):
    page = (ROOT / "docs" / "how-accurate.md").read_text()
    block = page.split("```python\n")[1].split("```")[0]
    exec(block, {})
    printed = block.split("print(")[1].split("# ")[1].strip()
    assert capsys.readouterr().out.strip() == printed


def test_closure_only_takes_closures_alone(benchmark):
    law = replace(jl.presets.load("westerly-rough"), closure_only=True)
    d = benchmark.random_paths(law, np.random.default_rng(3))
    truth = tractions(replace(law, resolution="reference"), d)
    for tolerance in (0.03, 0.003):
        made = law.at_tolerance(tolerance)
        assert made.closure_only
        assert errors(tractions(made, d), truth)[0].max() < tolerance
    assert [p.error.shape for p in law.tradeoff(["fast"], joints=0).rows] == [(4,)]
