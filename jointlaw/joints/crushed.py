"""Where the law ends: nothing in it stops a joint from closing when all its asperities touch."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

CRUSHED = 0.9999  # share of the asperities in touch beyond which a joint is closed


def warn_if_crushed(law: Any, closure: ArrayLike) -> None:
    """Warn of closures (m) at which nearly all asperities of a law with heights touch.

    Real joints stop there, by the rock between the asperities. Laboratory tests and joints that
    start under a normal stress call this; hosts that close joints themselves may, too.
    """
    highest = float(np.max(closure, initial=0.0))
    share = law.crushed(highest)
    if share > CRUSHED:
        warnings.warn(
            f"closure = {highest:.3g} m: {100 * share:.2f} % of the asperities touch: here the law "
            "ends (docs/limits.md). Lower the normal stress, or give more or stiffer asperities, "
            "a larger asperity.yield_interference, or heights that reach farther",
            stacklevel=3,
        )
