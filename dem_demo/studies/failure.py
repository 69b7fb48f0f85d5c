"""How a scene fails with a little less strength than it needs."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.record import Record, far
from ..output.run import play
from ..scene import Scene, usual_size

FIRST = 0.01  # of the usual size of a block: who has moved by half of the most then moves first


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
    away = next((frame for frame in moved if np.nanmax(frame) > FIRST * size), moved[-1])
    return away > 0.5 * np.nanmax(away)
