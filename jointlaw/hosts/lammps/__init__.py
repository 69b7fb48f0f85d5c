"""LAMMPS: the export of a law with its plug-in, and the folder where LAMMPS finds the plug-in.

export      tables, plug-in source, build script and an input script in one folder
files       those files, as they are copied
"""

import sys
from pathlib import Path


def plugin_folder() -> str:
    """Folder of the plug-in that `build.sh install` left; entry point `lammps.plugins`."""
    return str(Path(sys.prefix) / "share" / "jointlaw" / "lammps")
