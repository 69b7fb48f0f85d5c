"""Examples of docstrings, of the gallery and of the figures of the paper run.

Docstrings name arguments and errors; pictures of the gallery have data and labels with units;
curves of the paper's figures go through known points.

The site runs an example of the gallery cell by cell (`# %%`), saves the figures after each cell and
closes them.
"""

import doctest
import inspect
import re
import runpy
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_text import tex_source
from matplotlib import pyplot

import jointlaw as jl
from jointlaw.support.pyplot import style

DOCS = Path(__file__).parents[2] / "docs"
# a function or method of another class makes these
# for laws and elements of a user's own: docs/embed.md has a whole one, tested by test_own_law.py
EXTENSION = {"Element", "ElementResponse", "Law", "LawTables", "declared", "parameter"}
WITHOUT_EXAMPLE = EXTENSION | {
    "JointState", "JointTable", "NonFiniteError", "PathError", "Step", "TestRecord", "load_table",
}  # fmt: skip
NAMES = {name: getattr(jl, name) for name in jl.__all__ if not inspect.ismodule(getattr(jl, name))}
CALLABLES = NAMES | {
    f"{class_name}.{method}": getattr(thing, method)
    for class_name, thing in NAMES.items()
    for method in (vars(thing) if inspect.isclass(thing) else ())
    if not method.startswith("_") and callable(getattr(thing, method))
}


@pytest.mark.parametrize("name", CALLABLES)
def test_docstrings_name_arguments_and_errors(name):
    thing = CALLABLES[name]
    docstring = inspect.getdoc(thing)
    # the attributes of an error are its arguments
    signature = () if name.endswith("Error") else inspect.signature(thing).parameters
    arguments = [argument for argument in signature if argument not in ("self", "args")]
    missing = [argument for argument in arguments if not re.search(rf"\b{argument}\b", docstring)]
    assert missing == []
    checks_input = arguments and name.partition(".")[0] not in EXTENSION - {"Law"}
    assert inspect.isclass(thing) or not checks_input or re.search(r"\b[Rr]aises\b", docstring)


@pytest.fixture(scope="module")
def variables():
    """What the examples of docstrings use, but for a joint."""
    law = jl.presets.load("westerly-smooth")
    sheared = jl.direct_shear(law.joint(), 1e-6, normal=5e6)
    return {
        "jl": jl, "np": np, "replace": replace, "law": law,
        "record": jl.closure_test(law.joint(), 5e6), "sheared": sheared,
        "curve": jl.ShearCurve(sheared.shear[1:], sheared.shear_stress[1:], 5e6),
    }  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_examples_of_docstrings_run(name, variables, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    variables = variables | {"joint": variables["law"].joint()}
    tests = doctest.DocTestFinder().find(NAMES[name], name, globs=variables)
    assert name in WITHOUT_EXAMPLE or any(test.examples for test in tests)
    assert not any(doctest.DocTestRunner().run(test).failed for test in tests)


GALLERY = {path.stem.removeprefix("plot_"): path for path in DOCS.glob("gallery/plot_*.py")}
DIMENSIONLESS = re.compile(r"iteration|branch: .*|.+ over .+")  # counts and ratios


def run_cells(path):
    """Run an example cell by cell.

    Returns the axes of all figures, each with the number of its parts after the cell that drew it,
    and the TeX source that is visible in the figures.
    """
    variables = {"__name__": "__main__"}
    drawn = []
    visible_tex = []
    for number, cell in enumerate(re.split(r"^# %%.*$", path.read_text(), flags=re.MULTILINE)):
        exec(compile(cell, f"{path.name}, cell {number + 1}", "exec"), variables)
        for figure in map(pyplot.figure, pyplot.get_fignums()):
            drawn += [(axes, len(axes.get_children())) for axes in figure.axes]
            visible_tex += tex_source(figure)
        pyplot.close("all")
    return drawn, visible_tex


def first_label(siblings, direction):
    """Return the first label in a direction, "x" or "y", of axes that share it; "" without one."""
    labels = (getattr(axes, f"get_{direction}label")() for axes in siblings)
    return next(filter(None, labels), "")


def labels_of(axes):
    """Return the labels that must have a unit."""
    if axes.name == "polar":
        return [axes.get_title()]
    if axes.get_label() == "<colorbar>":
        return [axes.get_ylabel() or axes.get_xlabel()]
    return [
        first_label(axes.get_shared_x_axes().get_siblings(axes), "x"),
        first_label([axes], "y"),
    ]


def has_unit(label):
    in_parentheses = re.search(r"\(.+\)", label) and "(1)" not in label
    return bool(in_parentheses or DIMENSIONLESS.fullmatch(label))


def defects(axes, parts):
    """Yield the defects of axes that had so many `parts` when their figure was saved."""
    if len(axes.get_children()) != parts:
        yield "something is drawn after the figure was saved"
    if not axes.has_data():
        yield "no data"
    yield from (
        f"label {label!r} without a unit" for label in labels_of(axes) if not has_unit(label)
    )


@pytest.mark.slow  # a minute and a half in all
@pytest.mark.parametrize("name", sorted(GALLERY))
def test_example_of_the_gallery_runs_and_its_figures_have_units(name):
    with style() as plt, warnings.catch_warnings():
        plt.switch_backend("Agg")
        warnings.filterwarnings("ignore", message=".*non-interactive.*")  # plt.show()
        drawn, visible_tex = run_cells(GALLERY[name])
    assert drawn
    assert visible_tex == []
    assert [defect for axes, parts in drawn for defect in defects(axes, parts)] == []


def test_order_of_the_gallery_lists_all_examples():
    settings = (DOCS / "conf.py").read_text(encoding="utf-8")
    (order,) = re.findall(r"ORDER = \((.*?)\)", settings, re.DOTALL)
    assert sorted(re.findall(r"\w+", order)) == sorted(GALLERY)


FIGURES = {int(path.stem[-2:]): path for path in DOCS.glob("paper/plot_fig_*.py")}
TOTAL = "total form (as printed)"
LAW = "incremental law (this package)"
# panel, curve, row, y; by hand from Table 1, or as test_paper_*.py has them
KNOWN_POINTS = {
    8: ("(a) Kₛ/Kₙ = 0.5", "b = −1", 0, 0.7 / 0.6),
    9: ("", "c = 1/3", 45, 0.9),
    10: ("sliding fraction, Kₛ = Kₙ", "a = 2, total", 12, np.cos(2 * np.arctan(0.6))),
    14: (TOTAL, "a = 3", -1, 0.9356),
    15: (TOTAL, "linear, a = 6", -1, 0.6939),
    17: (LAW, "rough", -1, 0.661),
    18: (TOTAL, "every normal stress", 12, 30.6),
    19: (LAW, "slip of 1 mm, 0°", 0, 46.9),
}


@pytest.mark.slow
@pytest.mark.parametrize("number", sorted(FIGURES))
def test_figure_of_the_paper_goes_through_its_known_point(number, monkeypatch):
    monkeypatch.syspath_prepend(FIGURES[number].parent)
    panels = runpy.run_path(str(FIGURES[number]))["panels"]
    assert [tex_source(pyplot.figure(drawn)) for drawn in pyplot.get_fignums()] == [[]]
    for curve in (curve for curves in panels.values() for curve in curves.values()):
        assert np.isfinite(np.array(curve, float)).all()
    if number >= 11:  # loading: both forms of the law
        titles = " ".join(panels)
        assert TOTAL in titles
        assert LAW in titles
    if number in KNOWN_POINTS:
        panel, curve, row, y = KNOWN_POINTS[number]
        assert panels[panel][curve][1][row] == pytest.approx(y, rel=2e-3)


def test_every_figure_of_the_paper_with_computed_curves_is_drawn():
    assert sorted(FIGURES) == [3, 4, 5, *range(7, 20)]  # 1 and 2 are sketches; 6 is with 4
