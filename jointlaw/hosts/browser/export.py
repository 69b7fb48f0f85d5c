"""A joint in a browser: a page with the law as WebAssembly and tables of the presets."""

import base64
import json
from collections.abc import Mapping
from pathlib import Path

from ... import presets
from ...laws.joint_law import JointLaw
from ...laws.law import Law
from ...native.layout import (
    CELL_ROWS,
    ELEMENTS,
    FACET_LANES,
    INTEGERS,
    REALS,
    LawStruct,
    column_offsets,
)
from ...support.files import write_files
from ..c.export import packed

HERE = Path(__file__).parent
WASM = "joint.wasm"  # built by builder/wasm.py, so that exports need no compiler
SCRIPTS = ("law.js", "test.js", "pictures.js", "story.js", "page.js")
_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>A joint in your browser</title>
</head>
<body style="font-family: system-ui, sans-serif; max-width: 60rem; margin: auto; padding: 0 0.6rem">
<style>:root {{ color-scheme: light dark; }}</style>
{}
<script>
{}
</script>
</body>
</html>
"""


def export_browser(directory: str | Path) -> Path:
    """Write `index.html`, an interactive joint in one file; returns its path.

    directory: created if missing; a file of that name is replaced. Raises ValueError if it cannot
    be created.
    """
    part = (HERE / "joint.html").read_text(encoding="utf-8")
    return write_files(directory, {"index.html": _PAGE.format(part, script())}) / "index.html"


def script() -> str:
    """JavaScript of the browser page: the tables of all presets and the law as WebAssembly, both as
    text within a constant JOINTLAW, followed by the scripts of the page.
    """
    laws = {name: presets.load(name) for name in presets.names()}
    parts = [(HERE / name).read_text(encoding="utf-8") for name in SCRIPTS]
    return "".join([constant(laws), *parts])


def constant(laws: Mapping[str, JointLaw]) -> str:
    """JavaScript constant JOINTLAW for law.js: WebAssembly of the law, layout and tables of laws.

    laws: by name. Raises ValueError for a law that joint.c does not support.
    """
    rocks = {}
    for name, law in laws.items():
        o = law.orientation
        rocks[name] = {
            "a": o.a, "b": o.b, "c": o.c, "mu": law.asperity.mu, "range": law.closure_range,
            "tables": _text(tables(law)),
        }  # fmt: skip
    content = {
        "numbers": {name: getattr(LawStruct, name).offset for name in (*INTEGERS, *REALS)},
        "begin": LawStruct.facet.offset,
        "columns": column_offsets(),
        "rows": list(CELL_ROWS),
        "lanes": FACET_LANES,
        "wasm": _text((HERE / WASM).read_bytes()),
        "rocks": rocks,
    }
    return f'"use strict";\nconst JOINTLAW = {json.dumps(content)};\n'


def tables(law: Law) -> bytes:
    """Tables of a law as `load_law` of joint.c reads them: the numbers, then the arrays.

    Raises ValueError for a law that joint.c does not support.
    """
    numbers, arrays = packed(law)
    if numbers["dim"] != 3 or any(numbers[name] for name in ("curve_exponent", *ELEMENTS)):
        raise ValueError(
            "joint.c supports laws in space that consist of asperities only, whose heights have a "
            "finite density at the first contact"
        )
    head = bytes(LawStruct(**numbers))[: LawStruct.facet.offset]
    return b"".join([head, *(array.tobytes() for array in arrays.values())])


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()
