"""The figures of the paper: they are drawn, complete, and written as they say."""

import argparse
import csv
import io
import json

import numpy as np
import pytest

from jointlaw.cli import figures
from jointlaw.paper.contents import FIGURES, drawn, rendered, write_figures

pytest.importorskip("matplotlib")

LOADED = (11, 12, 13, 14, 15, 16, 17, 18, 19)  # involve loading: both forms side by side
QUICK = [4, 5, 8, 9]


@pytest.mark.parametrize("number", FIGURES)
def test_every_figure_has_finite_curves_units_and_a_caption(number):
    figure = FIGURES[number]
    assert len(figure.caption) > 80
    png, curves = rendered(figure)
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    rows = list(csv.DictReader(io.StringIO(curves)))
    assert len(rows) > 30
    assert all(row["x_axis"] and row["y_axis"] and row["curve"] for row in rows)
    values = np.array([[float(row["x"]), float(row["y"])] for row in rows])
    assert np.isfinite(values).all()
    titles = {row["panel"] for row in rows}
    assert len(titles) == figure.panels
    if number in LOADED:
        assert "total form" in " ".join(titles)
        assert "incremental law" in " ".join(titles)


def test_all_figures_of_the_paper_that_have_content_are_drawn():
    assert set(FIGURES) == set(range(3, 20))


def test_figures_show_the_ranges_that_the_text_quotes():
    _, right = drawn(FIGURES[8]).axes
    measured, hertz = (patch.get_bbox() for patch in right.patches)
    assert (measured.y0, measured.y1) == (0.78, 1.1)
    assert (hertz.x0, hertz.x1) == (0.67, 1.0)


def test_angles_are_written_in_degrees():
    rows = list(csv.DictReader(io.StringIO(rendered(FIGURES[9])[1])))
    assert [float(row["x"]) for row in rows[:181]] == list(range(0, 361, 2))


def test_files_and_summary(tmp_path):
    files = write_figures(tmp_path, [6, 5])  # 6 is drawn together with 4
    names = sorted(path.name for path in files)
    assert names == [
        "figure-04-06.csv", "figure-04-06.png", "figure-05.csv", "figure-05.png", "summary.json",
    ]  # fmt: skip
    assert all(path.stat().st_size > 0 for path in files)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["figures"]["figure-05"]["caption"] == FIGURES[5].caption


@pytest.mark.parametrize("number", [0, 1, 2, 20])
def test_unknown_figure_is_refused_before_anything_is_written(tmp_path, number):
    with pytest.raises(ValueError, match=f"figure {number}"):
        write_figures(tmp_path / "out", [5, number])
    assert not (tmp_path / "out").exists()


def run(*arguments):
    parser = argparse.ArgumentParser()
    figures.add(parser.add_subparsers())
    options = parser.parse_args(["figures", *arguments])
    options.run(options)


def test_command_draws(tmp_path, capsys):
    run(*map(str, QUICK), "--out", str(tmp_path))
    assert "9 files" in capsys.readouterr().out
    assert (tmp_path / "figure-08.png").exists()


def test_command_prints_claims(capsys):
    run("--claims", "hertz-mindlin-ratio", "frictionless-c11p")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4  # head, rule and two claims
    assert "0.8235" in lines[2]


@pytest.mark.parametrize("arguments", [["5"], ["5", "--claims"], ["--claims", "no-such-claim"]])
def test_command_refuses(arguments):
    with pytest.raises(ValueError, match=r"--out|--claims|no-such-claim"):
        run(*arguments)
