"""Wheels for other machines: `python builder/wheels.py FOLDER`, with the extra `wheels` installed.

One for each of `TARGETS` in jointlaw/native/build.py. Each is built from the source archive, in a
place of its own, by the packages of this environment, and holds all widths of vectors. Its library
is looked into: for which processor it is, and what it exports.
"""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import backend
import lief

ROOT = Path(__file__).parents[1]
EXPORTED = {"jlaw_run", "jlaw_lanes", "jlaw_levels", "jlaw_sources"}  # what library.py calls
PROCESSORS = {"x86_64": "X86_64", "aarch64": "ARM64"}  # of zig, and of lief


def build_wheel(target: str, folder: Path) -> Path:
    """The wheel for this target of zig."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT]
    subprocess.run(command, check=True, env=os.environ | {backend.TARGET: target})
    return next(folder.glob(f"*-py3-none-{backend.build.TARGETS[target]}.whl"))


def faults(wheel: Path, target: str) -> list[str]:
    """What is wrong with the library in a wheel."""
    processor, system = backend.build.Compiler((), target).machine
    with zipfile.ZipFile(wheel) as packed:
        library = lief.parse(
            packed.read(f"jointlaw/native/built/{backend.build.library_name(system)}")
        ).abstract
    found = []
    # Mach-O writes an underscore before each name
    if missing := EXPORTED - {one.name.removeprefix("_") for one in library.exported_functions}:
        found.append(f"it does not export {', '.join(sorted(missing))}")
    if (built := library.header.architecture.name) != PROCESSORS[processor]:
        found.append(f"it is for {built}")
    return found


def main() -> None:
    """The command."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for target in backend.build.TARGETS:
        wheel = build_wheel(target, Path(sys.argv[1]))
        if wrong := faults(wheel, target):
            sys.exit(f"{wheel}: {'; '.join(wrong)}")
        print(wheel, flush=True)


if __name__ == "__main__":
    main()
