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


WEAK = jl.JointLaw(
    orientation=jl.Orientation(3.0), asperity_density=1e6,
    asperity=jl.Asperity(1e9, 1.0, 0.0, 0.3, yield_interference=1e-6),
)  # fmt: skip
MATING = kinds.make_law(mating_length=1e-5)
HIDDEN = np.ma.masked_array([1e-7, 0.0, 0.0], [False, True, False])
NO_CLOSURE = r"1e\+12 Pa is beyond any closure"
NO_TRUTH = r"mated = .* must be True or False, or an array"
NO_RANGE = "give the smallest and the largest normal stress"


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda law: jl.Asperity.hertz_mindlin(-1.0, 0.2, 1e-5, 0.3), "G"),
        (lambda law: jl.Asperity.hertz_mindlin(1e10, 0.6, 1e-5, 0.3), "nu"),
        (lambda law: jl.Asperity.linear(0.0, 1.0, 0.3), "kn"),
        (lambda law: jl.Orientation.from_moments(0.0, 0.01), "mean"),
        (lambda law: jl.Orientation.from_moments(0.3, 10.0), "variance"),
        (lambda law: jl.Orientation.from_moments(1e-300, 1e300), "variance"),
        (lambda law: jl.GammaHeights.from_moments(1e-6, NAN), "variance"),
        (lambda law: law.closure(-1.0), r"normal_stress = -1\.0 is out of bounds"),
        (lambda law: WEAK.closure(1e12), NO_CLOSURE),
        (lambda law: WEAK.closure([1e3, 1e12]), NO_CLOSURE),
        (lambda law: law.joint(mated=False), "mated=False.*infinite mating_length"),
        (lambda law: law.joints(3, mated=False), "mated=False.*infinite mating_length"),
        (lambda law: kinds.LAWS["closure only"].joint(mated=False), "mated=False.*closure_only"),
        (lambda law: MATING.joint(1e6, mated=False), "mated=False.*starts at first touch"),
        (lambda law: law.joints(3, mated=[True]), NO_TRUTH),
        (lambda law: law.joints(3, mated=[True, True]), NO_TRUTH),
        (lambda law: law.joints(3, mated=1), NO_TRUTH),
        (lambda law: law.joints(3, mated="yes"), NO_TRUTH),
        (lambda law: law.joint().update(HIDDEN), "d has masked numbers"),
        (lambda law: law.step(np.zeros(3), np.zeros(3)), "expected"),
        (lambda law: law.step(np.zeros((2, law.state_size)), np.zeros(3)), "expected"),
        (lambda law: law.at_tolerance(0.05, stress=3e4), NO_RANGE),
        (lambda law: law.at_tolerance(0.05, stress=(1e6, 3e4)), NO_RANGE),
        (lambda law: law.at_tolerance(0.05, stress=(0.0, 1e6)), NO_RANGE),
        (lambda law: law.at_tolerance(0.05, stress=(3e4, 1e5, 1e6)), NO_RANGE),
    ],
)
def test_an_argument_that_a_call_refuses(law, call, told):
    with pytest.raises(ValueError, match=told):
        call(law)


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
