"""Regenerate the pictures of the pages: `python docs/make_pictures.py`, or some by their names."""

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
    "slope.png": ("dem_demo slope", "final.png"),
    "shear-box.png": ("dem_demo shear-box", "curves.png"),
    "strength.png": ("dem_demo strength-reduction slope", "failing-rough.png"),
    "fit.png": ("jointlaw fit grimsel_vd1_closure --up-to 5.3MPa", "fit.png"),
    "axes.png": ("jointlaw figures 4", "figure-04-06.png"),
}

if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or RUNS:
        command, made = RUNS[name]
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-m", *command.split(), "--out", folder], check=True)
            shutil.copy(Path(folder) / made, PICTURES / name)
