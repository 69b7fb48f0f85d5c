"""Scenes: blocks, laws, drives and joint sets, read from TOML and validated.

keys       the keys of all tables, with a rule for each value
blocks     convex blocks
laws       joint laws and Coulomb's law
drives     prescribed motions
cutting    an outline cut along joint sets
point_files  points of outlines and lines from CSV and DXF files
supports   rock bolts and pressures on faces
scene      a scene in memory, and the error of a state that it cannot continue from
read       a scene from its file
"""

from .blocks import Block, median_size, rotation
from .drives import Drive, Drives
from .keys import Tables, overlay
from .laws import INTACT_ROCK, TYPICAL_STRESS, Files, build_law
from .read import TEMPLATE, build, load, parse, read_tables, shipped
from .scene import Run, Scene, SceneError, Stress
from .supports import Bolt, FacePressure

__all__ = [
    "INTACT_ROCK",
    "TEMPLATE",
    "TYPICAL_STRESS",
    "Block",
    "Bolt",
    "Drive",
    "Drives",
    "FacePressure",
    "Files",
    "Run",
    "Scene",
    "SceneError",
    "Stress",
    "Tables",
    "build",
    "build_law",
    "load",
    "median_size",
    "overlay",
    "parse",
    "read_tables",
    "rotation",
    "shipped",
]
