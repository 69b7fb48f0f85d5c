"""Axes and signs of a joint: `python docs/draw/axes.py FOLDER` writes FOLDER/axes.png."""

import numpy as np
from folder import asked

from jointlaw.support.pyplot import style

TILT, AZIMUTH = np.radians(28.0), np.radians(38.0)
MOTION, FACET, AXIS = "#c95500", "#1f6fd0", "0.35"


def arrow(axes, at, way, name, colour):
    """An arrow with its name beyond the tip."""
    axes.annotate("", at + way, at, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.5})
    axes.text(
        *(at + way + 0.16 * way / np.hypot(*way)), name, color=colour, ha="center", va="center"
    )


def angle(axes, at, begin, end, name):
    """An arc between two directions in rad, with its name."""
    turn, middle = np.linspace(begin, end, 40), 0.5 * (begin + end)
    axes.plot(at[0] + 0.5 * np.cos(turn), at[1] + 0.5 * np.sin(turn), color="k", lw=1.5)
    axes.text(at[0] + 0.66 * np.cos(middle), at[1] + 0.66 * np.sin(middle), name, ha="center",
              va="center")  # fmt: skip


def section(axes):
    """The joint cut along the azimuth of an asperity."""
    rise = 0.7 * np.tan(TILT)
    x, z = np.array([-1.9, -0.7, 0.7, 1.9]), np.array([-rise, -rise, rise, rise])
    axes.fill_between(x, z, -1.75, color="#c9c2b6", lw=0)
    axes.fill_between(x, z, 1.75, color="#e6e1d8", lw=0)
    axes.plot(x, z, "k", lw=2)
    middle = np.zeros(2)
    arrow(axes, middle, np.array([0.0, -1.0]), "1", AXIS)
    arrow(axes, middle, 1.15 * np.array([np.sin(TILT), -np.cos(TILT)]), "n", FACET)
    arrow(axes, middle, 1.05 * np.array([np.cos(TILT), np.sin(TILT)]), "s", FACET)
    angle(axes, middle, -np.pi / 2, -np.pi / 2 + TILT, "θ")
    corner = np.array([-1.4, 1.3])
    arrow(axes, corner, np.array([0.8, 0.0]), "", MOTION)
    arrow(axes, corner, np.array([0.0, -0.8]), "", MOTION)
    axes.text(-0.5, 1.3, "shear δ₂, δ₃ > 0", color=MOTION, va="center")
    axes.text(-1.28, 0.45, "closure δ₁ > 0", color=MOTION, va="center")
    axes.text(-1.8, -1.7, "body at rest feels +F", va="bottom")
    axes.text(1.8, 1.7, "moving body feels −F", ha="right", va="top")
    axes.set_title("section along an asperity's azimuth", fontsize=14)


def plan(axes):
    """The joint seen along axis 1."""
    middle, n = np.array([-0.9, -0.9]), np.array([np.cos(AZIMUTH), np.sin(AZIMUTH)])
    arrow(axes, middle, np.array([2.2, 0.0]), "2", AXIS)
    arrow(axes, middle, np.array([0.0, 2.2]), "3", AXIS)
    arrow(axes, middle, 1.7 * n, "n, s", FACET)
    arrow(axes, middle, 0.9 * np.array([-n[1], n[0]]), "t", FACET)
    angle(axes, middle, 0.0, AZIMUTH, "φ")
    axes.set_title("plan, seen along axis 1", fontsize=14)


def main(folder):
    with style() as plt:
        plt.rcParams.update({"font.size": 14})
        figure, panels = plt.subplots(1, 2, figsize=(7.8, 4.2), width_ratios=(3.8, 3.4))
        for draw, axes, wide in zip((section, plan), panels, (1.9, 1.7), strict=True):
            draw(axes)
            axes.set(aspect="equal", xlim=(-wide, wide), ylim=(-1.75, 1.75))
            axes.axis("off")
        figure.savefig(folder / "axes.png", dpi=100)


if __name__ == "__main__":
    main(asked(__doc__))
