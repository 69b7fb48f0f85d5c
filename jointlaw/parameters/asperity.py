"""One asperity contact: normal power law, Mindlin shear, Coulomb friction (Eq. 33-36)."""

import math
from dataclasses import dataclass

from ..support.checks import at_least, more_than, number


@dataclass(frozen=True)
class Asperity:
    """Stiffness and friction of one asperity contact.

    Its normal force is lam K d^(1+eta) at the deformation d (Eq. 33), its initial shear stiffness
    1/lam of its tangent normal stiffness, its shear force at most mu times its normal force.

    Parameters
    ----------
    K: stiffness in Pa m^(1-eta), > 0. 200 GPa um^(1/2) is 2.0e8 Pa m^(1/2).
    lam: normal over shear stiffness, > 0; (2-nu)/(2(1-nu)) for Hertz-Mindlin (Eq. 34).
    eta: exponent, >= 0; 1/2 for Hertz, 0 for constant stiffness.
    mu: friction coefficient of the asperity contact, >= 0.
    yield_interference: largest elastic compression (m) of a spring of the contact, along the
        asperity normal, > 0. Beyond it the spring yields at constant force and keeps a set.
        Infinite (elastic) by default. Yielding has no end: where nearly all asperities touch
        (`jointlaw.joints.crushed`) the rock between them, which the law leaves out, would bear.
    """

    K: float
    lam: float
    eta: float
    mu: float
    yield_interference: float = math.inf

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "K", more_than("asperity.K", self.K, 0.0))
        set_(self, "lam", more_than("asperity.lam", self.lam, 0.0))
        set_(self, "eta", at_least("asperity.eta", self.eta, 0.0))
        set_(self, "mu", at_least("asperity.mu", self.mu, 0.0))
        name, limit = "yield_interference", self.yield_interference
        set_(self, name, more_than(f"asperity.{name}", limit, 0.0, infinite=True))

    @classmethod
    def hertz_mindlin(cls, G: float, nu: float, R: float, mu: float) -> "Asperity":
        """Hertz-Mindlin contact of elastic spheres, Eq. 34.

        G: shear modulus (Pa); nu: Poisson's ratio, 0..0.5; R: asperity radius of curvature (m).
        """
        G, R = more_than("G", G, 0.0), more_than("R", R, 0.0)
        nu = number("nu", nu)
        if not 0.0 <= nu <= 0.5:
            raise ValueError(f"nu = {nu!r} is out of bounds: 0 <= nu <= 0.5")
        K = 8 * G * math.sqrt(R) / (3 * (2 - nu))
        return cls(K=K, lam=(2 - nu) / (2 * (1 - nu)), eta=0.5, mu=mu)

    @classmethod
    def linear(cls, kn: float, ks: float, mu: float) -> "Asperity":
        """Constant normal and shear stiffness kn, ks in N/m (section 3 of the paper)."""
        kn, ks = more_than("kn", kn, 0.0), more_than("ks", ks, 0.0)
        return cls(K=ks, lam=kn / ks, eta=0.0, mu=mu)
