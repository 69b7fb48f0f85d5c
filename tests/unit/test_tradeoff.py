"""The price list: its table and frontier. Nothing is timed here."""

from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tradeoff import _time

CHOSEN = ["fast", "balanced", jl.Resolution(1, 3, 1), "fast"]


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
        return law.tradeoff(CHOSEN, joints=0)


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
