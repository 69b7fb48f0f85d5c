"""Tables in Markdown, and what a command of this project prints."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def table(head, rows):
    """All columns but the first are aligned to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in lines)


def run(*command, **env):
    """What `python COMMAND` prints, run at the top of the repository."""
    done = subprocess.run([sys.executable, *command], cwd=ROOT, env=os.environ | env, text=True,
                          stdout=subprocess.PIPE, check=True)  # fmt: skip
    return done.stdout
