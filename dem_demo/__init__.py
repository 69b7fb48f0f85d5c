"""Rigid rock blocks in 2-D with a joint law: pymunk finds and moves, jointlaw pushes.

The reference example of how to embed `jointlaw` in a block code; see docs/embed.md.
"""

from importlib import import_module

try:
    for package in ("matplotlib", "PIL", "pymunk", "shapely", "tqdm"):
        import_module(package)
except ImportError as error:  # `python -m` tells it in one line if it is about this package
    needs = f"the block demo lacks a package ({error}): pip install 'jointlaw[demo]'"
    raise ImportError(needs, name=__name__) from error

from .coulomb import CoulombLaw
from .interfaces import Refused
from .run import run
from .scene import Scene, load, parse
from .simulation import Simulation
from .tables import SceneError

__all__ = ["CoulombLaw", "Refused", "Scene", "SceneError", "Simulation", "load", "parse", "run"]
