"""Export of a joint law to C and C++: header, tables in two forms, examples and a Makefile."""

from __future__ import annotations

import re
import sys
from importlib import resources
from pathlib import Path

import numpy as np

from ...discretisation.nodes import UNUSED
from ...discretisation.tables import Tables
from ...kernels.cells import compliance
from ...kernels.reference import strength
from ...law import JointLaw
from ...support.checks import Array
from ...support.files import replace_file

LANES = 4  # facets side by side, as in jointlaw.h
AZIMUTHS = 512  # of a ring of facets at most, as in jointlaw.h
FORMAT = 2  # of table files: a change of their keywords or columns changes it
FILES = ("jointlaw.h", "example.c", "example.cpp", "Makefile", "README.md")
_LARGEST = sys.float_info.max
_MODEL = "granite"  # the name of the tables in these files


def include_dir() -> str:
    """Folder of `jointlaw.h`, for a compiler's -I."""
    return str(Path(__file__).parent)


def export_c(law: JointLaw, directory: str | Path, name: str = "joint") -> list[str]:
    """Write all that a C or C++ code needs to run this law; the folder may be copied away.

    law: any law. directory: made if missing; files of the same names are replaced. name: of the
    tables, an identifier of C.

    Writes `jointlaw.h` (the law), `NAME.jlaw` (its tables, for `jlaw_read`), `NAME.h` (the same as
    constants), `example.c`, `example.cpp`, `Makefile` and `README.md`. Returns the names. Raises
    ValueError for a name that C cannot have or too many azimuths, before anything is written.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,40}", name):
        raise ValueError(
            f"name = {name!r} is no identifier of C; take letters, digits and underscores, a "
            "letter first, at most 41"
        )
    tables = {f"{name}.jlaw": table_text(law), f"{name}.h": header_text(law, name)}
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    source = resources.files(__package__)
    for file in FILES:
        text = (source / file).read_text(encoding="utf-8")
        _write(folder / file, text if file == "jointlaw.h" else text.replace(_MODEL, name))
    for file, text in tables.items():
        _write(folder / file, text)
    return [*tables, *FILES]


def identifier(text: str) -> str:
    """A name for tables out of any text: letters, digits and underscores, a letter first."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:40]
    return name if name[:1].isalpha() else f"joint_{name}".rstrip("_")


def table_text(law: JointLaw) -> str:
    """The tables as text for `jlaw_read`: a keyword and its numbers a line, hexadecimal, exact.

    The last line holds a sum (FNV-1a) of the bytes before it, by which damage is told.
    """
    scalars, arrays = _scalars(law), _arrays(law)
    lines = [f"jointlaw tables {FORMAT}", f"fingerprint {law.fingerprint}"]
    lines += [f"# {line}" for line in _toml(law)]
    for key, value in scalars.items():
        lines.append(f"{key} {value if isinstance(value, int) else value.hex()}")
    for key, array in arrays.items():
        lines.append(key)
        lines += [" ".join(map(float.hex, row.tolist())) for row in array.reshape(-1, 4)]
    text = "\n".join([*lines, ""])
    return f"{text}sum {_sum(text.encode()):016x}\n"


def header_text(law: JointLaw, name: str) -> str:
    """The tables as constants of C: `&NAME` is the law."""
    scalars, arrays = _scalars(law), _arrays(law)
    about = "\n".join(" * " + line.replace("*/", "* /") for line in _toml(law))
    guard = f"JOINTLAW_TABLES_{name.upper()}"
    parts = [
        f"/* {name}: tables of a joint law, made by `jointlaw export c`.\n{about}\n */",
        f'#ifndef {guard}\n#define {guard}\n#include "jointlaw.h"\n'
        f"#if JLAW_FORMAT != {FORMAT}\n"
        f'#error "{name}.h is of format {FORMAT}, jointlaw.h of another: export both anew"\n#endif',
    ]
    for key, array in arrays.items():
        rows = ",\n".join(", ".join(map(repr, row.tolist())) for row in array.reshape(-1, 4))
        parts.append(f"static const double {name}_{key}[{array.size}] = {{\n{rows}}};")
    values = ", ".join(map(repr, scalars.values()))
    tables = ", ".join(f"{name}_{key}" for key in arrays)
    parts.append(
        f'static const jlaw_law {name} = {{{values},\n  {tables}, 0, "{law.fingerprint}"}};\n#endif'
    )
    return "\n".join([*parts, ""])


def _scalars(law: JointLaw) -> dict[str, int | float]:
    """Keywords and numbers, in the order of `struct jlaw_law`; refuses too many azimuths."""
    k, p = law.tables, law.asperity
    if max(_ring(law.facets.theta)) > AZIMUTHS:
        raise ValueError(
            f"resolution.phi = {law.resolution.phi} is out of bounds: jointlaw.h takes at most "
            f"{AZIMUTHS} azimuths on the circle"
        )
    return {
        "dim": k.dim,
        "facets": len(k.c1),
        "cells": k.cells,
        "pieces": len(k.curve.S),
        "yields": int(k.yields),
        "wears": int(k.wears),
        "critical_slip": min(k.critical_slip, _LARGEST),
        "eta": k.curve.eta,
        "scale": k.curve.scale,
        "rise": float(k.curve.rise),
        "closure_factor": law._first_loading.factor,
        "stiffness_factor": (max(1.0, 1.0 / p.lam) + p.mu) * float(np.sum(k.area / k.c1)),
        "largest_reach": law.largest_reach,
        "stretch": 1.0 + 2.0 * float(np.max(np.abs(k.m))),
        "farthest": min(law.largest_reach, law._first_loading.farthest),
        "mu": k.mu,
        "mu_residual": k.mu if k.mu_residual is None else k.mu_residual,
        "wear_slip": min(k.wear_slip, _LARGEST),
    }


def _arrays(law: JointLaw) -> dict[str, Array]:
    """The arrays of `struct jlaw_law`, LANES facets side by side, zeros beyond the last one."""
    k = law.tables
    M = len(k.c1)

    def blocks(columns: Array) -> Array:  # (M, ...) -> (blocks, ..., LANES)
        full = np.zeros((-(-M // LANES), LANES, *columns.shape[1:]))
        full.reshape(-1, *columns.shape[1:])[:M] = columns
        return np.moveaxis(full, 1, -1)

    facet = np.zeros((M, 27))
    for first, rows in ((0, k.m), (3, k.s), (6, k.t), (9, k.n)):
        facet[:, first : first + k.dim] = rows.T
    rest = (
        k.area, k.area / k.c1, strength(k, np.asarray(k.mu)).ravel(), compliance(k).ravel(),
        np.full(M, 1.0 / k.lam), k.area * k.c1, k.weight / k.weight.sum(), _mirror(k.n),
        _ring(law.facets.theta), _used(k.depth),
    )  # fmt: skip
    facet[:, 12:22] = np.stack(rest, axis=-1)
    if k.yield_depth is not None:
        late = np.stack(law._first_loading.yielding or (), axis=-1)  # (2 M, 2)
        facet[:, 22:] = np.column_stack([k.yield_depth, late[:M], late[M:]])
    return {
        "facet": blocks(facet),
        "depth": blocks(_depth(k)),
        "curve": k.curve.S,
        "energy": k.curve.T,
    }


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
    last = np.where(ends, zeta, _LARGEST)
    return np.stack([np.minimum(begin[0], _LARGEST), force0, slope0, last, G, kappa], axis=-1)


def _mirror(n: Array) -> Array:
    """Number of the facet (M,) whose normal has the other sign along axis 2."""
    image = n * np.where(np.arange(len(n)) == 1, -1.0, 1.0)[:, None]
    away = np.sum((image[:, :, None] - n[:, None]) ** 2, axis=0)
    return np.argmin(away, axis=1).astype(float)


def _ring(theta: Array) -> Array:
    """Number of the facets (M,) of the same inclination, which follow one another."""
    _, first, count = np.unique(theta, return_index=True, return_counts=True)
    several = count[np.argsort(first)]
    return np.repeat(several, several).astype(float)


def _used(depth: Array) -> Array:
    """Cells (M,) in use, the most of each block of LANES facets."""
    count = np.sum(depth[:, :-1] < UNUSED, axis=1)
    first = np.arange(0, len(count), LANES)
    most = np.maximum.reduceat(count, first)
    return np.repeat(most, LANES)[: len(count)].astype(float)


def _toml(law: JointLaw) -> list[str]:
    """The parameters, for the reader."""
    try:
        return law.to_toml().splitlines()
    except ValueError:  # heights that have no form as TOML
        return ["heights of a class of its own"]


def _sum(data: bytes) -> int:
    """FNV-1a of 64 bits, without carriage returns."""
    value = 0xCBF29CE484222325
    for byte in data:
        if byte != 13:
            value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


def _write(path: Path, text: str) -> None:
    replace_file(path, text.encode())
