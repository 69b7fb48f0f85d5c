"""Prior knowledge of the parameters of a joint: units, bounds, and 95 % ranges with their reasons.

One closure curve determines about three numbers, but the law has eleven parameters. The priors
determine the others, and the result of a fit reports the prior share of the variance of each
parameter. A range is a normal distribution of the transformed parameter (mostly its logarithm),
centred between the two ends, with a probability of 95 % between them.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ..laws.joint_law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.bond import Bond
from ..parameters.declared import parameters_of
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..support.checks import one_of

Values = Mapping[str, float]
Ranges = Mapping[str, tuple[float, float] | None]


class Transform(NamedTuple):
    """Unit, bounds and transform of a parameter: the logarithm of (value + shift) if `log`."""

    unit: str
    low: float
    high: float
    log: bool = True
    shift: float = 0.0

    def to(self, value: float) -> float:
        """The transformed value x."""
        return math.log(value + self.shift) if self.log else value

    def back(self, x: float) -> float:
        """The value whose transform is x."""
        return math.exp(x) - self.shift if self.log else x


# Parts of a law and their classes; "" is the law itself
PARTS = {
    "orientation": Orientation,
    "asperity": Asperity,
    "heights": GammaHeights,
    "": JointLaw,
    "bond": Bond,
}
TRANSFORMS = {
    name: Transform(declared.unit or "1", *declared.fit, declared.log, declared.shift)
    for kind in PARTS.values()
    for name, declared in parameters_of(kind).items()
    if declared.fit
} | {
    "preload_closure": Transform("m", 1e-12, 1.0),
    # a combination of parameters with a prior, see `quantity`
    "full_contact_stress": Transform("Pa", 1e-3, 1e18),
}

# Reason and 95 % range of each prior; "preload_closure" has none: the data determine it.
PRIORS: dict[str, tuple[float, float]] = {
    # Exponential heights (0) to nearly Gaussian ones (20); Westerly granite, lapped and rough: 3.82
    # and 6.14 (Yoshioka & Scholz 1989a)
    "alpha": (0.0, 20.0),
    # Six decades around 10 um: not informative for joints of laboratory size
    "beta": (1e-8, 1e-2),
    # N lam K sigma^(1+eta), see `quantity`: 0.63 GPa within a factor of 1000. A factor of 32 raised
    # extrapolated stresses by several per cent (docs/measure/fits.py)
    "full_contact_stress": (6.3e5, 6.3e11),
    # Hertz (Eq. 34): shear modulus of rock 10 to 30 GPa, radius of curvature 40 um to 4 cm
    "K": (1e8, 1e10),
    # (2 - nu)/(2 (1 - nu)) for any Poisson's ratio from 0 to 0.5 (Eq. 34)
    "lam": (1.0, 1.5),
    # plastic to elastic asperities (Johnson 1985, after Eq. 34)
    "eta": (0.0, 0.5),
    # 0.3 to 0.6 in the paper, 0.6 to 0.85 for rock on rock (Byerlee 1978)
    "mu": (0.2, 1.0),
    # 2.5 to 6 in the paper; mean inclinations from 45 down to 6 degrees
    "a": (1.3, 9.0),
    "b": (-1.0, 2.0),  # all of Eq. 18
    "c": (-1 / 3, 1 / 3),  # all of Eq. 18
}

# parameters that a prior of a combination constrains: it is used if one of them is free
_CONSTRAINED = {"full_contact_stress": {"asperity_density", "K"}}


def quantity(name: str, values: Values) -> float:
    """The value of a parameter, or of a combination of parameters with a prior.

    The combination `full_contact_stress` is N lam K sigma^(1+eta) in Pa: the stress that would
    compress all asperities by one standard deviation of their heights. Measured on random surfaces
    are N R sigma near 0.05 and (sigma/R)^(1/2), the slope of asperities, near 0.3 (Greenwood &
    Williamson 1966; Johnson 1985, section 13.4). With K of Hertz the stress is then about 0.03
    times the shear modulus, 0.6 GPa for G = 20 GPa, independent of the size of the asperities.
    """
    if name == "full_contact_stress":
        sigma = values["beta"] * math.sqrt(values["alpha"] + 1)
        stiffness = values["asperity_density"] * values["lam"] * values["K"]
        return float(stiffness * sigma ** (1 + values["eta"]))
    return values[name]


def normal_priors(free: tuple[str, ...], replaced: Ranges | None) -> dict[str, tuple[float, float]]:
    """Centre and standard deviation of the priors of the free parameters, after the transform.

    Parameters
    ----------
    free: names of the free parameters.
    replaced: 95 % ranges in physical units that replace defaults; None drops a prior.
    """
    defaults = {
        name: ends for name, ends in PRIORS.items() if _CONSTRAINED.get(name, {name}) & set(free)
    }
    ranges: Ranges = {**defaults, **(replaced or {})}
    return {name: _normal(name, *ends) for name, ends in ranges.items() if ends is not None}


def _normal(name: str, low: float, high: float) -> tuple[float, float]:
    """Centre and standard deviation of a prior with a 95 % range from low to high."""
    transform = TRANSFORMS[one_of("priors", name, tuple(TRANSFORMS))]
    if not transform.low <= low < high <= transform.high:
        raise ValueError(
            f"priors[{name!r}] = ({low!r}, {high!r}) must be the ascending ends of a 95 % range "
            f"from {transform.low:g} to {transform.high:g} {transform.unit}"
        )
    x0 = transform.to(low)
    x1 = transform.to(high)
    return 0.5 * (x0 + x1), (x1 - x0) / (2 * 1.959964)
