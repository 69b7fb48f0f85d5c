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


def large_shear(x):
    assert x["end"] == pytest.approx(x["before"], rel=1e-3)  # five D_c and more: steady


def from_scan(x):
    low, high = x["scan"].interval("a")
    assert low < x["true"].a < high


def blocks(x):
    # what the leapfrog's dynamics leaves, and the step of the record
    gap = np.abs(x["shear"] - x["alone"].shear_stress).max()
    assert gap < 0.05 * np.abs(x["shear"]).max()


def newton(x):
    assert len(x["newton"]) < 12  # quadratic once the branch is found


CHECKS = {
    f.__name__: f
    for f in (
        closure_cycle, direct_shear, strength_envelope, cyclic_shear, damping, large_shear,
        from_scan, blocks, newton,
    )
}  # fmt: skip


def run(path):
    """Names after all cells, and the axes of all pictures; each cell begins without pictures."""
    from matplotlib import pyplot

    space, drawn = {"__name__": "__main__"}, []
    for number, cell in enumerate(re.split(r"^# %%.*$", path.read_text(), flags=re.MULTILINE)):
        exec(compile(cell, f"{path.name}, cell {number + 1}", "exec"), space)
        drawn += [axes for k in pyplot.get_fignums() for axes in pyplot.figure(k).axes]
        pyplot.close("all")
    return space, drawn


@pytest.mark.parametrize("name", sorted(GALLERY))
def test_example_runs(name):
    with style() as plt, warnings.catch_warnings():
        plt.switch_backend("Agg")
        warnings.filterwarnings("ignore", message=".*non-interactive.*")  # plt.show()
        space, drawn = run(GALLERY[name])
    assert drawn
    assert all(axes.has_data() for axes in drawn)
    CHECKS.get(name, bool)(space)
