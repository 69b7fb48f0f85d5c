"""Where the numbers end, the law says so when it is built; just inside, everything holds."""

import pytest
from extremes.checks import run
from extremes.laws import SCALE, build, name

pytestmark = pytest.mark.slow

BEYOND = [
    {"K": 1e300}, {"density": 1e300}, {"K": 1e200, "density": 1e200}, {"mu": 1e300}, {"lam": 1e300},
    {"K": 1e-300}, {"K": 5e-324}, {"lam": 1e-300}, {"range": 1e300}, {"eta": 1e300},
    {"range": None, "K": 1e300}, {"range": None, "K": 1e-300},
]  # fmt: skip
INSIDE = [
    {"K": 1e100}, {"density": 1e110}, {"K": 1e-120}, {"mu": 1e100}, {"lam": 1e60}, {"eta": 50.0},
    {"eta": 1e3}, {"a": 1e300}, {"range": 5e-324},
    {"heights": (3.82, 1.15e-12, 0.0, "individual")},
    {"heights": (3.82, 1.15e-12, 2e-6, "population")},
    {"heights": (3.82, 1e-300, 0.0, "individual")},
    {"heights": (3.82, 1e300, 0.0, "individual")},
    {"heights": (3.82, 1.15e-6, 1e300, "individual")},
    {"heights": (-1.0 + 1e-15, 1.15e-6, 2e-6, "individual")},
    {"heights": (-1.0 + 1e-15, 1.15e-6, 0.0, "individual")},
    {"heights": (-0.7, 1e-30, 0.0, "individual")},
    {"heights": (1e9, 1e-15, 1e-6, "individual")},
]  # fmt: skip


@pytest.mark.parametrize("changes", BEYOND, ids=name)
def test_numbers_that_no_float_can_hold_are_refused(changes):
    with pytest.raises(ValueError, match=r"asperity.K = .* too (small|large) for floating point"):
        build(**changes)


@pytest.mark.parametrize("formation", ["individual", "population"])
def test_a_density_that_is_infinite_just_short_of_the_point_of_contact_is_refused(formation):
    """A millionth of a millionth of the heights: not for mathematics, but give 0 and it works."""
    with pytest.raises(ValueError, match=r"cannot be tabulated: .* begin them exactly there"):
        build(heights=(-0.9, 1.15e-6, 1e-18, formation))
    build(heights=(-0.9, 1.15e-6, 0.0, formation))


@pytest.mark.parametrize("changes", INSIDE, ids=name)
def test_just_inside_everything_holds(changes):
    law = build(**changes)
    size = min(SCALE, 1e-6 * law.largest_reach)
    assert not run(law, size, 1, n=6, steps=12)
