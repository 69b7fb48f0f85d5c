"""Rigid rock blocks in 2-D with a joint law: pymunk finds and moves, jointlaw pushes.

The reference example of how to embed `jointlaw` in a block code; see docs/embed.md.
"""

from .coulomb import CoulombLaw
from .interfaces import Refused
from .run import run
from .scene import Scene, load, parse
from .simulation import Simulation
from .tables import SceneError

__all__ = ["CoulombLaw", "Refused", "Scene", "SceneError", "Simulation", "load", "parse", "run"]
