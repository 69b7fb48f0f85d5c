"""Every example of the gallery runs as the site runs it, and its pictures show what they say.

The site runs an example cell by cell (`# %%`), takes the pictures after each cell and closes them.
"""

import re
import warnings

import pytest
from pages import ROOT

from jointlaw.support.pyplot import style

pytestmark = pytest.mark.slow  # a minute and a half in all

GALLERY = {path.stem.removeprefix("plot_"): path for path in ROOT.glob("docs/gallery/plot_*.py")}


WITHOUT_UNIT = re.compile(r"iteration|branch: .*|.+ over .+")  # counts and ratios


def run(path):
    """Each picture as it was after the cell that drew it."""
    from matplotlib import pyplot

    space, shown = {"__name__": "__main__"}, []
    for number, cell in enumerate(re.split(r"^# %%.*$", path.read_text(), flags=re.MULTILINE)):
        exec(compile(cell, f"{path.name}, cell {number + 1}", "exec"), space)
        figures = [pyplot.figure(number) for number in pyplot.get_fignums()]
        shown += [(axes, len(axes.get_children())) for one in figures for axes in one.axes]
        pyplot.close("all")
    return shown


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


@pytest.mark.parametrize("name", sorted(GALLERY))
def test_example_runs(name):
    with style() as plt, warnings.catch_warnings():
        plt.switch_backend("Agg")
        warnings.filterwarnings("ignore", message=".*non-interactive.*")  # plt.show()
        shown = run(GALLERY[name])
    assert shown
    assert [fault for one in shown for fault in faults(*one)] == []


def test_gallery_is_in_order_and_complete():
    settings = (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")
    order = settings.split("ORDER = (")[1].split(")")[0]
    assert sorted(re.findall(r"\w+", order)) == sorted(GALLERY)
