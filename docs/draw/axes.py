"""Axes and signs of a joint, which are Figures 4 and 6: `python docs/draw/axes.py FOLDER` writes
FOLDER/axes.png."""

import runpy
from pathlib import Path

from folder import asked

from jointlaw.support.pyplot import style

with style() as plt:
    runpy.run_path(str(Path(__file__).parents[1] / "paper" / "plot_fig_04.py"))
    plt.savefig(asked(__doc__) / "axes.png", dpi=100)
