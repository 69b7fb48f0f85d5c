"""Examples run as a reader runs them: in an empty folder, without a display.

No picture that they save, and no frame of an animation, shows TeX source.
"""

import figure_text
import pytest


@pytest.fixture(autouse=True)
def _without_a_display(in_an_empty_folder):
    from matplotlib import pyplot

    pyplot.switch_backend("Agg")
    yield
    pyplot.close("all")


@pytest.fixture(autouse=True)
def _no_picture_shows_tex_source(monkeypatch):
    from matplotlib.figure import Figure

    save, result = Figure.savefig, []

    def save_and_check(figure, *arguments, **options):
        result.extend(figure_text.tex_source(figure))
        return save(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", save_and_check)
    yield
    assert result == []
