"""Parameters are values: what laws share is read-only, equal laws have one fingerprint."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl
from jointlaw.parameters.resolution import named


def test_tables_that_laws_share_are_not_writeable(any_law):
    """The virgin curve and the inclinations outlive the law: a later law reads the same arrays."""
    k = any_law.tables.asperities
    for shared in () if k is None else (k.curve, vars(k).values(), vars(any_law.facets).values()):
        for array in shared:
            if isinstance(array, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    array[...] *= 2


@given(a=st.floats(1.0, 20.0), b=st.floats(-1.0, 2.0))
def test_an_orientation_has_the_moments_that_it_is_made_from(a, b):
    o = jl.Orientation(a, b)
    back = jl.Orientation.from_moments(o.mean, o.variance)
    # 1e-9: where two values of b nearly coincide (b = 1.4), b itself is known to half the digits
    assert (back.mean, back.variance) == pytest.approx((o.mean, o.variance), rel=1e-9)


def test_equal_laws_have_one_fingerprint(make_law):
    """-0.0 == 0.0: a state goes from one to the other."""
    one, other = make_law(c=0.0), make_law(c=-0.0)
    assert (one, one.fingerprint) == (other, other.fingerprint)
    one.joint().restore(other.joint().snapshot())


@pytest.mark.parametrize("name", ["fast", "balanced", "fine", "reference"])
def test_the_mating_length_chooses_the_nodes(make_law, name):
    """Its own depth cells and facets; a file holds the name, not the nodes."""
    for ratio, chosen in ((2.4, named(2.4)), (2.6, named()), (101.0, named(101.0))):
        law = make_law(resolution=name, closure_range=1e-6, mating_length=ratio * 1e-6)
        assert law.resolution == chosen[name]
        assert len(law.facets.theta) == len(law.tables.asperities.c1)
        assert (f'resolution = "{name}"' in law.to_toml()) == (name != "balanced")
        assert jl.JointLaw.from_text(law.to_toml()) == law
    assert (named(2.4)[name] != named()[name]) == (name in ("fast", "balanced"))
    assert (named(101.0)[name] != named()[name]) == (name == "fine")


def test_the_default_closure_range_is_the_same_for_every_resolution(make_law):
    fine, balanced = (make_law(closure_range=None, resolution=r) for r in ("fine", "balanced"))
    again = dataclasses.replace(balanced, resolution="fine")
    assert fine == again
    again.joint().restore(fine.joint().snapshot())
    # three rings against five: the law's own facets are not those of the default
    assert fine.closure(20e6) == pytest.approx(fine.closure_range, rel=0.02)


def test_linear_asperities_have_the_stiffness_given(make_law):
    asperity = jl.Asperity.linear(kn=3e5, ks=2e5, mu=0.4)
    law = make_law(
        K=asperity.K, lam=asperity.lam, eta=asperity.eta, mu=0.4, heights=None, a=1e6, b=0, c=0
    )
    _, C = law.joint().update([1e-7, 0.0, 0.0])  # nearly flat: every facet faces the joint normal
    # 1e-9: inclinations up to pi/2e6 rad leave errors of their square
    np.testing.assert_allclose(np.diag(C), 1e10 * np.array([3e5, 2e5, 2e5]), rtol=1e-9)
