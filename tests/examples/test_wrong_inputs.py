"""Every row of docs/wrong-inputs.md: what it says and its exit code. None passes in silence."""

import re
import shlex

import pytest
import wrong_files
from pages import text

import dem_demo.cli
from jointlaw.cli.main import main as jointlaw_main

ROW = re.compile(r"^\| (.+?) \| `(jointlaw|python -m dem_demo) (.+?)` \| (.+) \| (\d+) \|$", re.M)
ROWS = ROW.findall(text("docs/wrong-inputs.md"))


@pytest.mark.parametrize(("program", "words", "message", "status"), [row[1:] for row in ROWS])
def test_row(tmp_path, capsys, program, words, message, status):
    wrong_files.make(tmp_path)
    main = jointlaw_main if program == "jointlaw" else dem_demo.cli.main
    assert main(shlex.split(words)) == int(status)
    told = capsys.readouterr().err
    assert message in told
    assert len(told.splitlines()) == 1
    assert not (tmp_path / "out").exists()  # nothing is left of a refused command
    assert (tmp_path / "done" / "shear.csv").read_text() == "of an earlier run"


def test_no_row_is_missed():
    """A row that the pattern does not read would be a row without a test."""
    page = text("docs/wrong-inputs.md").split("Two more")[0]
    assert len(ROWS) == page.count("\n| ") - 1 >= 40


@pytest.mark.parametrize("folder", ["done", "new"])
def test_force_replaces_a_run_whole(tmp_path, folder):
    """What the other run wrote is gone, what the user put there stays."""
    wrong_files.make(tmp_path)
    (tmp_path / "done" / "notes.txt").write_text("mine")
    line = f"closure linear-a3 --steps 3 --force --out {folder}"
    assert jointlaw_main(line.split()) == 0
    assert (tmp_path / folder / "closure.csv").is_file()
    assert not (tmp_path / folder / "shear.csv").exists()
    assert (tmp_path / "done" / "notes.txt").read_text() == "mine"
    again = f"{line.replace(' --force', '')}"
    assert jointlaw_main(again.split()) == 2
