"""The density of asperity orientations: Eq. 14 to 18."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl


@given(a=st.floats(1.0, 20.0), b=st.floats(-1.0, 2.0))
def test_from_moments_returns_the_moments(a, b):
    o = jl.Orientation(a, b)
    back = jl.Orientation.from_moments(o.mean, o.variance)
    # 1e-9: where two values of b nearly coincide (b = 1.4), b itself is known to half the digits
    assert back.mean == pytest.approx(o.mean, rel=1e-9)
    assert back.variance == pytest.approx(o.variance, rel=1e-9)
