"""The tables of a law as numbers and arrays of `struct jlaw_law` (layout.py)."""

import numpy as np

from ..discretisation.nodes import UNUSED
from ..discretisation.tables import Tables
from ..kernels.cells import compliance
from ..kernels.reference import strength
from ..kernels.unmated import unmated_start
from ..parameters.bond import Bond
from ..support.checks import Array
from .layout import BOND, LANES, LARGEST, first_columns


def pack(k: Tables) -> tuple[dict[str, int | float], dict[str, Array]]:
    """Numbers and arrays of `struct jlaw_law` as far as the step and the measures read them."""
    bond = k.bond or Bond(0.0, 0.0, 0.0, 0.0)
    numbers_of_bond = bond.normal_stiffness, bond.shear_stiffness, *np.ravel(bond.limits).tolist()
    numbers = {
        "dim": k.dim,
        "facets": len(k.c1),
        "cells": k.cells,
        "pieces": len(k.curve.S),
        "yields": int(k.yields),
        "fades": int(k.fades),
        "wears": int(k.wears),
        "bonded": int(k.bond is not None),
        "soft": 1.0 / k.lam,
        "mu": k.mu,
        "mating_length": min(k.mating_length, LARGEST),
        "slope_wear": min(k.slope_wear, LARGEST),
        "slope_residual": k.slope_residual,
        "first_touch": float(unmated_start(k)[0]) if k.fades and k.dim > 1 else 0.0,
        "eta": k.curve.eta,
        "scale": k.curve.scale,
        "rise": float(k.curve.rise),
        **dict(zip(BOND, numbers_of_bond, strict=True)),
    }
    columns = {
        "M": k.m.T,
        "S": k.s.T,
        "T": k.t.T,
        "N": k.n.T,
        "E": k.azimuth.T,
        "STEEP": k.steep,
        "COSINE": k.c1,
        "A": k.area,
        "STIFF": k.area / k.c1,
        "STRENGTH": strength(k, np.ones((1, 1))).ravel(),
        "COMPLIANCE": compliance(k).ravel(),
        "POTENTIAL": k.area * k.c1,
        "SHARE": k.weight / k.weight.sum(),
        "YIELD": k.yield_depth if k.yields else np.zeros(len(k.c1)),
    }
    facet = in_columns(columns, len(k.c1))
    arrays = {"facet": facet, "depth": _depth(k), "curve": k.curve.S, "energy": k.curve.T}
    return numbers, arrays


def in_columns(columns: dict[str, Array], M: int) -> Array:
    """Columns by name, (M,) or (M, several), in a table of facets (M, JLAW_COLUMNS)."""
    first = first_columns()
    facet = np.zeros((M, first["COLUMNS"]))
    for name, values in columns.items():
        several = values.reshape(M, -1)
        facet[:, first[name] : first[name] + several.shape[1]] = several
    return facet


def in_blocks(rows: Array) -> Array:
    """Rows of facets (M, ...) side by side: (blocks, ..., LANES), zeros beyond the last facet."""
    full = np.zeros((-(-len(rows) // LANES), LANES, *rows.shape[1:]))
    full.reshape(-1, *rows.shape[1:])[: len(rows)] = rows
    return np.ascontiguousarray(np.moveaxis(full, 1, -1))


def _depth(k: Tables) -> Array:
    """Depth cells (M, D, 6): zeta, Phi, Phi' at the begin; zeta at the end, G and kappa there."""
    begin, end = (
        np.stack([k.depth[:, rows], k.depth_force[:, rows], k.depth_slope[:, rows]])
        for rows in (slice(-1), slice(1, None))
    )
    ends = end[0] < UNUSED  # others are open-ended
    zeta, force, slope = np.where(ends, end, 0.0)
    start, force0, slope0 = np.where(begin[0] < UNUSED, begin, 0.0)
    G = np.where(ends, force - force0 - slope0 * (zeta - start), 0.0)
    kappa = np.where(ends, slope - slope0, 0.0)
    last = np.where(ends, zeta, LARGEST)
    return np.stack([np.minimum(begin[0], LARGEST), force0, slope0, last, G, kappa], axis=-1)
