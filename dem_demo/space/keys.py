"""The keys of a scene in space, each with the rule that its value must satisfy."""

from functools import partial
from typing import Any

import numpy as np

from jointlaw.support.checks import finite, integer, number, one_of

from ..scene.keys import (
    DENSITY,
    FLAG,
    LIST,
    MAX_SEISMIC_COEFFICIENT,
    NOT_NEGATIVE,
    POSITIVE,
    TABLE,
    TEXT,
    some_of,
    within,
)

FIXED_MOTIONS = ("x", "y", "z", "turn")  # that may be prescribed for a block
DRIVEN_AXES = {"x": 0, "y": 1, "z": 2, "turn_x": 3, "turn_y": 4, "turn_z": 5}  # as in `Drive`


def vector(name: str, value: Any) -> np.ndarray:
    """Require three finite numbers."""
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(
            f"{name} = {value!r}: must be three numbers [x, y, z], as in all of a scene in space"
        )
    return np.array([number(name, one) for one in value])


def positive_vector(name: str, value: Any) -> np.ndarray:
    """Require three numbers above zero."""
    sides = vector(name, value)
    if not (sides > 0).all():
        raise ValueError(f"{name} = {value!r}: its sides must be above 0")
    return sides


def points(name: str, value: Any) -> np.ndarray:
    """Require a list of points (p, 3) in m, four or more."""
    rows = [vector(name, point) for point in LIST(name, value)]
    if len(rows) < 4:
        raise ValueError(f"{name}: must be 4 corners [x, y, z] or more")
    return np.array(rows)


def level(name: str, value: Any) -> np.ndarray:
    """Require one point of a horizontal plane, or three points of another plane (m).

    Returns coefficients (3,) of its height z = c . (1, x, y). Raises ValueError.
    """
    rows = np.array([vector(name, point) for point in LIST(name, value)]).reshape(-1, 3)
    if len(rows) == 1:
        return np.array([rows[0, 2], 0.0, 0.0])
    if len(rows) != 3:
        raise ValueError(
            f"{name}: must be one point [x, y, z] of a level, or three of a plane that is not level"
        )
    plan = rows[1:, :2] - rows[0, :2]
    sides = np.linalg.norm(plan, axis=1)
    if not abs(np.linalg.det(plan)) > MIN_LEVEL_SINE * sides.prod():
        raise ValueError(
            f"{name}: its three points lie on one line seen from above, so they give no height "
            "elsewhere; move one of them aside"
        )
    slope = np.linalg.solve(plan, rows[1:, 2] - rows[0, 2])
    return np.array([rows[0, 2] - slope @ rows[0, :2], *slope])


def horizontal_ratios(name: str, value: Any) -> np.ndarray:
    """Require the ratio of the horizontal stresses to the vertical one, or two, along x and y."""
    ratios = value if isinstance(value, list) else [value, value]
    if len(ratios) != 2:
        raise ValueError(f"{name} = {value!r}: must be one number, or two along x and y")
    return np.array([NOT_NEGATIVE(name, one) for one in ratios])


def stress_components(name: str, value: Any) -> np.ndarray:
    """Require the components sxx, syy, szz, sxy, syz, szx (Pa). Returns the tensor (3, 3)."""
    if not isinstance(value, list) or len(value) != 6:
        raise ValueError(f"{name} = {value!r}: must be [sxx, syy, szz, sxy, syz, szx] in Pa")
    xx, yy, zz, xy, yz, zx = (number(name, one) for one in value)
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def seismic_coefficients(name: str, value: Any) -> np.ndarray:
    """Require three shares of the weight."""
    shares = vector(name, value)
    for share in shares.tolist():
        within(name, share, -MAX_SEISMIC_COEFFICIENT, MAX_SEISMIC_COEFFICIENT,
               "(shares of the weight; 15 % is 0.15)")  # fmt: skip
    return shares


def not_there_yet(name: str, value: Any) -> Any:
    """Refuse a key that blocks in the plane have."""
    raise ValueError(
        f"{name}: not there yet for blocks in space, which have statics only; leave it out, or "
        "draw the scene in the plane"
    )


MIN_LEVEL_SINE = 1e-6  # of the angle between two sides, seen from above, of a plane's three points
SIDES = {  # axis and sense of the outward normals
    "left": (0, -1.0), "right": (0, 1.0), "front": (1, -1.0), "back": (1, 1.0),
    "bottom": (2, -1.0), "top": (2, 1.0),
}  # fmt: skip
ANGLE = partial(within, low=-360.0, high=360.0, unit="degrees")
DIP = partial(within, low=0.0, high=90.0, unit="degrees below the horizontal")
FRACTION = partial(within, low=0.0, high=1.0, unit="")
REGION = {
    "box": positive_vector, "at": vector, "corners": points,
    "dip": DIP, "dip_direction": ANGLE, "through": vector,
}  # fmt: skip
SHAPE = {"box": positive_vector, "at": vector, "corners": points, "file": TEXT}
BLOCK = {
    "name!": TEXT, **SHAPE, "density": DENSITY, "fixed": FLAG, "load": vector,
    "velocity": vector, "spin": vector,
    "fixed_motions": partial(some_of, names=FIXED_MOTIONS),
}  # fmt: skip
SET = {
    "dip!": DIP, "dip_direction!": ANGLE, "spacing!": POSITIVE, "law": TEXT, "through": vector,
    "persistence": FRACTION, "rough": ANGLE,
    "scatter": partial(within, low=0, high=0.999, unit="(two joints could meet)"),
}  # fmt: skip
ROCK = {
    "name!": TEXT, **SHAPE, "set!": [SET], "fixed": [REGION], "density": DENSITY,
    "seed": partial(integer, bound=0), "min_width": POSITIVE, "laws": TABLE,
    "hole": not_there_yet,
}  # fmt: skip
RUN = {
    "skin": POSITIVE, "max_overlap": POSITIVE, "end": POSITIVE,
    "fraction": partial(within, low=1e-6, high=0.95, unit="of the limit"),
    "step": POSITIVE, "settle": FLAG, "record": POSITIVE, "dashpot_normal": NOT_NEGATIVE,
    "dashpot_shear": NOT_NEGATIVE, "law_steps": partial(integer, bound=1),
    "corner_length": POSITIVE,
}  # fmt: skip
SCENE = {
    "title": TEXT, "gravity": vector, "seismic": seismic_coefficients, "density": DENSITY,
    "law": TEXT, "rough": ANGLE, "laws!": TABLE, "block": [BLOCK], "rock": [ROCK],
    "joint": [{"between!": LIST, "law!": TEXT, "rough": ANGLE}], "run": RUN,
    "water": {
        "table!": level, "unit_weight": POSITIVE, "at": [{"time!": POSITIVE, "table!": level}],
    },
    "in_situ": {
        "k0": horizontal_ratios, "stress": stress_components, "surface": level,
        **dict.fromkeys(SIDES, partial(one_of, choices=("fixed", "rollers", "loaded"))),
    },
    "excavate": [{
        "box": positive_vector, "at": vector, "corners": points, "start": NOT_NEGATIVE,
        "release_time!": POSITIVE,
    }],
    **dict.fromkeys(
        ("thickness", "bolt", "pressure"),
        not_there_yet,
    ),
    "drive": [{
        "block": TEXT, "motion!": partial(one_of, choices=tuple(DRIVEN_AXES)),
        "ramp": NOT_NEGATIVE, "times": partial(finite, unit="s"),
        "values": partial(finite, unit="m or degrees"),
        "sine": {
            "acceleration!": POSITIVE, "frequency!": POSITIVE,
            "cycles": partial(integer, bound=1),
        },
        "file": TEXT, "scale": number, "baseline": FLAG,
    }],
    "monitor": {"points": lambda name, value: [vector(name, one) for one in LIST(name, value)]},
}  # fmt: skip
