"""Random laws on random paths: 1e6 updates at full length, a part of them otherwise."""

import numpy as np

from extremes.checks import run
from extremes.laws import build, random_changes

# what this very suite found: friction limits of sizes whose squares underflow
FOUND = [56, 61]


def fuzz(seed, n=8, steps=32):
    """Faults of the law and path of a seed; None when the law is refused."""
    changes, size = random_changes(np.random.default_rng(seed))
    try:
        law = build(**changes)
    except ValueError as error:
        if "not convex" in str(error) or "cannot be tabulated" in str(error):
            return None
        raise
    return run(law, size, seed, n, steps)
