"""`jointlaw presets`: the parameter sets of the paper."""

import argparse

from .. import presets
from .command import Command, option, print_json


def _run(options: argparse.Namespace) -> None:
    if options.name and not options.json:
        print(presets.text(options.name), end="")
        return
    names = [options.name] if options.name else presets.names()
    if options.json:
        print_json({name: presets.about(name) for name in names})
    else:
        for name in names:
            print(f"{name:16s} {presets.about(name)['title']}")


COMMAND = Command(
    "presets",
    "list the parameter sets of the paper, or print one as the start of a parameter file",
    "jointlaw presets biegel-rough > mine.toml",
    _run,
    (
        option("name", nargs="?", metavar="PRESET", help="print the TOML file of this preset"),
        option("--json", action="store_true", help="print title, source and assumptions as JSON"),
    ),
)
