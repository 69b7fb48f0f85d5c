"""Find and run programs of this machine; a test is skipped if a program is not installed."""

import shutil
import subprocess

import pytest


def find_program(name, path=None):
    """Path of a program on PATH, or in the folders `path`; skips the test if there is none."""
    program = shutil.which(name, path=path)
    if program is None:
        pytest.skip(f"no program `{name}` on this machine: .ci/run shows how hosts are installed")
    return program


def run_program(*command, code=0, timeout=500, **options):
    """Run a command and return its output; it must end with this exit code. timeout: s."""
    process = subprocess.run(
        [str(word) for word in command],
        capture_output=True,
        text=True,
        timeout=timeout,
        stdin=subprocess.DEVNULL,
        **options,
    )
    text = process.stdout + process.stderr
    assert process.returncode == code, f"{command} ended with {process.returncode}:\n{text[-5000:]}"
    return text
