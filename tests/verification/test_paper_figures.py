"""The figures of the paper: they are drawn, complete, and written as they say."""

import argparse
import csv
import io
import json

import numpy as np
import pytest

from jointlaw.cli.figures import add_figures_command
from jointlaw.paper import figures
from jointlaw.paper.figures.captions import CAPTIONS

pytest.importorskip("matplotlib")

LOADED = (11, 12, 13, 14, 15, 16, 17, 18, 19)  # involve loading: both forms side by side
QUICK = [4, 5, 8, 9]


@pytest.mark.parametrize("number", figures.FIGURES)
def test_every_figure_has_finite_curves_units_and_a_caption(number):
    page = figures.FIGURES[number]()
    assert len(page.caption) > 80
    rows = list(csv.DictReader(io.StringIO(page.csv())))
    assert len(rows) > 30
    values = np.array([[float(row["x"]), float(row["y"])] for row in rows])
    assert np.isfinite(values).all()
    if number in LOADED:
        titles = " ".join(panel.title for panel in page.panels)
        assert "total form" in titles
        assert "incremental law" in titles
    for panel in page.panels:
        assert panel.x
        assert panel.y
    assert figures.png(page)[:8] == b"\x89PNG\r\n\x1a\n"


def test_every_caption_has_its_figure():
    drawn = {3, 4, 5, 7, 8, 9, *range(10, 20)}
    assert set(figures.FIGURES) == drawn
    assert len(CAPTIONS) == len(drawn)


def test_figures_show_the_ranges_that_the_text_quotes():
    (_, right) = figures.FIGURES[8]().panels
    ranges = {(band.axis, band.low, band.high) for band in right.bands}
    assert ranges == {("y", 0.78, 1.1), ("x", 0.67, 1.0)}


def test_files_and_summary(tmp_path):
    files = figures.write(tmp_path, [6, 5])  # 6 is drawn together with 4
    names = sorted(path.name for path in files)
    assert names == [
        "figure-04-06.csv", "figure-04-06.png", "figure-05.csv", "figure-05.png", "summary.json",
    ]  # fmt: skip
    assert all(path.stat().st_size > 0 for path in files)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["figures"]["figure-05"]["caption"] == CAPTIONS["05"][1]


@pytest.mark.parametrize("number", [0, 1, 2, 20])
def test_unknown_figure_is_refused_before_anything_is_written(tmp_path, number):
    with pytest.raises(ValueError, match=f"figure {number}"):
        figures.write(tmp_path / "out", [5, number])
    assert not (tmp_path / "out").exists()


def run(*arguments):
    parser = argparse.ArgumentParser()
    add_figures_command(parser.add_subparsers())
    options = parser.parse_args(["figures", *arguments])
    return options.run(options)


def test_command_draws(tmp_path, capsys):
    assert run(*map(str, QUICK), "--out", str(tmp_path)) == 0
    assert "9 files" in capsys.readouterr().out
    assert (tmp_path / "figure-08.png").exists()


def test_command_prints_claims(capsys):
    assert run("--claims", "hertz-mindlin-ratio", "frictionless-c11p") == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4  # head, rule and two claims
    assert "0.8235" in lines[2]


@pytest.mark.parametrize("arguments", [["5"], ["5", "--claims"], ["--claims", "no-such-claim"]])
def test_command_refuses(arguments):
    with pytest.raises(ValueError, match=r"--out|--claims|no-such-claim"):
        run(*arguments)
