"""Dynamics: blocks in motion, forces, energies, time steps.

blocks         the bodies, everything that touches pymunk, and loads on their edges
energy         the energy_balance of energies
timestep       the largest stable step
equilibrium    the start: stress of before, the equilibrium, and what it cannot hold
simulation     all of it, for a user; states in memory and in files
"""
