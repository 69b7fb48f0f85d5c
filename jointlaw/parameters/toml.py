"""Laws as TOML files: the same keys as the constructors, unknown keys refused by their path."""

import csv
import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from ..support.checks import remedy
from ..support.files import replace_file
from .asperity import Asperity
from .heights import GammaHeights, Heights
from .orientation import Orientation
from .resolution import Resolution, named

_LAW_KEYS = {
    "orientation", "asperity", "heights", "asperity_density", "closure_range", "resolution",
    "plane", "closure_only", "critical_slip",
}  # fmt: skip
T = TypeVar("T")
_ABOUT = "about"  # free table for title, source and notes
VERSION = 1  # of the keys; a file without one is of version 1


def write_law(law: Mapping[str, Any], path: Path | None) -> str:
    """TOML text of a law's parameters; written to `path` too, a histogram then as CSV beside it."""
    r = law["resolution"]
    lengths = law["critical_slip"], law["asperity"].yield_interference
    names = named(*(length / law["closure_range"] for length in lengths))
    name = next((n for n, value in names.items() if value == r), None)
    front = ", front = true" if r.front else ""
    own = f"{{ u = {r.u}, phi = {r.phi}, depth = {r.depth}{front} }}"
    resolution = f'"{name}"' if name else own
    lines = [
        f"version = {VERSION}  # of this file's keys",
        f"asperity_density = {_num(law['asperity_density'])}  # 1/m2",
        f"closure_range = {_num(law['closure_range'])}  # m",
        f"resolution = {resolution}",
        f"critical_slip = {_num(law['critical_slip'])}  # m",
    ]
    if law["plane"] is not None:
        lines.append(f"plane = {_num(law['plane'])}  # rad")
    if law["closure_only"]:
        lines.append("closure_only = true")
    o, p, h = law["orientation"], law["asperity"], law["heights"]
    lines += ["", "[orientation]", f"a = {_num(o.a)}", f"b = {_num(o.b)}", f"c = {_num(o.c)}"]
    lines += ["", "[asperity]", f"K = {_num(p.K)}  # Pa m^(1-eta)", f"lam = {_num(p.lam)}"]
    lines += [f"eta = {_num(p.eta)}", f"mu = {_num(p.mu)}"]
    if p.yield_interference < math.inf:
        lines.append(f"yield_interference = {_num(p.yield_interference)}  # m")
    if p.mu_residual is not None:
        lines += [f"mu_residual = {_num(p.mu_residual)}", f"wear_slip = {_num(p.wear_slip)}  # m"]
    if h is not None:
        lines += ["", "[heights]"]
        if isinstance(h, GammaHeights):
            lines += [f"alpha = {_num(h.alpha)}", f"beta = {_num(h.beta)}  # m"]
        elif isinstance(h, Heights) and h.is_histogram:
            lines += _write_histogram(h, path)
        elif isinstance(h, Heights):
            inner = ", ".join(f"{k} = {_num(v)}" for k, v in h.parameters)
            lines += [f'distribution = "{h.distribution}"', f"parameters = {{ {inner} }}"]
        else:
            raise ValueError(
                f"heights = {h!r} cannot be written as TOML: only GammaHeights and Heights can"
            )
        lines += [f"overlap = {_num(h.overlap)}  # m", f'formation = "{h.formation}"']
    text = "\n".join(lines) + "\n"
    if path is not None:
        replace_file(path, text.encode())
    return text


def read_law(build: Callable[..., T], source: str | Path) -> T:
    """A law from a TOML file, or from TOML text (a line break, or "=" and no such file)."""
    path = Path(source)
    if isinstance(source, str) and ("\n" in source or ("=" in source and not path.is_file())):
        return build_law(build, _parse(source, "TOML text"), "TOML text")
    if not path.is_file():
        raise ValueError(f"law file {str(path)!r} does not exist; give a TOML file of parameters")
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{str(path)!r} is not a text file in UTF-8: {error}") from None
    return build_law(build, _parse(text, str(path)), str(path), path.parent)


def build_law(
    build: Callable[..., T], data: dict[str, Any], where: str, folder: Path | None = None
) -> T:
    """A law from a mapping with the keys of the constructor; `where` is named in errors."""
    version = data.get("version", VERSION)
    if version != VERSION:
        raise ValueError(
            f"{where}: key 'version' = {version!r}: this jointlaw reads version {VERSION}; write "
            "the law again with this version, or install the one that wrote it"
        )
    known(data, _LAW_KEYS | {_ABOUT, "version"}, where, "")
    for key in ("orientation", "asperity", "asperity_density"):
        if key not in data:
            raise ValueError(f"{where}: key {key!r} is missing; a law needs it")
    values = {key: value for key, value in data.items() if key in _LAW_KEYS}
    values["orientation"] = _part(Orientation, data["orientation"], where, "orientation")
    values["asperity"] = _part(Asperity, data["asperity"], where, "asperity")
    if "heights" in data:
        values["heights"] = _heights(data["heights"], where, folder)
    if isinstance(data.get("resolution"), dict):
        values["resolution"] = _part(Resolution, data["resolution"], where, "resolution")
    try:
        return build(**values)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _heights(data: Any, where: str, folder: Path | None) -> GammaHeights | Heights:
    if not isinstance(data, dict):
        raise ValueError(f"{where}: key 'heights' must be a table")
    if "alpha" in data or "beta" in data:
        return _part(GammaHeights, data, where, "heights")
    if "histogram" in data:
        data = dict(data)
        data["distribution"] = _read_histogram(
            Path(folder or ".") / str(data.pop("histogram")), where
        )
    elif "counts" in data:
        data = dict(data)
        data["distribution"] = (data.pop("counts"), data.pop("edges", ()))
    return _part(Heights, data, where, "heights")


def _part(kind: type[T], data: Any, where: str, path: str) -> T:
    """One of the parameter classes from its table."""
    if not isinstance(data, dict):
        raise ValueError(f"{where}: key {path!r} must be a table")
    allowed = {f.name: f.default is MISSING for f in fields(cast(Any, kind)) if f.init}
    known(data, set(allowed), where, path + ".")
    missing = [name for name, required in allowed.items() if required and name not in data]
    if missing:
        raise ValueError(f"{where}: key '{path}.{missing[0]}' is missing; table {path!r} needs it")
    try:
        return kind(**data)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def known(data: dict[str, Any], allowed: set[str], where: str, prefix: str) -> None:
    """Refuse keys that a table does not have. Raises ValueError naming key and remedy."""
    for key in data:
        if key not in allowed:
            raise ValueError(
                f"{where}: key '{prefix}{key}' is unknown; "
                f"{remedy(key, sorted(allowed), 'known here:')}"
            )


def _parse(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where} is not valid TOML: {error}") from None


def _num(value: float) -> str:
    return repr(float(value) + 0.0)  # -0.0 is 0.0; inf and -inf are TOML too


def _write_histogram(heights: Heights, path: Path | None) -> list[str]:
    counts, edges = heights.distribution
    if path is None:
        return [f"counts = {list(counts)}", f"edges = {list(edges)}  # m"]
    csv_path = path.with_name(path.stem + "-heights.csv")
    rows = [f"{low!r},{high!r},{n!r}" for low, high, n in zip(edges, edges[1:], counts)]  # noqa: B905
    text = "lower_m,upper_m,count\n" + "\n".join(rows) + "\n"
    replace_file(csv_path, text.encode())
    name = json.dumps(csv_path.name, ensure_ascii=False)
    return [f"histogram = {name}  # lower edge (m), upper edge (m), count"]


def _read_histogram(path: Path, where: str) -> tuple[list[float], list[float]]:
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        lower = np.array([float(row["lower_m"]) for row in rows])
        upper = np.array([float(row["upper_m"]) for row in rows])
        counts = [float(row["count"]) for row in rows]
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{where}: key 'heights.histogram' = {str(path)!r} must be a CSV file with the columns "
            f"lower_m, upper_m, count ({error})"
        ) from None
    if not rows or not np.array_equal(lower[1:], upper[:-1]):
        raise ValueError(f"{where}: key 'heights.histogram': the classes must adjoin each other")
    return counts, [*lower.tolist(), float(upper[-1])]
