"""The table of the paper's claims on the page docs/theory.md, made from the tests of the claims.

A docstring in tests/verification/test_paper_*.py holds one paragraph for each claim that its test
decides: "PLACE: what the paper says", and from the next line that begins with one of VERDICTS on,
what we find. The tests are read as text, never imported.
"""

import ast
import re
from pathlib import Path

TESTS = Path(__file__).parents[2] / "tests" / "verification"
VERDICTS = "Holds|Misprint|In part|One reading|Fails"
CLAIM = re.compile(rf"([^:]+): (.+)\n({VERDICTS})(?:: (.+))?", re.DOTALL)


def claims(path):
    """Cells of the rows of one file: place, what the paper says, verdict, our finding, test."""
    for test in ast.parse(path.read_text(encoding="utf-8")).body:
        named = isinstance(test, ast.FunctionDef) and test.name.startswith("test_")
        for paragraph in filter(
            None, (ast.get_docstring(test) or "" if named else "").split("\n\n")
        ):
            found = CLAIM.fullmatch(paragraph.strip())
            if found is None:
                raise ValueError(f"{path.name}, {test.name}: not a claim: {paragraph!r}")
            yield *(cell or "" for cell in found.groups()), f"`{test.name}`"


def tables():
    """A heading and a table in Markdown for each file, in the order of the paper."""
    parts = []
    for path in sorted(TESTS.glob("test_paper_*.py")):
        rows = [[re.sub(r"\s+", " ", x).replace("|", r"\|") for x in row] for row in claims(path)]
        if rows:
            title = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))).splitlines()[0]
            head = ["Place", "The paper says", "Verdict", "We find", "Test"], ["---"] * 5
            lines = [f"| {' | '.join(row)} |" for row in (*head, *rows)]
            parts.append("\n".join([f"### {title.rstrip('.')}\n", *lines]))
    return "\n\n".join(parts)


def figures():
    """The pictures of the paper's figures, each leading to its page."""
    lines = []
    for path in sorted(TESTS.parents[1].glob("docs/paper/plot_*.py")):
        title = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))).splitlines()[0]
        picture = f"figures/images/sphx_glr_{path.stem}_001.png"
        lines.append(f"[![{title}]({picture})](figures/{path.stem}.rst)")
    return "\n".join([*lines, ""])


def fill(app, name, source):
    """Put the tables into the page where it asks for them, and lead its link to the figures."""
    if name == "theory":
        source[0] = source[0].replace("paper/GALLERY_HEADER.rst", "figures/index.rst")
        source[0] = source[0].replace("<!-- claims -->", tables())
        source[0] = source[0].replace("<!-- figures -->", figures())


def setup(app):
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
