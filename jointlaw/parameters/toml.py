"""Laws as TOML files, with the same keys as the constructors."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from typing import Any, TypeVar

from .asperity import Asperity
from .bond import Bond
from .heights import GammaHeights, Heights
from .keys import Removed, as_given, checked, keys_of
from .orientation import Orientation
from .resolution import Resolution, named

_RESOLUTION = keys_of(Resolution) | {
    "front": Removed("take more depth cells instead, such as depth = 12", neutral=False)
}
_WEAR = "slopes wear instead: give the law slope_wear (J/m2) and slope_residual"
_ASPERITY = keys_of(Asperity) | {
    "mu_residual": Removed(_WEAR, neutral=None),
    "wear_slip": Removed(_WEAR, neutral=math.inf),
}
_LAW = {
    "orientation!": keys_of(Orientation), "asperity!": _ASPERITY, "heights": as_given,
    "asperity_density!": as_given, "closure_range": as_given, "resolution": as_given,
    "plane": as_given, "closure_only": as_given, "mating_length": as_given,
    "slope_wear": as_given, "slope_residual": as_given,
    "critical_slip": Removed(
        "give mating_length (m), over which slopes fade and friction becomes residual",
        neutral=math.inf,
    ),
    "bond": keys_of(Bond), "about": as_given,  # free table for title, source and notes
    "version": as_given,
}  # fmt: skip
_BY_NAME = "write `counts` and `edges` (m) of a histogram, or `alpha` and `beta` of a gamma one"
_HEIGHTS = {
    "counts!": as_given, "edges!": as_given, "overlap": as_given, "formation": as_given,
    "histogram": Removed("write its `counts` and `edges` (m) into this table", neutral=None),
    "distribution": Removed(_BY_NAME, neutral=None),
    "parameters": Removed(_BY_NAME, neutral=None),
}  # fmt: skip
_UNITS = {
    "asperity_density": "1/m2", "closure_range": "m", "mating_length": "m", "plane": "rad",
    "slope_wear": "J/m2", "K": "Pa m^(1-eta)", "yield_interference": "m", "beta": "m",
    "overlap": "m", "normal_stiffness": "Pa/m", "shear_stiffness": "Pa/m", "tension": "Pa",
    "cohesion": "Pa", "energy_I": "J/m2", "energy_II": "J/m2",
}  # fmt: skip
# Values that a file does not hold: those of parameters that are off
_OFF = {"yield_interference": math.inf, "slope_wear": math.inf, "slope_residual": 0.0}
T = TypeVar("T")
VERSION = 1  # of the keys; a file without one is of version 1


def law_text(law: Mapping[str, Any]) -> str:
    """TOML text of a law's parameters."""
    r = law["resolution"]
    lengths = law["mating_length"], law["asperity"].yield_interference, law["closure_range"]
    names = named(*lengths)
    name = next((n for n, value in names.items() if value == r), None)
    nodes = [(one.name, getattr(r, one.name), one.default) for one in fields(r)]
    own = ", ".join(f"{name} = {value}" for name, value, off in nodes if value != off)
    lines = [
        f"version = {VERSION}  # of this file's keys",
        *_lines(law, ("asperity_density", "closure_range")),
        "resolution = " + (f'"{name}"' if name else f"{{ {own} }}"),
        *_lines(law, ("mating_length", "slope_wear", "slope_residual", "plane", "closure_only")),
    ]
    for part in ("orientation", "asperity", "heights", "bond"):
        if law[part] is not None:
            values = {one.name: getattr(law[part], one.name) for one in fields(law[part])}
            lines += ["", f"[{part}]", *_lines(values, values)]
    return "\n".join(lines) + "\n"


def _lines(values: Mapping[str, Any], names: Iterable[str]) -> list[str]:
    """A line for every value that a file holds, with its unit."""
    lines = []
    for name in names:
        value = values[name]
        if value is None or value is False or (name in _OFF and value == _OFF[name]):
            continue
        if name == "distribution":
            lines += [f"counts = {list(value[0])}", f"edges = {list(value[1])}  # m"]
            continue
        unit = f"  # {_UNITS[name]}" if name in _UNITS else ""
        lines.append(f"{name} = {_text(value)}{unit}")
    return lines


def _text(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, float):
        return repr(value + 0.0)  # -0.0 is 0.0; inf is TOML too
    return "true" if value is True else f'"{value}"'


def build_law(build: Callable[..., T], data: dict[str, Any], where: str) -> T:
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
        for part, kind in (("orientation", Orientation), ("asperity", Asperity), ("bond", Bond)):
            if part in values:
                values[part] = kind(**values[part])
        if "heights" in values:
            values["heights"] = _heights(values["heights"], where)
        if isinstance(values.get("resolution"), dict):
            nodes = checked(values["resolution"], _RESOLUTION, where, "resolution")
            values["resolution"] = Resolution(**nodes)
        return build(**values)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{where}: ") else f"{where}: {text}") from None


def _heights(data: Any, where: str) -> GammaHeights | Heights:
    if isinstance(data, dict) and ("alpha" in data or "beta" in data):
        return GammaHeights(**checked(data, keys_of(GammaHeights), where, "heights"))
    table = checked(data, _HEIGHTS, where, "heights")
    return Heights((table.pop("counts"), table.pop("edges")), **table)
