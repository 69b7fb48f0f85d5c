"""Accuracy that is promised is kept: the reference against the slow bed, tolerances elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from builders import increments, random_corners
from slow_bed import SlowBed

import jointlaw as jl
from jointlaw.accuracy.suite import errors, reference_resolution, standard_suite, tractions
from jointlaw.accuracy.tolerance import coarsest

pytestmark = pytest.mark.slow


def test_reference_of_the_suite_agrees_with_the_slow_bed():
    law = jl.JointLaw(
        orientation=jl.Orientation(4.0, 0.5, 0.1),
        asperity=jl.Asperity(K=1.0, lam=1.2, eta=0.5, mu=0.5),
        asperity_density=1.0,
        closure_range=1.0,
    )
    suite = standard_suite(law)
    paths = np.moveaxis(np.cumsum(suite.d, axis=0), 1, 0)
    F = np.stack([SlowBed(law, path, 6, 16, 120).follow()[0] for path in paths], axis=1)
    # the bed's own orientations (0.12 % here) and springs, and the reference's uncertainty
    assert errors(F, suite.F).max() < 2.5e-3
    assert suite.uncertainty[: len(paths)].max() < 5e-4
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
    coarse, fine = (errors(F, found[-1])[0] for F in found[:2])
    assert fine < 6e-4
    assert coarse > 2.8 * fine  # second order: 4; it is 2 where the cells end with the range


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
    assert fine.miss(replace(law, resolution=found)).largest.max() < 1.5 * bound


def test_what_cannot_be_met_is_refused_with_what_was_reached():
    law = replace(jl.presets.load("linear-a6"), plane=0.0)
    with pytest.raises(ValueError, match=r"tolerance = 1e-07 cannot be met .* was reached"):
        law.at_tolerance(1e-7)


@pytest.mark.parametrize("name", ["westerly-smooth", "biegel-rough", "nonlinear-a6"])
def test_tolerances_are_kept_on_paths_never_seen(name):
    law = replace(jl.presets.load(name), plane=0.0)
    corners = random_corners(np.random.default_rng(2), 6)[:, :, :2]
    d = np.ascontiguousarray(np.moveaxis(increments(law.closure_range * corners, 20), 1, 0))
    truth = tractions(replace(law, resolution=reference_resolution(law)), d)
    sliders = []
    for tolerance in (0.05, 0.02):
        made = law.at_tolerance(tolerance)
        assert replace(made, resolution=law.resolution) == law
        sliders.append(made.resolution.sliders)
        ratio = errors(tractions(made, d), truth) / tolerance
        # never twice the tolerance, and on these six paths the tolerance but for one at most
        assert ratio.max() < 2.0
        assert np.sort(ratio)[-2] <= 1.0
    assert sliders == sorted(sliders)


def test_closure_only_takes_closures_alone():
    law = replace(jl.presets.load("westerly-rough"), closure_only=True)
    made = law.at_tolerance(0.01)
    assert made.closure_only
    assert made == law.at_tolerance(0.01)
    assert [p.error.shape for p in law.tradeoff(["fast"], joints=0).rows] == [(4,)]


@pytest.mark.parametrize("name", ["westerly-smooth", "nonlinear-a6"])
def test_tolerances_are_kept_at_all_stresses_of_a_range(name):
    """Cells for the closure range alone err by up to 17 % within a hundredth of it."""
    law = replace(jl.presets.load(name), plane=0.0)
    stress = (1e4, 5e6)
    made = law.at_tolerance(0.02, stress=stress)
    assert made.closure_range == pytest.approx(law.closure(5e6), rel=1e-12)
    corners = random_corners(np.random.default_rng(2), 12)[:, :, :2]
    for most in np.geomspace(*stress, 5):
        near = replace(law, closure_range=float(law.closure(most)))
        d = np.moveaxis(increments(near.closure_range * corners, 20), 1, 0)
        truth = tractions(replace(near, resolution=reference_resolution(near)), d)
        assert errors(tractions(made, d), truth).max() <= 0.02
