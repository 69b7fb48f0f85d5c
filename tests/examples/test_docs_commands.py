"""The commands of the docs: short ones run, all of them exist."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from pages import PAGES, ROOT, blocks, commands, text
from scipy.ndimage import gaussian_filter

import dem_demo.cli
from jointlaw.cli.main import COMMANDS
from jointlaw.cli.main import main as jointlaw_main

# by what they begin with: too long for here, and what runs the same instead
LONG = {
    "jointlaw fit closure.csv --shear": "tests/verification/test_fit_shear_files.py",
    "jointlaw shear out/specimen/law.toml": "tests/verification/test_fit_shear_files.py",
    "jointlaw fit grimsel_vd1_closure --out": "tests/unit/test_fit_command.py",
    "python -m dem_demo ablate SCENE": "tests/examples/test_ablate.py",
    "python -m dem_demo new my-slope.toml": "tests/examples/test_rocks.py",
    "python -m dem_demo check my-slope.toml": "tests/examples/test_rocks.py",
    "python -m dem_demo my-slope.toml": "tests/examples/test_rocks.py",
    "python -m dem_demo compare": "tests/examples/test_rocks.py",
    "python -m dem_demo strength-reduction": "tests/verification/test_strength_reduction.py",
    "python -m dem_demo tilt": "tests/verification/test_blocks_tilt.py",
}
MINE = re.compile(r"(jointlaw|python -m (?:jointlaw|dem_demo)) ")
FOUND = sorted({line for page in PAGES for line in commands(page) if MINE.match(line)})


def is_long(line):
    return any(line.startswith(beginning) for beginning in LONG)


@pytest.fixture
def _files_that_the_reader_has(monkeypatch):
    monkeypatch.setenv("BROWSER", "true")  # opens nothing
    z = gaussian_filter(np.random.default_rng(0).standard_normal((400, 400)), 5)
    np.savetxt("scan.csv", 400 * z, delimiter=",")
    Path("block.toml").write_text(blocks("docs/blocks.md", "toml")[0])


@pytest.mark.slow
@pytest.mark.usefixtures("_files_that_the_reader_has")
@pytest.mark.parametrize("line", [line for line in FOUND if not is_long(line)])
def test_short_commands_run(line):
    words = shlex.split(line)
    words = words[words.index("-m") + 1 :] if "-m" in words else words
    main = {"jointlaw": jointlaw_main, "dem_demo": dem_demo.cli.main}[words[0]]
    assert main(words[1:]) == 0
    if "--out" in words:
        assert any(Path(words[words.index("--out") + 1]).iterdir())


def test_long_commands_are_still_printed():
    for beginning in LONG:
        assert any(line.startswith(beginning) for line in FOUND), beginning


@pytest.mark.parametrize("page", PAGES)
def test_what_commands_name_exists(page):
    for name in re.findall(r"(?:python|pytest) ((?:docs|benchmarks|tests)/?[\w/.]*)", text(page)):
        assert (ROOT / name).exists(), f"{page} names {name}"
    known = {command.name for command in COMMANDS}
    assert set(re.findall(r"`jointlaw ([a-z]\w*)", text(page))) <= known, page
