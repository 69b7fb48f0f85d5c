"""Places of the nodes: quadrature exact where it says so, cells where the curve asks for them."""

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.discretisation.facets import facets
from jointlaw.discretisation.nodes import depth_nodes, inclinations
from jointlaw.discretisation.virgin_curve import virgin_curve


@pytest.mark.parametrize("b", [-1.0, -0.3, 0.0, 0.5, 2.0])
@pytest.mark.parametrize("count", [1, 2, 3, 7, 40])
def test_inclinations_integrate_the_density_exactly(b, count):
    u, share = inclinations(b, count)
    assert (np.diff(u) > 0).all()
    assert u[0] > 0
    assert u[-1] < 1
    assert (share > 0).all()
    power = np.arange(min(2 * count, 12))  # a Gauss rule: exact to the degree 2 count - 1
    exact = (1 - b / 2) / (power + 1) + 1.5 * b / (power + 3)
    found = (share[:, None] * u[:, None] ** power).sum(axis=0)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-13)  # rounding of the recurrence


@pytest.mark.parametrize("plane", [None, 0.0, 0.6])
def test_weights_add_up_at_any_number_of_nodes(plane):
    orientation = jl.Orientation(3.0, 1.2, -0.1)
    for u in (1, 2, 5):
        assert facets(orientation, u, 3, plane).weight.sum() == pytest.approx(1.0, abs=1e-14)


def test_cells_of_a_power_law_are_a_power_grading():
    # sqrt(Phi'') Phi^-0.1 ~ y^-0.4 for Phi = y^1.5: its integral ~ y^0.6
    nodes = depth_nodes(virgin_curve(0.5, None), 2.0, np.array([0.0, 1.0]), 6)
    share = np.arange(1, 6) / (5 + 1.8)
    for zeta, reach in zip(nodes, (2.0, 4.0), strict=True):  # closure, and as much by shear
        assert zeta[0] == 0.0
        assert np.isinf(zeta[-1])
        # summed over 512 panels
        np.testing.assert_allclose(zeta[1:-1], reach * share ** (1 / 0.6), rtol=2e-3)


def test_cells_of_a_curve_without_curvature_are_even():
    nodes = depth_nodes(virgin_curve(0.0, None), 1.0, np.zeros(1), 3)
    np.testing.assert_allclose(nodes[0, 1:3], np.array([1, 2]) / 3.8, rtol=1e-3)


@pytest.mark.parametrize("formation", ["population", "individual"])
def test_cells_rise_and_scale_with_the_unit_of_length(formation):
    slope = np.array([0.0, 0.3, 1e9])
    for cells in (1, 2, 17):
        found = []
        for unit in (1.0, 4.0):
            heights = jl.GammaHeights(3.82, 1.15e-6 * unit, 2e-6 * unit, formation)
            curve = virgin_curve(0.5, heights)
            found.append(depth_nodes(curve, 1e-6 * unit, slope, cells))
        assert (np.diff(found[0], axis=1) > 0).all()
        np.testing.assert_array_equal(found[1][:, :-1], 4.0 * found[0][:, :-1])  # to the bit
