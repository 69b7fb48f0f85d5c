"""What the pages must hold: every equation of the paper, every public name, links that lead on."""

import re

import pytest
from pages import PAGES, ROOT, text

import jointlaw


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
    assert read["CITATION.cff"]["version"] == jointlaw.__version__
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
def test_links_lead_to_files(page):
    """As on GitHub; the site's own links are checked where it is built."""
    for target in re.findall(r"\]\(([^)#\s]+)", text(page)):
        if "://" not in target:
            assert (PAGES[page].parent / target).exists(), target
