"""Output of a run: monitors, tables, pictures, VTK files.

folder       names of the files of a run
monitors     readings of the `[monitor]` table, and predictions of the law alone
record       the history of a run, and the outcome of each rock mass
pictures     blocks and joints in one frame or an animation; curves
vtk          frames as VTK files
run          a run from start to end, and its files
"""
