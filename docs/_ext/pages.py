"""Differences between a page on GitHub and on the site: links, the first page, thumbnails."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
CITED = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
REPOSITORY = re.search(r'^repository-code: "(.+)"', CITED, re.MULTILINE)[1]
README = ROOT / "README.md"
SHARED = "<!-- end of the first page of the site -->"
PLACE = "<!-- the first part of README.md -->"
DOORS = re.compile(r"<!-- doors -->\n(.*)<!-- end of doors -->\n", re.DOTALL)
OPENING = "\n```python\n"  # what begins after the opening of README.md: its first script


def first_part():
    """README.md up to the mark SHARED, with links relative to docs/."""
    shared, mark, _ = README.read_text(encoding="utf-8").partition(SHARED)
    if not mark:
        raise ValueError(f"{README}: the line {SHARED} is missing; index.md includes what is above")
    inside = re.sub(r"\]\((?!docs/|\w+:|#)([^)\s]+)\)", r"](../\1)", shared)
    return inside.replace("](docs/", "](").replace('src="docs/', 'src="')


def first_page(index):
    """The page index.md with the first part of README.md, and its doors after the opening.

    The doors, links for three readers and a joint to drag, take the place of the picture of README.
    """
    doors = DOORS.search(index)[1]
    opening, mark, rest = first_part().partition(OPENING)
    without_picture = re.sub(r"!\[[^\]]*\]\([^)]*\)\n", "", opening)
    page = f"{without_picture}\n{doors}\n## A first script\n{mark}{rest}"
    return DOORS.sub("", index).replace(PLACE, page)


def links(text):
    """Lead links to scripts to the pages made from them, and links out of docs/ to the repository.

    The address of the repository is the one in CITATION.cff.
    """
    text = text.replace("gallery/GALLERY_HEADER.rst", "examples/index.rst")
    text = re.sub(r"\]\(gallery\)", "](examples/index.rst)", text)
    text = re.sub(r"\]\(paper\)", "](figures/index.rst)", text)
    text = re.sub(r"\]\(gallery/(plot_\w+)\.py\)", r"](examples/\1.rst)", text)
    text = re.sub(r"\]\(paper/(plot_\w+)\.py\)", r"](figures/\1.rst)", text)
    text = re.sub(r"\]\(\.\./([\w/.]+\.(?:md|cff))", rf"]({REPOSITORY}/blob/main/\1", text)
    text = re.sub(r"\]\(\.\./([\w/]+)\)", rf"]({REPOSITORY}/tree/main/\1)", text)
    return text.replace("https://repository.invalid/jointlaw", REPOSITORY)


def read(app, name, source):
    """Put the first part of README.md into index.md and adapt the links of every page."""
    if name == "index":
        app.env.note_dependency(README)
        source[0] = first_page(source[0])
    source[0] = links(source[0])


def describe_thumbnails(app, doctree):
    """Give thumbnails of the gallery, which have no alternative text, the title of their page."""
    from docutils import nodes  # comes with the extra `docs`, which tests of this file lack

    for image in doctree.findall(nodes.image):
        script = re.search(r"sphx_glr_(plot_\w+)_thumb", image["uri"])
        if script and not image.get("alt"):
            path = next(ROOT.glob(f"docs/*/{script[1]}.py"))  # the gallery copies its scripts
            text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
            image["alt"] = f"Thumbnail: {text.splitlines()[0].strip('= ')}"


def setup(app):
    app.connect("source-read", read)
    app.connect("doctree-read", describe_thumbnails)
    return {"parallel_read_safe": True}
