"""Every extreme alone and every two together: what must hold does, after every step."""

import numpy as np
import pytest

from extremes.checks import run
from extremes.laws import SCALE, alone, build

# what has no virgin curve that can be tabulated, or none that is convex, is refused when built
REFUSED = "cannot be tabulated|not convex"
# chosen to be refused: a population of eta near 0
NONE = [
    {"eta": eta, "heights": heights}
    for eta in (0.0, 1e-6)
    for heights in ("printed, population", "alpha = -0.5, overlap 0")
]


def ends(changes):
    """Whether the mathematics ends before this law."""
    return any(item.items() <= changes.items() for item in NONE)


LAWS = [changes for changes in alone() if not ends(changes)]


def kept_digits(changes):
    """Share of a closure that carries a force: beyond the yield interference springs give way, and
    the force is the difference of two places on the virgin curve, so much closer to each other."""
    return min(changes.get("yields at", np.inf) / SCALE, 1.0)


# laws with digits left to compare: those of a millionth of a closure are tested by `examine` alone
COMPARED = [changes for changes in LAWS if kept_digits(changes) > 1e-6]


def examine(changes, seed, n=8, steps=32):
    """Faults of one law: None when it was refused at construction, as it must be."""
    if ends(changes):
        with pytest.raises(ValueError, match=REFUSED):
            build(**changes)
        return None
    law = build(**changes)
    return run(law, SCALE, seed, n, steps)
