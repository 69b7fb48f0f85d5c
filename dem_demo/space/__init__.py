"""Rough blocks in space: convex solids, their contacts face on face, their statics and motion.

solids     convex polyhedra whose faces remember the joint set that cut them
meshes     solids from OBJ and STL files
cutting    a rock cut along joint sets
scene      a scene in memory
keys       the keys of all tables of a scene, with a rule for each value
read       a scene, in the plane or in space, from its file
loads      water on faces and in joints, stress from outside, and other loads
contacts   contact points of faces, edges and corners, and their kinematics
face_laws  law and rough direction of each contact
statics    static equilibrium, and blocks that have none
drawing    what a picture shows: faces, edges, states, rough directions
pictures   pictures by pyvista
view       a page for the browser with blocks that turn with the mouse
picture_files  pictures of an equilibrium and of a run, as files
strength   factor of safety, and blocks that fail first
blocks     blocks in motion
manager    contact points while blocks move, and their identity in time
simulation a scene in motion
output     files of an equilibrium
record     history and files of a run
"""

from .read import load, parse
from .record import SpaceRecord
from .scene import SpaceBlock, SpaceRock, SpaceScene
from .simulation import SpaceSimulation, load_simulation
from .statics import Equilibrium, Statics

__all__ = [
    "Equilibrium",
    "SpaceBlock",
    "SpaceRecord",
    "SpaceRock",
    "SpaceScene",
    "SpaceSimulation",
    "Statics",
    "load",
    "load_simulation",
    "parse",
]
