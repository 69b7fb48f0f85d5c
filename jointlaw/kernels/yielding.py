"""Asperities that yield: one flattened depth per facet, docs/theory-incremental.md, "Yielding".

Springs of a facet whose touch depth is less than its flattened depth z_p are flattened: all of them
touch again at the same effective closure, y = z_p. Normal force and friction limit of the facet are
therefore those of elastic springs at y less those at z_p.
"""

import numpy as np
from numpy.typing import NDArray

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import ROUNDING_TOLERANCE
from .cells import Cells
from .mating import Planes


def flatten(k: FacetTables, depth: Array, y: Array) -> Array:
    """Flattened depth (M, B) of every facet once the closures y (M, B) are reached."""
    own = np.maximum(depth, y - k.yield_depth[:, None])
    return np.maximum(own, own[k.opposite])


def flattened(virgin: Cells, flat: Cells | None) -> Cells:
    """The cells of the virgin curve less their values at the flattened depth."""
    if flat is None:
        return virgin
    over = virgin.y - flat.y
    touches = over > 0
    force = np.where(touches, np.maximum(virgin.force - flat.force, 0.0), 0.0)
    kappa = np.where(touches[:, None], virgin.kappa, 0.0)
    G = np.clip(virgin.G - flat.G, 0.0, kappa * np.maximum(over, 0.0)[:, None])
    return Cells(virgin.y, force, np.where(touches, virgin.slope, 0.0), G, kappa)


def flattens_itself(k: FacetTables, y1: Array, z1: Array) -> NDArray[np.bool_]:
    """Whether facets (M, B) flatten themselves; else the opposite one does.

    Both do, but for rounding, where the shear does not move them, as at a right angle to it.
    """
    return y1 - k.yield_depth[:, None] >= z1 - ROUNDING_TOLERANCE * np.abs(y1)


def plastic_work(k: FacetTables, y0: Array, y1: Array, flat0: Cells, flat1: Cells) -> Array:
    """Energy (B,) in J/m2 that springs lose while they are flattened.

    Exact for springs that the closure of their own facet flattens; for those that the opposite
    facet flattens it is the mean of their compressions before and after the step.
    """
    largest = k.yield_depth[:, None]
    mean = 0.5 * (np.clip(y0 - flat0.y, 0.0, largest) + np.clip(y1 - flat1.y, 0.0, largest))
    deep = np.where(flattens_itself(k, y1, flat1.y), largest, mean)
    return np.sum((k.area * k.c1)[:, None] * deep * (flat1.force - flat0.force), axis=0)


def softening(
    k: FacetTables, after: Cells, flat0: Cells, flat1: Cells, push: Array, end: Planes
) -> Array:
    """Part (dim, dim, B) by which yielding lowers the tangent: the flattened depth moves along.

    push: derivative (2, M, D, B) of q by G in slipping sliders. end: the planes after the step.
    """
    moves = (flat1.y - flat0.y > ROUNDING_TOLERANCE * flat1.y) & (after.kappa > 0).any(axis=1)
    own = flattens_itself(k, after.y, flat1.y)
    shear = np.sum(push * np.where(after.kappa > 0, flat1.kappa, 0.0), axis=2)
    along = end.n * (k.area[:, None] * flat1.slope)
    along = along + np.einsum("edmb,emb->dmb", end.basis, shear) / k.lam
    pressing = np.where(own, end.g, end.g[:, k.opposite])
    return np.einsum("imb,jmb->ijb", np.where(moves, along, 0.0), pressing)
