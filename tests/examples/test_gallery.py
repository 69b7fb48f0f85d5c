"""Examples run: those of docstrings, which name arguments and errors; those of the gallery, whose
pictures show what they say; the figures of the paper, with known points of their curves.

The site runs an example of the gallery cell by cell (`# %%`), takes the pictures after each cell
and closes them.
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
WITHOUT = {
    "JointTable",
    "NonFiniteError",
    "PathError",
    "TestRecord",
    "load_table",
}  # made by others
NAMES = {name: getattr(jl, name) for name in jl.__all__ if not inspect.ismodule(getattr(jl, name))}
CALLED = NAMES | {
    f"{name}.{own}": getattr(thing, own)
    for name, thing in NAMES.items()
    for own in (vars(thing) if inspect.isclass(thing) else ())
    if not own.startswith("_") and callable(getattr(thing, own))
}


@pytest.mark.parametrize("name", CALLED)
def test_docstrings_name_arguments_and_errors(name):
    text, thing = inspect.getdoc(CALLED[name]), CALLED[name]
    # an error holds what it was raised with
    arguments = () if name.endswith("Error") else inspect.signature(thing).parameters
    named = [one for one in arguments if one not in ("self", "args")]
    assert [one for one in named if not re.search(rf"\b{one}\b", text)] == []
    assert inspect.isclass(thing) or not named or re.search(r"\b[Rr]aises\b", text)


@pytest.mark.parametrize("name", NAMES)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    law = jl.presets.load("westerly-smooth")
    sheared = jl.direct_shear(law.joint(), 1e-6, normal=5e6)
    space = {
        "jl": jl, "np": np, "replace": replace, "law": law, "joint": law.joint(),
        "record": jl.closure_test(law.joint(), 5e6), "sheared": sheared,
        "curve": jl.ShearCurve(sheared.shear[1:], sheared.shear_stress[1:], 5e6),
    }  # fmt: skip
    found = doctest.DocTestFinder().find(NAMES[name], name, globs=space)
    assert name in WITHOUT or any(one.examples for one in found)
    assert not any(doctest.DocTestRunner().run(one).failed for one in found)


GALLERY = {path.stem.removeprefix("plot_"): path for path in DOCS.glob("gallery/plot_*.py")}


WITHOUT_UNIT = re.compile(r"iteration|branch: .*|.+ over .+")  # counts and ratios


def run(path):
    """Each picture as it was after the cell that drew it, and the TeX source that they show."""
    space, shown, source = {"__name__": "__main__"}, [], []
    for number, cell in enumerate(re.split(r"^# %%.*$", path.read_text(), flags=re.MULTILINE)):
        exec(compile(cell, f"{path.name}, cell {number + 1}", "exec"), space)
        figures = [pyplot.figure(number) for number in pyplot.get_fignums()]
        shown += [(axes, len(axes.get_children())) for one in figures for axes in one.axes]
        source += [text for figure in figures for text in tex_source(figure)]
        pyplot.close("all")
    return shown, source


def faults(axes, parts):
    """What a reader of the picture would miss.

    Data; labels with units, or those of the axes that it shares; what was drawn too late to be
    seen, when the picture had been taken with so many `parts`.
    """
    if len(axes.get_children()) != parts:
        yield "something is drawn after the picture was taken"
    if not axes.has_data():
        yield "no data"
    if axes.name == "polar":
        labels = [axes.get_title()]
    elif axes.get_label() == "<colorbar>":
        labels = [axes.get_ylabel() or axes.get_xlabel()]
    else:
        labels = [
            next(filter(None, (getattr(one, f"get_{way}label")() for one in group)), "")
            for way, group in (
                ("x", axes.get_shared_x_axes().get_siblings(axes)), ("y", [axes]),
            )
        ]  # fmt: skip
    for label in labels:
        if "(1)" in label or not (re.search(r"\(.+\)", label) or WITHOUT_UNIT.fullmatch(label)):
            yield f"label {label!r} without a unit"


@pytest.mark.slow  # a minute and a half in all
@pytest.mark.parametrize("name", sorted(GALLERY))
def test_example_runs(name):
    with style() as plt, warnings.catch_warnings():
        plt.switch_backend("Agg")
        warnings.filterwarnings("ignore", message=".*non-interactive.*")  # plt.show()
        shown, source = run(GALLERY[name])
    assert shown
    assert source == []
    assert [fault for one in shown for fault in faults(*one)] == []


def test_gallery_is_in_order_and_complete():
    settings = (DOCS / "conf.py").read_text(encoding="utf-8")
    (order,) = re.findall(r"ORDER = \((.*?)\)", settings, re.DOTALL)
    assert sorted(re.findall(r"\w+", order)) == sorted(GALLERY)


FIGURES = {int(path.stem[-2:]): path for path in DOCS.glob("paper/plot_fig_*.py")}
TOTAL, LAW = "total form (as printed)", "incremental law (this package)"
# panel, curve, row, y; by hand from Table 1, or as test_paper_*.py has them
KNOWN = {
    8: ("(a) Kₛ/Kₙ = 0.5", "b = −1", 0, 0.7 / 0.6),
    9: ("", "c = 1/3", 45, 0.9),
    10: ("share that slides, Kₛ = Kₙ", "a = 2, total", 12, np.cos(2 * np.arctan(0.6))),
    14: (TOTAL, "a = 3", -1, 0.9356),
    15: (TOTAL, "linear, a = 6", -1, 0.6939),
    17: (LAW, "rough", -1, 0.661),
    18: (TOTAL, "every normal stress", 12, 30.6),
    19: (LAW, "slip of 1 mm, 0°", 0, 46.9),
}


@pytest.mark.slow
@pytest.mark.parametrize("number", sorted(FIGURES))
def test_figure(number, monkeypatch):
    monkeypatch.syspath_prepend(FIGURES[number].parent)
    panels = runpy.run_path(str(FIGURES[number]))["panels"]
    assert [tex_source(pyplot.figure(drawn)) for drawn in pyplot.get_fignums()] == [[]]
    for curve in (curve for lines in panels.values() for curve in lines.values()):
        assert np.isfinite(np.array(curve, float)).all()
    if number >= 11:  # loading: both forms of the law
        titles = " ".join(panels)
        assert TOTAL in titles and LAW in titles  # noqa: PT018
    if number in KNOWN:
        panel, curve, row, y = KNOWN[number]
        assert panels[panel][curve][1][row] == pytest.approx(y, rel=2e-3)


def test_every_figure_with_something_to_compute_is_drawn():
    assert sorted(FIGURES) == [3, 4, 5, *range(7, 20)]  # 1 and 2 are sketches; 6 is with 4
