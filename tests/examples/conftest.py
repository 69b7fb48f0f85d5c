"""Examples run as a reader runs them: in an empty folder, without a display."""

import pytest


@pytest.fixture(autouse=True)
def _without_a_display(in_an_empty_folder):
    from matplotlib import pyplot

    pyplot.switch_backend("Agg")
    yield
    pyplot.close("all")
