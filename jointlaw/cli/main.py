"""The command line `jointlaw`: its subcommands, and those that need no file of their own."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from typing import Any

from .. import __version__, presets
from ..joints.batch import JointBatch
from ..joints.state import JointState, NonFiniteError, read_replay
from ..law import JointLaw
from .command import add_command
from .export import add_export_command
from .figures import add_figures_command
from .fit import add_fit_command
from .laboratory import add_closure_command, add_shear_command
from .scan import add_scan_command
from .tradeoff import add_tradeoff_command


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="jointlaw",
        description="A micromechanical, anisotropic, path-dependent rock joint.",
        epilog="each command has its own help with an example: jointlaw shear --help",
    )
    parser.add_argument("--version", action="version", version=f"jointlaw {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_shear_command(commands)
    add_closure_command(commands)
    _add_presets(commands)
    _add_replay(commands)
    add_figures_command(commands)
    add_export_command(commands)
    add_fit_command(commands)
    add_scan_command(commands)
    add_tradeoff_command(commands)
    options = parser.parse_args(_joined(sys.argv[1:] if arguments is None else arguments))
    try:
        return int(options.run(options))
    except (ValueError, ImportError, OSError) as error:
        print(f"jointlaw {options.command}: {error}", file=sys.stderr)
        return 2


def _joined(arguments: Sequence[str]) -> list[str]:
    """Arguments with "--reverse -2um" joined to "--reverse=-2um", lest -2um pass for an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and re.match(r"--[a-z-]+$", joined[-1]) and re.match(r"-[.\d]", argument):
            joined[-1] += "=" + argument
        else:
            joined.append(argument)
    return joined


def _add_presets(commands: Any) -> None:
    parser = add_command(
        commands,
        "presets",
        "list the parameter sets of the paper, or print one as TOML to start a file of your own",
        "jointlaw presets biegel-rough > mine.toml",
    )
    parser.add_argument("name", nargs="?", help="print this one")
    parser.set_defaults(run=_presets)


def _presets(options: argparse.Namespace) -> int:
    if options.name:
        print(presets.text(options.name), end="")
        return 0
    for name in presets.names():
        print(f"{name:16s} {presets.about(name)['title']}")
    return 0


def _add_replay(commands: Any) -> None:
    parser = add_command(
        commands,
        "replay",
        "run the step again that a NonFiniteError left in a file",
        "jointlaw replay jointlaw-replay-4711-1.npz",
    )
    parser.add_argument("file", help="the file that the error named")
    parser.set_defaults(run=_replay)


def _replay(options: argparse.Namespace) -> int:
    data = read_replay(options.file)
    law = JointLaw.from_toml(str(data["law"]))
    values, d = data["values"], data["d"]
    batch = JointBatch(law, values.shape[1])
    batch.restore(JointState(law.fingerprint, values))
    print(f"{law}\nstate: delta = {batch.delta} m, F = {batch.F} Pa\nstep: d = {d.T} m")
    try:
        F, _ = batch.trial(d.T, tangent=bool(data["tangent"]))
    except NonFiniteError as error:
        if error.replay is not None:  # the same file once more
            error.replay.unlink(missing_ok=True)
        print("fails again: the result is not finite")
        return 1
    print(f"passes: F = {F} Pa")
    return 0
