"""Every example of the gallery runs as the site runs it, and gives what physics asks.

The site runs an example cell by cell (`# %%`), takes the pictures after each cell and closes them.
"""

import re
import warnings
from itertools import pairwise

import numpy as np
import pytest
from pages import ROOT

from jointlaw.support.pyplot import style

pytestmark = pytest.mark.slow  # a minute and a half in all

GALLERY = {path.stem.removeprefix("plot_"): path for path in ROOT.glob("docs/gallery/plot_*.py")}


def first_curve(x):
    assert x["F"][0] == pytest.approx(10e6, rel=1e-9)  # seating is exact


def closure_hysteresis(x):
    losses = list(x["loss"].values())  # from gentle to steep
    assert losses == sorted(losses)
    assert 0 < losses[0] < 0.02


def closure_cycle(x):
    # measured 38 %; without yielding friction alone is left
    assert 0.3 < x["loss"]["yields"] < 0.46
    assert 0 < x["loss"]["elastic"] < 0.04  # most of it from the few cells of `balanced`
    assert (np.diff(x["kept"]) > 0).all()  # a set that grows with the largest stress


def strength_envelope(x):
    elastic, *yielding = x["angles"].values()  # the shorter the length, the weaker
    for harder, softer in pairwise([elastic, *yielding]):
        assert (softer <= harder + 0.1).all()
        assert softer[-1] < harder[-1]
    assert yielding[0][0] == pytest.approx(elastic[0], abs=0.1)  # low stress is left alone
    assert x["dilation"]["yields beyond 0.05 µm"][-1] < 0.5 * x["dilation"]["elastic"][-1]


def direct_shear(x):
    stress, stiffness, closure = (r.F1[-1] for r in x["records"].values())
    assert stress == pytest.approx(10e6, rel=1e-9)
    assert stress < stiffness < closure  # what may not dilate is pressed


def cyclic_shear(x):
    assert (np.diff(x["lost"]) > 0).all()
    assert (np.diff(x["stiffness"]) < 0).all()
    assert x["growth"] > 2  # partial slip: Mindlin's cubic law in the limit
    elastic, yielding, worn = x["peaks"].values()
    assert elastic[-1] == pytest.approx(elastic[0], rel=1e-2)
    assert yielding[0] < elastic[0]
    assert (np.diff(worn) < 0).all()


def damping(x):
    few, some, many = x["damping"].values()  # from low to high normal stress
    partly = few < 0.3  # beyond, most asperities slide, and all joints damp about alike
    assert (many < some)[partly].all()
    assert (some < few)[partly].all()
    assert (np.diff(x["stiffness"][10e6]) < 0).all()
    # Mindlin's limit: damping grows with the amplitude itself. 300 cells miss it by some per cent.
    assert np.log(some[8] / some[0]) == pytest.approx(np.log(x["amplitudes"][8] / 2e-9), rel=0.2)
    assert (x["coarse"][:8] < 0.5 * some[:8]).all()
    assert x["coarse"][-1] == pytest.approx(some[-1], rel=0.1)


def anisotropy(x):
    assert (x["friction"][0] > x["friction"][6]).all()
    # half a turn is the same joint
    assert x["friction"][-1] == pytest.approx(x["friction"][0], rel=1e-9)


def large_shear(x):
    assert x["end"] == pytest.approx(x["before"], rel=1e-3)  # five D_c and more: steady
    assert abs(x["rise"]) < 1e-9


def fit_closure(x):
    assert abs(x["error"]) < 0.01


def from_scan(x):
    low, high = x["scan"].interval("a")
    assert low < x["true"].a < high


def table(x):
    # this table has no path dependence at all: see docs/yade.md
    assert 0.3 < x["error"] < 1.5


def batch(x):
    assert (x["joints"].dissipated_energy >= 0).all()
    assert 0 < x["touching"][-1] < 1


def blocks(x):
    assert x["summary"]["largest_energy_error"] < 1e-3
    # what the leapfrog's dynamics leaves, and the step of the record
    gap = np.abs(x["shear"] - x["alone"].shear_stress).max()
    assert gap < 0.05 * np.abs(x["shear"]).max()
    # weight of the block on 1 m of joint
    assert x["normal"][-1] == pytest.approx(2600 * 0.5 * 9.81, rel=1e-2)


def newton(x):
    assert len(x["newton"]) < 12  # quadratic once the branch is found
    assert len(x["newton"]) < len(x["modified"]) / 4


def snapshot(x):
    assert (x["unbroken"] == x["resumed"]).all()
    first, other = x["closed_first"][-1], x["sheared_first"][-1]
    assert first[:3] == pytest.approx(other[:3])
    assert first[4] > 2 * other[4]  # shear after closure meets friction, before it hardly any


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
