"""How a scene fails with a little less strength than it needs: the run, and its picture."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from jointlaw.support.pyplot import style, written

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.pictures import FIXED, outlines
from ..output.record import Record, far
from ..output.run import play
from ..scene import Scene, usual_size

FIRST = 0.01  # of the usual size of a block: who has moved by half of the most then moves first
WIDTH = 4.6  # inches: text of 9 points can be read on a telephone


def seated(scene: Scene) -> Scene:
    """A scene that starts from its equilibrium, with the time step that follows."""
    return replace(scene, run=replace(scene.run, step=None, fraction=None, seat=True))


def failing(scene: Scene, until: float) -> Record:
    """A run to `until` (s), or until a block has moved by the usual size of a block.

    Where joints close too far for the time step, that is halved. What is recorded by then is kept
    where that does not help.
    """
    sim = Simulation(seated(scene))
    record = Record(sim)
    with suppress(Refused):
        play(sim, record, until, far)
    return record


def first(record: Record, apart: np.ndarray) -> np.ndarray:
    """Mask (n,) of the blocks that move first, but for those of a mask `apart`."""
    size = usual_size(block for block in record.scene.blocks if not block.fixed)
    moved = [~apart * np.hypot(*(record.displaced(i) - record.displaced(0)).T)
             for i in range(len(record.times))]  # fmt: skip
    away = next((frame for frame in moved if frame.max() > FIRST * size), moved[-1])
    return away > 0.5 * away.max()


@style()
def draw(record: Record, title: str, path: Path, ahead: np.ndarray) -> None:
    """How far each block moved (m), where it is, dotted where it was; bold who went ahead (n,)."""
    blocks, start, now = record.scene.blocks, outlines(record, 0), outlines(record, -1)
    corners = np.concatenate([*start, *now])
    wide, high = np.ptp(corners, axis=0)
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
    went = [shape for shape, goes in zip(now, ahead, strict=True) if goes]
    axes.add_collection(PolyCollection(went, facecolors="none", edgecolors="k", linewidths=1.6))
    axes.legend(handles=[Patch(fc="none", ec="k", lw=1.6, label="moves first")])
    axes.autoscale_view()
    figure.colorbar(drawn, location="bottom", label="moved since the start (m)", aspect=40)
    written(figure, path)
