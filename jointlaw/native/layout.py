"""Layout of a law's tables in C, written once: here, from where `layout.h` is made.

`python -m jointlaw.native` writes `layout.h` and `jointlaw.h` anew and builds the library.

A new number of a law or of its facets gets a line below, and is there in C, in table files and in
what `pack` gives to the library.
"""

import ctypes
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..discretisation.nodes import UNUSED
from ..discretisation.tables import Tables
from ..kernels.cells import compliance
from ..kernels.reference import strength
from ..kernels.unmated import unmated_start
from ..parameters.bond import Bond
from ..support import thresholds
from ..support.checks import Array
from .amalgamation import amalgamation

HERE = Path(__file__).parent
FORMAT = 4  # of table files: a change of what follows changes it
LANES = 4  # facets side by side in a block of the tables
AZIMUTHS = 512  # of a ring of facets at most
LARGEST = sys.float_info.max  # stands for infinity


class Number(NamedTuple):
    """A number of a law: its bounds, in C, and what it is."""

    least: str
    most: str
    about: str


WHOLE = {
    "dim": Number("1", "3", "components of a displacement"),
    "facets": Number("1", "1e6", "M"),
    "cells": Number("1", "1e6", "D, depth cells of a facet"),
    "pieces": Number("1", "1e6", "of the virgin curve"),
    "yields": Number("0", "1", "whether asperities yield"),
    "fades": Number("0", "1", "whether slopes fade with the distance from mate"),
    "wears": Number("0", "1", "whether slopes wear"),
    "bonded": Number("0", "1", "whether there is a bond"),
}
NUMBERS = {
    "soft": Number("0", "DBL_MAX", "1/lam"),
    "mu": Number("0", "DBL_MAX", "friction of asperities"),
    "mating_length": Number("DBL_MIN", "DBL_MAX", "m; infinite: the largest float"),
    "slope_wear": Number("DBL_MIN", "DBL_MAX", "J/m2; infinite: the largest float"),
    "slope_residual": Number("0", "1", "share of the slopes that never wears"),
    "first_touch": Number("-DBL_MAX", "0", "m: closure at which an unmated joint touches"),
    "eta": Number("0", "DBL_MAX", "exponent of the virgin curve"),
    "scale": Number("DBL_MIN", "DBL_MAX", "V of the virgin curve, m^(1/2)"),
    "rise": Number("0", "DBL_MAX", "p: the curve is tabulated over w^p"),
    "bond_normal": Number("0", "DBL_MAX", "Pa/m: stiffness of the bond"),
    "bond_shear": Number("0", "DBL_MAX", "Pa/m"),
    "opening_begin": Number("0", "DBL_MAX", "1/m: one over the opening where it begins to break"),
    "slip_begin": Number("0", "DBL_MAX", "1/m: the same of slip"),
    "opening_end": Number("0", "DBL_MAX", "1/m: where nothing of it is left"),
    "slip_end": Number("0", "DBL_MAX", "1/m"),
    "closure_factor": Number("0", "DBL_MAX", "normal stress over Phi"),
    "stiffness_factor": Number("0", "DBL_MAX", "bound of |C| over Phi'"),
    "bending_factor": Number("0", "DBL_MAX", "what slopes that fade add to it, over Phi"),
    "largest_reach": Number("0", "DBL_MAX", "m: bound of |y|"),
    "stretch": Number("1", "DBL_MAX", "bound of |y| over that of the displacement"),
    "farthest": Number("0", "DBL_MAX", "m: largest closure that a stress is looked for in"),
}
BOND = "bond_normal", "bond_shear", "opening_begin", "slip_begin", "opening_end", "slip_end"
TABLES = {
    "facet": "(blocks, JLAW_COLUMNS, JLAW_LANES), zeros beyond the last facet",
    "depth": "(blocks, cells, JLAW_ROWS, JLAW_LANES)",
    "curve": "(pieces, 4): S of the virgin curve",
    "energy": "(pieces, 4): T",
}
COLUMNS = {  # of a facet: how many, and what
    "M": (3, "m = n/c1: y = m . (closure, offset)"),
    "S": (3, "in-facet direction s"),
    "T": (3, "in-facet direction t"),
    "N": (3, "normal n"),
    "E": (2, "unit vector of the azimuth"),
    "STEEP": (1, "tan(theta)"),
    "COSINE": (1, "c1"),
    "A": (1, "A"),
    "STIFF": (1, "A/c1"),
    "STRENGTH": (1, "mu lam A"),
    "COMPLIANCE": (1, "c1/(2 A lam): from |q|^2/kappa to energy"),
    "POTENTIAL": (1, "A c1"),
    "SHARE": (1, "of all orientations"),
    "YIELD": (1, "y_p = d_y/c1"),
    "MIRROR": (1, "the facet mirrored along axis 2"),
    "RING": (1, "facets of this inclination, one after the other"),
    "LATE": (4, "unsheared joint: share, depth, share, depth of what yielding takes off"),
}
ROWS = {  # of a depth cell
    "LOW": "zeta at its begin",
    "FORCE": "Phi there",
    "SLOPE": "Phi' there",
    "HIGH": "zeta at its end",
    "G": "G there",
    "KAPPA": "kappa there",
}


class Law(ctypes.Structure):
    """`struct jlaw_law`."""

    _fields_ = [
        *((name, ctypes.c_int) for name in WHOLE),
        *((name, ctypes.c_double) for name in NUMBERS),
        *((name, ctypes.c_void_p) for name in TABLES),
        ("own", ctypes.c_void_p),
        ("fingerprint", ctypes.c_char * 80),
    ]


def first_columns() -> dict[str, int]:
    """Number of the first column of each name, and of all of them."""
    ends = np.cumsum([0, *(count for count, _ in COLUMNS.values())]).tolist()
    return dict(zip([*COLUMNS, "COLUMNS"], ends, strict=True))


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


def layout_h() -> str:
    """The text of layout.h."""
    lines = ["/* Made from layout.py by `python -m jointlaw.native`; change it there. */"]
    lines += [f"#define JLAW_FORMAT {FORMAT} /* of table files */", "enum {"]
    lines += [f"  JLAW_LANES = {LANES}, /* facets side by side in a block of the tables */"]
    lines += [f"  JLAW_AZIMUTHS = {AZIMUTHS}, /* most */"]
    for name, first in first_columns().items():
        about = COLUMNS[name][1] if name in COLUMNS else "of a facet"
        lines += [f"  JLAW_{name} = {first}, /* {about} */"]
    lines += [f"  JLAW_{name} = {i}, /* {about} */" for i, (name, about) in enumerate(ROWS.items())]
    lines += [f"  JLAW_ROWS = {len(ROWS)} /* of a depth cell */", "};"]
    for name, value in vars(thresholds).items():
        if name.isupper():
            lines += [f"#define JLAW_{name} {value!r}"]
    lines += ["struct jlaw_law {"]
    lines += [f"  int {name}; /* {number.about} */" for name, number in WHOLE.items()]
    lines += [f"  double {name}; /* {number.about} */" for name, number in NUMBERS.items()]
    lines += [f"  const double *{name}; /* {about} */" for name, about in TABLES.items()]
    lines += ["  double *own; /* what jlaw_free frees */", "  char fingerprint[80];", "};"]
    lines += ["/* Each number of a table file: its name, 1 if it is whole, its bounds */"]
    keys = [
        f"  X({name}, {int(numbers is WHOLE)}, {number.least}, {number.most})"
        for numbers in (WHOLE, NUMBERS)
        for name, number in numbers.items()
    ]
    lines += ["#define JLAW_NUMBERS(X) \\", " \\\n".join(keys)]
    return "\n".join([*lines, ""])


def made() -> dict[str, str]:
    """Texts of the files that are made from others, by name."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in HERE.glob("*.h")}
    texts["layout.h"] = layout_h()
    return {"layout.h": texts["layout.h"], "jointlaw.h": amalgamation(texts)}
