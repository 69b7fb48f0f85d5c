"""Parameter files: every mistake is told by file and by the key's path."""

import re

import pytest

import jointlaw as jl

GOOD = """
asperity_density = 1e10
[orientation]
a = 3.0
[asperity]
K = 2.0e8
lam = 1.2
eta = 0.5
mu = 0.3
[heights]
alpha = 3.82
beta = 1.15e-6
overlap = 2e-6
"""
NAMED = GOOD.split("[heights]")[0] + '[heights]\ndistribution = "chi2"\noverlap = 2e-6\n'


def told(text, tmp_path):
    """The error text for a file with this text, which is the same for the text alone."""
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError) as from_file:
        jl.JointLaw.from_toml(path)
    with pytest.raises(ValueError) as from_text:
        jl.JointLaw.from_toml(text)
    message = str(from_file.value)
    assert str(path) in message
    assert message.replace(str(path), "TOML text") == str(from_text.value)
    return message


def test_the_text_that_the_tests_spoil_is_good(tmp_path):
    assert jl.JointLaw.from_toml(GOOD).orientation == jl.Orientation(3.0)


@pytest.mark.parametrize(
    ("spoil", "path"),
    [
        (lambda t: "asperity_densty = 1.0" + t, "asperity_densty"),
        (lambda t: t.replace("a = 3.0", "a = 3.0\nd = 1"), "orientation.d"),
        (lambda t: t.replace("K = 2.0e8", "K = 2.0e8\nk = 1"), "asperity.k"),
        (lambda t: t.replace("alpha =", "beta_ = 1\nalpha ="), "heights.beta_"),
        (lambda t: t + 'distribution = "chi2"', "heights.distribution"),
        (lambda t: "resolution = { u = 2, phi = 4, depth = 2, r = 1 }" + t, "resolution.r"),
        (lambda t: t + "[elasticity]\nG = 1", "elasticity"),
        (lambda t: t + "_frozen = 1", "heights._frozen"),
    ],
)
def test_unknown_key(tmp_path, spoil, path):
    message = told(spoil(GOOD), tmp_path)
    assert f"key '{path}' is unknown; " in message
    assert "; known here: " in message or "; did you mean '" in message


@pytest.mark.parametrize(
    ("line", "path"),
    [
        ("asperity_density = 1e10", "asperity_density"),
        ("a = 3.0", "orientation.a"),
        ("K = 2.0e8", "asperity.K"),
        ("lam = 1.2", "asperity.lam"),
        ("eta = 0.5", "asperity.eta"),
        ("mu = 0.3", "asperity.mu"),
        ("alpha = 3.82", "heights.alpha"),
        ("beta = 1.15e-6", "heights.beta"),
    ],
)
def test_missing_key(tmp_path, line, path):
    assert f"key '{path}' is missing" in told(GOOD.replace(line, ""), tmp_path)


@pytest.mark.parametrize("table", ["orientation", "asperity"])
def test_missing_table(tmp_path, table):
    text = re.sub(rf"\[{table}\][^\[]*", "", GOOD)
    assert f"key '{table}' is missing" in told(text, tmp_path)


def test_empty_heights(tmp_path):
    assert "key 'heights.distribution' is missing" in told(NAMED.split("distrib")[0], tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "path", "bound"),
    [
        ("a = 3.0", "a = 0.9", "orientation.a = 0.9", ">= 1"),
        ("a = 3.0", "a = 3.0\nb = 2.5", "orientation.b = 2.5", "-1 <= b <= 2"),
        ("a = 3.0", "a = 3.0\nc = -0.4", "orientation.c = -0.4", "1/3 - b/6"),
        ("K = 2.0e8", "K = 0", "asperity.K = 0.0", "> 0"),
        ("mu = 0.3", "mu = -0.3", "asperity.mu = -0.3", ">= 0"),
        ("eta = 0.5", "eta = nan", "asperity.eta = nan", "finite"),
        ("lam = 1.2", 'lam = "1.2"', "asperity.lam = '1.2'", "not a number"),
        ("lam = 1.2", "lam = true", "asperity.lam = True", "not a number"),
        ("density = 1e10", "density = 0", "asperity_density = 0.0", "> 0"),
        ("density = 1e10", "density = 1e10\nplane = inf", "plane = inf", "finite"),
        ("density = 1e10", "density = 1e10\ncritical_slip = 0", "critical_slip = 0.0", "> 0"),
        ("density = 1e10", 'density = 1e10\nresolution = "rough"', "resolution = 'rough'", "fine"),
        (
            "density = 1e10",
            "density = 1e10\nresolution = { u = 2, phi = 2, depth = 1 }",
            "resolution.phi = 2",
            ">= 3",
        ),
        ("overlap = 2e-6", "overlap = -2e-6", "heights.overlap = -2e-06", ">= 0"),
        ("overlap = 2e-6", 'formation = "both"', "heights.formation = 'both'", "individual"),
    ],
)
def test_out_of_bounds(tmp_path, old, new, path, bound):
    message = told(GOOD.replace(old, new), tmp_path)
    assert path in message
    assert bound in message


@pytest.mark.parametrize("table", ["orientation", "asperity", "heights"])
def test_a_table_that_is_none(tmp_path, table):
    text = f"{table} = 3\n" + re.sub(rf"\[{table}\][^\[]*", "", GOOD)
    assert f"key '{table}' must be a table" in told(text, tmp_path)


@pytest.mark.parametrize(
    ("line", "path"),
    [
        ("parameters = { dff = 3 }", "dff"),
        ("parameters = 3", "heights.parameters = 3"),
        ('parameters = { df = "3" }', "heights.parameters.df = '3'"),
        ("", "heights.parameters"),
    ],
)
def test_parameters_of_a_distribution(tmp_path, line, path):
    assert path in told(NAMED + line, tmp_path)


def test_not_toml(tmp_path):
    assert "not valid TOML" in told("a = \n", tmp_path)


def test_not_utf_8(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes(b"# \xb5m\n")
    with pytest.raises(ValueError, match=r"latin\.toml.* UTF-8"):
        jl.JointLaw.from_toml(path)


@pytest.mark.parametrize("name", ["missing.toml", "."])
def test_no_such_file(tmp_path, name):
    with pytest.raises(ValueError, match="does not exist"):
        jl.JointLaw.from_toml(tmp_path / name)


@pytest.mark.parametrize(
    ("csv", "told"),
    [
        (None, "lower_m, upper_m, count"),
        ("", "adjoin"),
        ("lower_m,upper_m\n0,1\n", "count"),
        ("lower_m,upper_m,count\n0,one,3\n", "one"),
        ("lower_m,upper_m,count\n0,1e-6,3\n2e-6,3e-6,1\n", "adjoin"),
        ("lower_m,upper_m,count\n0,1e-6,-3\n", "counts must be"),
    ],
)
def test_bad_histogram_file(tmp_path, csv, told):
    text = GOOD.split("[heights]")[0] + '[heights]\nhistogram = "h.csv"\nformation = "individual"'
    (tmp_path / "law.toml").write_text(text)
    if csv is not None:
        (tmp_path / "h.csv").write_text(csv)
    with pytest.raises(ValueError, match="heights") as error:
        jl.JointLaw.from_toml(tmp_path / "law.toml")
    assert told in str(error.value)
    assert "law.toml" in str(error.value)


def test_a_mapping_is_checked_alike_and_left_alone():
    data = {"orientation": {"a": 3.0}, "asperity": {"K": 1.0, "lam": 1.0, "eta": 0.5, "mu": 0.3}}
    data |= {"asperity_density": 1.0, "heights": {"counts": [1], "edges": [0.0, 1.0]}}
    data["heights"] |= {"formation": "individual"}
    before = repr(data)
    assert jl.JointLaw.from_dict(data).heights.is_histogram
    assert repr(data) == before
    data["orientation"]["e"] = 1
    with pytest.raises(ValueError, match=r"here: key 'orientation\.e' is unknown"):
        jl.JointLaw.from_dict(data, "here")
