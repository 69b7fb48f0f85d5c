"""Scenes: blocks, laws, drives and joint sets, read from TOML and checked.

tables     a TOML table that names what is wrong with it
blocks     convex blocks
laws       joint laws and plain Coulomb
drives     prescribed motions
cutting    an outline cut along joint sets
rocks      the rock masses of a scene
scene      a scene in memory
read       a scene from its file
"""

from .read import build, load, names, parse
from .scene import Scene

__all__ = ["Scene", "build", "load", "names", "parse"]
