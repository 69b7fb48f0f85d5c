"""Regenerate the pictures of README.md and rock-masses.md.

`python docs/make_pictures.py [NAME ...]`: all of them, or these.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PICTURES = Path(__file__).parent / "pictures"
RUNS = {
    "shear.png": (
        "jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse=-2um "
        "--resolution fine",
        "shear.png",
    ),
    "tilt.png": ("dem_demo tilt", "final.png"),
    "strength.png": ("dem_demo strength-reduction slope", "failing-rough.png"),
}

if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or RUNS:
        command, made = RUNS[name]
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-m", *command.split(), "--out", folder], check=True)
            shutil.copy(Path(folder) / made, PICTURES / name)
