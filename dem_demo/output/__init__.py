"""Output: what a run records, writes and draws.

monitors     what a scene's [monitor] table asks for, and what the law alone says of it
record       the history of a run, and what became of each rock mass
pictures     of blocks and joints, animations, curves
vtk          frames as VTK files
run          a run from start to end, and its files
"""
