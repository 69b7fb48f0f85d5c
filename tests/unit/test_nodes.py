"""Nodes of a resolution: quadrature exact where it says so, cells where the curve asks for them.
The price list's table and frontier. Nothing is timed here."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.accuracy.slip import LEG, distance, slip
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tradeoff import _time
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


@pytest.fixture(scope="module")
def found():
    """Against a reference of fewer nodes than usual, for the time it takes."""
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


def test_each_resolution_has_its_price(found):
    assert [row.sliders for row in found.rows] == [4, 20, 34]
    assert {len(found.paths), len(found.uncertainty), *(row.error.size for row in found.rows)} == {
        9
    }
    for row in found.rows:
        assert row.error.shape == (9,)
        assert row.bytes >= 8 * (2 * row.sliders + 4)
        assert np.isnan(row.ns)
        # each is coarser than the reference by far
        assert row.worst > found.uncertainty.max()
    # more of everything, less error
    for name in ("worst", "friction", "dilation"):
        one, fast, balanced = [getattr(row, name) for row in found.rows]
        assert one > fast > balanced > 0.0, name


def test_slip_tells_friction_and_dilation_along_its_way(make_law):
    """At half the stress, across the axis of c, there and back: as a test of one joint says."""
    law = make_law(5.0, 0.0, 0.3, resolution="fast")
    told = slip(law, law.closure_range, 1e6, np.array([[0.5, 90.0, 1.0]]))
    far = distance(law.mating_length, law.closure_range)
    record = jl.direct_shear(law.joint(), [far, 0.0], 5e5, azimuth=np.pi / 2, steps=400)
    tangents = [
        *(record.shear_stress[[400, 800]] / 5e5 * [1, -1]),
        (record.closure[399] - record.closure[400]) / (far / 400),
    ]
    assert [*told.friction[[LEG - 1, -1], 0], told.dilation[LEG - 1, 0]] == pytest.approx(
        np.degrees(np.arctan(tangents)), abs=0.1
    )


def test_the_frontier_falls(found):
    frontier = found.frontier()
    assert [row.sliders for row in frontier] == sorted({row.sliders for row in frontier})
    assert (np.diff([row.worst for row in frontier]) < 0).all()
    assert frontier[0].sliders == 4
    same = replace(frontier[0], sliders=5, error=(1 - 1e-9) * frontier[0].error)
    assert replace(found, rows=(*found.rows, same)).frontier() == frontier
    assert any(line.endswith(" fast") for line in str(found).splitlines())


def test_a_joint_that_only_closes_has_the_paths_that_do_not_shear(make_law):
    suite = standard_suite(make_law(closure_only=True), jl.Resolution(4, 4, 8))
    assert suite.names == ("closure", "re-contact", "walk", "weave")
    assert suite.d.shape[1:] == (4, 1)


@pytest.mark.parametrize("tangent", [False, True])
def test_a_time_is_that_of_one_joint_in_nanoseconds(law, tangent):
    """An update of three joints takes more than a microsecond and less than seconds."""
    assert 1e2 < _time(law, 3, tangent, 0.0) < 1e9
