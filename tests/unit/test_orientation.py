"""The density of asperity orientations: Eq. 14 to 18."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl
from jointlaw.discretisation.facets import facets

extents, shapes, shares = st.floats(1.0, 20.0), st.floats(-1.0, 2.0), st.floats(-1.0, 1.0)


def orientation(a, b, share=0.0):
    return jl.Orientation(a, b, share * (1 / 3 - b / 6))


@given(a=extents, b=shapes)
def test_from_moments_returns_the_moments(a, b):
    o = jl.Orientation(a, b)
    back = jl.Orientation.from_moments(o.mean, o.variance)
    # 1e-9: where two values of b nearly coincide (b = 1.4), b itself is known to half the digits
    assert back.mean == pytest.approx(o.mean, rel=1e-9)
    assert back.variance == pytest.approx(o.variance, rel=1e-9)


@given(a=extents, b=shapes, share=shares, u=st.integers(2, 6), phi=st.integers(3, 8),
       plane=st.none() | st.floats(-4, 4))  # fmt: skip
def test_facets(a, b, share, u, phi, plane):
    f = facets(orientation(a, b, share), u, phi, plane)
    dim = 3 if plane is None else 2
    assert f.n.shape == f.s.shape == f.t.shape == (dim, len(f.weight))
    assert len(f.weight) <= u * (2 * phi if plane is None else phi + 1)
    assert f.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert (f.weight >= 0).all()
    assert (f.n[0] > 0).all()
    if plane is None:
        basis = np.stack([f.n, f.s, f.t])
        product = np.einsum("idm,jdm->ijm", basis, basis)
        np.testing.assert_allclose(product, np.eye(3)[:, :, None] + 0 * product, atol=1e-14)
