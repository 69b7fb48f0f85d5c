"""What a joint lets through: hydraulic aperture and transmissivity from its closure."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..support.checks import at_least, finite, more_than

VISCOSITY, UNIT_WEIGHT = 1.0016e-3, 9789.0  # of water at 20 C, in Pa s and N/m3


def hydraulic_aperture(closure: ArrayLike, aperture: float, spread: float = 0.0) -> Any:
    """Gap (m) of the smooth parallel plates that let through as much as the rough joint.

    closure: of the joint in m, `joint.delta[0]`: joints that dilate have a smaller one, or one
    below zero; aperture: mean gap in m at zero closure, > 0, which a joint law does not know: take
    it from a flow test or a scan of both faces; spread: standard deviation of the gap in m, >= 0.

    h / sqrt(1 + (spread/h)^2) with h = aperture - closure, zero where no gap is left: the geometric
    mean of log-normal gaps (Renshaw 1995, doi:10.1029/95JB02159). Has the shape of `closure`.
    """
    gap = more_than("aperture", aperture, 0.0) - finite("closure", closure, "m")
    h = np.maximum(gap, 0.0)
    size = np.hypot(h, at_least("spread", spread, 0.0))
    return np.divide(h * h, size, out=np.zeros_like(h), where=size > 0)[()]


def transmissivity(
    hydraulic_aperture: ArrayLike, viscosity: float = VISCOSITY, unit_weight: float = UNIT_WEIGHT
) -> Any:
    """Transmissivity (m2/s): flow per width and head gradient, by the cubic law.

    hydraulic_aperture: in m, >= 0; viscosity in Pa s and unit weight in N/m3 of the fluid, those of
    water at 20 C. unit_weight h^3/(12 viscosity): Witherspoon et al. 1980,
    doi:10.1029/WR016i006p01016.
    """
    h = finite("hydraulic_aperture", hydraulic_aperture, "m")
    if not (h >= 0).all():
        raise ValueError(f"hydraulic_aperture = {h} is out of bounds: it must be >= 0")
    weight = more_than("unit_weight", unit_weight, 0.0)
    return weight * h**3 / (12 * more_than("viscosity", viscosity, 0.0))
