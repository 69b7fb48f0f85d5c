"""Command that makes the headers and the library of the compiled law.

python -m jointlaw.native                               here, for this machine
python -m jointlaw.native --target all --out FOLDER     for others, by the package `ziglang`
"""

import argparse
import sys
from pathlib import Path

from . import build, layout


def main() -> None:
    """The command."""
    about = "Make the headers and the library of the compiled law."
    parser = argparse.ArgumentParser(prog="python -m jointlaw.native", description=about)
    parser.add_argument("--target", choices=[*build.TARGETS, "all"], help="another machine, by zig")
    parser.add_argument("--out", type=Path, help="folder; with --target one within for each")
    given = parser.parse_args()
    for name, text in layout.made().items():
        if (build.HERE / name).read_text(encoding="utf-8") != text:
            (build.HERE / name).write_text(text, encoding="utf-8")
    if given.target is not None:
        targets = build.TARGETS if given.target == "all" else [given.target]
        for target in targets:
            out = build.build(build.zig(target), (given.out or Path()) / target)
            sys.stdout.write(f"{out}\n")
        return
    compiler = build.find_compiler()
    if compiler is None:
        sys.exit("no C compiler works here: install gcc or clang, or `pip install ziglang`")
    out = build.build(compiler, given.out or build.HERE)
    sys.stdout.write(f"{out} by {' '.join(compiler.command)}\n")


main()
