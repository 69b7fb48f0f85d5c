"""Layout of a law's tables in C, written once: here, from where `layout.h` is made.

A new number of a law or of its facets gets a line below, and is there in C and in table files;
`pack.py` gives it its value. By the standard library alone: the package is built by it, where
numpy may be missing.
"""

import ctypes
import re
import sys
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

from ..support import thresholds

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
    "facets": Number("0", "1e6", "M"),
    "cells": Number("0", "1e6", "D, depth cells of a facet"),
    "pieces": Number("0", "1e6", "of the virgin curve"),
    "yields": Number("0", "1", "whether asperities yield"),
    "fades": Number("0", "1", "whether slopes fade with the distance from mate"),
    "wears": Number("0", "1", "whether slopes wear"),
    "asperities": Number("0", "1", "whether there are asperities"),
    "bonded": Number("0", "1", "whether there is a bond beside them"),
    "coulomb": Number("0", "1", "whether it is Coulomb's joint"),
}
ELEMENTS = ("bonded", "coulomb")  # beside the asperities: functions of elements.h begin so
NUMBERS = {
    "soft": Number("0", "DBL_MAX", "1/lam"),
    "mu": Number("0", "DBL_MAX", "friction of asperities"),
    "mating_length": Number("0", "DBL_MAX", "m; infinite: the largest float"),
    "slope_wear": Number("0", "DBL_MAX", "J/m2; infinite: the largest float"),
    "slope_residual": Number("0", "1", "share of the slopes that never wears"),
    "first_touch": Number("-DBL_MAX", "0", "m: closure at which an unmated joint touches"),
    "eta": Number("0", "DBL_MAX", "exponent of the virgin curve"),
    "scale": Number("0", "DBL_MAX", "V of the virgin curve, m^(1/2)"),
    "rise": Number("0", "DBL_MAX", "p: the curve is tabulated over w^p"),
    "bond_normal": Number("0", "DBL_MAX", "Pa/m: stiffness of the bond"),
    "bond_shear": Number("0", "DBL_MAX", "Pa/m"),
    "opening_begin": Number("0", "DBL_MAX", "1/m: one over the opening where it begins to break"),
    "slip_begin": Number("0", "DBL_MAX", "1/m: the same of slip"),
    "opening_end": Number("0", "DBL_MAX", "1/m: where nothing of it is left"),
    "slip_end": Number("0", "DBL_MAX", "1/m"),
    "coulomb_normal": Number("0", "DBL_MAX", "Pa/m: stiffness of Coulomb's joint"),
    "coulomb_shear": Number("0", "DBL_MAX", "Pa/m"),
    "coulomb_friction": Number("0", "DBL_MAX", "its friction"),
    "coulomb_cohesion": Number("0", "DBL_MAX", "Pa"),
    "coulomb_tension": Number("0", "DBL_MAX", "Pa"),
    "coulomb_residual_friction": Number("0", "DBL_MAX", "once it has weakened"),
    "coulomb_residual_cohesion": Number("0", "DBL_MAX", "Pa"),
    "coulomb_weakening": Number("0", "DBL_MAX", "m of shear over which it weakens"),
    "closure_factor": Number("0", "DBL_MAX", "normal stress over Phi"),
    "stiffness_factor": Number("0", "DBL_MAX", "sum of A/c1: stiffness over Phi'"),
    "bending_factor": Number("0", "DBL_MAX", "what slopes that fade add to it, over Phi"),
    "joining_more": Number("0", "DBL_MAX", "what springs that join a cell add to it, over Phi'"),
    "joining_most": Number("0", "DBL_MAX", "and at most"),
    "largest_reach": Number("0", "DBL_MAX", "m: bound of |y|"),
    "stretch": Number("1", "DBL_MAX", "bound of |y| over that of the displacement"),
    "farthest": Number("0", "DBL_MAX", "m: largest closure that a stress is looked for in"),
}
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
    ends = accumulate((count for count, _ in COLUMNS.values()), initial=0)
    return dict(zip([*COLUMNS, "COLUMNS"], ends, strict=True))


def layout_h() -> str:
    """The text of layout.h."""
    columns = COLUMNS | {"COLUMNS": (0, "of a facet")}
    keys = [
        f"  X({name}, {int(numbers is WHOLE)}, {number.least}, {number.most})"
        for numbers in (WHOLE, NUMBERS)
        for name, number in numbers.items()
    ]
    lines = [
        "/* Made from layout.py; change it there. */",
        "#ifndef JLAW_FORMAT",
        f"#define JLAW_FORMAT {FORMAT} /* of table files */",
        "enum {",
        f"  JLAW_LANES = {LANES}, /* facets side by side in a block of the tables */",
        f"  JLAW_AZIMUTHS = {AZIMUTHS}, /* most */",
        *(f"  JLAW_{name} = {i}, /* {columns[name][1]} */" for name, i in first_columns().items()),
        *(f"  JLAW_{name} = {i}, /* {about} */" for i, (name, about) in enumerate(ROWS.items())),
        f"  JLAW_ROWS = {len(ROWS)} /* of a depth cell */",
        "};",
        *(
            f"#define JLAW_{name} {value!r}"
            for name, value in vars(thresholds).items()
            if name.isupper()
        ),
        "struct jlaw_law {",
        *(f"  int {name}; /* {number.about} */" for name, number in WHOLE.items()),
        *(f"  double {name}; /* {number.about} */" for name, number in NUMBERS.items()),
        *(f"  const double *{name}; /* {about} */" for name, about in TABLES.items()),
        "  double *own; /* what jlaw_free frees */",
        "  char fingerprint[80];",
        "};",
        f"#define JLAW_ELEMENTS(X) {' '.join(f'X({name})' for name in ELEMENTS)}",
        "/* Each number of a table file: its name, 1 if it is whole, its bounds */",
        "#define JLAW_NUMBERS(X) \\",
        " \\\n".join(keys),
        "#endif\n",
    ]
    return "\n".join(lines)


def jointlaw_h() -> str:
    """The text of jointlaw.h: host.h with all that it includes, one file for a host.

    many.h, the law for many joints side by side, is its text once more, under other names.
    """
    texts = {path.name: path.read_text(encoding="utf-8") for path in HERE.glob("*.h")}
    texts["layout.h"] = layout_h()

    def unfold(text: str) -> str:
        return re.sub(
            r'^#include "(\w+\.h)"\n', lambda found: unfold(texts[found[1]]), text, flags=re.M
        )

    law = unfold(texts["lanes.h"] + texts["elements.h"] + texts["law.h"])
    other = {"jl_": "jm_", "JL_": "JM_", "JLAW_ABREAST": "JM_ABREAST"}
    texts["many.h"] = re.sub(r"\b(jl_|JL_|JLAW_ABREAST)", lambda found: other[found[1]], law)
    return unfold(texts["host.h"])
