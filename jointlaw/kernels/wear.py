"""Friction that falls with the slip of the asperities, docs/theory-incremental.md, "Wear"."""

import numpy as np

from ..discretisation.tables import Tables
from ..support.checks import Array
from .cells import Cells, compliance, reciprocal


def friction(k: Tables, slip: Array) -> Array:
    """mu (B,) after the slip L (B,) of the asperities."""
    assert k.mu_residual is not None
    return k.mu_residual + (k.mu - k.mu_residual) * np.exp(-slip / k.wear_slip)


def within_limit(
    k: Tables, before: Cells, q: Array, strength: Array, fallen: Array, mu: Array
) -> tuple[Array, Array]:
    """q brought back within the friction limit of mu (B,), and the energy (B,) that it loses.

    fallen (B,): by how much mu had fallen in the last step. q is within the limits of that step; a
    slider above its present limit is within it after losing the share that mu has lost since.
    """
    last = k.mu - fallen
    since = np.minimum(np.divide(mu, last, out=np.ones_like(last), where=last > 0), 1.0)
    q2 = q[0] ** 2 + q[1] ** 2
    share = np.where(q2 > (strength * before.G) ** 2, since, 1.0)
    lost = (1 - share) * (1 + share) * q2 * reciprocal(before.kappa)
    return share * q, np.sum(compliance(k) * lost, axis=(0, 1))


def slipped(k: Tables, before: Cells, after: Cells, mu: Array, lost: Array) -> Array:
    """Slip dL (B,) of the asperities: the energy lost to friction over the mean friction limit."""
    limit = 0.5 * mu * np.sum(k.area[:, None] * (before.force + after.force), axis=0)
    return np.divide(lost, limit, out=np.zeros_like(limit), where=limit > 0)
