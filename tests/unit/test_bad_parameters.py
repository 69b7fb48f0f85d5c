"""Every parameter out of its bound is refused by name, value and bound."""

import re

import kinds
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl

GOOD = kinds.make_law(bond=jl.Bond(2e9, 1e9, 1e6, 3e6, 300.0, 5000.0))
NAN, INF = float("nan"), float("inf")
NO_NUMBERS = ["1", "", b"1", True, 1j, [1.0], {}, object, NAN, 10**400]


@pytest.mark.parametrize(
    "name", [name for name, (_, _, said) in kinds.PARAMETERS.items() if said.kind is float]
)
def test_what_is_no_finite_number(name):
    (law, _), (_, path, said) = kinds.off_default(name), kinds.PARAMETERS[name]
    for no_number in NO_NUMBERS if said.infinite else [*NO_NUMBERS, INF, -INF]:
        with pytest.raises(ValueError, match=rf"{path} = .* is not (a number|finite)"):
            kinds.with_value(law, path, no_number)


@pytest.mark.parametrize(
    ("path", "value", "bound"),
    [
        ("orientation.a", 0.999, ">= 1"),
        ("orientation.b", 2.001, "-1 <= b <= 2 (Eq. 18)"),
        ("orientation.b", -1.001, "-1 <= b <= 2 (Eq. 18)"),
        ("asperity.K", 0.0, "> 0"),
        ("asperity.lam", 0.0, "> 0"),
        ("asperity.eta", -1e-308, ">= 0"),
        ("asperity.mu", -1e-308, ">= 0"),
        ("asperity.yield_interference", 0.0, "> 0"),
        ("heights.alpha", -1.0, "> -1"),
        ("heights.beta", 0.0, "> 0"),
        ("heights.overlap", -1e-308, ">= 0"),
        ("heights.formation", "both", "population, individual"),
        ("bond.normal_stiffness", -1.0, ">= 0 and <= 1e+100"),
        ("bond.normal_stiffness", 0.0, "> 0, for bond.tension = 1000000.0 Pa"),
        ("bond.shear_stiffness", 0.0, "> 0, for bond.cohesion = 3000000.0 Pa"),
        ("bond.tension", -1e-308, ">= 0"),
        ("bond.cohesion", 1e101, "<= 1e+100"),
        ("bond.energy_I", 249.9, ">= 250, the elastic energy at the peak"),
        ("bond.energy_II", 4499.0, ">= 4500"),
        ("asperity_density", 0.0, "> 0"),
        ("asperity_density", "1e10", "not a number"),
        ("closure_range", -1e-6, "> 0"),
        ("mating_length", NAN, "not finite"),
        ("mating_length", 1e-12, "0.1 closure_range = "),
        ("slope_wear", 1.0, "finite mating_length"),
        ("slope_residual", 1.1, "it must be >= 0 and <= 1"),
        ("plane", INF, "not finite"),
        ("plane", True, "not a number"),
        ("closure_only", 1, "True or False"),
        ("resolution", "coarse", "fast, balanced, fine, reference"),
        ("resolution", (2, 4, 2), "fast, balanced, fine, reference"),
        ("orientation", {"a": 3.0}, "must be of type Orientation"),
        ("asperity", None, "must be of type Asperity"),
        ("heights", {"alpha": 3.0}, "has no overlap, formation"),
        ("bond", {"tension": 1e6}, "must be of type Bond"),
    ],
)
def test_a_value_out_of_bounds(path, value, bound):
    said = re.escape(f"{path} = {value!r}")
    with pytest.raises(ValueError, match=f"{said}.*{re.escape(bound)}"):
        kinds.with_value(GOOD, path, value)


def test_energy_of_a_bond_without_cohesion():
    with pytest.raises(ValueError, match=r"energy_II = 5000.0 .*<= 0"):
        kinds.with_value(GOOD, "bond.cohesion", 0.0)


@given(b=st.floats(-1, 2), over=st.floats(1e-11, 1e6), sign=st.sampled_from([-1, 1]))
def test_c_outside_eq_18(b, over, sign):
    bound = 1 / 3 - b / 6
    jl.Orientation(3.0, b, sign * bound)
    with pytest.raises(ValueError, match=r"orientation\.c = .*\|c\| <= 1/3 - b/6 = .*Eq\. 18"):
        jl.Orientation(3.0, b, sign * (bound + over))


@pytest.mark.parametrize(
    ("more", "given", "told"),
    [
        ({}, {}, "infinite mating_length"),
        ({"closure_only": True, "mating_length": 1e-5}, {}, "closure_only"),
        ({"mating_length": 1e-5}, {"normal_stress": 1e6}, "starts at first touch"),
    ],
)
def test_an_unmated_start_that_there_is_not(make_law, more, given, told):
    for start in (make_law(**more).joint, lambda **kw: make_law(**more).joints(3, **kw)):
        with pytest.raises(ValueError, match=f"mated=False.*{told}"):
            start(mated=False, **given)


@pytest.mark.parametrize(
    ("build_it", "name"),
    [
        (lambda: jl.Asperity.hertz_mindlin(-1.0, 0.2, 1e-5, 0.3), "G"),
        (lambda: jl.Asperity.hertz_mindlin(1e10, 0.6, 1e-5, 0.3), "nu"),
        (lambda: jl.Asperity.linear(0.0, 1.0, 0.3), "kn"),
        (lambda: jl.Orientation.from_moments(0.0, 0.01), "mean"),
        (lambda: jl.Orientation.from_moments(0.3, 10.0), "variance"),
        (lambda: jl.Orientation.from_moments(1e-300, 1e300), "variance"),
        (lambda: jl.GammaHeights.from_moments(1e-6, NAN), "variance"),
    ],
)
def test_other_constructors(build_it, name):
    with pytest.raises(ValueError, match=name):
        build_it()


@pytest.mark.parametrize("method", ["normal_stress", "closure", "contacts", "max_stiffness"])
@pytest.mark.parametrize("value", [NAN, [1e-7, INF], "1um"])
def test_arguments_of_the_virgin_curve(law, method, value):
    with pytest.raises(ValueError, match=r"(closure|normal_stress) = "):
        getattr(law, method)(value)


@pytest.mark.parametrize(
    "ask",
    [
        lambda law, u: law.normal_stress([1e-7, u]),
        lambda law, u: law.max_stiffness(0.0, u),
        lambda law, u: law.critical_time_step(1, 1, u),
        lambda law, u: jl.secant(law, [0, -u, 0]),
    ],
)
def test_closures_whose_forces_overflow(law, ask):
    """Beyond `largest_reach` a number would be infinite, or next to it: refused."""
    ask(law, 0.3 * law.largest_reach)
    for value in (10.0 * law.largest_reach, 1e300):
        with pytest.raises(ValueError, match=r"(closure|delta) = .* is out of bounds.*overflow"):
            ask(law, value)


def test_a_pure_step_that_overflows_is_refused(law):
    states = np.zeros((2, law.state_size))
    far = np.array([[1e-7, 0.0, 0.0], [1.1 * law.largest_reach, 0.0, 0.0]])
    for start, d in ((states, far), (np.hstack([far, states[:, 3:]]), 0.0 * far)):
        with pytest.raises(ValueError, match=r"joint 1: .* leads beyond largest_reach"):
            law.step(start, d)


def test_truths_and_masks(law):
    for mated in ([True], [True, True], 1, "yes"):
        with pytest.raises(ValueError, match=r"mated = .* must be True or False, or an array"):
            law.joints(3, mated=mated)
    hidden = np.ma.masked_array([1e-7, 0.0, 0.0], [False, True, False])
    with pytest.raises(ValueError, match="d has masked numbers"):
        law.joint().update(hidden)


def test_stresses_that_have_no_closure(law):
    with pytest.raises(ValueError, match=re.escape("normal_stress = -1.0 is out of bounds")):
        law.closure(-1.0)
    asperity = jl.Asperity(1e9, 1.0, 0.0, 0.3, yield_interference=1e-6)
    weak = jl.JointLaw(orientation=jl.Orientation(3.0), asperity=asperity, asperity_density=1e6)
    for stress in (1e12, [1e3, 1e12]):
        with pytest.raises(ValueError, match=r"1e\+12 Pa is beyond any closure"):
            weak.closure(stress)
