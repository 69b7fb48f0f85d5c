"""Rough blocks in space: convex solids, their contacts face on face, and their statics.

solids     convex polyhedra whose faces remember the joint set that cut them
meshes     solids from OBJ and STL files
cutting    a rock cut along joint sets
scene      a scene in memory
keys       the keys of all tables of a scene, with a rule for each value
read       a scene, in the plane or in space, from its file
loads      water on faces and in joints, stress from outside, and other loads
contacts   contact points of faces that lie on each other, and their kinematics
statics    static equilibrium, and blocks that have none
drawing    what a picture shows: faces, edges, states, rough directions
pictures   pictures by pyvista
strength   factor of safety, and blocks that fail first
"""

from .read import load, parse
from .scene import SpaceBlock, SpaceRock, SpaceScene
from .statics import Equilibrium, Statics

__all__ = ["Equilibrium", "SpaceBlock", "SpaceRock", "SpaceScene", "Statics", "load", "parse"]
