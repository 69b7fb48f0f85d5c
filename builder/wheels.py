"""Wheels for other machines: `python builder/wheels.py FOLDER`, with the extra `wheels` installed.

One for each of `TARGETS` in jointlaw/native/build.py. Each is built from the source archive, in a
place of its own, by the packages of this environment, and holds all widths of vectors. Its
libraries are checked: their processor, and the functions that they export.
"""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import backend
import lief

ROOT = Path(__file__).parents[1]
EXPORTED = {  # functions that library.py and dem_demo/compiled.py call
    "jointlaw": {"jlaw_run", "jlaw_lanes", "jlaw_levels", "jlaw_sources"},
    "dem_demo": {"dem_sources", "dem_move_blocks", "dem_finish_step", "dem_find_candidates"},
}
PROCESSORS = {"x86_64": "X86_64", "aarch64": "ARM64"}  # of zig, and of lief


def build_wheel(target: str, folder: Path) -> Path:
    """The wheel for this target of zig."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT]
    subprocess.run(command, check=True, env=os.environ | {backend.TARGET: target})
    return next(folder.glob(f"*-py3-none-{backend.build.TARGETS[target]}.whl"))


def faults(wheel: Path, target: str) -> list[str]:
    """What is wrong with the libraries in a wheel."""
    processor, system = backend.build.Compiler((), target).machine
    found = []
    for package, builder in (("jointlaw", backend.build), ("dem_demo", backend.demo_build)):
        name = f"{package}/native/built/{builder.library_name(system)}"
        with zipfile.ZipFile(wheel) as packed:
            library = lief.parse(packed.read(name)).abstract
        # Mach-O writes an underscore before each name
        exported = {function.name.removeprefix("_") for function in library.exported_functions}
        if missing := EXPORTED[package] - exported:
            found.append(f"{name} does not export {', '.join(sorted(missing))}")
        if (architecture := library.header.architecture.name) != PROCESSORS[processor]:
            found.append(f"{name} is for {architecture}")
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
