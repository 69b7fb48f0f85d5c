"""Axes and signs of a joint, which are Figures 4 and 6: `python docs/draw/axes.py FOLDER` writes
FOLDER/axes.png."""

import runpy
from pathlib import Path

from command_line import output_folder

from jointlaw.support.pyplot import style

if __name__ == "__main__":
    figure_script = Path(__file__).parents[1] / "paper" / "plot_fig_04.py"
    with style() as plt:
        runpy.run_path(str(figure_script))
        plt.savefig(output_folder(__doc__) / "axes.png", dpi=100)
