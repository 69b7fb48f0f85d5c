"""What differs between a page on GitHub and on the site."""

import re
from pathlib import Path

CITED = (Path(__file__).parents[2] / "CITATION.cff").read_text(encoding="utf-8")
REPOSITORY = re.search(r'^repository-code: "(.+)"', CITED, re.MULTILINE)[1]


def read(app, name, source):
    """Links to scripts of the gallery and of the paper's figures lead to their pages.

    Those to other files lead to the repository, whose address is that of CITATION.cff.
    """
    text = source[0].replace("gallery/GALLERY_HEADER.rst", "examples/index.rst")
    text = re.sub(r"\]\(gallery/(plot_\w+)\.py\)", r"](examples/\1.rst)", text)
    text = re.sub(r"\]\(paper/(plot_\w+)\.py\)", r"](figures/\1.rst)", text)
    text = re.sub(r"\]\(\.\./(\w+\.(?:md|cff))", rf"]({REPOSITORY}/blob/main/\1", text)
    source[0] = text.replace("https://repository.invalid/jointlaw", REPOSITORY)


def setup(app):
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
