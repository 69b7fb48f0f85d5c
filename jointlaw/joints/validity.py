"""Range of validity: the law does not limit the closure when nearly all asperities touch."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

MAX_CONTACT_FRACTION = 0.9999  # of the asperities: real joints are closed there


def warn_if_closed(law: Any, closure: ArrayLike) -> None:
    """Warn of closures (m) at which nearly all asperities of a law with heights are in contact.

    The rock between the asperities, which the law does not model, stops a real joint there.
    Laboratory tests and joints that start under a normal stress call this function; hosts that
    close joints themselves may call it, too.
    """
    largest = float(np.max(closure, initial=0.0))
    fraction = law.contact_fraction(largest)
    if fraction > MAX_CONTACT_FRACTION:
        warnings.warn(
            f"closure = {largest:.3g} m: {100 * fraction:.2f} % of the asperities touch: here the "
            "law ends (docs/limits.md). Lower the normal stress, or give more or stiffer "
            "asperities, a larger asperity.yield_interference, or heights that reach farther",
            stacklevel=3,
        )
