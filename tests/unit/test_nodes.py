"""Places of the nodes: quadrature exact where it says so, cells where the curve asks for them."""

import tracemalloc

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.discretisation.facets import facets
from jointlaw.discretisation.nodes import azimuths, depth_nodes, inclinations
from jointlaw.discretisation.virgin_curve import virgin_curve


@pytest.mark.parametrize("b", [-1.0, 0.5, 2.0])
@pytest.mark.parametrize(
    ("count", "root"), [(1, 1), (2, 2), (3, 3), (5, 3), (7, 3), (8, 1), (40, 1)]
)
def test_inclinations_integrate_the_density_exactly(b, count, root):
    u, share = inclinations(b, count)
    assert (np.diff([0.0, *u, 1.0]) > 0).all()
    assert (share > 0).all()
    # a Gauss rule in v, u = v^root: exact to the degree 2 count - 1 of v
    power = np.arange(min(2 * count, 12)) / root
    exact = (1 - b / 2) / (power + 1) + 1.5 * b / (power + 3)
    found = (share[:, None] * u[:, None] ** power).sum(axis=0)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-13)  # rounding of the recurrence


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
    """sqrt(Phi''/Phi) ~ 1/y from the lowest closure on: errors are the same shares of all loads."""
    curve, lowest = virgin_curve(0.5, None), 1e-2
    (nodes,) = depth_nodes(curve, 2.0, np.zeros(1), np.array([30]), lowest)
    inner = nodes[nodes > 2.0 * lowest][:-1]
    ratio = inner[1:] / inner[:-1]
    assert len(inner) > 15
    assert np.ptp(ratio) < 0.01 * ratio[0]  # summed over panels
    usual = depth_nodes(curve, 2.0, np.zeros(1), np.array([30]))
    assert np.count_nonzero(nodes < 0.1) > 2 * np.count_nonzero(usual < 0.1)


def test_memory_goes_with_the_number_of_facets(make_law):
    """Of 3660 facets; their distances from each other would be 300 MB."""
    tracemalloc.start()
    make_law(resolution=jl.Resolution(60, 60, 1), plane=0.0).joint()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 20e6
