"""The tables of a law as numbers and arrays of `struct jlaw_law` (native/layout.py)."""

import numpy as np

from ..discretisation.nodes import UNUSED
from ..discretisation.tables import FacetTables
from ..native.layout import ARRAYS, FACET_LANES, INTEGERS, LARGEST_FLOAT, REALS, column_offsets
from ..support.checks import Array
from .asperities import Asperities, strength
from .cells import compliance
from .reference import LawTables


def pack(k: LawTables) -> tuple[dict[str, int | float], dict[str, Array]]:
    """Numbers and arrays of `struct jlaw_law` by name, in its order.

    Raises ValueError for an element without C, and KeyError for a number that native/layout.py does
    not name.
    """
    if k.python_only:
        raise ValueError(
            f"the element {k.python_only[0]} has no C version, so this law has no tables for C "
            "hosts: use it in Python, or write its functions in native/elements.h and name it in "
            "native/layout.py"
        )
    numbers: dict[str, int | float] = dict.fromkeys(INTEGERS, 0) | dict.fromkeys(REALS, 0.0)
    arrays = {name: np.zeros(0) for name in ARRAYS}
    found = {
        "dim": k.dim,
        "max_effective_closure": min(element.reach for element in k.elements),
        "max_search_closure": min(min(one.reach, one.farthest) for one in k.elements),
        "closure_per_displacement": k.stretch,
        "tensile_opening": max(element.tensile_opening for element in k.elements),
    }
    for element in k.elements:
        found |= {element.native_name: 1, **element.numbers()}
        if isinstance(element, Asperities):
            arrays |= _arrays(element.k, element.first_loading.yielding)
    if missing := found.keys() - numbers.keys():
        raise KeyError(f"native/layout.py has no {', '.join(sorted(missing))}")
    numbers |= {name: min(value, LARGEST_FLOAT) for name, value in found.items()}
    return numbers, arrays


def _arrays(k: FacetTables, late: tuple[Array, Array] | None) -> dict[str, Array]:
    """LawTables of facets, in blocks; late: what yielding takes off first loading, `yield_sum`."""
    columns = {
        "M": k.m.T,
        "S": k.s.T,
        "T": k.t.T,
        "N": k.n.T,
        "E": k.azimuth.T,
        "TAN_THETA": k.steep,
        "COS_THETA": k.c1,
        "A": k.area,
        "SHEAR_STIFFNESS": k.area / k.c1,
        "FRICTION_LIMIT": strength(k, np.ones((1, 1))).ravel(),
        "SLIDER_COMPLIANCE": compliance(k).ravel(),
        "ENERGY_FACTOR": k.area * k.c1,
        "WEIGHT": k.weight / k.weight.sum(),
        "MIRROR": _mirror(k.n),
        "RING_SIZE": rings(k.theta),
    }
    if late is not None:
        columns["YIELD_CLOSURE"] = k.yield_depth
        columns["YIELD_CORRECTION"] = np.hstack(np.split(np.stack(late, axis=-1), 2))  # of (2 M, 2)
    first, M = column_offsets(), len(k.c1)
    facet = np.zeros((M, first["COLUMNS"]))
    for name, values in columns.items():
        several = values.reshape(M, -1)
        facet[:, first[name] : first[name] + several.shape[1]] = several
    return {
        "facet": _in_blocks(facet),
        "depth": _in_blocks(_depth(k)),
        "curve": k.curve.S,
        "energy": k.curve.T,
    }


def rings(theta: Array) -> Array:
    """Number of the facets (M,) of the same inclination, which follow one another."""
    _, first, count = np.unique(theta, return_index=True, return_counts=True)
    several = count[np.argsort(first)]
    return np.repeat(several, several).astype(float)


def _mirror(n: Array) -> Array:
    """Number of the facet (M,) whose normal has the other sign along axis 2."""
    image = n * np.where(np.arange(len(n)) == 1, -1.0, 1.0)[:, None]
    found = []
    # among those of its inclination, which follow one another: else memory as the square of M
    for ring in np.split(np.arange(n.shape[1]), np.flatnonzero(np.diff(n[0])) + 1):
        away = np.sum((image[:, ring, None] - n[:, None, ring]) ** 2, axis=0)
        found.append(ring[np.argmin(away, axis=1)])
    return np.concatenate(found).astype(float)


def _in_blocks(rows: Array) -> Array:
    """Rows of facets (M, ...) as (blocks, ..., FACET_LANES); zeros beyond the last facet."""
    full = np.zeros((-(-len(rows) // FACET_LANES), FACET_LANES, *rows.shape[1:]))
    full.reshape(-1, *rows.shape[1:])[: len(rows)] = rows
    return np.ascontiguousarray(np.moveaxis(full, 1, -1))


def _depth(k: FacetTables) -> Array:
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
    last = np.where(ends, zeta, LARGEST_FLOAT)
    return np.stack([np.minimum(begin[0], LARGEST_FLOAT), force0, slope0, last, G, kappa], axis=-1)
