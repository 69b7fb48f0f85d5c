"""Depth cells of facets: how the virgin curve at one moment is shared among them."""

from typing import NamedTuple

import numpy as np

from ..discretisation.tables import Tables
from ..support.checks import Array

TINY = 1e-290  # a stiffness whose reciprocal might overflow, or a square that underflows: zero


class Cells(NamedTuple):
    """The depth cells of all facets at one moment."""

    y: Array  # effective closure (M, B)
    force: Array  # Phi (M, B)
    slope: Array  # Phi' (M, B)
    G: Array  # share of Phi of each cell (M, D, B)
    kappa: Array  # its slope dG/dy


def cells(k: Tables, y: Array) -> Cells:
    """Virgin curve at y (M, B), and the share of every depth cell in it."""
    force, slope = k.curve.force(y)
    low, high = k.depth[:, :-1, None], k.depth[:, 1:, None]
    low_force, high_force = k.depth_force[:, :-1, None], k.depth_force[:, 1:, None]
    low_slope, high_slope = k.depth_slope[:, :-1, None], k.depth_slope[:, 1:, None]
    at, at_force, at_slope = y[:, None], force[:, None], slope[:, None]
    reach = np.clip(at, low, high)
    # by place, not by size: beyond its last height a tabulated slope wavers by its rounding
    kappa = np.where(at > high, high_slope, at_slope) - low_slope
    kappa = np.where(at > low, np.maximum(kappa, 0.0), 0.0)
    stored = np.clip(at_force, low_force, high_force) - low_force - low_slope * (reach - low)
    G = kappa * (at - reach) + stored
    G = np.clip(G, 0.0, kappa * np.maximum(at - low, 0.0))
    return Cells(y, force, slope, G, kappa)


def compliance(k: Tables) -> Array:
    """c1/(2 A lam) per facet (M, 1, 1): turns |q|^2/kappa into energy; 0 for an empty facet."""
    scale = 2 * k.area * k.lam
    return np.divide(k.c1, scale, out=np.zeros_like(scale), where=scale > 0)[:, None, None]


def reciprocal(kappa: Array) -> Array:
    """1/kappa, 0 where there is no stiffness."""
    return np.divide(1.0, kappa, out=np.zeros_like(kappa), where=kappa > TINY)
