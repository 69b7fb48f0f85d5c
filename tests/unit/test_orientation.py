"""The density of asperity orientations: Eq. 14 to 18."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate

import jointlaw as jl
from jointlaw.discretisation.facets import facets

extents, shapes, shares = st.floats(1.0, 20.0), st.floats(-1.0, 2.0), st.floats(-1.0, 1.0)


def orientation(a, b, share=0.0):
    return jl.Orientation(a, b, share * (1 / 3 - b / 6))


def over_cap(o, f):
    """int f(theta, phi) density sin(theta) over the cap by scipy; the azimuth has period pi."""
    end = math.pi / (2 * o.a)
    # 40 midpoints integrate the second harmonic of phi exactly
    phi = (np.arange(40) + 0.5) * math.pi / 20
    inner = lambda t: math.sin(t) * np.mean(o.density(t, phi) * f(t, phi)) * 2 * math.pi  # noqa: E731
    return integrate.quad(inner, 0.0, end, epsabs=1e-13, epsrel=1e-12)[0]


@given(a=extents, b=shapes, share=shares)
def test_density_integrates_to_one(a, b, share):
    assert over_cap(orientation(a, b, share), lambda t, p: 1.0) == pytest.approx(1.0, abs=1e-10)


@given(a=extents, b=shapes, share=shares)
def test_mean_and_variance_are_eq_17(a, b, share):
    o = orientation(a, b, share)
    mean = over_cap(o, lambda t, p: t)
    assert o.mean == pytest.approx(mean, rel=1e-10)
    # 1e-8: the printed variance is a difference of numbers ten times its size
    assert o.variance == pytest.approx(over_cap(o, lambda t, p: (t - mean) ** 2), rel=1e-8)


def test_printed_mean_inclinations():
    """Section 4.1: 19 degrees for a = 3, 10 degrees for a = 6."""
    assert round(math.degrees(jl.Orientation(3.0).mean)) == 19
    assert round(math.degrees(jl.Orientation(6.0).mean)) == 10


@given(a=extents, b=shapes)
def test_from_moments_returns_the_moments(a, b):
    o = jl.Orientation(a, b)
    back = jl.Orientation.from_moments(o.mean, o.variance)
    # 1e-9: where two values of b nearly coincide (b = 1.4), b itself is known to half the digits
    assert back.mean == pytest.approx(o.mean, rel=1e-9)
    assert back.variance == pytest.approx(o.variance, rel=1e-9)


@given(a=extents, b=shapes, share=shares)
def test_density_is_never_negative(a, b, share):
    o = orientation(a, b, share)
    theta, phi = np.meshgrid(np.linspace(0, math.pi / (2 * a), 60), np.linspace(0, math.pi, 60))
    assert o.density(theta, phi).min() >= -1e-12 * a * a


@pytest.mark.parametrize(
    ("b", "share", "u", "phi"),
    [
        (-1.0, 0.0, 1.0, 0.0),  # at the joint normal
        (2.0, 0.0, 0.0, 0.0),  # at the rim
        (0.5, 1.0, 0.0, math.pi / 2),
        (0.5, -1.0, 0.0, 0.0),
    ],
)
def test_bounds_of_eq_18_touch_zero(b, share, u, phi):
    a = 2.5
    o, theta = orientation(a, b, share), math.acos(u) / a
    assert o.density(theta, phi) == pytest.approx(0.0, abs=1e-12)
    inside = orientation(a, 0.9 * b, 0.9 * share)
    assert inside.density(theta, phi) > 1e-3


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
