"""Dynamics: forces, energies, time steps; each room function takes a state and returns one.

world                everything that touches pymunk
energy               the ledger of energies
timestep             the largest stable step
state                what stays the same during a run, and what changes
forces               forces at a state
guards               what is refused
initial_equilibrium  displacements that balance the weight
start                from the drawing to step 0
step                 one step; law points that come, go or change their length of joint
saved_states         states in memory and in files
simulation           all of it, for a user
"""
