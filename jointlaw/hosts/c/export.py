"""Export of a joint law to C and C++: header, tables in two forms, examples and a Makefile."""

import math
import re
from dataclasses import astuple
from pathlib import Path

from ...kernels.pack import pack, ring_sizes
from ...laws.law import Law
from ...native.layout import MAX_AZIMUTHS, TABLE_FORMAT, jointlaw_h
from ...parameters.aperture import Aperture
from ...parameters.toml import text_or_reason
from ...support.checks import Array
from ...support.files import write_files

FILES = ("jointlaw.c", "example.c", "example.cpp", "example.f90", "Makefile", "CMakeLists.txt",
         "README.md")  # fmt: skip
HEADER = "jointlaw.h"
_CONSTANT = (
    "static JLAW_FUNCTION const"  # qualifier of constants; on a GPU they are stored in its memory
)
_KEYWORDS = re.compile(  # of C and C++
    r"alignas|alignof|and|asm|auto|bitand|bitor|bool|break|case|catch|char|class|"
    r"compl|const|consteval|constexpr|constinit|continue|decltype|default|delete|do|"
    r"double|else|enum|explicit|export|extern|false|float|for|friend|goto|if|inline|"
    r"int|long|main|mutable|namespace|new|noexcept|not|nullptr|NULL|operator|or|"
    r"private|protected|public|register|requires|restrict|return|short|signed|sizeof|"
    r"static|struct|switch|template|this|throw|true|try|typedef|typeid|typename|"
    r"union|unsigned|using|virtual|void|volatile|while|xor"
)
_NAME_IN_FILES = "granite"  # of the tables


def export_c(
    law: Law, directory: str | Path, name: str = "joint", aperture: Aperture | None = None
) -> list[str]:
    """Write all files that a C or C++ code needs to run this law; the folder may be copied.

    >>> names = jl.export_c(law, "joint-for-c")

    law: any law. directory: created if missing; files of the same names are replaced. name: of the
    tables, an identifier of C. aperture: its hydraulic aperture, for `jlaw_hydraulic_aperture`.

    Writes `jointlaw.h` (the law), `NAME.jlaw` (its tables, for `jlaw_read`), `NAME.h` (the same as
    constants), `jointlaw.c` (compiles the law), `example.c`, `example.cpp`, `example.f90`,
    `Makefile`, `CMakeLists.txt` and `README.md`. Returns the names. Raises ValueError for a name
    that is not valid in C or too many azimuths, before anything is written.
    """
    require_name(name)
    texts = {
        f"{name}.jlaw": table_text(law, aperture),
        f"{name}.h": header_text(law, name, aperture),
        HEADER: jointlaw_h(),
        **{file: file_text(file).replace(_NAME_IN_FILES, name) for file in FILES},
    }
    write_files(directory, texts)
    return list(texts)


def file_text(file: str) -> str:
    """Text of a file of this folder, in which the tables have the name granite."""
    return Path(__file__).with_name(file).read_text(encoding="utf-8")


def require_name(name: str) -> None:
    """Raise ValueError for a name of tables that is no identifier of C or reserved."""
    if not _is_valid_name(name):
        raise ValueError(
            f"name = {name!r} is no identifier of C; take letters, digits and underscores, a "
            "letter first, at most 41, and no keyword of C or C++; names of the header begin with "
            "jointlaw or jlaw"
        )


def _is_valid_name(name: str) -> bool:
    match = re.fullmatch(r"(?!jointlaw|jlaw)[A-Za-z][A-Za-z0-9_]{0,40}", name)
    return match is not None and not _KEYWORDS.fullmatch(name)


def identifier(text: str) -> str:
    """A valid C name made from any text, for tables.

    Runs of other characters than letters and digits become one underscore; at most 40 characters.
    "joint_" is put in front where the rest starts with a digit, or is a keyword or a name in use.
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:40]
    return name if _is_valid_name(name) else f"joint_{name}".rstrip("_")


def table_text(law: Law, aperture: Aperture | None = None) -> str:
    """The tables as text for `jlaw_read`: keywords with exact hexadecimal numbers.

    The last line holds a checksum (FNV-1a) of the preceding bytes.
    """
    numbers, arrays = packed(law)
    lines = [f"jointlaw tables {TABLE_FORMAT}", f"fingerprint {law.fingerprint}"]
    lines += [f"# {line}" for line in _parameters_as_comment(law, aperture)]
    lines += [f"{key} {x if isinstance(x, int) else _exact(x)}" for key, x in numbers.items()]
    for key, array in arrays.items():
        lines.append(key)
        lines += [" ".join(map(_exact, row.tolist())) for row in array.reshape(-1, 4)]
    text = "\n".join([*lines, ""])
    return f"{text}sum {_checksum(text.encode()):016x}\n"


def header_text(law: Law, name: str, aperture: Aperture | None = None) -> str:
    """Text of a C header whose constants are the tables of a law.

    `&NAME` is the `jlaw_law`, and with `aperture` `&NAME_aperture` is its hydraulic aperture. The
    header starts with the parameters as a comment, includes jointlaw.h, and refuses to compile with
    a jointlaw.h of another table format. Raises ValueError as `packed` does.
    """
    numbers, arrays = packed(law)
    comment = "\n".join(
        " * " + line.replace("*/", "* /") for line in _parameters_as_comment(law, aperture)
    )
    guard = f"JOINTLAW_TABLES_{name.upper()}"
    parts = [
        f"/* {name}: tables of a joint law, made by `jointlaw export c`.\n{comment}\n */",
        f'#ifndef {guard}\n#define {guard}\n#include "jointlaw.h"\n'
        f"#if JLAW_TABLE_FORMAT != {TABLE_FORMAT}\n"
        f'#error "{name}.h has format {TABLE_FORMAT}, jointlaw.h another one: export both again"\n'
        "#endif",
    ]
    for key, array in arrays.items():
        rows = ",\n".join(", ".join(map(repr, row.tolist())) for row in array.reshape(-1, 4))
        size = max(array.size, 1)  # C has no empty arrays; Coulomb's joint has no facets
        parts.append(f"{_CONSTANT} double {name}_{key}[{size}] = {{\n{rows or '0.0'}}};")
    if aperture:
        values = ", ".join(map(repr, astuple(aperture)))
        parts.append(f"{_CONSTANT} jlaw_aperture {name}_aperture = {{{values}}};")
    values = ", ".join(map(repr, numbers.values()))
    tables = ", ".join(f"{name}_{key}" for key in arrays)
    fingerprint = f'"{law.fingerprint}" JLAW_STORAGE'
    parts.append(
        f"{_CONSTANT} jlaw_law {name} = {{{values},\n  {tables}, 0, {fingerprint}}};\n#endif"
    )
    return "\n".join([*parts, ""])


def _parameters_as_comment(law: Law, aperture: Aperture | None = None) -> list[str]:
    """Lines with the parameters as TOML, or with the reason why they have no such text."""
    text, reason = text_or_reason(law, aperture)
    return text.splitlines() or [f"without parameters: {reason}"]


def packed(law: Law) -> tuple[dict[str, int | float], dict[str, Array]]:
    """Numbers and arrays of `struct jlaw_law` by name, in its order.

    Raises ValueError for a law with more azimuths than the C text has room for, and for an element
    without a C version.
    """
    facets = law.tables.asperities
    if facets is not None and (count := ring_sizes(facets.theta).max()) > MAX_AZIMUTHS:
        raise ValueError(
            f"resolution.phi gives {count:g} azimuths: jointlaw.h supports at most "
            f"{MAX_AZIMUTHS}; lower it"
        )
    return pack(law.tables)


def _exact(value: float) -> str:
    """Exact text of a float in C: a hexadecimal integer and a power of two.

    It has no decimal point, which C reads by the locale.
    """
    mantissa, exponent = math.frexp(value)
    return f"{int(mantissa * 2**53):#x}p{exponent - 53}"


def _checksum(data: bytes) -> int:
    """Checksum of a file: FNV-1a of 64 bits over its bytes, except carriage returns."""
    value = 0xCBF29CE484222325
    for byte in data.replace(b"\r", b""):
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value
