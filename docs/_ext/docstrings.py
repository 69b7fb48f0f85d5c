"""Docstrings of this project, as reStructuredText.

They are written to be read in a terminal: `code` in single backticks, plain formulas such as
|q|^2, and parameters as `name: what it is`, under "Parameters" or in a paragraph of their own.
"""

import re

from sphinx.util.inspect import TypeAliasForwardRef

PARAMETER = re.compile(r"(\w+(?:, \w+)*): (.*)")
CODE = re.compile(r"`+([^`]+)`+")


def plain(text):
    """One line with code as code, and everything else taken as it stands."""
    parts = CODE.split(text)
    for k in range(0, len(parts), 2):
        parts[k] = re.sub(r"([*|\\])", r"\\\1", parts[k])
        parts[k] = re.sub(r"(\w)_(?=\W|$)", r"\1\\_", parts[k])
    for k in range(1, len(parts), 2):
        parts[k] = f"``{parts[k]}``\\ "
    return "".join(parts).rstrip(" ") if len(parts) == 1 else "".join(parts)


def lists_parameters(lines):
    """Whether a paragraph is `name: what it is`, line after line."""
    paragraph = "\n".join(lines).split("\n\n")[0].splitlines()
    names = [line for line in paragraph if not line.startswith(" ")]
    return len(names) > 1 and all(PARAMETER.fullmatch(line) for line in names)


def convert(lines):
    """The lines of a docstring, converted."""
    result, in_parameters, literal = [], False, False
    for k, line in enumerate(lines):
        if not in_parameters and line.strip() and not (k and lines[k - 1].strip()):
            in_parameters = lists_parameters(lines[k:])
        following = lines[k + 1] if k + 1 < len(lines) else ""
        if line == "Parameters" and set(following) == {"-"}:
            in_parameters = True
            continue
        if set(line) == {"-"} and len(line) > 3:
            continue
        indented = line.startswith("    ")
        if indented and not in_parameters:
            if not literal:
                result += ["::", ""]
            literal = True
            result.append(line)
            continue
        literal = literal and not line.strip()
        if in_parameters and not line.strip():
            in_parameters = False
            result.append("")
        elif in_parameters and not indented and (found := PARAMETER.fullmatch(line)):
            names, text = found.groups()
            result.append(f":param {names}: {plain(text)}")
        else:
            result.append(plain(line))
    return result


def process(app, what, name, obj, options, lines):
    lines[:] = convert(lines)


def setup(app):
    TypeAliasForwardRef.__repr__ = lambda self: self.name  # as in dict[str, Array]
    app.connect("autodoc-process-docstring", process)
    return {"parallel_read_safe": True}
