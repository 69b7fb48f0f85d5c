"""The page "Match shear tests by hand" in Chromium: curves, errors and fit as in Python."""

import importlib.util
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium

import jointlaw as jl

DOCS = Path(__file__).parents[2] / "docs"
STRESSES = (1.0, 2.0, 3.0, 4.0, 5.0)  # MPa
UNSEEN = (1, 3)


def load_module(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


EXTENSION = load_module(DOCS / "_ext/browser.py")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page, its script beside it."""
    folder = tmp_path_factory.mktemp("match")
    text = (DOCS / "match.md").read_text(encoding="utf-8")
    (folder / "_static").mkdir()
    (folder / "_static/match.js").write_text(EXTENSION.match_script(), encoding="utf-8")
    body = re.search(r"<style>.*</script>", text, re.DOTALL)[0]
    head = "<!doctype html><meta charset='utf-8'><style>:root { color-scheme: light dark; }</style>"
    (folder / "index.html").write_text(f"{head}{body}", encoding="utf-8")
    with Chromium(tmp_path_factory.mktemp("profile")) as chromium:
        chromium.call("Page.navigate", url=(folder / "index.html").as_uri())
        chromium.wait("typeof joint === 'object' && byId('result').textContent !== ''")
        yield chromium
        assert chromium.errors == []


def stresses_by_python(mu, steep, mating):
    """Shear stresses (tests, points) of the law of the page by Python."""
    law = EXTENSION.match_law()
    law = replace(
        law, orientation=replace(law.orientation, a=90 / steep),
        asperity=replace(law.asperity, mu=mu), mating_length=mating,
    )  # fmt: skip
    return np.array(
        [jl.direct_shear(law.joint(), 10e-3, 1e6 * s, steps=60).shear_stress for s in STRESSES]
    )


def errors_by_python(stresses, tests):
    """Root mean square errors of peak and last stresses, and of displacements of the peaks."""
    rows = np.genfromtxt(DOCS / "data/sandstone-ja-dry.csv", delimiter=",", names=True)
    errors = [
        stresses.max(1) / (1e6 * rows["peak_MPa"]) - 1,
        stresses[:, -1] / (1e6 * rows["last_MPa"]) - 1,
    ]
    peaks = []
    for curve in stresses:
        top = int(curve.argmax())
        parabola = np.polyfit(np.arange(-1, 2), curve[top - 1 : top + 2] / curve[top], 2)
        peaks.append((top - parabola[1] / (2 * parabola[0])) * 10.0 / (curve.size - 1))
    at = np.array(peaks) / rows["peak_at_mm"] - 1
    tests = list(tests)
    return np.sqrt(np.mean(np.square(errors)[:, tests])), np.sqrt(np.mean(at[tests] ** 2))


def percents(errors):
    """Both errors as the page prints them."""
    stresses, displacements = (100 * error for error in errors)
    return (
        f"{stresses:.1f} % of peak and last stresses, "
        f"{displacements:.0f} % of the peaks' displacements"
    )


def test_data_are_the_sandstone_tests_of_the_predictions():
    text = (DOCS / "measure/fits.py").read_text(encoding="utf-8")
    for row in (DOCS / "data/sandstone-ja-dry.csv").read_text(encoding="utf-8").split()[1:]:
        stress, *numbers = row.split(",")
        assert f"{stress}: ({', '.join(numbers)})," in text


@pytest.mark.slow
@pytest.mark.parametrize("parameters", [(0.6, 30.0, 6e-3), (0.45, 18.5, 20e-3)])
def test_curves_are_those_of_python(page, parameters):
    mu, steep, mating = parameters
    curves = page.run(f"curves({{ mu: {mu}, steep: {steep}, mating: {mating} }}, true)")
    expected = stresses_by_python(mu, steep, mating)
    # the page loads a joint to its normal stress in other steps than `direct_shear`
    np.testing.assert_allclose(curves, expected, atol=2e-3 * expected.max(axis=1).min())


@pytest.mark.slow
def test_fit_finds_the_least_error(page):
    page.run("byId('fit').click()")
    text = page.run("byId('result').textContent")
    values = page.run("read()")
    parameters = values["mu"], values["steep"], values["mating"]
    seen = [k for k in range(5) if k not in UNSEEN]

    def objective(parameters):
        stresses, displacements = errors_by_python(stresses_by_python(*parameters), seen)
        return np.hypot(stresses, 0.1 * displacements)

    fitted = stresses_by_python(*parameters)
    assert f"1, 3 and 5 MPa: {percents(errors_by_python(fitted, seen))}." in text
    assert "Unseen" not in text
    for k in range(3):
        for factor in (0.9, 1.1):
            other = list(parameters)
            other[k] *= factor
            assert objective(other) > objective(parameters)
    page.run("byId('unseen').click()")
    unseen = percents(errors_by_python(fitted, UNSEEN))
    assert f"Unseen, at 2 and 4 MPa: {unseen}." in page.run("byId('result').textContent")


@pytest.mark.slow
def test_sliders_change_what_the_page_says(page):
    before = page.run("byId('result').textContent")
    page.run("byId('mu').value = 0.8; byId('mu').oninput()")
    assert page.run("byId('mu-value').textContent") == "0.800"
    assert page.run("byId('result').textContent") != before
