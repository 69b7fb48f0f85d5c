"""Rebuild the headers and the library of the compiled law: `python -m jointlaw.native`."""

import sys

from . import build

if len(sys.argv) > 1:
    sys.exit(f"{__doc__} It takes no options; builder/wheels.py builds for other machines")
compiler = build.find_compiler()
if compiler is None:
    sys.exit("no C compiler works here: install gcc or clang, or `pip install ziglang`")
try:
    library = build.build(compiler)
except ValueError as error:
    sys.exit(str(error))
sys.stdout.write(f"built {library} with {' '.join(compiler.command)}\n")
