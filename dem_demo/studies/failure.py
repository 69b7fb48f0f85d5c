"""How a scene fails with a little less strength than it needs."""

from contextlib import suppress
from dataclasses import replace

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.record import Record, far
from ..output.run import play
from ..scene import Scene


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
