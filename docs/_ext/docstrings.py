"""Docstrings of this project, as reStructuredText.

They are written to be read in a terminal, with parameters as `name: what it is`, under
"Parameters" or in a paragraph of their own. napoleon would read what follows the colon as a type.
Code in single backticks is set in conf.py (`default_role`).
"""

import re

PARAMETER = re.compile(r"^(\w+(?:, \w+)*): ", re.MULTILINE)


def fields(paragraph):
    """A paragraph with its parameters as a field list, if it is `name: what it is` throughout."""
    titled = re.match(r"Parameters\n-+\n", paragraph)
    text = paragraph[titled.end() :] if titled else paragraph
    starts = [line for line in text.splitlines() if not line.startswith(" ")]
    if all(map(PARAMETER.match, starts)) and (titled or len(starts) > 1):
        return PARAMETER.sub(lambda name: f":param {name[1].replace(', ', ',')}: ", text)
    return text


def process(app, what, name, obj, options, lines):
    lines[:] = "\n\n".join(map(fields, "\n".join(lines).split("\n\n"))).split("\n")


def unwrap(app, what, name, obj, options, signature, returns):
    """Names of types instead of the wrapper that Sphinx puts round them in a union."""
    pattern = r"TypeAliasForwardRef\('(\w+)'\)"
    return tuple(text and re.sub(pattern, r"\1", text) for text in (signature, returns))


def setup(app):
    app.connect("autodoc-process-docstring", process)
    app.connect("autodoc-process-signature", unwrap)
    return {"parallel_read_safe": True}
