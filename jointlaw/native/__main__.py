"""`python -m jointlaw.native` makes the headers and the library of the compiled law anew."""

import sys

from . import build

if len(sys.argv) > 1:
    sys.exit(f"{__doc__} It takes no options; for other machines: builder/wheels.py")
compiler = build.find_compiler()
if compiler is None:
    sys.exit("no C compiler works here: install gcc or clang, or `pip install ziglang`")
try:
    made = build.build(compiler)
except ValueError as error:
    sys.exit(str(error))
sys.stdout.write(f"{made} by {' '.join(compiler.command)}\n")
