"""Rough blocks in space: convex solids, their contacts face on face, and their statics.

solids     convex polyhedra whose faces remember the joint set that cut them
meshes     solids from OBJ and STL files
cutting    a rock cut along joint sets
contacts   contact points of faces that lie on each other, and their kinematics
"""
