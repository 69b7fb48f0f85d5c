"""Laws as TOML files, with the same keys as the constructors."""

import csv
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..support.files import replace_file
from .asperity import Asperity
from .heights import GammaHeights, Heights
from .keys import Removed, as_given, checked, keys_of, read
from .orientation import Orientation
from .resolution import Resolution, named

_RESOLUTION = keys_of(Resolution) | {
    "front": Removed("take more depth cells instead, such as depth = 12", neutral=False)
}
_LAW = {
    "orientation!": keys_of(Orientation), "asperity!": keys_of(Asperity), "heights": as_given,
    "asperity_density!": as_given, "closure_range": as_given, "resolution": as_given,
    "plane": as_given, "closure_only": as_given, "critical_slip": as_given,
    "about": as_given,  # free table for title, source and notes
    "version": as_given,
}  # fmt: skip
T = TypeVar("T")
VERSION = 1  # of the keys; a file without one is of version 1


def write_law(law: Mapping[str, Any], path: Path | None) -> str:
    """TOML text of a law's parameters; written to `path` too, a histogram then as CSV beside it."""
    r = law["resolution"]
    lengths = law["critical_slip"], law["asperity"].yield_interference
    names = named(*(length / law["closure_range"] for length in lengths))
    name = next((n for n, value in names.items() if value == r), None)
    own = f"{{ u = {r.u}, phi = {r.phi}, depth = {r.depth} }}"
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


def read_law(build: Callable[..., T], path: str | Path) -> T:
    """A law from a TOML file."""
    if "\n" in str(path):
        raise ValueError("this is TOML text, not the path of a law file: use JointLaw.from_text")
    path = Path(path)
    data = read(path, "law file")
    return build_law(build, data, str(path), path.parent)


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
    values = checked(data, _LAW, where)
    values.pop("version", None)
    values.pop("about", None)
    try:
        values["orientation"] = Orientation(**values["orientation"])
        values["asperity"] = Asperity(**values["asperity"])
        if "heights" in values:
            values["heights"] = _heights(values["heights"], where, folder)
        if isinstance(values.get("resolution"), dict):
            nodes = checked(values["resolution"], _RESOLUTION, where, "resolution")
            values["resolution"] = Resolution(**nodes)
        return build(**values)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{where}: ") else f"{where}: {text}") from None


def _heights(data: Any, where: str, folder: Path | None) -> GammaHeights | Heights:
    table = dict(data) if isinstance(data, dict) else {}
    if "alpha" in table or "beta" in table:
        return GammaHeights(**checked(data, keys_of(GammaHeights), where, "heights"))
    if "histogram" in table:
        path = Path(folder or ".") / str(table.pop("histogram"))
        table["distribution"] = _read_histogram(path, where)
    elif "counts" in table:
        table["distribution"] = (table.pop("counts"), table.pop("edges", ()))
    return Heights(**checked(table or data, keys_of(Heights), where, "heights"))


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
