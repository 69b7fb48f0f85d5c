"""Limit analysis of blocks by linear programming: an upper bound of their factor of safety.

A scene holds only if there are forces in its joints, pressing and within the friction cone, that
balance every block. Whether there are any is a linear program, whatever the joints' stiffnesses. So
no scene that is held by friction has a higher factor than this, the largest at which there are
some. It is also what the joints would have that dilate by their friction angle (associated flow);
joints without dilation may fail before, because they cannot choose among the forces.
"""

import numpy as np
from scipy.optimize import bisect, linprog
from scipy.sparse import diags, hstack

from dem_demo.contact import Tracker
from dem_demo.dynamics.blocks import Blocks
from dem_demo.dynamics.timestep import rates


def upper_factor(scene, low=0.25, high=4.0, exact=1e-3):
    """Largest factor by which Coulomb's friction can be divided, by bisection; no cohesion."""
    blocks = Blocks(scene)
    tracker = Tracker(scene, blocks.motion)
    tracker.renew(blocks.motion, blocks.near())
    contacts = tracker.contacts
    carries = np.flatnonzero(contacts.length > 0)
    k, free = len(contacts.length), blocks.free.ravel()
    ways = rates(blocks, contacts)[np.concatenate([carries, k + carries])].T  # of N, and of shear
    friction = np.array([law.friction for law in scene.laws.values()])[tracker.law[carries]]
    n = len(carries)
    press, shear = ways[:, :n], ways[:, n:]
    load = ((blocks.gravity + blocks.loads) * blocks.root).ravel()[free]
    scale = np.abs(load).max()

    def holds(factor):
        # What a joint bears is a sum, with no negative part, of forces along its normal and along
        # the two edges of its cone.
        across = press @ diags(factor / friction)
        balance = hstack([press, across + shear, across - shear]).tocsr()
        found = linprog(np.zeros(3 * n), A_eq=balance, b_eq=-load / scale, bounds=(0, None))
        return 1.0 if found.status == 0 else -1.0

    return bisect(holds, low, high, xtol=exact)
