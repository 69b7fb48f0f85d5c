"""Nodes of a resolution: exact quadrature, cells graded by the curve. Cost and error.

No test depends on a timing.
"""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.accuracy.slip import STEPS_PER_LEG, max_slip, run_slip_tests
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tradeoff import _time_update
from jointlaw.discretisation.facets import facets
from jointlaw.discretisation.first_loading_curve import first_loading_curve
from jointlaw.discretisation.nodes import azimuths, cell_limits, inclinations


@pytest.mark.parametrize("b", [-1.0, 0.5, 2.0])
@pytest.mark.parametrize(
    ("count", "root"), [(1, 1), (2, 2), (3, 3), (5, 3), (7, 3), (8, 1), (40, 1)]
)
def test_inclinations_integrate_the_density_exactly(b, count, root):
    u, weight = inclinations(b, count)
    assert (np.diff([0.0, *u, 1.0]) > 0).all()
    assert (weight > 0).all()
    # a Gauss rule in v, u = v^root: exact to the degree 2 count - 1 of v
    power = np.arange(min(2 * count, 12)) / root
    exact = (1 - b / 2) / (power + 1) + 1.5 * b / (power + 3)
    moments = (weight[:, None] * u[:, None] ** power).sum(axis=0)
    np.testing.assert_allclose(moments, exact, rtol=0, atol=1e-13)  # rounding of the recurrence


@pytest.mark.parametrize(("phi", "flattest"), [(3, 3), (4, 4), (9, 4), (24, 12)])
def test_azimuths_are_exact_for_the_harmonics_of_c(phi, flattest):
    numbers = azimuths(6, phi)
    assert (numbers[0], numbers[-1]) == (phi, flattest)
    assert numbers == sorted(numbers, reverse=True)
    assert phi % 4 or {n % 2 for n in numbers} == {0}
    for plane in (None, 0.0):
        f = facets(jl.Orientation(3.0, 0.3, 0.0), 6, phi, plane)
        assert f.weight.sum() == pytest.approx(1.0, abs=1e-14)
        # cos 2 phi of the density times cos 2 phi of the stiffness
        harmonics = np.cos(np.outer([1, 2, 3, 4], f.phi)) @ f.weight
        np.testing.assert_allclose(harmonics, 0.0, atol=1e-14)


def test_cells_for_small_loads_are_a_geometric_grading():
    """sqrt(Phi''/Phi) ~ 1/y from the lowest closure on: relative errors of all loads are equal."""
    curve = first_loading_curve(0.5, None)
    lowest = 1e-2
    (nodes,) = cell_limits(curve, 2.0, np.zeros(1), np.array([30]), lowest)
    inner = nodes[nodes > 2.0 * lowest][:-1]
    ratio = inner[1:] / inner[:-1]
    assert len(inner) > 15
    assert np.ptp(ratio) < 0.01 * ratio[0]  # summed over panels
    usual = cell_limits(curve, 2.0, np.zeros(1), np.array([30]))
    assert np.count_nonzero(nodes < 0.1) > 2 * np.count_nonzero(usual < 0.1)


def test_memory_is_proportional_to_the_number_of_facets(make_law):
    """3660 facets; a matrix of their distances would take 300 MB."""
    tracemalloc.start()
    make_law(resolution=jl.Resolution(60, 60, 1), plane=0.0).joint()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


@pytest.fixture(scope="module")
def measured():
    """Cost and error of three resolutions, with a coarse reference to save time."""
    law = jl.JointLaw(
        orientation=jl.Orientation(6.0),
        asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3),
        asperity_density=1e10,
        plane=0.0,
    )
    with pytest.MonkeyPatch.context() as patch:
        name = "jointlaw.accuracy.suite.reference_resolution"
        patch.setattr(name, lambda law: jl.Resolution(8, 12, 24))
        return law.tradeoff(["fast", "balanced", jl.Resolution(1, 3, 1), "fast"], joints=0)


def test_each_resolution_has_cost_and_error(measured):
    assert [row.sliders for row in measured.rows] == [4, 20, 34]
    assert len(measured.paths) == len(measured.uncertainty) == 9
    for row in measured.rows:
        assert row.traction_error.shape == (9,)
        assert row.bytes_per_joint >= 8 * (2 * row.sliders + 4)
        assert np.isnan(row.update_ns)
        # each is much coarser than the reference
        assert row.max_error > measured.uncertainty.max()
    # more nodes, smaller errors
    for name in ("max_error", "friction_error", "dilation_error"):
        coarsest, fast, balanced = [getattr(row, name) for row in measured.rows]
        assert coarsest > fast > balanced > 0.0, name


def test_slip_tests_agree_with_direct_shear(make_law):
    """At half the stress, across the axis of c, forwards and back."""
    law = make_law(5.0, 0.0, 0.3, resolution="fast")
    results = run_slip_tests(law, law.closure_range, 1e6, np.array([[0.5, 90.0, 1.0]]))
    farthest = max_slip(law.mating_length, law.closure_range)
    record = jl.direct_shear(law.joint(), [farthest, 0.0], 5e5, azimuth=np.pi / 2, steps=400)
    tangents = [
        *(record.shear_stress[[400, 800]] / 5e5 * [1, -1]),
        (record.closure[399] - record.closure[400]) / (farthest / 400),
    ]
    last = STEPS_PER_LEG - 1
    angles = [*results.friction[[last, -1], 0], results.dilation[last, 0]]
    assert angles == pytest.approx(np.degrees(np.arctan(tangents)), abs=0.1)


def test_errors_on_the_pareto_front_decrease(measured):
    front = measured.pareto_front()
    assert [row.sliders for row in front] == sorted({row.sliders for row in front})
    assert (np.diff([row.max_error for row in front]) < 0).all()
    assert front[0].sliders == 4
    equal_error = (1 - 1e-9) * front[0].traction_error
    equal = replace(front[0], sliders=5, traction_error=equal_error)
    assert replace(measured, rows=(*measured.rows, equal)).pareto_front() == front
    assert any(line.endswith(" fast") for line in str(measured).splitlines())


def test_a_law_of_closure_only_has_the_paths_without_shear(make_law):
    suite = standard_suite(make_law(closure_only=True), jl.Resolution(4, 4, 8))
    assert suite.names == ("closure", "re-contact", "walk", "weave")
    assert suite.d.shape[1:] == (4, 1)


@pytest.mark.parametrize("tangent", [False, True])
def test_times_are_per_joint_in_nanoseconds(law, tangent):
    """An update of three joints takes more than a microsecond and less than seconds."""
    assert 1e2 < _time_update(law, 3, tangent, 0.0) < 1e9
