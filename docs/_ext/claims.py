"""The table of the paper's claims on the page docs/theory.md, made from the tests of the claims.

A docstring in tests/verification/test_paper_*.py has one paragraph for each claim that its test
decides: "PLACE: statement of the paper", then a line that begins with one of VERDICTS, and our
finding. The tests are parsed as text, never imported.
"""

import ast
import re
from pathlib import Path

TESTS = Path(__file__).parents[2] / "tests" / "verification"
VERDICTS = "Holds|Misprint|In part|One reading|Fails"
CLAIM = re.compile(rf"([^:]+): (.+)\n({VERDICTS})(?:: (.+))?", re.DOTALL)


def module_of(path):
    """Return the syntax tree of a Python file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def title_of(path):
    """Return the first line of the docstring of a Python file."""
    return ast.get_docstring(module_of(path)).splitlines()[0]


def claims(path):
    """Yield the cells of each row for one file: place, statement, verdict, our finding, test."""
    for test in module_of(path).body:
        if not (isinstance(test, ast.FunctionDef) and test.name.startswith("test_")):
            continue
        for paragraph in filter(None, (ast.get_docstring(test) or "").split("\n\n")):
            claim = CLAIM.fullmatch(paragraph.strip())
            if claim is None:
                raise ValueError(f"{path.name}, {test.name}: not a claim: {paragraph!r}")
            yield *(cell or "" for cell in claim.groups()), f"`{test.name}`"


def tables():
    """Return a heading and a Markdown table for each file, in the order of the paper."""
    parts = []
    for path in sorted(TESTS.glob("test_paper_*.py")):
        rows = [
            [re.sub(r"\s+", " ", cell).replace("|", r"\|") for cell in row] for row in claims(path)
        ]
        if rows:
            head = ["Place", "The paper says", "Verdict", "We find", "Test"]
            lines = [f"| {' | '.join(row)} |" for row in (head, ["---"] * 5, *rows)]
            parts.append("\n".join([f"### {title_of(path).rstrip('.')}\n", *lines]))
    return "\n\n".join(parts)


def figures():
    """Return the pictures of the paper's figures, each with a link to its page."""
    lines = []
    for path in sorted(TESTS.parents[1].glob("docs/paper/plot_*.py")):
        picture = f"figures/images/sphx_glr_{path.stem}_001.png"
        lines.append(f"[![{title_of(path)}]({picture})](figures/{path.stem}.rst)")
    return "\n".join([*lines, ""])


def fill(app, name, source):
    """Replace the marks of the page docs/theory.md by the tables and the figures."""
    if name == "theory":
        source[0] = source[0].replace("paper/GALLERY_HEADER.rst", "figures/index.rst")
        source[0] = source[0].replace("<!-- claims -->", tables())
        source[0] = source[0].replace("<!-- figures -->", figures())


def setup(app):
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
