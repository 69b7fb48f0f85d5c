"""`jointlaw presets`: the parameter sets of the paper."""

import argparse

from .. import presets
from .command import Command, option


def _presets(options: argparse.Namespace) -> None:
    if options.name:
        print(presets.text(options.name), end="")
    else:
        for name in presets.names():
            print(f"{name:16s} {presets.about(name)['title']}")


COMMAND = Command(
    "presets",
    "list the parameter sets of the paper, or print one as TOML to start a file of your own",
    "jointlaw presets biegel-rough > mine.toml",
    _presets,
    (option("name", nargs="?", help="print this one"),),
)
