"""README.md and the pages of the docs.

Python and short commands run as printed, and all commands exist. The pages are complete: every
equation of the paper, every default, links whose target exists, terms that a reader searches for,
error messages as the code has them.
"""

import ast
import contextlib
import importlib.util
import io
import re
import shlex
import tomllib
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import dem_demo.cli
import jointlaw as jl
from dem_demo.scene import Run
from jointlaw.calibration.priors import PRIORS
from jointlaw.cli.main import COMMANDS
from jointlaw.cli.main import main as jointlaw_main

ROOT = Path(__file__).parents[2]
PAGES = {str(p.relative_to(ROOT)): p for p in [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]}


def text(page):
    return PAGES[page].read_text(encoding="utf-8")


def blocks(page, *languages):
    """Fenced blocks of a page in these languages."""
    result = re.findall(r"^```(\w*)\n(.*?)^```$", text(page), re.DOTALL | re.MULTILINE)
    return [block for language, block in result if language in languages]


def commands(page):
    """Command lines of a page, fenced or indented, as typed in an activated environment."""
    shell = "\n".join(blocks(page, "bash", "console", ""))
    indented = re.findall(r"^    ((?:jointlaw|python) .*)$", text(page), re.MULTILINE)
    lines = [line.split("  #")[0].strip() for line in [*shell.splitlines(), *indented]]
    lines = [part.strip() for line in lines for part in line.split("&&")]
    return [line.replace(".venv/bin/", "") for line in lines]


CITATION_KEYS = "volume", "issue", "year"
# runs in YADE's own Python: tests/hosts/test_yade_table.py; tutorials: test_tutorials.py
ELSEWHERE = {"docs/particles.md", *(page for page in PAGES if "/tutorial-" in page)}
CHECKS = {  # of the variables of the examples of a page
    # a point of the data
    "docs/fits.md": lambda names: names["fit"].predict(100e-6) == pytest.approx(6.4e6, rel=0.02),
    "docs/embed.md": lambda names: names["slid"] > 1e-3,  # 41 degrees is beyond its friction
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
    """All blocks of a page share one namespace, as the cells of a notebook do.

    The page shows each line that they print, in a comment or below.
    """
    names, output = {"__name__": "__main__"}, io.StringIO()
    with contextlib.redirect_stdout(output):
        for number, block in enumerate(blocks(page, "python")):
            exec(compile(block, f"{page}, block {number + 1}", "exec"), names)
    assert page not in CHECKS or CHECKS[page](names)
    assert [line for line in output.getvalue().splitlines() if line not in text(page)] == []


# by what they begin with: too long for here, and what runs the same instead
LONG = {
    "jointlaw fit closure.csv --shear": "tests/verification/test_fit_shear_files.py",
    "jointlaw fit closure.csv --cycle --flow": "tests/verification/test_aperture.py",
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
    for line in {
        line
        for page in PAGES
        if "/tutorial-" not in page  # test_tutorials.py runs their commands in their order
        for line in commands(page)
    }
    if re.match(r"(jointlaw|python -m (jointlaw|dem_demo)) ", line)
)


@pytest.fixture
def _files_that_the_reader_has(monkeypatch):
    monkeypatch.setenv("BROWSER", "true")  # opens nothing
    z = gaussian_filter(np.random.default_rng(0).standard_normal((400, 400)), 5)
    np.savetxt("scan.csv", 400 * z, delimiter=",")
    Path("block.toml").write_text(blocks("docs/blocks.md", "toml")[0])
    Path("my-rock.toml").write_text(blocks("docs/space.md", "toml")[0])


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


def without_code_and_pictures(markdown):
    return re.sub(r"```.*?```|!\[[^\]]*\]\([^)]*\)", "", markdown, flags=re.DOTALL)


def test_readme_reaches_its_first_command_in_90_words_and_one_number():
    """Code and pictures are not counted."""
    opening = without_code_and_pictures(text("README.md").partition("```bash")[0])
    assert len(re.findall(r"\w[\w'-]*", opening)) <= 90
    assert len(re.findall(r"\d+(?:\.\d+)*", opening)) <= 1


def test_pages_cite_the_paper_as_the_citation_file_does():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    cited = [re.search(rf"^    {key}: (\w+)$", citation, re.M)[1] for key in CITATION_KEYS]
    citations = {}
    for name, page in PAGES.items():
        words = " ".join(page.read_text(encoding="utf-8").split())
        for one in re.findall(r"J\. Geophys\. Res\. (\d+)\((\w+)\), (\d{4})", words):
            citations[name] = [*one]
    assert {"README.md", "docs/theory.md"} <= {*citations}
    assert citations == dict.fromkeys(citations, cited)


def test_readme_names_the_oldest_python():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (named,) = re.findall(r"Python (\d\.\d+) or newer", PAGES["README.md"].read_text("utf-8"))
    assert project["requires-python"] == f">={named}"


def test_readme_shares_its_first_part_with_the_first_page_of_the_site():
    spec = importlib.util.spec_from_file_location("pages", ROOT / "docs" / "_ext" / "pages.py")
    pages = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(pages)
    assert pages.PLACE in text("docs/index.md")
    displayed = pages.links(pages.first_part())
    assert blocks("README.md", "python")[0] in displayed
    assert displayed.count("```bash") == 2
    targets = re.findall(r"\]\(([^)#\s]+)|src=\"([^\"]+)", displayed)
    targets = [link or picture for link, picture in targets]
    inside = [target for target in targets if "://" not in target and "examples/" not in target]
    inside = [
        target for target in inside if not target.startswith("figures/")
    ]  # made by the gallery
    assert len(inside) > 20
    assert [target for target in inside if not (ROOT / "docs" / target).exists()] == []


@pytest.mark.parametrize("page", PAGES)
def test_cells_of_tables_are_short(page):
    """Longer ones belong into the text."""
    rows = [line for line in text(page).splitlines() if line.startswith("|")]
    assert [cell for row in rows for cell in row.split("|") if len(cell.split()) > 40] == []


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_names_exists(page):
    """Links as on GitHub, the site's own are checked where it is built; files, and commands."""
    links = re.findall(r"(?:\]\(|<img src=\")([^)#\s\"]+)", text(page))
    links = [link for link in links if "://" not in link]
    files = re.findall(r"(?:python|pytest) ((?:docs|benchmarks|tests)/?[\w/.]*)", text(page))
    named = [PAGES[page].parent / link for link in links] + [ROOT / file for file in files]
    assert [path for path in named if not path.exists()] == []
    commands = re.findall(r"`jointlaw ([a-z]\w*)", text(page))
    assert set(commands) <= {command.name for command in COMMANDS}


def test_every_picture_is_on_a_page():
    pictures = {path.name for path in (ROOT / "docs" / "pictures").iterdir()}
    displayed = {name for page in PAGES for name in re.findall(r"pictures/([\w.-]+)", text(page))}
    assert pictures == displayed


@pytest.mark.parametrize("one", [one for one in fields(Run) if one.default not in (MISSING, None)])
def test_the_page_gives_the_default_of_each_key_of_a_run(one):
    keys = text("docs/blocks.md").partition("## The keys of")[2]
    (row,) = re.findall(rf"^\|.*`{one.name}`.*\|.*$", keys, re.MULTILINE)
    assert f"({str(one.default).lower()})" in row


TERMS = (
    """
GPU, CUDA, OpenMP, threads, benchmark, tutorial, checkpoint, restart, licence, tensile strength,
interlock, Mohr-Coulomb, unbalanced force, contact detection, post-peak softening, confidence
interval, cyclic, degradation, seismic, CNL, CNS, history variable, troubleshooting
""".replace("\n", " ")
    .strip()
    .split(", ")
)


@pytest.mark.parametrize("term", TERMS)
def test_pages_use_the_standard_term(term):
    """Read by a person: in the text of a page, not in its code."""
    words = re.escape(term).replace(r"\ ", r"\s+")
    prose = [without_code_and_pictures(text(page)) for page in PAGES]
    assert any(re.search(rf"\b{words}s?\b", one, re.IGNORECASE) for one in prose)


@pytest.fixture(scope="module")
def search_index(tmp_path_factory):
    """Terms of the search of the site, each with the numbers of its pages.

    The pages are built without the gallery and the reference of functions, which take minutes.
    """
    application = pytest.importorskip("sphinx.application")  # comes with the extra `docs`
    pytest.importorskip("sphinx_gallery")
    from sphinx.util.docutils import docutils_namespace

    out = tmp_path_factory.mktemp("site")
    quick = {"extensions": ["myst_parser", "pages"], "html_theme": "basic", "html_static_path": []}
    with docutils_namespace():
        site = application.Sphinx(
            ROOT / "docs", ROOT / "docs", out, out / "doctrees", "html", quick, status=None,
            warning=None,
        )  # fmt: skip
        site.build()
        index = site.builder.indexer
        return index.lang, index.freeze()


@pytest.mark.slow
@pytest.mark.parametrize("term", TERMS)
def test_search_of_the_site_finds(search_index, term):
    """One page has all words of the term, after the stemming that the search applies to them."""
    language, frozen = search_index
    result = [
        {index}
        if isinstance(index := frozen["terms"].get(stem, frozen["titleterms"].get(stem, [])), int)
        else set(index)
        for stem in (language.stem(word.lower()) for word in re.findall(r"\w+", term))
    ]
    assert set.intersection(*result)


def messages():
    """Text of every string of the sources, with `...` for what is filled in."""
    for path in [*ROOT.glob("jointlaw/**/*.py"), *ROOT.glob("dem_demo/**/*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = (getattr(part, "value", "...") for part in node.values)
                yield "".join(part if isinstance(part, str) else "..." for part in parts)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
    yield from (path.read_text(encoding="utf-8") for path in ROOT.glob("jointlaw/**/*.cpp"))


ELSEWHERE_SAID = {"No module named 'pymunk'", "jointlaw: command not found"}  # Python, the shell


def test_troubleshooting_quotes_messages_as_the_code_has_them():
    rows = re.findall(r"^\| (.+?) \|", text("docs/troubleshooting.md"), re.MULTILINE)
    quoted = {quote for row in rows for quote in re.findall(r"`([^`]+)`", row)}
    quoted = {quote for quote in quoted if " " in quote} - ELSEWHERE_SAID
    assert len(quoted) > 20
    sources = "\n".join(messages())
    assert [quote for quote in sorted(quoted) if quote not in sources] == []


def test_the_table_of_priors_has_every_prior():
    table = text("docs/fits.md").split("| prior | range |")[1].split("\n\n")[0]
    first_cells = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    assert set(re.findall(r"`(\w+)`", "".join(first_cells))) == set(PRIORS)
