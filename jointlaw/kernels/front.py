"""A front cell per facet, docs/theory-incremental.md, "A front that moves".

The depth cell in which y last turned from falling to rising is cut in two there: the springs above
are the front, one more slider, the last of its facet. When y falls again, the springs that part are
those that touched since, and they carry nothing of the force that was there before.
"""

import numpy as np
from numpy.typing import NDArray

from ..discretisation.tables import Tables
from ..support.checks import Array
from .cells import Cells, Limits, compliance, limits, reciprocal

STILL = 1e-12  # of y: a fall below that is rounding, and moves no front


def cut(k: Tables, front: Array) -> Limits:
    """Limits of all sliders where the fronts begin at the depths `front` (M, B), fronts last."""
    whole = limits(k)
    inside = holds(whole, front)
    # at a cell limit what the table has there: a spring that touches at once is in the first cell
    begins = front[:, None] <= whole.low
    own = [
        np.where(begins, low, x[:, None])
        for low, x in zip(whole[:3], (front, *k.curve.force(front)), strict=True)
    ]
    low = [np.broadcast_to(x, inside.shape) for x in whole[:3]]
    high = [np.where(inside, x, end) for x, end in zip(own, whole[3:], strict=True)]
    last = [np.sum(np.where(inside, x, 0.0), axis=1, keepdims=True) for x in (*own, *whole[3:])]
    return Limits(*(np.concatenate(two, axis=1) for two in zip(low + high, last, strict=True)))


def holds(cell: Limits, depth: Array) -> NDArray[np.bool_]:
    """In which slider (M, sliders, B) a depth (M, B) lies."""
    return (cell.low <= depth[:, None]) & (depth[:, None] < cell.high)


def moved(
    k: Tables, front: Array, at: Limits, y0: Array, after: Cells, q: Array
) -> tuple[Array, Array, Array]:
    """Where the fronts begin after a step, (M, B), the forces then, and the energy (B,) it loses.

    at: limits of the sliders in the step. y0: effective closure before it. after, q: at its end.

    Where y has fallen, the front joins its cell, and the springs that touch from now on are the
    next front. If joining loses more energy than there is in the slider that springs part from, the
    front stays: else a cycle of many steps, or one that trembles, would lose locked-in shear.
    """
    y, kappa, soft = np.maximum(after.y, 0.0), after.kappa, reciprocal(after.kappa)
    inside = holds(limits(k), front)
    cell_kappa = np.sum(np.where(inside, kappa[:, :-1], 0.0), axis=1)
    cell_q = np.sum(np.where(inside, q[:, :, :-1], 0.0), axis=2)
    front_kappa, front_q = kappa[:, -1], q[:, :, -1]
    gap = cell_q * reciprocal(cell_kappa) - front_q * soft[:, -1]
    loss = cell_kappa * (front_kappa * reciprocal(cell_kappa + front_kappa))
    loss = loss * (gap[0] ** 2 + gap[1] ** 2)
    parting = (at.low < y[:, None]) & (y[:, None] <= at.high)
    stake = np.sum(np.where(parting, (q[0] ** 2 + q[1] ** 2) * soft, 0.0), axis=1)
    joins = ((after.y < y0 * (1 - STILL)) & (loss <= stake)) | (y < front)
    q = q.copy()
    q[:, :, :-1] += np.where(joins[:, None] & inside, front_q[:, :, None], 0.0)
    q[:, :, -1] = np.where(joins, 0.0, front_q)
    lost = np.sum(compliance(k)[:, 0] * np.where(joins, loss, 0.0), axis=0)
    return np.where(joins, y, front), q, lost
