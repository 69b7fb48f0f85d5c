"""The virgin curve Phi(y) and its slope straight from their definitions, one integral a value."""

import math
from dataclasses import dataclass
from itertools import pairwise

from scipy.integrate import quad
from scipy.special import gammainc, gammaln


@dataclass(frozen=True)
class SlowGamma:
    """Gamma heights of Eq. 12 with the overlap r0 at zero closure."""

    alpha: float
    beta: float
    overlap: float
    formation: str

    def density(self, r):
        """H(r), Eq. 12."""
        x = r / self.beta
        return math.exp(self.alpha * math.log(x) - x - gammaln(self.alpha + 1.0)) / self.beta

    def cumulative(self, r):
        """P(r), the share of asperities that overlap by less than r."""
        return float(gammainc(self.alpha + 1.0, r / self.beta))


def virgin(y, eta, heights=None, ends=()):
    """Phi(y) and Phi'(y) of a single closure y >= 0; `ends`: heights between which H is smooth.

    Source: docs/theory-incremental.md, "Heights, direction and Hertz become one curve".
    """
    if y <= 0.0:
        p0 = 1.0 if heights is None else heights.cumulative(heights.overlap)
        return 0.0, (p0 if eta == 0.0 else 0.0)
    force, slope = y ** (1.0 + eta), (1.0 + eta) * y**eta
    if heights is None:
        return force, slope
    r0 = heights.overlap
    if heights.formation == "population":
        p, h = heights.cumulative(r0 + y), heights.density(r0 + y)
        return p * force, p * slope + h * force
    p0 = heights.cumulative(r0)

    def new(power):
        total = 0.0
        for low, high in pairwise([0.0, *(s - r0 for s in ends if r0 < s < r0 + y), y]):
            # the density in u = s/y; the last piece with QUADPACK's weight for (1 - u)^power: no
            # loss at the end where contacts are born
            last = high == y
            rule = {"weight": "alg", "wvar": (0.0, power)} if last else {}

            def f(u, p=0.0 if last else power):
                return heights.density(r0 + u * y) * (1.0 - u) ** p

            total += quad(f, low / y, high / y, epsrel=1e-12, epsabs=0.0, **rule)[0]
        return total * y ** (1.0 + power)

    return p0 * force + new(1.0 + eta), p0 * slope + (1.0 + eta) * new(eta)
