"""Start at rest: where the blocks sit when their joints carry gravity and loads from step 0."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags
from scipy.sparse.linalg import spsolve

from .joints import Joints

TIGHT = 1e-11  # residual force as a share of the applied one


def equilibrium(joints: Joints, rows: csr_array, closure, slid, area, force):
    """Displacements of the free motions that balance `force`; rows as in `StepLimit.rows`.

    closure, slid (k,): where the joints are without these displacements (m), reached in one step
    from the virgin state.

    First with joints that cannot slide; then with the law itself. If the law cannot hold the
    blocks, with joints that neither slide nor open, which always has an answer.
    Returns (displacement, slid (k,) in m, balanced): balanced is False when the law cannot hold
    the blocks: they will move from step 0.
    """
    k = len(closure)
    rows = diags(np.concatenate([-np.ones(k), np.ones(k)])) @ rows  # to (closure, shear)
    start = np.concatenate([closure, slid])
    weight = np.concatenate([area, area])

    def bonded(d, pull=0.0):
        c = np.maximum(np.abs(d[:k]), 1e-9)
        shear = joints.stiffness_at(c)
        slope = (joints.stress_at(1.01 * c) - joints.stress_at(0.99 * c)) / (0.02 * c)
        acts = np.where(d[:k] > 0, 1.0, pull)
        F = np.concatenate([joints.stress_at(c) * acts * np.sign(d[:k]), shear * d[k:]])
        return F, diags(np.concatenate([slope * acts, shear]))

    def law(d):
        F, C = joints.trial(np.stack([d[:k], d[k:]], axis=1))
        i, j = np.arange(k), np.arange(k) + k
        where = np.concatenate([i, i, j, j]), np.concatenate([i, j, i, j])
        entries = np.concatenate([C[:, 0, 0], C[:, 0, 1], C[:, 1, 0], C[:, 1, 1]])
        return F.T.ravel(), csr_array((entries, where), shape=(2 * k, 2 * k))

    guess, _ = _newton(bonded, rows, start, weight, force, np.zeros(rows.shape[1]), 300)
    best, balanced = _newton(law, rows, start, weight, force, guess, 100)
    if not balanced:
        nothing = np.zeros(rows.shape[1])
        best, _ = _newton(lambda d: bonded(d, 1.0), rows, start, weight, force, nothing, 300)
    return best, slid + (rows @ best)[k:], balanced


def _newton(law, rows, start, weight, force, y, most):
    """Levenberg's damped Newton steps on the unbalanced force."""

    def unbalanced(y):
        F, C = law(start + rows @ y)
        return force - rows.T @ (weight * F), C

    r, C = unbalanced(y)
    size, target = np.linalg.norm(r), TIGHT * np.linalg.norm(force)
    damp = None
    for _ in range(most):
        if size <= target:
            return y, True
        K = (rows.T @ diags(weight) @ C @ rows).tocsc()
        if damp is None:
            damp = max(1e-3 * abs(K).max(), 1.0)
        for _ in range(40):
            step = spsolve((K + damp * diags(np.ones(len(y)))).tocsc(), r)
            r_new, C_new = unbalanced(y + step)
            if np.linalg.norm(r_new) < size:
                break
            damp *= 4
        else:
            return y, size <= 1e3 * target
        y, r, C, size = y + step, r_new, C_new, np.linalg.norm(r_new)
        damp /= 10
    return y, size <= 1e3 * target
