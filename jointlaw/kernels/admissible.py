"""Admissible states: the bounds of every number of a state, the same in Python and in C.

States come from outside where a host stores them: `Law.step`, `JointBatch.restore`, and the
functions `jlaw_update` and `jlaw_update_many` of the C header (`jlaw_state_is_valid_`). A number
beyond its bounds, such as a damage of 5, is no history of a joint: a step from it reverses forces
or gives numbers that are not finite.
"""

import numpy as np

from ..support.checks import Array
from ..support.thresholds import MAX_SLIDER_SQUARES
from .reference import LawTables

REMEDY = "Give zeros, the virgin state, or a state that a joint of this law had"


def require_admissible_states(k: LawTables, states: Array) -> None:
    """Check states (n, rows) from outside.

    Raises ValueError with the joint, the number, its value and its bounds unless every number is
    within its bounds, and the squares of the slider forces have a sum below MAX_SLIDER_SQUARES.
    """
    lower, upper = k.state_bounds
    is_within = (states >= lower) & (states <= upper)  # False for NaN
    if not is_within.all():
        joint, row = np.argwhere(~is_within)[0]
        raise ValueError(
            f"joint {joint}: {_name_of(k, row)} of the state is {float(states[joint, row])!r}, out "
            f"of bounds: it must be from {lower[row]:g} to {upper[row]:g}. {REMEDY}"
        )
    first = k.first_rows.get("q")
    if first is None:
        return
    q = states[:, first : first + k.row_counts["q"]]
    with np.errstate(over="ignore"):
        squares = np.einsum("nr,nr->n", q, q)
    if not (squares < MAX_SLIDER_SQUARES).all():
        joint = int(np.argmin(squares < MAX_SLIDER_SQUARES))
        row = first + int(np.argmax(np.abs(q[joint])))
        raise ValueError(
            f"joint {joint}: {_name_of(k, row)} of the state is {float(states[joint, row])!r}, out "
            f"of bounds: the squares of all q must have a sum < {MAX_SLIDER_SQUARES:g}. {REMEDY}"
        )


def _name_of(k: LawTables, row: int) -> str:
    """Name of a row of a state, and its number: "q[3] (number 7)"."""
    names = [name for name, count in k.row_counts.items() if count and k.first_rows[name] <= row]
    name = names[-1]
    index = f"[{row - k.first_rows[name]}]" if k.row_counts[name] > 1 else ""
    return f"{name}{index} (number {row})"
