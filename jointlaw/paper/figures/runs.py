"""The paper's tests, each run once: what figures and claims both read.

Parameters come from the presets (`jointlaw.presets`), which hold those printed in the paper.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ... import presets
from ...laboratory.experiments import direct_shear
from ...laboratory.record import Record
from ...law import JointLaw
from ...parameters.resolution import Resolution
from ...support.checks import Array
from .total import TotalShear, total_shear

WESTERLY = (("westerly-smooth", "smooth", "C0"), ("westerly-rough", "rough", "C1"))
BIEGEL = (("biegel-smooth", "smooth", "C0"), ("biegel-rough", "rough", "C1"))

# Fine enough that the claims' numbers hold to about 1 %: 12 x 32 orientations, one spring bed cell
# where asperities are linear (it is exact there), 8 where they are not.
_TAIL = np.linspace(0.0, 0.95, 30)
_LINEAR, _CURVED = Resolution(12, 16, 1), Resolution(12, 16, 8)


@cache
def law(name: str) -> JointLaw:
    """The law of a preset, at the resolution of the figures."""
    found = presets.load(name)
    return replace(found, resolution=_LINEAR if found.asperity.eta == 0 else _CURVED)


@cache
def changed(name: str, heights: str = "", orientation: str = "", formation: str = "") -> JointLaw:
    """The law of a preset with the heights or the orientation of another, or another formation.

    heights = "none" takes the heights away: all asperities touch at zero closure.
    """
    found = law(name)
    if heights:
        found = replace(found, heights=None if heights == "none" else law(heights).heights)
    if orientation:
        found = replace(found, orientation=law(orientation).orientation)
    if formation and found.heights is not None:
        found = replace(found, heights=replace(found.heights, formation=formation))  # type: ignore[type-var]
    return found


@cache
def incremental(
    name: str,
    to: float,
    normal: float = 0.0,
    closure: float = 0.0,
    azimuth: float = 0.0,
    steps: int = 200,
) -> Record:
    """Direct shear of a preset to the displacement `to` (m) by the incremental law.

    Keeps the normal stress `normal` (Pa), or, if a `closure` (m) is given, that closure.
    """
    found = law(name)
    if closure:
        stress = float(found.normal_stress(closure))
        return direct_shear(found.joint(), to, stress, "closure", azimuth, steps=steps)
    return direct_shear(found.joint(), to, normal, "stress", azimuth, steps=steps)


@cache
def total(
    name: str,
    to: float,
    normal: float = 0.0,
    closure: float = 0.0,
    azimuth: float = 0.0,
    contact: str = "exact",
) -> TotalShear:
    """The same test by the total form, up to the displacement `to` (m) if it gets so far."""
    found = law(name)
    if closure:
        tilts = np.arctan(np.linspace(0.0, to / closure, 101))
        return total_shear(found, tilts, azimuth, closure=closure, contact=contact)
    steepest = 90 / found.orientation.a
    tilts = np.radians(np.concatenate([np.arange(0.0, 90.0), 90 + steepest * _TAIL]))
    test = total_shear(found, tilts, azimuth, normal=normal, contact=contact)
    last = min(int(np.searchsorted(test.shear, to)) + 1, len(test.shear))
    return TotalShear(**{key: value[:last] for key, value in vars(test).items()})


def ratio(test: Record | TotalShear) -> Array:
    """Shear resistance over normal stress of a test (rows,)."""
    result: Array = test.shear_stress / test.F1
    return result
