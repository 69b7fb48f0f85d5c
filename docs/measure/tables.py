"""Tables in Markdown, and what a command of this project prints."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def asked(about, *names, **more):
    """The words after a command, by name; --help shows `about`, the text of its script."""
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in names:
        parser.add_argument(name, **more)
    return parser.parse_args()


def table(head, rows):
    """All columns but the first are aligned to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in lines)


def run(*command, **env):
    """What `python COMMAND` prints, run at the top of the repository."""
    done = subprocess.run([sys.executable, *command], cwd=ROOT, env=os.environ | env, text=True,
                          stdout=subprocess.PIPE, check=True)  # fmt: skip
    return done.stdout
