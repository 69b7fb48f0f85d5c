"""The initial equilibrium: displacements with which the joints carry gravity and loads."""

from functools import partial

import numpy as np
from scipy.sparse import bmat, csr_array, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from ..contact import Joints, StiffnessCurve

TIGHT = 1e-11  # residual force as a share of the applied one


def equilibrium(joints: Joints, rows: csr_array, closure, slid, area, force, settle, near):
    """Displacements of the free motions that balance `force`; rows as in `StepLimit.rows`.

    closure, slid (k,): where the joints are without these displacements (m), reached in one step
    from the virgin state. settle (free motions,): those that are asked for; near: they are almost
    in balance.

    First with joints that cannot slide; then with the law itself. Blocks that the law cannot hold
    are placed with joints that neither slide nor open, which always has an answer. Blocks that no
    joint connects, such as two slopes side by side, find their answers apart. Returns
    (displacement, balanced), both (free motions,): balanced is False where the law cannot hold:
    those blocks will move from step 0.
    """
    k = len(closure)
    rows = diags(np.concatenate([-np.ones(k), np.ones(k)])) @ rows  # to (closure, shear)
    start = np.concatenate([closure, slid])
    weight = np.concatenate([area, area])

    def bonded(d, pull=0.0):
        c = np.maximum(np.abs(d[:k]), 1e-9)
        shear = joints.virgin(StiffnessCurve.at_closure, c)
        stress, above, below = (
            joints.virgin(StiffnessCurve.stress_at, part * c) for part in (1.0, 1.01, 0.99)
        )
        slope = (above - below) / (0.02 * c)
        acts = np.where(d[:k] > 0, 1.0, pull)
        F = np.concatenate([stress * acts * np.sign(d[:k]), shear * d[k:]])
        return F, diags(np.concatenate([slope * acts, shear]))

    def law(d):
        F, C = joints.trial(np.stack([d[:k], d[k:]], axis=1))
        blocks = [[diags(C[:, i, j]) for j in (0, 1)] for i in (0, 1)]
        return F.T.ravel(), csr_array(bmat(blocks))

    touched = abs(rows[:k]) + abs(rows[k:])  # the law couples closure and shear
    _, island = connected_components(touched.T @ touched, directed=False)
    idle, nothing = np.bincount(island, settle) == 0, np.zeros(len(force))
    guess = nothing
    if not near:
        guess, _ = _newton(bonded, rows, start, weight, force, nothing, 300, island, idle)
    best, balanced = _newton(law, rows, start, weight, force, guess, 100, island, idle)
    if not (near or balanced.all()):
        glue = partial(bonded, pull=1.0)
        glued, _ = _newton(glue, rows, start, weight, force, nothing, 300, island, balanced)
        best = np.where(balanced[island], best, glued)
    return best, balanced[island]


def _newton(law, rows, start, weight, force, y, most, island, idle):
    """Levenberg's damped Newton steps on the unbalanced force, each island with its damping.

    island (free motions,): number of the group of connected blocks; idle: islands to leave alone.
    Returns y and whether each island found its balance.
    """

    def unbalanced(y):
        F, C = law(start + rows @ y)
        return force - rows.T @ (weight * F), C

    def norm(r):
        return np.sqrt(np.bincount(island, r * r))

    r, C = unbalanced(y)
    size, target = norm(r), TIGHT * norm(force)
    damp = None
    stuck = idle.copy()  # no damping makes a better step
    for _ in range(most):
        active = (size > target) & ~stuck
        if not active.any():
            break
        K = (rows.T @ diags(weight) @ C @ rows).tocsc()
        if damp is None:
            damp = np.full(len(size), max(1e-3 * abs(K).max(), 1.0))
        waits = active.copy()
        step = np.zeros(len(y))
        for _ in range(40):
            trial = spsolve((K + diags(damp[island])).tocsc(), r)
            step = np.where(waits[island], trial, step)
            r_new, C_new = unbalanced(y + step * active[island])
            waits = active & ~(norm(r_new) < size)
            if not waits.any():
                break
            damp = np.where(waits, 4 * damp, damp)
        stuck |= waits
        y = y + step * (active & ~waits)[island]
        r, C = (r_new, C_new) if not waits.any() else unbalanced(y)
        size = norm(r)
        damp = np.where(active & ~waits, damp / 10, damp)
    return y, size <= 1e3 * target
