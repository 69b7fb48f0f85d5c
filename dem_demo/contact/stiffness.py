"""What a host needs of a law besides its joints: stiffness, stress and work of a virgin joint.

The time step and the dashpots take the stiffness, the initial equilibrium how far a joint closes.
"""

from dataclasses import dataclass

import numpy as np

import jointlaw as jl

from ..scene import is_coulomb


@dataclass(frozen=True)
class StiffnessCurve:
    """Upper bound of a law's stiffness (Pa/m) against normal stress (Pa) and closure (m), and the
    work (J/m2) that a virgin joint takes up to a closure.

    At a given normal stress the unsheared joint is the stiffest one (Phi' is a concave function of
    Phi), so the virgin curve bounds the sheared joint as well.
    """

    closure: np.ndarray
    stress: np.ndarray
    stiffness: np.ndarray
    work: np.ndarray

    @classmethod
    def of(cls, law: jl.JointLaw) -> "StiffnessCurve":
        """Tabulate a law from no closure to 2 GPa, more than any corner of rock stands."""
        top = float(law.closure(2e9))
        closure = np.concatenate([[0.0], np.geomspace(1e-8 * top, top, 600)])
        stress = law.normal_stress(closure)
        work = np.concatenate(
            [[0.0], np.cumsum(0.5 * (stress[1:] + stress[:-1]) * np.diff(closure))]
        )
        return cls(closure, stress, _largest_stiffness(law, closure), work)

    def at_stress(self, stress: np.ndarray) -> np.ndarray:
        """Stiffness (Pa/m) at a normal stress; 0 for an open joint."""
        return np.interp(stress, self.stress, self.stiffness) * (stress > 0)

    def at_closure(self, closure: np.ndarray) -> np.ndarray:
        """Stiffness (Pa/m) of a virgin joint at a closure."""
        return np.interp(closure, self.closure, self.stiffness)

    def stress_at(self, closure: np.ndarray) -> np.ndarray:
        """Normal stress (Pa) of a virgin joint at a closure."""
        return np.interp(closure, self.closure, self.stress)


def _largest_stiffness(law: jl.JointLaw, closure: np.ndarray) -> np.ndarray:
    """Largest eigenvalue (Pa/m) of a joint's stiffness.

    The law's bound adds mu for the coupling of shear to closure. That of level asperities has no
    eigenvalue of its own: (kn, 0; mu kn, 0) has kn and 0.
    """
    if not is_coulomb(law):
        return law.max_stiffness(closure)
    p = law.asperity  # K is the shear stiffness, lam K the normal one
    return np.full(len(closure), max(1.0, p.lam) * p.K * law.asperity_density)
