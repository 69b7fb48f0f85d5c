"""The compiled step of the blocks: its structures, its source in C, and how it is built.

layout            the structures that Python and C share; `layout.h` is made from it
blocks.c          the step, in the plane and in space
corners.c         contacts in the plane, corners on edges
bolts.c           rock bolts
relaxation.c      static equilibrium by dynamic relaxation
face_contacts.c   contacts of convex polyhedra in space, face on face
export.h          marks the functions that Python calls
build             makes the library; `python -m dem_demo.native` calls it
"""
