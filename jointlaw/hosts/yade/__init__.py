"""YADE: the export of a law, and the files that run in YADE's own Python.

export      table, law, adapter and scripts in one folder
files       the adapter `yade_joint.py` and example scripts, as they are copied
"""
