"""Wheels for other machines: `python builder/wheels.py FOLDER`, with the extra `wheels` installed.

One wheel for each of `TARGETS` in jointlaw/native/build.py. Each is built from the source archive,
in a separate folder, with the packages of this environment, and its libraries support all vector
widths. The libraries are then inspected: processor and exported functions.
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
    """Build the wheel for a target of zig and return its path."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT]
    subprocess.run(command, check=True, env=os.environ | {backend.TARGET: target})
    return next(folder.glob(f"*-py3-none-{backend.build.TARGETS[target]}.whl"))


def find_defects(wheel: Path, target: str) -> list[str]:
    """Defects of the libraries in a wheel: wrong processor, missing functions."""
    processor, system = backend.build.Compiler((), target).machine
    defects = []
    for package, builder in (("jointlaw", backend.build), ("dem_demo", backend.demo_build)):
        name = f"{package}/native/built/{builder.library_name(system)}"
        with zipfile.ZipFile(wheel) as packed:
            library = lief.parse(packed.read(name)).abstract
        # Mach-O adds an underscore to each name
        exported = {function.name.removeprefix("_") for function in library.exported_functions}
        if missing := EXPORTED[package] - exported:
            defects.append(f"{name} does not export {', '.join(sorted(missing))}")
        if (architecture := library.header.architecture.name) != PROCESSORS[processor]:
            defects.append(f"{name} is for {architecture}")
    return defects


def main() -> None:
    """Run the command."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for target in backend.build.TARGETS:
        wheel = build_wheel(target, Path(sys.argv[1]))
        if defects := find_defects(wheel, target):
            sys.exit(f"{wheel}: {'; '.join(defects)}")
        print(wheel, flush=True)


if __name__ == "__main__":
    main()
