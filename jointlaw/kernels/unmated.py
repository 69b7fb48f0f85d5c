"""Where the asperities of a joint touch first whose faces have never met."""

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import FAR, ROUNDED
from .mating import offset


def first_touch(k: FacetTables) -> Array:
    """Displacement (dim,) in m from the mated position, at first touch, along axis 2.

    Raises ValueError for asperities that are always mated.
    """
    if k.dim == 1:
        raise ValueError("mated=False: a joint with closure_only is always mated")
    if not k.fades:
        raise ValueError(
            "mated=False: with an infinite mating_length a joint stays mated however far it slips; "
            "give the law a finite one"
        )
    p = np.zeros((k.dim - 1, 1))
    p[0] = FAR * k.mating_length
    highest = np.max(k.m[1:].T @ offset(k, p))
    return np.array([-(1 + ROUNDED) * highest, *p[:, 0]])
