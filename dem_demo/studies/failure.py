"""How a scene fails: a run that ends once it has."""

from dataclasses import replace

import numpy as np

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.record import Record, far
from ..output.run import play
from ..scene import Scene, usual_size

FIRST = 0.01  # of the usual size of a block: who has moved by half of the most then moves first


def seated(scene: Scene) -> Scene:
    """A scene that starts from its equilibrium, with the time step that follows: it is halved where
    joints close too far for it."""
    return replace(scene, run=replace(scene.run, step=None, fraction=None, seat=True))


def to_failure(scene: Scene, until: float) -> tuple[Record, str]:
    """A run to `until` (s), or until a block has moved by the usual size of a block; and why it was
    refused, if it was: what is recorded by then is kept."""
    sim = Simulation(scene)
    record, refused = Record(sim), ""
    try:
        play(sim, record, until, far)
    except Refused as error:
        refused = str(error)
    return record, refused


def first(record: Record, apart: np.ndarray) -> np.ndarray:
    """Mask (n,) of the blocks that move first, but for those of a mask `apart`."""
    size = usual_size(block for block in record.scene.blocks if not block.fixed)
    moved = [np.where(apart, 0.0, np.hypot(*(record.displaced(i) - record.displaced(0)).T))
             for i in range(len(record.times))]  # fmt: skip
    away = next((frame for frame in moved if np.nanmax(frame) > FIRST * size), moved[-1])
    return away > 0.5 * np.nanmax(away)
