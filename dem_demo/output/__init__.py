"""Output: what a run records, writes and draws.

law_alone    what the law says without blocks
monitors     what a scene's [watch] table asks for
record       the history of a run
outcome      what became of each rock mass
drawing      what the pictures share
frames       pictures of single blocks, animations
rock_report  pictures of rock masses
curves       energies, tilt and shear curves
vtk          frames as VTK files
interrupt    what Ctrl-C does to a run
run          a run from start to end, and its files
"""
