"""The slow bed is checked on its own, against results that need no package."""

import numpy as np
import pytest
from slow_bed import SlowBed, cap_quadrature, reach_of
from slow_virgin import SlowGamma, virgin

pytestmark = pytest.mark.slow

NORMAL, ONE = np.array([[1.0, 0.0, 0.0]]), np.array([1.0])
RULE = {"K": 3.0, "lam": 1.2, "eta": 0.5, "mu": 0.4, "density": 2.0}
HEIGHTS = {
    None: None,
    "population": SlowGamma(3.82, 1.15, 2.0, "population"),
    "individual": SlowGamma(3.82, 1.15, 2.0, "individual"),
}


@pytest.mark.parametrize("heights", HEIGHTS.values(), ids=str)
@pytest.mark.parametrize("eta", [0.0, 0.3, 0.5, 1.0])
def test_virgin_slope_is_the_derivative_of_the_force(heights, eta):
    if eta == 0.0 and heights is not None and heights.formation == "population":
        eta = 0.35  # the printed heights make a convex curve above eta = 0.287 only
    for y in (0.03, 0.4, 1.7):
        h = 1e-4 * y
        points = [virgin(y + i * h, eta, heights)[0] for i in (-2, -1, 1, 2)]
        slope = np.dot(points, [1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
        # fourth-order difference at h/y = 1e-4: rounding, 1e-16/1e-4, is what is left
        assert virgin(y, eta, heights)[1] == pytest.approx(slope, rel=1e-10)


@pytest.mark.parametrize("heights", HEIGHTS.values(), ids=str)
def test_pure_closure_is_the_virgin_curve_on_every_facet(heights):
    n, w = cap_quadrature(2.5, 0.7, 0.1, 6, 12)
    path = np.array([[0.9, 0.0, 0.0], [0.4, 0.0, 0.0], [1.3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    # 80 bins with their last edge at the largest closure, where the curve is met exactly
    bed = SlowBed(n, w, reach_of(path, n), heights=heights, n_depth=80, **RULE)
    for d in np.diff(path, axis=0, prepend=0.0):
        bed.update(d)
        phi = virgin(bed.delta[0], 0.5, heights)[0]
        exact = 2.0 * w * 1.2 * 3.0 * n[:, 0] ** 1.5 * phi
        # trapezoid error of 80 bins inside a bin, relative to the largest force: (1/80)^2
        assert np.allclose(bed.facet_forces()[0], exact, atol=2e-4 * 2.0 * 1.2 * 3.0 * w.max())


def test_constant_closure_follows_equation_35():
    bed = SlowBed(NORMAL, ONE, np.array([1.0]), n_depth=400, **RULE)
    normal = bed.update([1.0, 0.0, 0.0])[0]
    full = RULE["mu"] * RULE["lam"]
    for x in np.linspace(0.05, 1.2, 24):
        shear = bed.update([0.0, x * full - bed.delta[1], 0.0])[1]
        exact = RULE["mu"] * normal * (1.0 - (1.0 - min(x, 1.0)) ** 1.5)
        # Phi'' in 400 bins: second order in the bin, (1/400)^2 and room for the singular end
        assert shear == pytest.approx(exact, abs=2e-5 * normal)
