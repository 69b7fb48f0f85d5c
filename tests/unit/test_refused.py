"""Invalid parameters, arguments and keys of files raise an error that names value and bound."""

import re
import tomllib
from copy import deepcopy

import kinds
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl
from jointlaw.parameters.keys import validate_table
from jointlaw.support.checks import number

GOOD = kinds.make_law(bond=jl.Bond(2e9, 1e9, 1e6, 3e6, 300.0, 5000.0))
NAN = float("nan")
INF = float("inf")
NOT_NUMBERS = ["1", "", b"1", True, 1j, [1.0], {}, object, NAN, 10**400]


@pytest.mark.parametrize(
    "name", [name for name, (_, _, declared) in kinds.PARAMETERS.items() if declared.kind is float]
)
def test_a_value_that_is_not_a_finite_number(name):
    law, _ = kinds.off_default(name)
    _, path, declared = kinds.PARAMETERS[name]
    for value in NOT_NUMBERS if declared.infinite else [*NOT_NUMBERS, INF, -INF]:
        with pytest.raises(ValueError, match=rf"{path} = .* is not (a number|finite)"):
            kinds.with_value(law, path, value)


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
    message = re.escape(f"{path} = {value!r}")
    with pytest.raises(ValueError, match=f"{message}.*{re.escape(bound)}"):
        kinds.with_value(GOOD, path, value)


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
FIELD = {"jrc": 10.0, "jcs": 100e6, "length": 0.1, "normal_stress": 1e6,
         "normal_stiffness": 30e9, "basic_friction": np.radians(30.0)}  # fmt: skip
UNIFORM = [1], [0.0, 1e-5]
MASKED = np.ma.masked_array([1e-7, 0.0, 0.0], [False, True, False])
NO_FINITE_CLOSURE = r"1e\+12 Pa is beyond any closure"
NOT_BOOLEANS = r"mated = .* must be True or False, or an array"
BEYOND = "joint 1: .* leads beyond max_effective_closure"
NOT_A_RANGE = "give the smallest and the largest normal stress"


def closed_states(law, fraction):
    """States of two joints, the second closed to this fraction of `max_effective_closure`."""
    states = np.zeros((2, law.state_size))
    states[:, 0] = 1e-7, fraction * law.max_effective_closure
    return states


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda law: kinds.with_value(GOOD, "bond.cohesion", 0.0), "energy_II = 5000.0 .*<= 0"),
        (lambda law: jl.Asperity.hertz_mindlin(-1.0, 0.2, 1e-5, 0.3), "G"),
        (lambda law: jl.Asperity.hertz_mindlin(1e10, 0.6, 1e-5, 0.3), "nu"),
        (lambda law: jl.Asperity.linear(0.0, 1.0, 0.3), "kn"),
        (lambda law: jl.Orientation.from_moments(0.0, 0.01), "mean"),
        (lambda law: jl.Orientation.from_moments(0.3, 10.0), "variance"),
        (lambda law: jl.Orientation.from_moments(1e-300, 1e300), "variance"),
        (lambda law: jl.GammaHeights.from_moments(1e-6, NAN), "variance"),
        (lambda law: law.closure(-1.0), r"normal_stress = -1\.0 is out of bounds"),
        (lambda law: WEAK.closure(1e12), NO_FINITE_CLOSURE),
        (lambda law: WEAK.closure([1e3, 1e12]), NO_FINITE_CLOSURE),
        (lambda law: law.joint(mated=False), "mated=False.*infinite mating_length"),
        (lambda law: law.joints(3, mated=False), "mated=False.*infinite mating_length"),
        (lambda law: kinds.LAWS["closure only"].joint(mated=False), "mated=False.*closure_only"),
        (lambda law: MATING.joint(1e6, mated=False), "mated=False.*starts at first touch"),
        (lambda law: law.joints(3, mated=[True]), NOT_BOOLEANS),
        (lambda law: law.joints(3, mated=[True, True]), NOT_BOOLEANS),
        (lambda law: law.joints(3, mated=1), NOT_BOOLEANS),
        (lambda law: law.joints(3, mated="yes"), NOT_BOOLEANS),
        (lambda law: law.joint().update(MASKED), "d has masked numbers"),
        (lambda law: law.step(np.zeros(3), np.zeros(3)), "expected"),
        (lambda law: law.step(np.zeros((2, law.state_size)), np.zeros(3)), "expected"),
        (lambda law: law.at_tolerance(0.05, stress=3e4), NOT_A_RANGE),
        (lambda law: law.at_tolerance(0.05, stress=(1e6, 3e4)), NOT_A_RANGE),
        (lambda law: law.at_tolerance(0.05, stress=(0.0, 1e6)), NOT_A_RANGE),
        (lambda law: law.at_tolerance(0.05, stress=(3e4, 1e5, 1e6)), NOT_A_RANGE),
        (
            lambda law: law.step(closed_states(law, 0.0), closed_states(law, 1.1)[:, :3]),
            BEYOND,
        ),
        (
            lambda law: law.step(closed_states(law, 1.1), np.zeros((2, 3))),
            r"joint 1: delta\[0\] .* out of bounds",
        ),
        (
            lambda law: law.joints(3, normal_stress=[1e6, 2e6]),
            r"normal_stress has shape \(2,\): give one or \(3,\)",
        ),
        (lambda law: law.joint(-1.0), "normal_stress = -1"),
        (lambda law: jl.JointLaw.from_toml("missing.toml"), "does not exist"),
        (lambda law: jl.JointLaw.from_toml(law.to_toml()), "TOML text.* use from_text"),
        # the slope of a density that ends in a step falls at its end, beyond every quantile
        (lambda law: kinds.make_law(heights=jl.Heights(UNIFORM, 0.0, "population")), "not convex"),
        (
            lambda law: kinds.make_law(heights=jl.Heights(UNIFORM, 9.9e-6, "population")),
            "not convex",
        ),
        *(
            (
                lambda law, d=distribution: jl.Heights(d, 0.0, "individual"),
                rf"heights\.distribution.*{message}",
            )
            for distribution, message in (
                (5, "must be"),
                ("chi2", "GammaHeights"),
                (([1, 2], [0.0, 1.0]), "2 counts need 3 edges, got 2"),
                (([], [0.0]), "need"),
                (([1, 2], [0.0, 2.0, 1.0]), "ascending"),
                (([1, 2], [-1.0, 0.0, 1.0]), ">= 0"),
                (([1, -2], [0.0, 1.0, 2.0]), "counts must be"),
                (([0, 0], [0.0, 1.0, 2.0]), "not all zero"),
                (([1, NAN], [0.0, 1.0, 2.0]), "counts must be"),
                (("one", "two"), "numpy.histogram"),
                (([1, 2], [0.0, 1.0, 2.0], "extra"), "numpy.histogram"),
            )
        ),
        *(
            (lambda law, name=name, x=x: getattr(law, name)(x), "(closure|normal_stress) = ")
            for name in ("normal_stress", "closure", "contacts", "max_stiffness")
            for x in (NAN, [1e-7, INF], "1um")
        ),
        *(
            (lambda law, n=name: jl.from_field(**(FIELD | {n: NAN})), f"^{name} = nan")
            for name in FIELD
        ),
    ],
)
def test_an_invalid_argument_of_a_call(law, call, message):
    with pytest.raises(ValueError, match=message):
        call(law)


@pytest.mark.parametrize(
    "call",
    [
        lambda law, u: law.normal_stress([1e-7, u]),
        lambda law, u: law.max_stiffness(0.0, u),
        lambda law, u: law.critical_time_step(1, 1, u),
        lambda law, u: jl.secant(law, [0, -u, 0]),
    ],
)
def test_closures_whose_forces_overflow(law, call):
    """Beyond `max_effective_closure` a force would overflow, so the closure is refused."""
    call(law, 0.3 * law.max_effective_closure)
    for value in (10.0 * law.max_effective_closure, 1e300):
        with pytest.raises(ValueError, match=r"(closure|delta) = .* is out of bounds.*overflow"):
            call(law, value)


HEIGHTS = "alpha = 3.82\nbeta = 1.15e-6\noverlap = 2e-6\n"
FILE = f"""
asperity_density = 1e10
[orientation]
a = 3.0
[asperity]
K = 2.0e8
lam = 1.2
eta = 0.5
mu = 0.3
[heights]
{HEIGHTS}"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("asperity_density", "asperity_densty = 1.0\nasperity_density",
         "key 'asperity_densty' is unknown; did you mean 'asperity_density'?"),
        ("a = 3.0", "a = 3.0\nd = 1", "key 'orientation.d' is unknown; known here: a, b, c"),
        ("overlap", "_frozen = 1\noverlap", "key 'heights._frozen' is unknown"),
        ("asperity_density = 1e10", "", "key 'asperity_density' is missing"),
        ("K = 2.0e8", "", "key 'asperity.K' is missing"),
        ("beta = 1.15e-6", "", "key 'heights.beta' is missing"),
        ("[orientation]\na = 3.0", "", "key 'orientation' is missing"),
        ("[orientation]\na = 3.0", "orientation = 3", "key 'orientation' must be a table"),
        ("a = 3.0", "a = 0.9", "orientation.a = 0.9 is out of bounds: it must be >= 1"),
        ("lam = 1.2", 'lam = "1.2"', "asperity.lam = '1.2' is not a number"),
        ("eta = 0.5", "eta = nan", "asperity.eta = nan is not finite"),
        ("density = 1e10", "density = 1e10\nmating_length = 0", "mating_length = 0.0"),
        ("density = 1e10", 'density = 1e10\nresolution = "rough"', "resolution = 'rough'"),
        ("density = 1e10", "density = 1e10\nresolution = {u = 2, phi = 2, depth = 1}",
         "resolution.phi = 2 is out of bounds"),
        ("density = 1e10", "density = 1e10\nresolution = {u = 2, phi = 3, depth = 1, lowest = 2}",
         "resolution.lowest = 2.0 is out of bounds: it must be > 0 and <= 1"),
        ("density = 1e10",
         "density = 1e10\nresolution = {u = 2, phi = 3, depth = 1, front = true}",
         "key 'resolution.front' is unknown"),
        ("overlap = 2e-6", 'formation = "both"', "heights.formation = 'both'"),
        ("asperity_density", "version = 99\nasperity_density", "reads version 1; write"),
        ("a = 3.0", "a = ", "not valid TOML"),
        ("[heights]\n" + HEIGHTS, "[heights]\n", "key 'heights.alpha' is missing"),
        ("[heights]\n" + HEIGHTS, '[heights]\nkind = "histogram"',
         "key 'heights.distribution' is missing"),
        ("[heights]", '[heights]\nkind = "weibull"', "heights.kind = 'weibull' is unknown"),
        (HEIGHTS, 'kind = "histogram"\ndistribution = "chi2"\n',
         "heights.distribution = 'chi2' must be (counts, edges)"),
        ("[heights]", "[[heights]]", "key 'heights' must be a table"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_file_is_named_by_file_and_key(tmp_path, old, new, message):
    """The messages are the same for a file and for its text."""
    path = tmp_path / "bad.toml"
    text = FILE.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    for read, source, name in (
        (jl.JointLaw.from_toml, path, str(path)), (jl.JointLaw.from_text, text, "TOML text")
    ):  # fmt: skip
        with pytest.raises(ValueError, match=f"{re.escape(name)}.*{re.escape(message)}"):
            read(source)


def test_a_file_that_is_not_utf_8(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes(b"# \xb5m\n")
    with pytest.raises(ValueError, match=r"latin\.toml.* UTF-8"):
        jl.JointLaw.from_toml(path)


def test_a_mapping_is_checked_as_a_file_and_not_changed():
    histogram = {"kind": "histogram", "distribution": [[1], [0.0, 1.0]], "formation": "individual"}
    data = tomllib.loads(FILE) | {"heights": histogram}
    before = deepcopy(data)
    assert isinstance(jl.JointLaw.from_dict(data).heights, jl.Heights)
    assert data == before
    data["orientation"]["e"] = 1
    with pytest.raises(ValueError, match=r"here: key 'orientation\.e' is unknown"):
        jl.JointLaw.from_dict(data, "here")


RULES = {"end!": number, "drive": [{"block!": number}]}


def test_rules_for_lists_of_tables():
    data = {"end": 2, "drive": [{"block": 1}]}
    assert validate_table(data, RULES, "f") == {"end": 2.0, "drive": [{"block": 1.0}]}
    for message, change in {
        "f: key 'run.drive[1].block' is missing": {"drive": [{"block": 1}, {}]},
        "f: key 'run.drive' must be a list": {"drive": 3},
        "f: key 'run.old' is unknown; known here: drive, end": {"old": 1},
        "run.end = 'x' is not a number": {"end": "x"},
    }.items():
        with pytest.raises(ValueError, match=re.escape(message)):
            validate_table(data | change, RULES, "f", "run")
