"""Docstrings of this project, as reStructuredText.

They are written for a terminal, with parameters as `name: description`, under "Parameters" or in a
paragraph of their own. napoleon would read the text after the colon as a type.
Code in single backticks is set in conf.py (`default_role`).
"""

import re

PARAMETER = re.compile(r"^(\w+(?:, \w+)*): ", re.MULTILINE)


def fields(paragraph):
    """Return a paragraph as a field list if it consists of `name: description` entries."""
    titled = re.match(r"Parameters\n-+\n", paragraph)
    text = paragraph[titled.end() :] if titled else paragraph
    starts = [line for line in text.splitlines() if not line.startswith(" ")]
    if all(map(PARAMETER.match, starts)) and (titled or len(starts) > 1):
        return PARAMETER.sub(lambda name: f":param {name[1].replace(', ', ',')}: ", text)
    return text


def process(app, what, name, obj, options, lines):
    """Rewrite the lines of one docstring in place."""
    lines[:] = "\n\n".join(map(fields, "\n".join(lines).split("\n\n"))).split("\n")


def unwrap(app, what, name, obj, options, signature, returns):
    """Return a signature with names of types in place of Sphinx' wrapper of types in a union."""
    pattern = r"TypeAliasForwardRef\('(\w+)'\)"
    return tuple(text and re.sub(pattern, r"\1", text) for text in (signature, returns))


def setup(app):
    app.connect("autodoc-process-docstring", process)
    app.connect("autodoc-process-signature", unwrap)
    return {"parallel_read_safe": True}
