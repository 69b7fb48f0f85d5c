"""Rigid rock blocks in 2-D with a joint law: pymunk finds neighbours, jointlaw pushes.

The reference example of how to embed `jointlaw` in a block code; see docs/embed.md.
Rooms, each using only those above it: scene, contact, dynamics, output, studies, space (statics of
blocks in space); then the commands.
"""

try:
    from .dynamics.simulation import Simulation
    from .output.run import run
    from .scene import Scene, SceneError, load, parse
except ImportError as error:  # `python -m` tells it in one line if it is about this package
    needs = f"the block demo lacks a package ({error}): pip install 'jointlaw[demo]'"
    raise ImportError(needs, name=__name__) from error

__all__ = ["Scene", "SceneError", "Simulation", "load", "parse", "run"]
