"""Dynamics: blocks in motion, forces, energies, time steps.

blocks           the bodies, everything that touches pymunk, and loads on their edges
energy_balance   the energies of a run
timestep         the largest stable step
equilibrium      the initial state: in-situ stress, static equilibrium, unstable blocks
search           the search for an equilibrium, in the plane or in space
relaxation       dynamic relaxation to an equilibrium, or to the verdict that there is none
simulation       a scene in motion, for users; excavation; saved states
"""
