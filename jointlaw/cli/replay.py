"""`jointlaw replay`: the step again that failed."""

import argparse
from typing import Any

from ..joints.batch import JointBatch
from ..joints.state import JointState, NonFiniteError, read_replay
from ..law import JointLaw
from .command import add_command


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    parser = add_command(
        commands,
        "replay",
        "run the step again that a NonFiniteError left in a file",
        "jointlaw replay jointlaw-replay-4711-1.npz",
        _replay,
    )
    parser.add_argument("file", help="the file that the error named")


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
