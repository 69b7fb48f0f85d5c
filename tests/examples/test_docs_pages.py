"""What the pages must hold: every equation of the paper, every public name, links that lead on."""

import re

import pytest
from pages import PAGES, text


def test_theory_leaves_no_equation_out():
    placed = set()
    for mention in re.findall(r"Eq\. (\d[\d, -]*)", text("docs/theory.md")):
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", mention):
            placed |= set(range(int(first), int(last or first) + 1))
    assert placed >= set(range(1, 38))


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files(page):
    """As on GitHub; the site's own links are checked where it is built."""
    for target in re.findall(r"\]\(([^)#\s]+)", text(page)):
        if "://" not in target:
            assert (PAGES[page].parent / target).exists(), target
