"""Every example of the gallery runs as the site runs it, and gives what physics asks.

The site runs an example cell by cell (`# %%`), takes the pictures after each cell and closes them.
"""

import re
import warnings

import numpy as np
import pytest
from pages import ROOT

from jointlaw.support.pyplot import style

pytestmark = pytest.mark.slow  # a minute and a half in all

GALLERY = {path.stem.removeprefix("plot_"): path for path in ROOT.glob("docs/gallery/plot_*.py")}


def first_curve(x):
    assert x["F"][0] == pytest.approx(10e6, rel=1e-9)  # seating is exact


def closure_hysteresis(x):
    assert 0 < x["loss"][3.0] < x["loss"][2.0] < x["loss"][1.5]  # from gentle to steep


def closure_cycle(x):
    # measured 38 %; without yielding friction alone is left
    assert 0.3 < x["loss"]["yields"] < 0.46
    assert 0 < x["loss"]["elastic"] < 0.04  # most of it from the few cells of `balanced`


def strength_envelope(x):
    elastic, *yielding = x["angles"].values()  # the shorter the length, the weaker
    assert (np.diff([elastic, *yielding], axis=0)[:, -1] < 0).all()
    assert yielding[0][0] == pytest.approx(elastic[0], abs=0.1)  # low stress is left alone


def direct_shear(x):
    stress, stiffness, closure = (r.F1[-1] for r in x["records"].values())
    assert stress < stiffness < closure  # what may not dilate is pressed


def cyclic_shear(x):
    assert x["growth"] > 2  # partial slip: Mindlin's cubic law in the limit
    elastic = x["peaks"]["elastic"]
    assert elastic[-1] == pytest.approx(elastic[0], rel=1e-2)


def damping(x):
    some = x["damping"][10e6]
    # Mindlin's limit: damping grows with the amplitude itself. 300 cells miss it by some per cent.
    assert np.log(some[8] / some[0]) == pytest.approx(np.log(x["amplitudes"][8] / 2e-9), rel=0.2)
    assert x["coarse"][-1] == pytest.approx(some[-1], rel=0.1)


def anisotropy(x):
    # half a turn is the same joint
    assert x["friction"][-1] == pytest.approx(x["friction"][0], rel=1e-9)


def large_shear(x):
    assert x["end"] == pytest.approx(x["before"], rel=1e-3)  # five D_c and more: steady


def fit_closure(x):
    assert abs(x["error"]) < 0.01


def from_scan(x):
    low, high = x["scan"].interval("a")
    assert low < x["true"].a < high


def table(x):
    # this table has no path dependence at all: see docs/yade.md
    assert 0.3 < x["error"] < 1.5


def batch(x):
    assert 0 < x["touching"][-1] < 1


def blocks(x):
    # what the leapfrog's dynamics leaves, and the step of the record
    gap = np.abs(x["shear"] - x["alone"].shear_stress).max()
    assert gap < 0.05 * np.abs(x["shear"]).max()


def newton(x):
    assert len(x["newton"]) < 12  # quadratic once the branch is found


def snapshot(x):
    assert (x["unbroken"] == x["resumed"]).all()


CHECKS = {
    f.__name__: f
    for f in (
        first_curve, closure_hysteresis, closure_cycle, direct_shear, strength_envelope,
        cyclic_shear, damping, anisotropy, large_shear, fit_closure, from_scan, table,
        batch, blocks, newton, snapshot,
    )
}  # fmt: skip


WITHOUT_UNIT = re.compile(r"iteration|branch: .*|.+ over .+")  # counts and ratios


def run(path):
    """Names after all cells, and each picture as it was after the cell that drew it."""
    space, shown = {"__name__": "__main__"}, []
    for number, cell in enumerate(re.split(r"^# %%.*$", path.read_text(), flags=re.MULTILINE)):
        exec(compile(cell, f"{path.name}, cell {number + 1}", "exec"), space)
        shown += [(axes, len(axes.get_children())) for axes in close_pictures()]
    return space, shown


def close_pictures():
    """Close all pictures, as the site does, and return their axes."""
    from matplotlib import pyplot

    axes = [one for number in pyplot.get_fignums() for one in pyplot.figure(number).axes]
    pyplot.close("all")
    return axes


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
        space, shown = run(GALLERY[name])
    assert shown
    assert [fault for one in shown for fault in faults(*one)] == []
    CHECKS[name](space)


def test_gallery_is_in_order_and_complete():
    settings = (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")
    order = settings.split("ORDER = (")[1].split(")")[0]
    assert sorted(re.findall(r"\w+", order)) == sorted(GALLERY)
