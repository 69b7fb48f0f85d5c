"""The first-loading curve Phi(y) and its slope from their definitions, one integral for a value."""

import math
from dataclasses import dataclass
from itertools import pairwise

from scipy.integrate import quad
from scipy.special import gammainc, gammaln


@dataclass(frozen=True)
class ReferenceGamma:
    """Gamma heights of Eq. 12 with the overlap r0 at zero closure, independent of the package."""

    alpha: float
    beta: float
    overlap: float
    formation: str

    def density(self, r):
        """H(r), Eq. 12."""
        x = r / self.beta
        return math.exp(self.alpha * math.log(x) - x - gammaln(self.alpha + 1.0)) / self.beta

    def cumulative(self, r):
        """P(r), the fraction of asperities that overlap by less than r."""
        return float(gammainc(self.alpha + 1.0, r / self.beta))


def first_loading(y, eta, heights=None, breakpoints=()):
    """Phi(y) and Phi'(y) of one closure y >= 0.

    breakpoints: heights between which H is smooth. Source: docs/theory-incremental.md, "Heights,
    direction and Hertz become one curve".
    """
    if y <= 0.0:
        p0 = 1.0 if heights is None else heights.cumulative(heights.overlap)
        return 0.0, (p0 if eta == 0.0 else 0.0)
    force = y ** (1.0 + eta)
    slope = (1.0 + eta) * y**eta
    if heights is None:
        return force, slope
    r0 = heights.overlap
    if heights.formation == "population":
        p = heights.cumulative(r0 + y)
        h = heights.density(r0 + y)
        return p * force, p * slope + h * force
    p0 = heights.cumulative(r0)

    def new_contacts(power):
        """Integral over the contacts that form during the closure."""
        inner = (point - r0 for point in breakpoints if r0 < point < r0 + y)
        total = 0.0
        for low, high in pairwise([0.0, *inner, y]):
            # the density in u = s/y; the last piece with QUADPACK's weight for (1 - u)^power: no
            # loss of accuracy at the end where contacts form
            is_last = high == y
            rule = {"weight": "alg", "wvar": (0.0, power)} if is_last else {}

            def integrand(u, p=0.0 if is_last else power):
                return heights.density(r0 + u * y) * (1.0 - u) ** p

            total += quad(integrand, low / y, high / y, epsrel=1e-12, epsabs=0.0, **rule)[0]
        return total * y ** (1.0 + power)

    force_of_new = new_contacts(1.0 + eta)
    slope_of_new = (1.0 + eta) * new_contacts(eta)
    return p0 * force + force_of_new, p0 * slope + slope_of_new
