"""The scripts of the paper's figures: their curves and known points of them."""

import runpy

import numpy as np
import pytest
from pages import ROOT

pytestmark = pytest.mark.slow
FIGURES = {int(path.stem[-2:]): path for path in ROOT.glob("docs/paper/plot_fig_*.py")}
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


@pytest.mark.parametrize("number", sorted(FIGURES))
def test_figure(number, monkeypatch):
    monkeypatch.syspath_prepend(FIGURES[number].parent)
    panels = runpy.run_path(str(FIGURES[number]))["panels"]
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
