"""Depth cells of facets: how the virgin curve at one moment is shared among them."""

from typing import NamedTuple

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import MIN_DIVISOR


class Cells(NamedTuple):
    """The depth cells of all facets at one moment."""

    y: Array  # effective closure (M, B)
    force: Array  # Phi (M, B)
    slope: Array  # Phi' (M, B)
    G: Array  # share of Phi of each cell (M, D, B)
    kappa: Array  # its slope dG/dy


def cells(k: FacetTables, y: Array) -> Cells:
    """Virgin curve at y (M, B), and the share of every depth cell in it."""
    force, slope = k.curve.force(y)
    limits = [x[:, :, None] for x in (k.depth, k.depth_force, k.depth_slope)]
    low, low_force, low_slope = (x[:, :-1] for x in limits)
    high, high_force, high_slope = (x[:, 1:] for x in limits)
    y_, force_, slope_ = y[:, None], force[:, None], slope[:, None]
    reach = np.clip(y_, low, high)
    # y tells which slope holds: beyond the last height a tabulated slope is not quite constant
    kappa = np.where(y_ > high, high_slope, slope_) - low_slope
    kappa = np.where(y_ > low, np.maximum(kappa, 0.0), 0.0)
    stored = np.clip(force_, low_force, high_force) - low_force - low_slope * (reach - low)
    G = kappa * (y_ - reach) + stored
    G = np.clip(G, 0.0, kappa * np.maximum(y_ - low, 0.0))
    return Cells(y, force, slope, G, kappa)


def compliance(k: FacetTables) -> Array:
    """c1/(2 A lam) per facet (M, 1, 1): turns |q|^2/kappa into energy; 0 for an empty facet."""
    scale = 2 * k.area * k.lam
    return np.divide(k.c1, scale, out=np.zeros_like(scale), where=scale > 0)[:, None, None]


def reciprocal(kappa: Array) -> Array:
    """1/kappa, 0 where there is no stiffness."""
    return np.divide(1.0, kappa, out=np.zeros_like(kappa), where=kappa > MIN_DIVISOR)
