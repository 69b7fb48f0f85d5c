"""The keys of a scene's tables, each with the rule that its value must satisfy.

A rule is a function of the name and the value of a key; it returns the value or raises ValueError.
Keys that end in "!" are required (`jointlaw.parameters.keys`).
"""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
from shapely import Polygon

from jointlaw.support.checks import at_least, finite, integer, more_than, number, one_of

Tables = dict[str, Any]
MAX_FLATNESS = 1e-12  # width over length of a polygon whose corners lie on one line
MAX_SEISMIC_COEFFICIENT = 2.0  # of the weight: no site has been shaken so strongly


def of_kind(name: str, value: Any, kind: type) -> Any:
    """Require a value of a type."""
    if not isinstance(value, kind):
        kinds = {str: "a text", bool: "true or false", list: "a list", dict: "a table"}
        raise ValueError(f"{name} = {value!r}: must be {kinds[kind]}")
    return value


def within(name: str, value: Any, low: float, high: float, unit: str) -> float:
    """Require a number from `low` to `high`."""
    if not low <= number(name, value) <= high:
        raise ValueError(f"{name} = {value!r}: must be from {low:g} to {high:g} {unit}")
    return float(value)


def vector(name: str, value: Any) -> tuple[float, float]:
    """Require two finite numbers."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{name} = {value!r}: must be two numbers [x, y]")
    return number(name, value[0]), number(name, value[1])


def seismic_coefficients(name: str, value: Any) -> tuple[float, float]:
    """Require two shares of the weight."""
    x, y = vector(name, value)
    for one in (x, y):
        within(name, one, -MAX_SEISMIC_COEFFICIENT, MAX_SEISMIC_COEFFICIENT,
               "(shares of the weight; 15 % is 0.15)")  # fmt: skip
    return x, y


def points(name: str, value: Any) -> list[tuple[float, float]]:
    """Require a list of points (m)."""
    return [vector(name, point) for point in LIST(name, value)]


def pairs_of_points(name: str, value: Any) -> list[list[tuple[float, float]]]:
    """Require a list of pairs of different points (m)."""
    pairs = [points(f"{name}[{i}]", pair) for i, pair in enumerate(LIST(name, value))]
    for i, pair in enumerate(pairs):
        if len(pair) != 2 or pair[0] == pair[1]:
            raise ValueError(f"{name}[{i}]: must be two different points [[x, y], [x, y]]")
    return pairs


def _is_flat(ring: np.ndarray) -> bool:
    """Whether corners (k, 2) lie on one line, but for rounding."""
    sizes = np.linalg.svd(ring - ring.mean(axis=0), compute_uv=False)
    return bool(sizes[1] <= MAX_FLATNESS * sizes[0])


def corners(name: str, value: Any) -> np.ndarray:
    """Require the corners (k, 2) of a polygon that does not cross itself, in m."""
    ring = np.array(points(name, value))
    if len(ring) >= 3 and _is_flat(ring):
        raise ValueError(f"{name}: all corners lie on one line, so the area is zero")
    if len(ring) < 3 or not Polygon(ring).is_valid:
        raise ValueError(f"{name}: must be 3 corners [x, y] or more that do not cross or touch")
    return ring


def some_of(name: str, value: Any, names: Iterable[str], count: int | None = None) -> list[str]:
    """Require a list of different known names; `count` of them, if given."""
    is_known = isinstance(value, list) and all(isinstance(v, str) and v in names for v in value)
    if not is_known or len(set(value)) < len(value) or count not in (None, len(value)):
        quantity = f"{count} of" if count else "some of"
        raise ValueError(f"{name} = {value!r}: must be {quantity} {', '.join(names)}, each once")
    return value


def polyline(name: str, value: Any) -> np.ndarray:
    """Require points (m, 2) of a line from left to right (m)."""
    line = np.array(points(name, value)).reshape(-1, 2)
    if not len(line) or (np.diff(line[:, 0]) <= 0).any():
        raise ValueError(f"{name}: must be points [x, y] from left to right, x increasing")
    return line


AXES = {"x": 0, "y": 1, "turn": 2}
TEXT, FLAG, LIST, TABLE = (partial(of_kind, kind=kind) for kind in (str, bool, list, dict))
POSITIVE, NOT_NEGATIVE = partial(more_than, bound=0), partial(at_least, bound=0)
DENSITY = partial(within, low=50.0, high=30000.0, unit="kg/m3; 2.6 g/cm3 is 2600 kg/m3")

BLOCK = {
    "name!": TEXT, "box": vector, "at": vector, "angle": number, "corners": corners,
    "density": DENSITY, "fixed": FLAG, "velocity": vector, "spin": number, "load": vector,
    "fixed_motions": partial(some_of, names=AXES),
}  # fmt: skip
SET = {
    "dip!": partial(within, low=-90, high=90, unit="degrees"), "spacing!": POSITIVE, "law": TEXT,
    "through": vector, "persistence": partial(within, low=0, high=1, unit=""),
    "scatter": partial(within, low=0, high=0.999, unit="(two joints could meet)"),
}  # fmt: skip
ROCK = {
    "name!": TEXT, "outline!": corners, "set!": [SET], "at": vector,
    "fixed": [{"corners!": corners}], "hole": [{"corners!": corners}], "density": DENSITY,
    "seed": partial(integer, bound=0), "min_width": POSITIVE, "laws": TABLE,
    "cut_law": TEXT,
}  # fmt: skip
DRIVE = {
    "block": TEXT, "motion!": partial(one_of, choices=tuple(AXES)), "ramp": NOT_NEGATIVE,
    "times": partial(finite, unit="s"), "values": partial(finite, unit="m or degrees"),
    "reverse": {"block!": TEXT, "slip!": POSITIVE, "by!": number, "duration!": POSITIVE},
    "sine": {
        "acceleration!": POSITIVE, "frequency!": POSITIVE, "cycles": partial(integer, bound=1),
    },
    "file": TEXT, "scale": number, "baseline": FLAG,
}  # fmt: skip
RUN = {
    "end!": POSITIVE, "fraction": partial(within, low=1e-6, high=0.95, unit="of the limit"),
    "step": POSITIVE, "settle": FLAG, "record": POSITIVE, "dashpot_normal": NOT_NEGATIVE,
    "dashpot_shear": NOT_NEGATIVE, "law_steps": partial(integer, bound=1), "skin": POSITIVE,
    "corner_length": POSITIVE, "max_overlap": POSITIVE,
}  # fmt: skip
SCENE = {
    "title": TEXT, "gravity": vector, "density": DENSITY, "thickness": POSITIVE, "law": TEXT,
    "seismic": seismic_coefficients,
    "laws!": TABLE, "block": [BLOCK], "rock": [ROCK], "drive": [DRIVE], "run!": RUN,
    "joint": [{"between": LIST, "around": vector, "law!": TEXT}],
    "excavate": [{"corners!": corners, "start": NOT_NEGATIVE, "release_time!": POSITIVE}],
    "in_situ": {
        "k0": NOT_NEGATIVE, "stress": partial(finite, unit="Pa"), "surface": polyline,
        **dict.fromkeys(("left", "right", "bottom", "top"),
                        partial(one_of, choices=("fixed", "rollers", "loaded"))),
    },
    "water": {
        "table!": polyline, "unit_weight": POSITIVE,
        "at": [{"time!": POSITIVE, "table!": polyline}],
    },
    "bolt": [{
        "from!": vector, "to!": vector, "stiffness!": POSITIVE, "capacity!": POSITIVE,
        "pretension": NOT_NEGATIVE,
    }],
    "pressure": [{"from!": vector, "to!": vector, "value!": NOT_NEGATIVE}],
    "monitor": {
        "slip": LIST, "shear": LIST, "points": points, "joints": points,
        "convergence": pairs_of_points,
    },
}  # fmt: skip


def overlay(below: Any, above: Any) -> Any:
    """Lay one value over another: tables are merged key by key, lists of tables table by table;
    any other value of `above` replaces that of `below`."""
    if isinstance(above, dict) and isinstance(below, dict):
        return below | {key: overlay(below.get(key), value) for key, value in above.items()}
    if isinstance(below, list) and all(isinstance(table, dict) for table in (*below, *above)):
        merged = [overlay(*pair) for pair in zip(below, above, strict=False)]
        return merged + below[len(merged) :] + above[len(merged) :]
    return above
