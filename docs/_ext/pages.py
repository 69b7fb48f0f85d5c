"""What differs between a page on GitHub and on the site."""

import re
from pathlib import Path


def read(app, name, source):
    """Links to gallery scripts lead to their pages; `page?` in a list is one that may not exist."""
    text = re.sub(r"\]\(gallery/(plot_\w+)\.py\)", r"](examples/\1.rst)", source[0])
    for page in re.findall(r"^([\w-]+)\?$", text, re.MULTILINE):
        there = (Path(app.srcdir) / f"{page}.md").exists()
        text = text.replace(f"{page}?\n", f"{page}\n" if there else "")
    source[0] = text


def setup(app):
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
