"""Section 2, surface geometry: heights (Eq. 11-13) and orientations (Eq. 14-18, Fig. 5 and 7)."""

import math

import numpy as np
import pytest
from builders import directions, shapes
from scipy.integrate import quad

import jointlaw as jl

ROUNDING = 1e-12  # of sums of some hundred terms of order one


@pytest.mark.parametrize(
    ("name", "mean"), [("westerly-smooth", 1.15e-6 * 4.82), ("westerly-rough", 3.52e-6 * 7.14)]
)
def test_heights(name, mean):
    """Eq. 11: asperities in contact are N_r = int_0^r N H dr
    Holds: `law.contacts` is this integral to 1e-10

    Eq. 13: mean height beta (alpha + 1), variance beta^2 (alpha + 1)
    Holds: means 5.54 µm (smooth) and 25.13 µm (rough)
    """
    law = jl.presets.load(name)
    heights = law.heights
    for closure in (0.0, 1e-7, 5e-6):
        fraction, _ = quad(heights.pdf, 0.0, heights.overlap + closure, epsrel=1e-12)
        assert law.contacts(closure) == pytest.approx(law.asperity_density * fraction, rel=1e-10)
    r = np.linspace(0.0, 80.0, 40001)[1:] * heights.beta
    mass = heights.pdf(r) * r[0]  # the density vanishes smoothly at both ends: 1e-8
    assert [mass @ r, heights.mean] == pytest.approx([mean, mean], rel=1e-8)
    assert mass @ (r - mean) ** 2 == pytest.approx(heights.variance, rel=1e-8)


def test_density_and_its_moments():
    """Eq. 14: the sentence before it says 0 <= theta <= 2pi/a, the equation pi/(2a)
    Misprint: over 2pi/a the density sums to 0 (b = c = 0), over pi/(2a) to 1

    Eq. 15: the density of orientations integrates to 1
    Holds: to rounding, at 100 random a, b, c

    Eq. 17: mean and variance of the inclination
    Holds: to rounding, at 100 random a, b, c
    """
    assert quad(lambda x: 2 * math.sin(2 * x), 0.0, math.pi)[0] == pytest.approx(0.0, abs=1e-12)
    for o in shapes(100):
        n, weight = directions(o.a, o.b, o.c)
        theta = np.arccos(n[0])
        mean = (theta * weight).sum()
        exact = 1.0, mean, ((theta - mean) ** 2 * weight).sum()
        assert (weight.sum(), o.mean, o.variance) == pytest.approx(exact, abs=ROUNDING)


def test_contacts_by_direction():
    """Eq. 16: N_Omega = N_r xi(Omega) dOmega
    Holds: `law.contacts` of a direction is N_r times the density, which integrates to 1
    """
    law = jl.presets.load("jing-replica")
    direction = (0.3, 0.7)
    xi = law.orientation.density(*direction)
    assert law.contacts(3e-4, direction) == pytest.approx(law.contacts(3e-4) * xi, rel=ROUNDING)


@pytest.mark.parametrize(("b", "c"), [(-1, 0), (-1, 0.5), (0, -1 / 3), (1, 1 / 6), (2, 0)])
def test_bounds_of_b_and_c(b, c):
    """Eq. 18: -1 <= b <= 2 and |c| <= 1/3 - b/6 keep the density >= 0
    Holds: exact, the least density is > 0 inside, 0 on the bounds, < 0 at 1 % outside
    """
    theta, phi = np.meshgrid(np.linspace(0.0, math.pi / 2, 91), np.linspace(0.0, math.pi, 73))
    assert jl.Orientation(1.0, b, c).density(theta, phi).min() == pytest.approx(0.0, abs=ROUNDING)
    assert directions(1.0, 0.99 * b, 0.99 * c)[-1].min() > 0
    assert directions(1.0, 1.01 * b, 1.01 * c)[-1].min() < 0
    with pytest.raises(ValueError, match=r"b = |c = "):
        jl.Orientation(1.0, 1.01 * b, 1.01 * c)


def test_smooth_interface():
    """Section 2.2.2: as a grows the density tends to a delta function
    Holds: the mean inclination is 0.0057° at a = 10⁴

    Section 4.1: mean inclination 19° for a = 3 and 10° for a = 6
    Holds: 19.10° and 9.55°
    """
    mean = [math.degrees(jl.Orientation(a).mean) for a in (3, 6, 1e4)]
    assert mean == pytest.approx([19.10, 9.55, 0.0057], rel=0.01)
    assert jl.Orientation(1e4).variance < 1e-8  # all inclinations are below pi/(2a)


def test_shape_parameters():
    """Fig. 7a, b: extent pi/2 at a = 1 and pi/4 at a = 2
    Holds: no asperity leans more

    Fig. 7a: b = -1 crowds contacts towards the horizon, b = 2 towards the normal
    Holds: share inclined above 45° at a = 1: 0.884 (b = -1), 0.707 (b = 0), 0.354 (b = 2)

    Section 2.2.2: for b = 0 contacts are equally distributed in theta
    One reading: per solid angle at a = 1 only; the density at the axis over the density at the edge
    is 1.000 (a = 1), 1.414 (a = 2), 1.500 (a = 3); uniform in cos aθ for every a

    Fig. 7c: c = 1/3 makes the density anisotropic in azimuth, c = 0 isotropic
    Holds: at θ = 90°, a = 1: 0.318/sr along axis 2, 0 along axis 3; the same for c = 0
    """
    for a, over_edge in ((1, 1.0), (2, math.sqrt(2)), (3, 1.5)):
        axis, edge, outside = jl.Orientation(a).density(math.pi / 2 / a * np.array([0, 1, 1.001]))
        assert (axis / edge, outside) == pytest.approx((over_edge, 0.0), rel=ROUNDING)
    u = math.sqrt(0.5)  # by hand: u + b (u^3 - u)/2 at u = cos 45 deg
    for b, fraction in ((-1, 0.884), (0, 0.707), (2, 0.354)):
        steep_fraction = directions(1.0, b, 0.0, math.pi / 4)[-1].sum()
        assert steep_fraction == pytest.approx(u + b * (u**3 - u) / 2, abs=ROUNDING)
        assert steep_fraction == pytest.approx(fraction, abs=5e-4)
    for c, expected in ((1 / 3, [1 / math.pi, 0.0]), (0.0, [0.5 / math.pi] * 2)):
        density = jl.Orientation(1.0, 0.0, c).density(math.pi / 2, np.array([0.0, math.pi / 2]))
        assert density == pytest.approx(expected, abs=ROUNDING)  # (1 + 3c cos 2 phi)/(2 pi)
