"""Parameter files: every mistake is told by file and by the key's path."""

import re
import tomllib
from copy import deepcopy

import pytest

import jointlaw as jl
from jointlaw.parameters.keys import checked
from jointlaw.support.checks import number

HEIGHTS = "alpha = 3.82\nbeta = 1.15e-6\noverlap = 2e-6\n"
GOOD = f"""
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
def test_a_mistake_is_told_by_file_and_key(tmp_path, old, new, message):
    """The same for a file and for its text."""
    path, text = tmp_path / "bad.toml", GOOD.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    for read, given, name in (
        (jl.JointLaw.from_toml, path, str(path)), (jl.JointLaw.from_text, text, "TOML text")
    ):  # fmt: skip
        with pytest.raises(ValueError, match=f"{re.escape(name)}.*{re.escape(message)}"):
            read(given)


def test_a_file_that_cannot_be_read(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes(b"# \xb5m\n")
    with pytest.raises(ValueError, match=r"latin\.toml.* UTF-8"):
        jl.JointLaw.from_toml(path)
    with pytest.raises(ValueError, match="does not exist"):
        jl.JointLaw.from_toml(tmp_path / "missing.toml")
    with pytest.raises(ValueError, match=r"TOML text.* use from_text"):
        jl.JointLaw.from_toml(GOOD)


def test_a_mapping_is_checked_alike_and_left_alone():
    histogram = {"kind": "histogram", "distribution": [[1], [0.0, 1.0]], "formation": "individual"}
    data = tomllib.loads(GOOD) | {"heights": histogram}
    before = deepcopy(data)
    assert isinstance(jl.JointLaw.from_dict(data).heights, jl.Heights)
    assert data == before
    data["orientation"]["e"] = 1
    with pytest.raises(ValueError, match=r"here: key 'orientation\.e' is unknown"):
        jl.JointLaw.from_dict(data, "here")


RULES = {"end!": number, "drive": [{"block!": number}]}


def test_rules_for_lists_of_tables():
    data = {"end": 2, "drive": [{"block": 1}]}
    assert checked(data, RULES, "f") == {"end": 2.0, "drive": [{"block": 1.0}]}
    for message, change in {
        "f: key 'run.drive[1].block' is missing": {"drive": [{"block": 1}, {}]},
        "f: key 'run.drive' must be a list": {"drive": 3},
        "f: key 'run.old' is unknown; known here: drive, end": {"old": 1},
        "run.end = 'x' is not a number": {"end": "x"},
    }.items():
        with pytest.raises(ValueError, match=re.escape(message)):
            checked(data | change, RULES, "f", "run")
