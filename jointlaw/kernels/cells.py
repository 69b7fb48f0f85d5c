"""Cells of facets: how the first-loading curve of a facet is divided among its cells.

A facet is a bed of parallel springs that engage at different depths zeta (effective closures).
The density of engagement is Phi'' of the first-loading curve Phi. A cell lumps the springs with
depths between two limits. Its springs share one slider with Coulomb friction: an Iwan-type
spring-slider. G is the normal force that its springs have together, kappa = dG/dy their stiffness.
The sum of G over the cells of a facet is Phi, whatever the number of cells, so the normal force of
first loading is exact; few cells only coarsen the sequence in which sliders reach their limits.
"""

from typing import NamedTuple

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import MIN_DIVISOR


class Cells(NamedTuple):
    """The cells of all facets at one effective closure."""

    y: Array  # effective closure (M, B)
    force: Array  # Phi (M, B)
    slope: Array  # Phi' (M, B)
    G: Array  # part of Phi of each cell (M, D, B)
    kappa: Array  # its slope dG/dy (M, D, B)


def evaluate_cells(k: FacetTables, y: Array) -> Cells:
    """Force and stiffness of the first-loading curve, and of the springs of every cell.

    y: effective closure (M, B) in m. Returns `Cells`: Phi and Phi' of each facet (M, B), and G and
    kappa of each cell (M, D, B), to which only springs between the depth limits of the cell
    contribute, as far as they are engaged at y.
    """
    force, slope = k.curve.force(y)
    limits = [x[:, :, None] for x in (k.cell_depth, k.cell_force, k.cell_slope)]
    low, low_force, low_slope = (x[:, :-1] for x in limits)
    high, high_force, high_slope = (x[:, 1:] for x in limits)
    y_ = y[:, None]
    force_ = force[:, None]
    slope_ = slope[:, None]
    engaged = np.clip(y_, low, high)  # springs up to this depth are engaged
    # y decides which slope holds: beyond the last height a tabulated slope is not quite constant
    kappa = np.where(y_ > high, high_slope, slope_) - low_slope
    kappa = np.where(y_ > low, np.maximum(kappa, 0.0), 0.0)
    force_at_engaged = (
        np.clip(force_, low_force, high_force) - low_force - low_slope * (engaged - low)
    )
    G = kappa * (y_ - engaged) + force_at_engaged
    G = np.clip(G, 0.0, kappa * np.maximum(y_ - low, 0.0))
    return Cells(y, force, slope, G, kappa)


def slider_compliance(k: FacetTables) -> Array:
    """c1/(2 A lam) per facet (M, 1, 1): |q|^2/kappa times it is energy; 0 for an empty facet."""
    scale = 2 * k.area * k.lam
    return np.divide(k.c1, scale, out=np.zeros_like(scale), where=scale > 0)[:, None, None]


def reciprocal(kappa: Array) -> Array:
    """1/kappa, 0 where there is no stiffness."""
    return np.divide(1.0, kappa, out=np.zeros_like(kappa), where=kappa > MIN_DIVISOR)
