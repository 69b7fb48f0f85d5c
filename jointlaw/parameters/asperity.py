"""One asperity contact: normal power law, Mindlin shear, Coulomb friction (Eq. 33-36)."""

import math
from dataclasses import dataclass

from ..support.checks import more_than, number
from .declared import check, declared, parameter


@declared
@dataclass(frozen=True)
class Asperity:
    """Stiffness and friction of one asperity contact.

    Its normal force is lam K d^(1+eta) at the deformation d (Eq. 33), its initial shear stiffness
    1/lam of its tangent normal stiffness, its shear force at most mu times its normal force.
    """

    K: float = parameter(
        "stiffness; 200 GPa um^(1/2) is 2.0e8 Pa m^(1/2)",
        "Pa m^(1-eta)",
        above=0.0,
        fit=(1e3, 1e16),
    )
    lam: float = parameter(
        "normal over shear stiffness; (2-nu)/(2(1-nu)) for Hertz-Mindlin, Eq. 34",
        above=0.0,
        fit=(0.05, 20.0),
    )
    eta: float = parameter(
        "exponent; 1/2 for Hertz, 0 for constant stiffness", low=0.0, fit=(0.0, 1.0), log=False
    )
    mu: float = parameter("friction coefficient of the asperity contact", low=0.0, fit=(1e-3, 5.0))
    yield_interference: float = parameter(
        "largest elastic compression of a spring of the contact, along the asperity normal; beyond "
        "it the spring is perfectly plastic: constant force, permanent compression. Infinite: "
        "elastic. Plastic indentation has no limit, but where nearly all asperities touch "
        "(docs/limits.md) the rock between them, which the law does not model, would bear",
        "m",
        math.inf,
        above=0.0,
        infinite=True,
        fit=(1e-12, 1.0),
    )

    def __post_init__(self) -> None:
        check(self, "asperity")

    @classmethod
    def hertz_mindlin(cls, G: float, nu: float, R: float, mu: float) -> "Asperity":
        """Hertz-Mindlin contact of elastic spheres, Eq. 34.

        G: shear modulus (Pa); nu: Poisson's ratio, 0..0.5; R: asperity radius of curvature (m); mu:
        friction coefficient. Raises ValueError for a number out of its bounds.

        >>> asperity = jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.55)
        """
        G, R = more_than("G", G, 0.0), more_than("R", R, 0.0)
        nu = number("nu", nu)
        if not 0.0 <= nu <= 0.5:
            raise ValueError(f"nu = {nu!r} is out of bounds: 0 <= nu <= 0.5")
        K = 8 * G * math.sqrt(R) / (3 * (2 - nu))
        return cls(K=K, lam=(2 - nu) / (2 * (1 - nu)), eta=0.5, mu=mu)

    @classmethod
    def linear(cls, kn: float, ks: float, mu: float) -> "Asperity":
        """Constant normal and shear stiffness kn, ks in N/m, friction mu (section 3 of the paper).

        Raises ValueError for a number out of its bounds.
        """
        kn, ks = more_than("kn", kn, 0.0), more_than("ks", ks, 0.0)
        return cls(K=ks, lam=kn / ks, eta=0.0, mu=mu)
