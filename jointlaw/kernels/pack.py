"""Numbers and arrays of a law for `struct jlaw_law` (native/layout.py)."""

import numpy as np

from ..discretisation.nodes import UNUSED
from ..discretisation.tables import FacetTables
from ..native.layout import (
    ARRAYS,
    ELEMENTS,
    FACET_LANES,
    INTEGERS,
    LARGEST_FLOAT,
    REALS,
    column_offsets,
)
from ..support.checks import Array
from .asperities import AsperityElement, friction_limit
from .cells import slider_compliance
from .element import Element
from .reference import LawTables


def pack(k: LawTables) -> tuple[dict[str, int | float], dict[str, Array]]:
    """Numbers and arrays of `struct jlaw_law` by name, in its order.

    Raises ValueError for an element without a C version or with other rows there, and KeyError for
    a number that native/layout.py does not name.
    """
    if k.python_only:
        raise ValueError(
            f"the element {k.python_only[0]} has no C version, so this law has no tables for C "
            "hosts: use it in Python, or write its functions in native/elements.h and name it in "
            "native/layout.py"
        )
    _require_same_rows(k.dim, k.elements)
    values = {
        "dim": k.dim,
        "max_effective_closure": min(element.max_effective_closure for element in k.elements),
        "max_search_closure": min(
            min(element.max_effective_closure, element.max_search_closure) for element in k.elements
        ),
        "closure_per_displacement": k.closure_per_displacement,
        "tensile_opening": max(element.tensile_opening for element in k.elements),
    }
    arrays = {name: np.zeros(0) for name in ARRAYS}
    for element in k.elements:
        values |= {element.native_name: 1, **element.numbers()}
        if isinstance(element, AsperityElement):
            arrays |= _facet_arrays(element.k, element.first_loading.plastic_correction)
    numbers: dict[str, int | float] = dict.fromkeys(INTEGERS, 0) | dict.fromkeys(REALS, 0.0)
    if missing := values.keys() - numbers.keys():
        raise KeyError(f"native/layout.py has no {', '.join(sorted(missing))}")
    numbers |= {name: min(value, LARGEST_FLOAT) for name, value in values.items()}
    return numbers, arrays


def _require_same_rows(dim: int, elements: tuple[Element, ...]) -> None:
    """Raise ValueError unless the elements and their rows are those of native/layout.py."""
    names = [element.native_name for element in elements]
    order = ["asperities", *ELEMENTS]
    if names != [name for name in order if name in names]:
        raise ValueError(
            f"a joint in C has each element at most once, in the order {', '.join(order)}; this "
            f"law has {', '.join(names)}: reorder them in `tables`"
        )
    for element in elements:
        if isinstance(element, AsperityElement):
            continue
        rows = ELEMENTS[element.native_name]
        counts = {name: dim - 1 if row.is_vector else 1 for name, row in rows.items()}
        bounds = {name: (row.lower, row.upper) for name, row in rows.items()}
        damage = {name: row.upper for name, row in rows.items() if row.is_damage}
        own_damage = {element.damage_row: element.separated_damage} if element.damage_row else {}
        own = element.rows, dict(element.row_bounds), own_damage
        if list(element.rows) != list(counts) or own != (counts, bounds, damage):
            raise ValueError(
                f"{type(element).__name__} has the state rows {element.rows} with bounds "
                f"{dict(element.row_bounds)} and damage {own_damage}, but {element.native_name!r} "
                f"in native/layout.py {counts}, {bounds} and {damage}"
            )


def _facet_arrays(
    k: FacetTables, plastic_correction: tuple[Array, Array] | None
) -> dict[str, Array]:
    """Arrays `facet`, `depth`, `curve` and `energy` of `struct jlaw_law`, by name.

    Columns of facets are in blocks of FACET_LANES facets, padded by zeros. plastic_correction:
    factors and depths as in `FirstLoadingResponse`, or None for asperities that do not yield.
    """
    columns = {
        "M": k.m.T,
        "S": k.s.T,
        "T": k.t.T,
        "N": k.n.T,
        "E": k.azimuth.T,
        "TAN_THETA": k.tan_theta,
        "COS_THETA": k.c1,
        "A": k.area,
        "SHEAR_STIFFNESS": k.area / k.c1,
        "FRICTION_LIMIT": friction_limit(k, np.ones((1, 1))).ravel(),
        "SLIDER_COMPLIANCE": slider_compliance(k).ravel(),
        "ENERGY_FACTOR": k.area * k.c1,
        "WEIGHT": k.weight / k.weight.sum(),
        "MIRROR": _mirror_facets(k.n),
        "RING_SIZE": ring_sizes(k.theta),
    }
    if plastic_correction is not None:
        columns["YIELD_CLOSURE"] = k.yield_depth
        # of (2 M, 2): four columns per facet
        columns["YIELD_CORRECTION"] = np.hstack(np.split(np.stack(plastic_correction, axis=-1), 2))
    first = column_offsets()
    M = len(k.c1)
    facet = np.zeros((M, first["COLUMNS"]))
    for name, values in columns.items():
        column = values.reshape(M, -1)
        facet[:, first[name] : first[name] + column.shape[1]] = column
    return {
        "facet": _in_blocks(facet),
        "depth": _in_blocks(_cell_rows(k)),
        "curve": k.curve.S,
        "energy": k.curve.T,
    }


def ring_sizes(theta: Array) -> Array:
    """Number of facets in the ring of each facet, as floats (M,).

    theta: inclinations (M,). Facets with equal inclination form a ring; they are consecutive.
    """
    _, first, count = np.unique(theta, return_index=True, return_counts=True)
    sizes = count[np.argsort(first)]
    return np.repeat(sizes, sizes).astype(float)


def _mirror_facets(n: Array) -> Array:
    """Index (M,), as floats, of the facet that mirrors each facet at the plane normal to axis 2.

    n: facet normals (dim, M). The mirror image is sought within the ring of the facet, so that the
    time and memory grow with the size of rings, not with M squared.
    """
    image = n * np.where(np.arange(len(n)) == 1, -1.0, 1.0)[:, None]
    mirrors = []
    # within rings of one inclination, which follow one another: else memory grows as M squared
    for ring in np.split(np.arange(n.shape[1]), np.flatnonzero(np.diff(n[0])) + 1):
        distance = np.sum((image[:, ring, None] - n[:, None, ring]) ** 2, axis=0)
        mirrors.append(ring[np.argmin(distance, axis=1)])
    return np.concatenate(mirrors).astype(float)


def _in_blocks(rows: Array) -> Array:
    """Rows of facets (M, ...) as (blocks, ..., FACET_LANES); zeros beyond the last facet."""
    full = np.zeros((-(-len(rows) // FACET_LANES), FACET_LANES, *rows.shape[1:]))
    full.reshape(-1, *rows.shape[1:])[: len(rows)] = rows
    return np.ascontiguousarray(np.moveaxis(full, 1, -1))


def _cell_rows(k: FacetTables) -> Array:
    """Cells (M, D, 6): zeta, Phi, Phi' at the lower limit; zeta, G and kappa at the upper one."""
    lower, upper = (
        np.stack([k.cell_depth[:, cells], k.cell_force[:, cells], k.cell_slope[:, cells]])
        for cells in (slice(-1), slice(1, None))
    )
    is_bounded = upper[0] < UNUSED  # the last cell is open-ended
    zeta1, force1, slope1 = np.where(is_bounded, upper, 0.0)
    zeta0, force0, slope0 = np.where(lower[0] < UNUSED, lower, 0.0)
    G = np.where(is_bounded, force1 - force0 - slope0 * (zeta1 - zeta0), 0.0)
    kappa = np.where(is_bounded, slope1 - slope0, 0.0)
    low = np.minimum(lower[0], LARGEST_FLOAT)
    high = np.where(is_bounded, zeta1, LARGEST_FLOAT)
    return np.stack([low, force0, slope0, high, G, kappa], axis=-1)
