"""`python -m dem_demo.native` builds the library of the compiled step of the blocks anew."""

import sys

from jointlaw.native.build import find_compiler

from . import build

if len(sys.argv) > 1:
    sys.exit(f"{__doc__} It takes no options.")
compiler = find_compiler()
if compiler is None:
    sys.exit("no C compiler works here: install gcc or clang, or `pip install ziglang`")
sys.stdout.write(f"{build.build(compiler)} by {' '.join(compiler.command)}\n")
