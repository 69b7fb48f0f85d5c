"""Docstrings of this project, as reStructuredText.

They are written for a terminal, with parameters as `name: description`, under "Parameters" or in a
paragraph of their own. napoleon would read the text after the colon as a type.
Code in single backticks is set in conf.py (`default_role`). Signatures name types as a reader knows
them, `Array` and `ArrayLike`, not by the classes of numpy that these stand for.
"""

import re
import sys

import sphinx.ext.autodoc  # noqa: F401  (loaded before its printing of types is replaced)
from sphinx.util import typing

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


NAMES_OF_TYPES = (  # as a type is printed, and what a reader knows it by
    (r"TypeAliasForwardRef\('(\w+)'\)", r"\1"),
    (r"~?(?:numpy\.)?ndarray\[(?:~?\w+\.)*tuple\[~?(?:typing\.)?Any, \.\.\.\], "
     r"~?(?:numpy\.)?dtype\[~?(?:numpy\.)?[\w.]+(?:\[~?(?:typing\.)?Any\])?\]\]", "Array"),
    (r"~?(?:[\w.]+\.)?_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]", "ArrayLike"),
    (r"<factory>", "..."),
    (r"<dataclasses\._MISSING_TYPE object[^>]*>", "..."),
    (r"<class '(?:numpy\.)?(\w+)'>", r"\1"),
    (r"type\[~?(?:typing\.)?Any\] \| ~?(?:numpy\.)?dtype\[.*?_DTypeDict \| str", "DTypeLike"),
    (r"\b(?:numpy\.)?ndarray\b(?!\[)", "Array"),
    (r"0\.5235987755982988", "pi/6"),
)  # fmt: skip


def plain(text):
    """Return the text of a type or a signature with names of types that a reader knows."""
    for pattern, name in NAMES_OF_TYPES:
        text = re.sub(pattern, name, text)
    return text


def unwrap(app, what, name, obj, options, signature, returns):
    """Return a signature in plain names of types."""
    return tuple(text and plain(text) for text in (signature, returns))


def name_types_plainly():
    """Let Sphinx print every type by `plain`, those of properties and attributes too."""
    printed = typing.stringify_annotation

    def stringify(*arguments, **settings):
        return plain(printed(*arguments, **settings))

    for name, module in list(sys.modules.items()):
        if name.startswith("sphinx.") and vars(module).get("stringify_annotation") is printed:
            module.stringify_annotation = stringify


def setup(app):
    name_types_plainly()
    app.connect("autodoc-process-docstring", process)
    app.connect("autodoc-process-signature", unwrap)
    return {"parallel_read_safe": True}
