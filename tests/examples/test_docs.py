"""README.md and the pages of the docs: Python and short commands run as printed, all commands
exist. A page holds what it must: every equation of the paper, every default, links that lead on."""

import contextlib
import io
import re
import shlex
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import dem_demo.cli
import jointlaw as jl
from dem_demo.scene import Run
from jointlaw.cli.main import COMMANDS
from jointlaw.cli.main import main as jointlaw_main

ROOT = Path(__file__).parents[2]
PAGES = {str(p.relative_to(ROOT)): p for p in [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]}


def text(page):
    return PAGES[page].read_text(encoding="utf-8")


def blocks(page, *languages):
    """Fenced blocks of a page in these languages."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text(page), re.DOTALL | re.MULTILINE)
    return [block for language, block in found if language in languages]


def commands(page):
    """Command lines of a page, fenced or indented, as typed in an activated environment."""
    shell = "\n".join(blocks(page, "bash", "console", ""))
    indented = re.findall(r"^    ((?:jointlaw|python) .*)$", text(page), re.MULTILINE)
    lines = [line.split("  #")[0].strip() for line in [*shell.splitlines(), *indented]]
    lines = [part.strip() for line in lines for part in line.split("&&")]
    return [line.replace(".venv/bin/", "") for line in lines]


ELSEWHERE = {"docs/particles.md"}  # runs in YADE's own Python: tests/hosts/test_yade_table.py
# the first block of README.md is one line of a host's loop
GIVEN = {"README.md": lambda: {"joint": jl.presets.load("linear-a3").joint(), "d": [1e-9, 0, 0]}}
CHECKS = {  # what the names and the printed lines of a page must be
    "README.md": lambda names, printed: (
        names["joint"].delta[:2] == pytest.approx([2e-7, 1e-7])
        and "J/m2 lost to friction" in printed[0]
    ),
    "docs/field.md": lambda _, printed: all(line in text("docs/field.md") for line in printed),
    # a point of the data
    "docs/fits.md": lambda names, _: names["fit"].predict(100e-6) == pytest.approx(6.4e6, rel=0.02),
    "docs/embed.md": lambda names, _: names["slid"] > 1e-3,  # 41 degrees is beyond its friction
}
QUICK = ("README.md", "docs/start.md", "docs/embed.md")


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.slow] * (page not in QUICK))
        for page in PAGES
        if blocks(page, "python") and page not in ELSEWHERE
    ],
)
def test_blocks_run_as_printed(page):
    """All of a page in one namespace, as in a notebook."""
    names, printed = {"__name__": "__main__"} | GIVEN.get(page, dict)(), io.StringIO()
    with contextlib.redirect_stdout(printed):
        for number, block in enumerate(blocks(page, "python")):
            exec(compile(block, f"{page}, block {number + 1}", "exec"), names)
    assert page not in CHECKS or CHECKS[page](names, printed.getvalue().splitlines())


# by what they begin with: too long for here, and what runs the same instead
LONG = {
    "jointlaw fit closure.csv --shear": "tests/verification/test_fit_shear_files.py",
    "jointlaw shear out/specimen/law.toml": "tests/verification/test_fit_shear_files.py",
    "jointlaw fit grimsel_vd1_closure --out": "tests/unit/test_commands.py",
    "python -m dem_demo ablate SCENE": "tests/examples/test_rocks.py",
    "python -m dem_demo new my-slope.toml": "tests/examples/test_rocks.py",
    "python -m dem_demo check my-slope.toml": "tests/examples/test_rocks.py",
    "python -m dem_demo my-slope.toml": "tests/examples/test_rocks.py",
    "python -m dem_demo compare": "tests/examples/test_rocks.py",
    "python -m dem_demo strength-reduction": "tests/verification/test_strength_reduction.py",
    "python -m dem_demo tilt": "tests/verification/test_blocks_tilt.py",
}
FOUND = sorted(
    line
    for line in {line for page in PAGES for line in commands(page)}
    if re.match(r"(jointlaw|python -m (jointlaw|dem_demo)) ", line)
)


@pytest.fixture
def _files_that_the_reader_has(monkeypatch):
    monkeypatch.setenv("BROWSER", "true")  # opens nothing
    z = gaussian_filter(np.random.default_rng(0).standard_normal((400, 400)), 5)
    np.savetxt("scan.csv", 400 * z, delimiter=",")
    Path("block.toml").write_text(blocks("docs/blocks.md", "toml")[0])


@pytest.mark.slow
@pytest.mark.usefixtures("_files_that_the_reader_has")
@pytest.mark.parametrize("line", [line for line in FOUND if not line.startswith(tuple(LONG))])
def test_short_commands_run(line):
    words = shlex.split(line)
    words = words[words.index("-m") + 1 :] if "-m" in words else words
    main = {"jointlaw": jointlaw_main, "dem_demo": dem_demo.cli.main}[words[0]]
    assert main(words[1:]) == 0
    if "--out" in words:
        assert any(Path(words[words.index("--out") + 1]).iterdir())


def test_long_commands_are_still_printed():
    for beginning, test in LONG.items():
        assert any(line.startswith(beginning) for line in FOUND), beginning
        assert (ROOT / test).exists(), test


def test_theory_leaves_no_equation_out():
    placed = set()
    for mention in re.findall(r"Eq\. (\d[\d, -]*)", text("docs/theory.md")):
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", mention):
            placed |= set(range(int(first), int(last or first) + 1))
    assert placed >= set(range(1, 38))


def test_files_for_a_code_host_can_be_read():
    """The citation has the version and the one address; the checks are those of .ci/run."""
    yaml = pytest.importorskip("yaml")  # comes with the extra `docs`
    read = {path.name: yaml.safe_load(path.read_text(encoding="utf-8"))
            for path in (ROOT / "CITATION.cff", *ROOT.glob(".github/workflows/*.yml"))}  # fmt: skip
    assert read["CITATION.cff"]["version"] == jl.__version__
    assert read["CITATION.cff"]["repository-code"].startswith("https://")
    assert read["ci.yml"]["jobs"]["all"]["steps"][-1] == {"run": "bash .ci/run"}
    assert set(read["wheels.yml"]["jobs"]) == {"build", "publish"}


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_a_command_stands_beside_every_number(page):
    """In the last table of validation.md; code and versions of Python apart."""
    table = text("docs/validation.md").split("## Numbers of the README")[1].split("##")[0]
    prose = re.sub(r"```.*?```|`[^`]*`|Python [\d.]+", "", text(page), flags=re.DOTALL)
    numbers = set(re.findall(r"(?<![\w.])[-+]?\d+\.\d+", prose))
    assert numbers <= set(re.findall(r"(?<![\w.])[-+]?\d+\.\d+", table))


@pytest.mark.parametrize("page", PAGES)
def test_cells_of_tables_are_short(page):
    """Longer ones belong into the text."""
    rows = [line for line in text(page).splitlines() if line.startswith("|")]
    assert [cell for row in rows for cell in row.split("|") if len(cell.split()) > 40] == []


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_names_exists(page):
    """Links as on GitHub, the site's own are checked where it is built; files, and commands."""
    links = [link for link in re.findall(r"\]\(([^)#\s]+)", text(page)) if "://" not in link]
    files = re.findall(r"(?:python|pytest) ((?:docs|benchmarks|tests)/?[\w/.]*)", text(page))
    named = [PAGES[page].parent / link for link in links] + [ROOT / file for file in files]
    assert [path for path in named if not path.exists()] == []
    commands = re.findall(r"`jointlaw ([a-z]\w*)", text(page))
    assert set(commands) <= {command.name for command in COMMANDS}


@pytest.mark.parametrize("one", [one for one in fields(Run) if one.default not in (MISSING, None)])
def test_the_page_tells_the_default_of_each_key_of_a_run(one):
    keys = text("docs/blocks.md").partition("## The keys of")[2]
    (row,) = re.findall(rf"^\|.*`{one.name}`.*\|.*$", keys, re.MULTILINE)
    assert f"({str(one.default).lower()})" in row
