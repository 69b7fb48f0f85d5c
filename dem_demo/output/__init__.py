"""Output: what a run records, writes and draws.

law_alone    what the law says without blocks
monitors     what a scene's [watch] table asks for
record       the history of a run
outcome      what became of each rock mass
pictures     of blocks and joints, and animations
curves       energies, tilt and shear curves
vtk          frames as VTK files
run          a run from start to end, and its files
"""
