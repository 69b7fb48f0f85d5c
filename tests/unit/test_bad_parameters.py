"""Every parameter out of its bound is refused by name, value and bound."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl

finite = st.floats(allow_nan=False, allow_infinity=False)
not_finite = st.sampled_from([float("nan"), float("inf"), float("-inf")])
no_number = st.sampled_from([None, "1", "inf", "", b"1", True, 1j, [1.0], (1.0, 2.0), {}, object])
GOOD = {
    "orientation": {"a": 3.0, "b": 0.0, "c": 0.0},
    "asperity": {"K": 1.0, "lam": 1.0, "eta": 0.5, "mu": 0.3},
    "heights": {"alpha": 3.82, "beta": 1.0, "overlap": 2.0},
}
KINDS = {"orientation": jl.Orientation, "asperity": jl.Asperity, "heights": jl.GammaHeights}
NAMES = [f"{part}.{name}" for part, values in GOOD.items() for name in values]


def build(path, value):
    part, name = path.split(".")
    return KINDS[part](**(GOOD[part] | {name: value}))


def refused(path, value, bound):
    """The value is refused, and the text holds parameter, value and bound."""
    with pytest.raises(ValueError) as error:
        build(path, value)
    text = str(error.value)
    assert path in text
    assert repr(value) in text
    assert bound in text


@given(a=finite.filter(lambda a: a < 1))
def test_a_below_one(a):
    refused("orientation.a", a, ">= 1")


@given(b=finite.filter(lambda b: not -1 <= b <= 2))
def test_b_outside_eq_18(b):
    refused("orientation.b", b, "-1 <= b <= 2 (Eq. 18)")


@given(b=st.floats(-1, 2), over=st.floats(1e-11, 1e6), sign=st.sampled_from([-1, 1]))
def test_c_outside_eq_18(b, over, sign):
    bound = 1 / 3 - b / 6
    with pytest.raises(ValueError, match=r"orientation\.c = .*\|c\| <= 1/3 - b/6 = .*Eq\. 18"):
        jl.Orientation(3.0, b, sign * (bound + over))


@given(b=st.floats(-1, 2), sign=st.sampled_from([-1, 1]))
def test_c_at_its_bound_is_accepted(b, sign):
    jl.Orientation(3.0, b, sign * (1 / 3 - b / 6))


@pytest.mark.parametrize(
    ("path", "bound"),
    [("asperity.K", 0.0), ("asperity.lam", 0.0), ("heights.beta", 0.0), ("heights.alpha", -1.0)],
)
@given(data=st.data())
def test_strict_lower_bounds(path, bound, data):
    value = data.draw(finite.filter(lambda x: x <= bound))
    refused(path, value, f"> {bound:g}")


@pytest.mark.parametrize("path", ["asperity.eta", "asperity.mu", "heights.overlap"])
@given(value=st.floats(-1e308, -1e-308))
def test_negative(path, value):
    refused(path, value, ">= 0")


@pytest.mark.parametrize("path", NAMES)
@given(value=not_finite)
def test_not_finite(path, value):
    refused(path, value, "finite")


@pytest.mark.parametrize("path", NAMES)
@given(value=no_number)
def test_not_a_number(path, value):
    with pytest.raises(ValueError, match=re.escape(f"{path} = {value!r} is not a number")):
        build(path, value)


def test_a_whole_number_too_large_for_a_float():
    with pytest.raises(ValueError, match=r"orientation\.a"):
        jl.Orientation(10**400)


@pytest.mark.parametrize("value", [0, 0.0, -1e10, float("nan"), float("inf"), "1e10", None])
def test_asperity_density(make_law, value):
    with pytest.raises(ValueError, match=r"asperity_density = .*(> 0|finite|not a number)"):
        make_law(asperity_density=value)


@pytest.mark.parametrize("name", ["closure_range", "critical_slip"])
@pytest.mark.parametrize("value", [0.0, -1e-6, float("nan"), "2um"])
def test_lengths_of_the_law(make_law, name, value):
    with pytest.raises(ValueError, match=f"{name} = "):
        make_law(**{name: value})


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "0", True])
def test_plane(make_law, value):
    with pytest.raises(ValueError, match="plane = "):
        make_law(plane=value)


@pytest.mark.parametrize("value", ["coarse", 3, None, (2, 4, 2), {"u": 2}])
def test_resolution(make_law, value):
    with pytest.raises(ValueError, match=r"resolution = .*fast, balanced, fine, reference"):
        make_law(resolution=value)


@pytest.mark.parametrize(
    "u_phi_depth", [(0, 4, 2), (2, 2, 2), (2, 4, 0), (2.0, 4, 2), (2, 4, True)]
)
def test_resolution_numbers(u_phi_depth):
    with pytest.raises(ValueError, match=r"resolution\.(u|phi|depth) = .*whole number >= \d"):
        jl.Resolution(*u_phi_depth)


@pytest.mark.parametrize("part", ["orientation", "asperity", "heights"])
def test_parts_of_a_wrong_type(law, part):
    values = {name: getattr(law, name) for name in ("orientation", "asperity", "heights")}
    with pytest.raises(ValueError, match=f"{part} = .* must be"):
        jl.JointLaw(**(values | {part: {"a": 3.0}}), asperity_density=1e10)


def test_unknown_formation():
    with pytest.raises(ValueError, match=r"heights\.formation = 'both' .*population, individual"):
        jl.GammaHeights(3.82, 1.15e-6, 2e-6, "both")


@pytest.mark.parametrize(
    ("build_it", "name"),
    [
        (lambda: jl.Asperity.hertz_mindlin(-1.0, 0.2, 1e-5, 0.3), "G"),
        (lambda: jl.Asperity.hertz_mindlin(1e10, 0.6, 1e-5, 0.3), "nu"),
        (lambda: jl.Asperity.hertz_mindlin(1e10, 0.2, 0.0, 0.3), "R"),
        (lambda: jl.Asperity.linear(0.0, 1.0, 0.3), "kn"),
        (lambda: jl.Asperity.linear(1.0, -1.0, 0.3), "ks"),
        (lambda: jl.Asperity.linear(1.0, 1.0, -0.3), "asperity.mu"),
        (lambda: jl.Orientation.from_moments(0.0, 0.01), "mean"),
        (lambda: jl.Orientation.from_moments(0.3, -0.01), "variance"),
        (lambda: jl.Orientation.from_moments(0.3, 10.0), "variance"),
        (lambda: jl.Orientation.from_moments(1e-200, 1e-300), "variance"),
        (lambda: jl.Orientation.from_moments(1e200, 1.0), "variance"),
        (lambda: jl.Orientation.from_moments(1e-300, 1e300), "variance"),
        (lambda: jl.GammaHeights.from_moments(1e-6, float("nan")), "variance"),
    ],
)
def test_other_constructors(build_it, name):
    with pytest.raises(ValueError, match=name):
        build_it()


@pytest.mark.parametrize("n", [-1, 2.0, "3", None, True])
def test_size_of_a_batch(law, n):
    with pytest.raises(ValueError, match="n = "):
        law.joints(n)
    with pytest.raises(ValueError, match="n = "):
        law.joints(2).resize(n)


@pytest.mark.parametrize("method", ["normal_stress", "closure", "contacts", "max_stiffness"])
@pytest.mark.parametrize("value", [float("nan"), [1e-7, float("inf")], "1um", None])
def test_arguments_of_the_virgin_curve(law, method, value):
    with pytest.raises(ValueError, match=r"(closure|normal_stress) = "):
        getattr(law, method)(value)


@pytest.mark.parametrize(
    "ask",
    [
        lambda law, u: law.normal_stress(u),
        lambda law, u: law.normal_stress([1e-7, u]),
        lambda law, u: law.max_stiffness(u),
        lambda law, u: law.critical_time_step(1, 1, u),
        lambda law, u: jl.secant(law, [u, 0, 0]),
        lambda law, u: jl.secant(law, [0, -u, 0]),
    ],
)
def test_closures_whose_forces_overflow(law, ask):
    """Beyond `largest_reach` a number would be infinite, or next to it: refused."""
    ask(law, 0.9 * law.largest_reach)
    for value in (1.1 * law.largest_reach, 1e300):
        with pytest.raises(ValueError, match=r"(closure|delta) = .* is out of bounds.*overflow"):
            ask(law, value)


@pytest.mark.parametrize("delta", [["1e-6", "0", "0"], [True, False, False], [1e-6, np.nan, 0]])
def test_displacements_of_the_total_form(law, delta):
    with pytest.raises(ValueError, match="delta = "):
        jl.secant(law, delta)


@pytest.mark.parametrize("direction", [(np.nan, 0.0), (0.1, np.inf), ("0.1", 0.0)])
def test_directions(law, direction):
    with pytest.raises(ValueError, match=r"(theta|phi) = "):
        law.contacts(1e-6, direction)


@pytest.mark.parametrize(
    "ask",
    [
        lambda shape: jl.closed_form.elastic(shape, 1, 1),
        lambda shape: jl.closed_form.inelastic(shape, 1, 1, 0.1),
        lambda shape: jl.closed_form.inelastic(shape, 1, 1, 1e3),  # where nothing slides
        jl.closed_form.inclination,
    ],
)
@pytest.mark.parametrize(
    ("shape", "name"),
    [((0.5,), "a"), ((np.nan,), "a"), ((3.0, 7.0), "b"), ((3.0, 0.0, 0.4), "c")],
)
def test_shapes_of_the_closed_forms(ask, shape, name):
    with pytest.raises(ValueError, match=rf"orientation\.{name} = "):
        ask(jl.closed_form.Shape(*shape))


def test_negative_normal_stress_has_no_closure(law):
    with pytest.raises(ValueError, match=r"normal_stress = -1\.0 .* >= 0"):
        law.closure(-1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"yield_interference": 0.0}, "asperity.yield_interference = 0.0 is out of bounds"),
        ({"yield_interference": -1e-6}, "asperity.yield_interference = -1e-06 is out of bounds"),
        ({"yield_interference": float("nan")}, "asperity.yield_interference = nan"),
        ({"mu_residual": 0.1, "wear_slip": 0.0}, "asperity.wear_slip = 0.0 is out of bounds"),
        ({"mu_residual": 0.1, "wear_slip": float("nan")}, "asperity.wear_slip = nan"),
        ({"mu_residual": 0.4, "wear_slip": 1.0}, "asperity.mu_residual = 0.4 .* <= mu = 0.3"),
        ({"mu_residual": 0.0, "wear_slip": 1.0}, "asperity.mu_residual = 0.0 is out of bounds"),
        ({"mu_residual": 0.1}, "give both or neither"),
        ({"wear_slip": 1.0}, "give both or neither"),
    ],
)
def test_yielding_and_wear_out_of_bounds(changes, message):
    with pytest.raises(ValueError, match=message):
        jl.Asperity(**GOOD["asperity"], **changes)


def test_a_stress_that_yielding_asperities_never_reach():
    asperity = jl.Asperity(1e9, 1.0, 0.0, 0.3, yield_interference=1e-6)
    law = jl.JointLaw(orientation=jl.Orientation(3.0), asperity=asperity, asperity_density=1e6)
    with pytest.raises(ValueError, match="beyond any closure"):
        law.closure(1e12)
