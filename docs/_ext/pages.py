"""What differs between a page on GitHub and on the site."""

import re


def read(app, name, source):
    """Links to scripts of the gallery and of the paper's figures lead to their pages."""
    source[0] = source[0].replace("gallery/GALLERY_HEADER.rst", "examples/index.rst")
    source[0] = re.sub(r"\]\(gallery/(plot_\w+)\.py\)", r"](examples/\1.rst)", source[0])
    source[0] = re.sub(r"\]\(paper/(plot_\w+)\.py\)", r"](figures/\1.rst)", source[0])


def setup(app):
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
