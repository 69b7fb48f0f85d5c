"""Pictures of README, pages and commands show words, numbers and mathematics, no TeX source.

`conftest.py` checks every figure that is saved; figures of the gallery are checked in
`test_gallery.py`.
"""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from figure_text import is_typeset, tex_source, visible_texts
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scene_text import PLAIN, block

import jointlaw as jl
from dem_demo import Simulation, parse, run
from dem_demo.output.pictures import Pictures, curves
from jointlaw.cli.main import main as jointlaw_main
from jointlaw.support.pyplot import style

DRAW = Path(__file__).parents[2] / "docs" / "draw"
SCRIPTS = [path for path in sorted(DRAW.glob("*.py")) if "__main__" in path.read_text()]
NAMED_WITH_DOLLARS = f"""
title = "Costs $2 or $3 \\\\math"
[laws.plain]
{PLAIN}{block("base", box=[4.0, 1.0], at=[0.5, -0.5], fixed=True)}
{block("$a_b$", box=[1.0, 0.5], at=[0.0, 0.25])}
[monitor]
shear = [["$a_b$", "base"]]
[run]
end = 0.01
"""


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_pictures_of_pages(script, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(script.parent)
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    runpy.run_path(str(script), run_name="__main__")
    assert list(tmp_path.iterdir())


def test_a_logarithmic_axis_is_typeset_and_its_source_is_found():
    with style() as plt:
        figure, axes = plt.subplots()
        axes.loglog([1e-3, 1e3], [1.0, 1e4])
        assert tex_source(figure) == []
        assert any("mathdefault" in text.get_text() for text in visible_texts(figure))
    with style() as plt, plt.rc_context({"text.parse_math": False}):
        figure, axes = plt.subplots()
        axes.loglog([1e-3, 1e3], [1.0, 1e4])
        assert r"$\mathdefault{10^{0}}$" in tex_source(figure)


def pixels(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())


def test_names_with_dollars_are_drawn_as_given(tmp_path, monkeypatch):
    """The same picture as matplotlib draws of the given texts with mathematics switched off."""
    record, _ = run(Simulation(parse(NAMED_WITH_DOLLARS)), pictures=None)
    saved = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: saved.append(figure))
    Pictures(record).final(tmp_path / "final.png")
    curves(record, tmp_path / "curves.png")
    for figure in saved:
        texts = [text for text in visible_texts(figure) if r"\$" in text.get_text()]
        assert texts
        assert not any(is_typeset(text) for text in visible_texts(figure))
        pixels(figure)
        figure.set_layout_engine("none")  # a second layout would move parts by less than a pixel
        drawn = pixels(figure)
        for text in texts:
            text.set_text(text.get_text().replace(r"\$", "$"))
            text.set_parse_math(False)
        np.testing.assert_array_equal(drawn, pixels(figure))


def test_pictures_of_laboratory_tests():
    law = jl.presets.load("biegel-rough")
    for record in (
        jl.closure_test(law.joint(), 5e6),
        jl.direct_shear(law.joint(), 1e-6, normal=5e6),
    ):
        assert tex_source(record.plot()) == []
    pyplot.close("all")


def test_pictures_of_a_fit(tmp_path):
    words = ["fit", "grimsel_vd1_closure", "--up-to", "5.3MPa", "--out", str(tmp_path)]
    assert jointlaw_main(words) == 0
    assert (tmp_path / "fit.png").exists()
