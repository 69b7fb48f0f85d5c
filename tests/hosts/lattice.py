"""Contacts of a simple cubic lattice, whose stable time step hosts and Python compare."""

import numpy as np


def lattice_contacts(n):
    """First and second bodies of the contacts in a periodic simple cubic lattice of n^3 bodies."""
    bodies = np.arange(n**3).reshape(n, n, n)
    neighbours = [np.roll(bodies, -1, axis).ravel() for axis in range(3)]
    return np.tile(bodies.ravel(), 3), np.concatenate(neighbours)
