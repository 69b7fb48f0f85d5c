"""Scenes: blocks, laws, drives and joint sets, read from TOML and checked.

keys       the keys of all tables, and what each may be
blocks     convex blocks
laws       joint laws and Coulomb's
drives     prescribed motions
cutting    an outline cut along joint sets
scene      a scene in memory, and what is refused of its states
read       a scene from its file
"""

from .blocks import Block, turn, usual_size
from .drives import Drives
from .keys import Tables, overlay
from .laws import USUAL, WHOLE, Files, Law, build_law, opens_to, springs
from .read import TEMPLATE, build, load, parse, read_tables, shipped
from .scene import Refused, Run, Scene, Stress

__all__ = [
    "TEMPLATE",
    "USUAL",
    "WHOLE",
    "Block",
    "Drives",
    "Files",
    "Law",
    "Refused",
    "Run",
    "Scene",
    "Stress",
    "Tables",
    "build",
    "build_law",
    "load",
    "opens_to",
    "overlay",
    "parse",
    "read_tables",
    "shipped",
    "springs",
    "turn",
    "usual_size",
]
