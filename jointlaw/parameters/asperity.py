"""One asperity contact: normal power law, Mindlin shear, Coulomb friction (Eq. 33-36)."""

import math
from dataclasses import dataclass

from ..support.checks import at_least, more_than, number

LEAST_RESIDUAL = 1e-6  # of mu_residual: no rock is smoother


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
    mu_residual: friction coefficient of worn asperities, > 0 and <= mu; None for no wear.
    wear_slip: slip (m) of the asperities over which mu falls to mu_residual by a factor e, > 0:
        mu(L) = mu_residual + (mu - mu_residual) exp(-L/wear_slip). L is an energy over a force:
        with critical_slip it is longer than the distance slid (docs/theory-incremental.md).
    """

    K: float
    lam: float
    eta: float
    mu: float
    yield_interference: float = math.inf
    mu_residual: float | None = None
    wear_slip: float = math.inf

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "K", more_than("asperity.K", self.K, 0.0))
        set_(self, "lam", more_than("asperity.lam", self.lam, 0.0))
        set_(self, "eta", at_least("asperity.eta", self.eta, 0.0))
        set_(self, "mu", at_least("asperity.mu", self.mu, 0.0))
        for name in ("yield_interference", "wear_slip"):
            value = more_than(f"asperity.{name}", getattr(self, name), 0.0, infinite=True)
            set_(self, name, value)
        if (self.mu_residual is None) != math.isinf(self.wear_slip):
            raise ValueError(
                f"asperity.mu_residual = {self.mu_residual!r}, wear_slip = {self.wear_slip!r} m: "
                "wear needs both a residual friction and a finite slip; give both or neither"
            )
        if self.mu_residual is not None:
            residual = number("asperity.mu_residual", self.mu_residual)
            if residual < LEAST_RESIDUAL:  # the slip is the energy lost, divided by mu
                raise ValueError(
                    f"asperity.mu_residual = {residual!r} is out of bounds: it must be >= "
                    f"{LEAST_RESIDUAL:g}, for without friction the slip that wears has no measure"
                )
            if residual > self.mu:
                raise ValueError(
                    f"asperity.mu_residual = {residual!r} is out of bounds: it must be <= mu = "
                    f"{self.mu!r}, for wear lowers friction"
                )
            set_(self, "mu_residual", residual)

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
