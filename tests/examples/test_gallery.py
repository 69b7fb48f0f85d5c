"""Every example of the gallery runs, and one number of each is what physics asks."""

import re
import runpy
import warnings
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot
from pages import ROOT

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


COUNTS = ("iteration", "branch: up, down to 10 MPa; up, down to 20 MPa")  # axes without a unit

CHECKS = {
    f.__name__: f
    for f in (
        first_curve, closure_hysteresis, closure_cycle, direct_shear, strength_envelope,
        cyclic_shear, damping, anisotropy, large_shear, fit_closure, from_scan, table,
        batch, blocks, newton, snapshot,
    )
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(GALLERY))
def test_example_runs(name):
    assert matplotlib.get_backend().lower() == "agg"
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*non-interactive.*")  # plt.show()
        space = runpy.run_path(str(GALLERY[name]))
    CHECKS[name](space)
    assert pyplot.get_fignums()
    for number in pyplot.get_fignums():
        for axes in pyplot.figure(number).axes:
            labels = {axes.get_xlabel(), axes.get_ylabel()} - {"", *COUNTS}
            assert all(re.search(r"\(.+\)", label) for label in labels), labels  # a unit


def test_gallery_is_in_order_and_complete():
    settings = (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")
    order = settings.split("ORDER = (")[1].split(")")[0]
    assert sorted(re.findall(r"\w+", order)) == sorted(GALLERY)
