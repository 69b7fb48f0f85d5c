"""Memory layout of a law in C: the single declaration from which `layout.h` is generated.

A law reaches C as `struct jlaw_law`: integers, floats, and pointers to arrays. The same names are
the keywords of a table file (`NAME.jlaw`), the fields of `LawStruct`, through which the compiled
library reads a law from Python, and the offsets with which the page in a browser changes a number.
A new number of a law needs one line below; `kernels/pack.py` fills it with the value that the
elements of the law return by `numbers()`.

The tables of facets are stored in blocks of four facets (`FACET_LANES`), which lie side by side:

    facet   (blocks, columns, 4)        column c of facet i is facet[i // 4, c, i % 4]
    depth   (blocks, cells, rows, 4)    row r of cell j of facet i is depth[i // 4, j, r, i % 4]

A kernel that vectorises over the facets of one joint loads one column of four facets at once, and
a kernel that vectorises over joints reads one number and broadcasts it. Both kernels read the same
tables, so the exported header, the library, a graphics processor and the page in a browser share
them. The last block is filled up with facets whose numbers are all zero; they carry no force.

Only the standard library is imported here: the build of the package runs this module before numpy
is installed.
"""

import ctypes
import re
import sys
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

from ..support import thresholds

HERE = Path(__file__).parent
TABLE_FORMAT = 6  # version of the table files: increase it with every change of this layout
FACET_LANES = 4  # facets that lie side by side in a block of the tables
MAX_AZIMUTHS = 512  # facets of one inclination
LARGEST_FLOAT = sys.float_info.max  # represents infinity, which table files cannot hold


class Field(NamedTuple):
    """A number of a law: its bounds as expressions of C, and its meaning."""

    lower: str
    upper: str
    meaning: str


class Row(NamedTuple):
    """Rows of the state of an element: their bounds, and what they are.

    A vector has one row for each direction in the plane of the joint, any other name one row.
    Damage is 0 while the element is intact, and `upper` once its faces have separated.
    """

    lower: float
    upper: float
    is_vector: bool = False
    is_damage: bool = False


INTEGERS = {
    "dim": Field("1", "3", "components of a displacement"),
    "facets": Field("0", "1e6", "M"),
    "cells": Field("0", "1e6", "D, cells of a facet"),
    "pieces": Field("0", "1e6", "of the first-loading curve"),
    "yields": Field("0", "1", "whether asperities are elastic-perfectly plastic"),
    "interlock_decays": Field("0", "1", "whether dilation decays with slip"),
    "degrades": Field("0", "1", "whether asperities degrade under shear work"),
    "degrades_by_stress": Field("0", "1", "whether asperities degrade by the contact stress"),
    "asperities": Field("0", "1", "whether the joint has asperities"),
    "bonded": Field("0", "1", "whether the joint has a cohesive bond"),
    "coulomb": Field("0", "1", "whether the joint follows Coulomb's law"),
}
# Elements of elements.h: the prefix of their functions, and the rows of their state by name, in the
# order of both in a state. `kernels/pack.py` compares them with the elements in Python.
ELEMENTS = {
    "bonded": {"damage": Row(0.0, 1.0, is_damage=True)},
    "coulomb": {
        "shear_stress": Row(-thresholds.MAX_STRENGTH, thresholds.MAX_STRENGTH, is_vector=True),
        "softening": Row(0.0, thresholds.SEPARATED_STATE, is_damage=True),
    },
}
REALS = {
    "stiffness_ratio": Field("0", "DBL_MAX", "1/lam: shear over normal stiffness of an asperity"),
    "mu": Field("0", "DBL_MAX", "friction coefficient of asperities"),
    "mating_length": Field("0", "DBL_MAX", "m; infinite: the largest float"),
    "slope_wear": Field("0", "DBL_MAX", "J/m2; infinite: the largest float"),
    "slope_residual": Field("0", "1", "fraction of the slopes that never degrades"),
    "degradation_stress": Field("0", "DBL_MAX", "Pa; infinite: the largest float"),
    "first_touch_closure": Field("-DBL_MAX", "0", "m: closure at which an unmated joint touches"),
    "eta": Field("0", "DBL_MAX", "exponent of the first-loading curve"),
    "curve_scale": Field("0", "DBL_MAX", "V of the first-loading curve, m^(1/2)"),
    "curve_exponent": Field("0", "DBL_MAX", "p: the curve is tabulated over w^p"),
    "bond_normal_stiffness": Field("0", "DBL_MAX", "Pa/m"),
    "bond_shear_stiffness": Field("0", "DBL_MAX", "Pa/m"),
    "inverse_onset_opening": Field("0", "DBL_MAX", "1/m: 1/(opening at which damage begins)"),
    "inverse_onset_slip": Field("0", "DBL_MAX", "1/m: 1/(slip at which damage begins)"),
    "inverse_failure_opening": Field("0", "DBL_MAX", "1/m: 1/(opening at which the bond fails)"),
    "inverse_failure_slip": Field("0", "DBL_MAX", "1/m: 1/(slip at which the bond fails)"),
    "coulomb_normal_stiffness": Field("0", "DBL_MAX", "Pa/m"),
    "coulomb_shear_stiffness": Field("0", "DBL_MAX", "Pa/m"),
    "coulomb_friction": Field("0", "DBL_MAX", "friction coefficient"),
    "coulomb_cohesion": Field("0", "DBL_MAX", "Pa"),
    "coulomb_tension": Field("0", "DBL_MAX", "Pa: tensile strength"),
    "coulomb_residual_friction": Field("0", "DBL_MAX", "friction coefficient after softening"),
    "coulomb_residual_cohesion": Field("0", "DBL_MAX", "Pa, after softening"),
    "coulomb_weakening_length": Field("0", "DBL_MAX", "m of slip over which the strength softens"),
    "normal_stress_factor": Field("0", "DBL_MAX", "normal stress over Phi, unsheared"),
    "stiffness_factor": Field("0", "DBL_MAX", "sum of A/c1: stiffness over Phi'"),
    "curvature_stiffness_factor": Field(
        "0", "DBL_MAX", "bound of the stiffness by the decay of slopes, over Phi"
    ),
    "engagement_stiffness_factor": Field(
        "0", "DBL_MAX", "bound of the stiffness by springs that engage in a cell, over Phi'"
    ),
    "engagement_stiffness_limit": Field("0", "DBL_MAX", "upper limit of the same stiffness"),
    "max_effective_closure": Field("0", "DBL_MAX", "m: bound of |y|"),
    "closure_per_displacement": Field("1", "DBL_MAX", "bound of |y| over |displacement|"),
    "tensile_opening": Field("0", "DBL_MAX", "m: an intact joint bears tension up to it"),
    "max_search_closure": Field("0", "DBL_MAX", "m: upper end of the search for a closure"),
}
ARRAYS = {
    "facet": "(blocks, JLAW_COLUMNS, JLAW_FACET_LANES), zeros beyond the last facet",
    "depth": "(blocks, cells, JLAW_ROWS, JLAW_FACET_LANES)",
    "curve": "(pieces, 4): S of the first-loading curve",
    "energy": "(pieces, 4): T, of its integral",
}
FACET_COLUMNS = {  # of a facet: number of components, and meaning
    "M": (3, "m = n/c1: y = m . (closure, offset)"),
    "S": (3, "in-facet direction s"),
    "T": (3, "in-facet direction t"),
    "N": (3, "normal n"),
    "E": (2, "unit vector of the azimuth"),
    "TAN_THETA": (1, "tan(theta), theta: inclination"),
    "COS_THETA": (1, "c1 = cos(theta)"),
    "A": (1, "A, area factor"),
    "SHEAR_STIFFNESS": (1, "A/c1"),
    "FRICTION_LIMIT": (1, "mu lam A"),
    "SLIDER_COMPLIANCE": (1, "c1/(2 A lam): energy over |q|^2/kappa"),
    "ENERGY_FACTOR": (1, "A c1: energy over Psi"),
    "WEIGHT": (1, "fraction of all orientations"),
    "YIELD_CLOSURE": (1, "y_p = d_y/c1"),
    "MIRROR": (1, "index of the facet mirrored along axis 2"),
    "RING_SIZE": (1, "number of consecutive facets of this inclination"),
    "YIELD_CORRECTION": (4, "unsheared joint: two pairs (factor, depth) that yielding subtracts"),
}
CELL_ROWS = {
    "ZETA_START": "zeta at the start of the cell",
    "PHI_START": "Phi at the start",
    "DPHI_START": "Phi' at the start",
    "ZETA_END": "zeta at the end",
    "G_END": "G at the end",
    "KAPPA_END": "kappa at the end",
}


class LawStruct(ctypes.Structure):
    """`struct jlaw_law`."""

    _fields_ = [
        *((name, ctypes.c_int) for name in INTEGERS),
        *((name, ctypes.c_double) for name in REALS),
        *((name, ctypes.c_void_p) for name in ARRAYS),
        ("memory", ctypes.c_void_p),
        ("fingerprint", ctypes.c_char * 80),
    ]


def column_offsets() -> dict[str, int]:
    """Index of the first column of each name; "COLUMNS" is the number of columns."""
    offsets = accumulate((count for count, _ in FACET_COLUMNS.values()), initial=0)
    return dict(zip([*FACET_COLUMNS, "COLUMNS"], offsets, strict=True))


def max_element_rows() -> int:
    """Largest number of rows of an element in a state, in 3-D; at least one."""
    in_space = [
        sum(2 if row.is_vector else 1 for row in rows.values()) for rows in ELEMENTS.values()
    ]
    return max([1, *in_space])


def layout_h() -> str:
    """Generate the text of layout.h."""
    columns = FACET_COLUMNS | {"COLUMNS": (0, "of a facet")}
    keywords = [
        f"  X({name}, {int(fields is INTEGERS)}, {field.lower}, {field.upper})"
        for fields in (INTEGERS, REALS)
        for name, field in fields.items()
    ]
    lines = [
        "/* Generated from layout.py; change it there. */",
        "#ifndef JLAW_TABLE_FORMAT",
        f"#define JLAW_TABLE_FORMAT {TABLE_FORMAT} /* version of table files */",
        "enum {",
        f"  JLAW_FACET_LANES = {FACET_LANES}, /* facets side by side in a block of the tables */",
        f"  JLAW_MAX_AZIMUTHS = {MAX_AZIMUTHS},",
        *(f"  JLAW_{name} = {i}, /* {columns[name][1]} */" for name, i in column_offsets().items()),
        *(f"  JLAW_{name} = {i}, /* {text} */" for i, (name, text) in enumerate(CELL_ROWS.items())),
        f"  JLAW_ROWS = {len(CELL_ROWS)}, /* of a cell */",
        f"  JLAW_ELEMENT_ROW_NAMES = {sum(map(len, ELEMENTS.values()))}, /* of all elements */",
        f"  JLAW_MAX_ELEMENT_ROWS = {max_element_rows()} /* of one element */",
        "};",
        *(
            f"#define JLAW_{name} {value!r}"
            for name, value in vars(thresholds).items()
            if name.isupper()
        ),
        "struct jlaw_law {",
        *(f"  int {name}; /* {field.meaning} */" for name, field in INTEGERS.items()),
        *(f"  double {name}; /* {field.meaning} */" for name, field in REALS.items()),
        *(f"  const double *{name}; /* {text} */" for name, text in ARRAYS.items()),
        "  double *memory; /* of the arrays, freed by jlaw_free */",
        "  char fingerprint[80];",
        "};",
        f"#define JLAW_ELEMENTS(X) {' '.join(f'X({name})' for name in ELEMENTS)}",
        "/* State rows of an element: X(name, 1 for a vector, 1 for damage, lower, upper bound) */",
        *(
            f"#define JLAW_ROWS_OF_{name}(X) "
            + " ".join(
                f'X("{row_name}", {int(row.is_vector)}, {int(row.is_damage)}, {row.lower!r}, '
                f"{row.upper!r})"
                for row_name, row in rows.items()
            )
            for name, rows in ELEMENTS.items()
        ),
        "/* Keywords of a table file: X(name, 1 for an integer, lower bound, upper bound) */",
        "#define JLAW_KEYWORDS(X) \\",
        " \\\n".join(keywords),
        "#endif\n",
    ]
    return "\n".join(lines)


def jointlaw_h() -> str:
    """Generate the text of jointlaw.h: host.h with all that it includes, one file for a host.

    host.h includes the law twice: lanes.h, elements.h and law.h for one joint at a time, and
    many.h for several joints in the lanes of a vector. many.h is generated here: it is the text of
    the three files with other prefixes, so that both versions fit into one program.
    """
    texts = {path.name: path.read_text(encoding="utf-8") for path in HERE.glob("*.h")}
    texts["layout.h"] = layout_h()

    def expand_includes(text: str) -> str:
        return re.sub(
            r'^#include "(\w+\.h)"\n',
            lambda include: expand_includes(texts[include[1]]),
            text,
            flags=re.M,
        )

    law = expand_includes(texts["lanes.h"] + texts["elements.h"] + texts["law.h"])
    renamed = {"jl_": "jm_", "JL_": "JM_", "JLAW_FACET_VECTORS": "JM_FACET_VECTORS"}
    pattern = r"\b(jl_|JL_|JLAW_FACET_VECTORS)"
    texts["many.h"] = re.sub(pattern, lambda prefix: renamed[prefix[1]], law)
    return expand_includes(texts["host.h"])
