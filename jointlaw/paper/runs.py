"""The paper's tests, each run once: what figures and claims both read.

Parameters come from the presets (`jointlaw.presets`), which hold those printed in the paper.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from .. import presets
from ..laboratory.experiments import direct_shear
from ..laboratory.record import Record
from ..law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..parameters.resolution import Resolution
from ..support.checks import Array
from .total import TotalShear, total_shear

# Fine enough that the claims' numbers hold to about 1 %: 12 x 32 orientations, one spring bed cell
# where asperities are linear (it is exact there), 8 where they are not.
_LINEAR, _CURVED = Resolution(12, 16, 1), Resolution(12, 16, 8)
_TAIL = np.linspace(0.0, 0.95, 30)


@cache
def law(name: str) -> JointLaw:
    """The law of a preset, at the resolution of the figures."""
    found = presets.load(name)
    return replace(found, resolution=_LINEAR if found.asperity.eta == 0 else _CURVED)


def gamma_heights(name: str) -> GammaHeights:
    """The heights of a preset that has them."""
    heights = law(name).heights
    assert isinstance(heights, GammaHeights)
    return heights


def simple(
    a: float,
    mu: float,
    eta: float = 0.0,
    lam: float = 1.0,
    b: float = 0.0,
    c: float = 0.0,
    resolution: Resolution = Resolution(1, 3, 64),  # noqa: B008  (frozen)
) -> JointLaw:
    """A law without heights, K = 1 and N = 1."""
    return JointLaw(
        orientation=Orientation(a, b, c),
        asperity=Asperity(K=1.0, lam=lam, eta=eta, mu=mu),
        asperity_density=1.0,
        closure_range=1.0,
        resolution=resolution,
    )


@cache
def incremental(
    name: str, to: float, normal: float = 0.0, closure: float = 0.0, azimuth: float = 0.0
) -> Record:
    """Direct shear of a preset to the displacement `to` (m) by the incremental law.

    Keeps the normal stress `normal` (Pa), or, if a `closure` (m) is given, that closure.
    """
    found = law(name)
    if closure:
        stress = float(found.normal_stress(closure))
        return direct_shear(found.joint(), to, stress, "closure", azimuth, steps=200)
    return direct_shear(found.joint(), to, normal, "stress", azimuth, steps=200)


@cache
def total(
    name: str, to: float, normal: float = 0.0, closure: float = 0.0, azimuth: float = 0.0
) -> TotalShear:
    """The same test by the total form, up to the displacement `to` (m) if it gets so far."""
    found = law(name)
    if closure:
        tilts = np.arctan(np.linspace(0.0, to / closure, 101))
        return total_shear(found, tilts, azimuth, closure=closure)
    steepest = 90 / found.orientation.a
    tilts = np.radians(np.concatenate([np.arange(0.0, 90.0), 90 + steepest * _TAIL]))
    test = total_shear(found, tilts, azimuth, normal=normal)
    last = min(int(np.searchsorted(test.shear, to)) + 1, len(test.shear))
    return TotalShear(**{key: value[:last] for key, value in vars(test).items()})


def ratio(test: Record | TotalShear) -> Array:
    """Shear resistance over normal stress of a test (rows,)."""
    result: Array = test.shear_stress / test.F1
    return result


def resistance(
    name: str, at: Array, to: float, normal: float = 0.0, closure: float = 0.0
) -> tuple[Array, Array]:
    """F2/F1 at the displacements `at` (m) of such a test: total form, incremental law."""
    tests = total(name, to, normal, closure), incremental(name, to, normal, closure)
    printed, ours = (np.interp(at, test.shear, ratio(test)) for test in tests)
    return printed, ours


def first_sliding(test: Record) -> int:
    """First row at which every asperity in touch slides; the last row if none does."""
    rows = np.flatnonzero((test.sliding > 0) & (test.sliding + test.separated > 1 - 1e-9))
    return int(rows[0]) if len(rows) else len(test.sliding) - 1
