"""The page "A joint in your browser": the law as WebAssembly, and the tables of the presets.

`python docs/_ext/browser.py FOLDER` writes the page alone, as FOLDER/index.html; the site writes
the same files into its folder _static/joint. Files that hold bytes are scripts, so that the page
also opens from a disk, without a server.
"""

import base64
import ctypes
import json
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from jointlaw import presets
from jointlaw.hosts.c.export import include_dir, packed
from jointlaw.native.build import FLAGS, Compiler
from jointlaw.native.layout import ELEMENTS, NUMBERS, WHOLE

SOURCES = Path(__file__).parents[1] / "browser"
RESOLUTIONS = ("fast", "balanced", "fine")
ZIG = Compiler((sys.executable, "-m", "ziglang", "cc"), "wasm32-wasi")
WASM = ("-target", "wasm32-wasi", "-mexec-model=reactor", "-nostartfiles", "-Wl,--strip-all")
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>A joint in your browser</title>
</head>
<body style="font-family: system-ui, sans-serif; max-width: 60rem; margin: auto">
<style>:root {{ color-scheme: light dark; }}</style>
{}
<script src="law.js"></script>
<script src="joint.js"></script>
</body>
</html>
"""


class Head(ctypes.Structure):
    """The numbers of `struct jlaw_law`, which lie before its tables on every machine alike."""

    _fields_ = (
        *((name, ctypes.c_int) for name in WHOLE),
        *((name, ctypes.c_double) for name in NUMBERS),
    )


def compiled():
    """The bytes of the law in WebAssembly."""
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(scratch) / "joint.wasm"
        flags = ["-Os" if flag == "-O3" else flag for flag in FLAGS]
        ZIG.run(*WASM, *flags, f"-I{include_dir()}", SOURCES / "joint.c", "-o", made)
        return made.read_bytes()


def tables(law):
    """The bytes of a law's tables, as `take_law` of joint.c reads them."""
    numbers, arrays = packed(law)
    if numbers["dim"] != 3 or any(
        numbers[name] for name in ("yields", "fades", "wears", *ELEMENTS)
    ):
        raise ValueError("joint.c runs elastic laws in space, mated and of asperities alone")
    return b"".join([bytes(Head(**numbers)), *(array.tobytes() for array in arrays.values())])


def text(data):
    """Bytes as a string of a script."""
    return json.dumps(base64.b64encode(data).decode())


def make(folder):
    """Write the files that the page loads."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(SOURCES / "joint.js", folder)
    about = {"presets": presets.names(), "resolutions": RESOLUTIONS}
    script = f"const JOINTLAW = {json.dumps(about)};\nJOINTLAW.wasm = {text(compiled())};\n"
    (folder / "law.js").write_text(script, encoding="utf-8")
    for name in presets.names():
        for resolution in RESOLUTIONS:
            law = replace(presets.load(name), resolution=resolution)
            key = f"{name}-{resolution}"
            script = f"JOINTLAW[{json.dumps(key)}] = {text(tables(law))};\n"
            (folder / f"{key}.js").write_text(script, encoding="utf-8")


def write_alone(folder):
    """Write the page alone, outside of the site."""
    part = (SOURCES / "joint.html").read_text(encoding="utf-8")
    (folder / "index.html").write_text(PAGE.format(part), encoding="utf-8")


def add(app, failed):
    """Put the files beside the pages of a site that was built."""
    if failed is None and app.builder.format == "html":
        make(Path(app.outdir) / "_static" / "joint")


def setup(app):
    app.connect("build-finished", add)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    make(Path(sys.argv[1]))
    write_alone(Path(sys.argv[1]))
