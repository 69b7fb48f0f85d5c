"""Elastic-perfectly plastic asperities: docs/theory-incremental.md, "Yielding".

A spring of a facet is compressed elastically by at most the yield interference y_p along y. Beyond
that it keeps a constant force and a permanent compression. The springs that engage first yield
first, so one number per facet describes them all: the plastic indentation z. Springs that engage
at a depth less than z have yielded; all of them touch again at the same effective closure, y = z.

Normal force and friction limit of the facet are therefore the values of elastic springs at y less
the values at z: Phi(y) - Phi(z), and the same for G of every cell. While a facet is loaded beyond
its yield interference, z = y - y_p grows with y, and the springs dissipate y_p times the increase
of Phi(z). On unloading z stays, so the joint keeps a permanent closure.

Where the interlock decays, a facet and the opposite one of the same asperity share one
indentation, the larger one; else each has its own (`opposite` of the tables).
"""

import numpy as np
from numpy.typing import NDArray

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import ROUNDING_TOLERANCE
from .cells import Cells
from .interlock import Planes


def update_indentation(k: FacetTables, indentation: Array, y: Array) -> Array:
    """Plastic indentation (M, B) in m of every facet once the closures y (M, B) are reached.

    It never decreases. Two opposite facets are the two sides of one asperity: both take the larger
    of their indentations, the closure beyond the yield depth.
    """
    single = np.maximum(indentation, y - k.yield_depth[:, None])
    return np.maximum(single, single[k.opposite])


def subtract_plastic(elastic: Cells, indented: Cells | None) -> Cells:
    """Forces and stiffnesses of cells whose springs are plastically indented.

    The values at y less the values at the indentation, both on the first-loading curve; zero where
    y is at most the indentation. `elastic` is returned as it is where `indented` is None.
    """
    if indented is None:
        return elastic
    compression = elastic.y - indented.y
    touches = compression > 0
    force = np.where(touches, np.maximum(elastic.force - indented.force, 0.0), 0.0)
    slope = np.where(touches, elastic.slope, 0.0)
    kappa = np.where(touches[:, None], elastic.kappa, 0.0)
    G = np.clip(elastic.G - indented.G, 0.0, kappa * np.maximum(compression, 0.0)[:, None])
    return Cells(elastic.y, force, slope, G, kappa)


def sets_own_indentation(k: FacetTables, y1: Array, z1: Array) -> NDArray[np.bool_]:
    """Whether the closure of the facets (M, B) sets their indentation, else the opposite facet.

    Both do, but for rounding, where the shear does not move them, as at a right angle to it.
    """
    return y1 - k.yield_depth[:, None] >= z1 - ROUNDING_TOLERANCE * np.abs(y1)


def plastic_work(k: FacetTables, y0: Array, y1: Array, indented0: Cells, indented1: Cells) -> Array:
    """Energy (B,) in J/m2 that springs dissipate while they are indented.

    Exact for springs that the closure of their own facet indents; for springs that the opposite
    facet indents it takes the mean of their compressions before and after the step.
    """
    largest = k.yield_depth[:, None]
    compression0 = np.clip(y0 - indented0.y, 0.0, largest)
    compression1 = np.clip(y1 - indented1.y, 0.0, largest)
    mean = 0.5 * (compression0 + compression1)
    compression = np.where(sets_own_indentation(k, y1, indented1.y), largest, mean)
    increase = indented1.force - indented0.force
    return np.sum((k.area * k.c1)[:, None] * compression * increase, axis=0)


def plastic_softening(
    k: FacetTables, after: Cells, indented0: Cells, indented1: Cells, push: Array, end: Planes
) -> Array:
    """Part (dim, dim, B) by which the growth of the indentation lowers the tangent.

    push: derivative (2, M, D, B) of q by G in slipping sliders. end: the planes after the step.
    """
    indents = is_indented(after, indented0, indented1)
    shear = np.sum(push * np.where(after.kappa > 0, indented1.kappa, 0.0), axis=2)
    along = end.n * (k.area[:, None] * indented1.slope)
    along = along + np.einsum("edmb,emb->dmb", end.basis, shear) / k.lam
    pressing = pressing_slope(k, after, indented1, end)
    return np.einsum("imb,jmb->ijb", np.where(indents, along, 0.0), pressing)


def normal_softening(
    k: FacetTables, after: Cells, indented0: Cells, indented1: Cells, end: Planes
) -> Array:
    """Part (dim, B) by which the growth of the indentation lowers dN/dd of the contact stress N."""
    indents = is_indented(after, indented0, indented1)
    softening = (k.area * k.c1)[:, None] * np.where(indents, indented1.slope, 0.0)
    pressing = pressing_slope(k, after, indented1, end)
    return np.einsum(
        "mb,jmb->jb", softening, np.broadcast_to(pressing, (len(pressing), *softening.shape))
    )


def is_indented(after: Cells, indented0: Cells, indented1: Cells) -> NDArray[np.bool_]:
    """Whether the step indents facets (M, B) that are in touch at its end."""
    indents = indented1.y - indented0.y > ROUNDING_TOLERANCE * indented1.y
    return indents & (after.kappa > 0).any(axis=1)


def pressing_slope(k: FacetTables, after: Cells, indented1: Cells, end: Planes) -> Array:
    """Slope g (J, M, B) of the facet whose closure indents each facet: its own or the opposite."""
    is_own = sets_own_indentation(k, after.y, indented1.y)
    return np.where(is_own, end.g, end.g[:, k.opposite])
