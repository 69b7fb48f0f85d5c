"""Programs of this machine: found, or the test is skipped; run, and what they print."""

import shutil
import subprocess

import pytest


def found(name, path=None):
    """The program's path, of the folders of PATH or of `path`; skips the test if there is none."""
    program = shutil.which(name, path=path)
    if program is None:
        pytest.skip(f"no program `{name}` on this machine: .ci/run shows how hosts are installed")
    return program


def output(*command, code=0, timeout=500, **options):
    """What a program prints that must end with this code; timeout: in s."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, timeout=timeout,
        stdin=subprocess.DEVNULL, **options,
    )  # fmt: skip
    told = done.stdout + done.stderr
    assert done.returncode == code, f"{command} ended with {done.returncode}:\n{told[-5000:]}"
    return told
