"""Laws of a scene: built from its TOML tables, and tabulated once for the host.

A host needs from a law, besides `joints(n)`: how stiff a joint is at a given normal stress (time
step, dashpots) and how far it closes (seating). Both come from the virgin curve.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

import jointlaw as jl

from .coulomb import CoulombLaw, CoulombState
from .tables import finite


def build_law(table: dict[str, Any], where: str):
    """A law from a scene's `[laws.NAME]` table; `kind` is "joint" (default) or "coulomb"."""
    if not isinstance(table, dict):
        raise ValueError(f"{where} = {table!r}: must be a table")
    table = dict(table)
    kind = table.pop("kind", "joint")
    if table.get("closure_only"):
        raise ValueError(f"{where}.closure_only = true: joints between blocks shear; leave it out")
    if kind == "joint":
        return jl.JointLaw.from_dict({"plane": 0.0, **table}, where)
    if kind != "coulomb":
        raise ValueError(f"{where}.kind = {kind!r}: must be 'joint' or 'coulomb'")
    known = {f.name for f in fields(CoulombLaw)}
    for key in table:
        if key not in known:
            raise ValueError(f"{where}.{key} is unknown; known here: {', '.join(sorted(known))}")
    if missing := known - set(table):
        raise ValueError(f"{where} lacks {', '.join(sorted(missing))}")
    for key, value in table.items():
        if not (finite(value) or value == np.inf):
            raise ValueError(f"{where}.{key} = {value!r}: must be a number")
    try:
        return CoulombLaw(**{key: float(value) for key, value in table.items()})
    except ValueError as error:
        raise ValueError(f"{where}.{error}") from None


def load_state(law, path):
    """The state of a law's batch from the file that its `save` wrote."""
    return CoulombState.load(path) if isinstance(law, CoulombLaw) else jl.load_state(path)


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
    def of(cls, law) -> StiffnessCurve:
        """Tabulate a law from no closure to 2 GPa, more than any corner of rock stands."""
        top = float(law.closure(2e9))
        closure = np.concatenate([[0.0], np.geomspace(1e-8 * top, top, 600)])
        stress = law.normal_stress(closure)
        work = np.concatenate(
            [[0.0], np.cumsum(0.5 * (stress[1:] + stress[:-1]) * np.diff(closure))]
        )
        return cls(closure, stress, law.max_stiffness(closure), work)

    def at_stress(self, stress: np.ndarray) -> np.ndarray:
        """Stiffness (Pa/m) at a normal stress; 0 for an open joint."""
        return np.interp(stress, self.stress, self.stiffness) * (stress > 0)

    def at_closure(self, closure: np.ndarray) -> np.ndarray:
        """Stiffness (Pa/m) of a virgin joint at a closure."""
        return np.interp(closure, self.closure, self.stiffness)

    def virgin_stress(self, closure: np.ndarray) -> np.ndarray:
        """Normal stress (Pa) of a virgin joint at a closure."""
        return np.interp(closure, self.closure, self.stress)
