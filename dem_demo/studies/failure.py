"""How a scene fails with a little less strength than it needs: the run, and its picture."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from jointlaw.support.pyplot import style, written

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.pictures import FIXED, outlines
from ..output.record import Record, far
from ..output.run import play
from ..scene import Scene

WIDTH = 4.6  # inches: text of 9 points can be read on a telephone


def failing(scene: Scene, until: float) -> Record:
    """A run to `until` (s), or until a block has moved by the usual size of a block.

    Where joints close too far for the time step, that is halved. What is recorded by then is kept
    where that does not help.
    """
    sim = Simulation(replace(scene, run=replace(scene.run, step=None, fraction=None, seat=True)))
    record = Record(sim)
    with suppress(Refused):
        play(sim, record, until, far)
    return record


@style()
def draw(record: Record, title: str, path: Path) -> None:
    """How far each block has moved (m), where it is now, and dotted where it was."""
    blocks, start, now = record.scene.blocks, outlines(record, 0), outlines(record, -1)
    corners = np.concatenate([*start, *now])
    wide, high = np.ptp(corners[np.isfinite(corners).all(axis=1)], axis=0)
    figure = Figure(figsize=(WIDTH, max(WIDTH * high / wide, 2.0) + 1.6), layout="constrained")
    figure.suptitle(title)  # constrained layout clips a title of axes whose aspect is equal
    axes = figure.add_subplot(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    rock = [shape for block, shape in zip(blocks, now, strict=True) if block.fixed]
    free = np.array([not block.fixed for block in blocks])
    moves = [shape for block, shape in zip(blocks, now, strict=True) if not block.fixed]
    before = [shape for block, shape in zip(blocks, start, strict=True) if not block.fixed]
    axes.add_collection(PolyCollection(rock, facecolors=FIXED, edgecolors="0.45", linewidths=0.4))
    drawn = PolyCollection(moves, array=record.moved[free], cmap="YlOrRd", edgecolors="0.3", lw=0.4)
    drawn.set_clim(0.0)
    axes.add_collection(drawn)
    axes.add_collection(
        PolyCollection(before, facecolors="none", edgecolors="0.5", linestyles=":", lw=0.6)
    )
    axes.autoscale_view()
    figure.colorbar(drawn, location="bottom", label="moved since the start (m)", aspect=40)
    written(figure, path)
