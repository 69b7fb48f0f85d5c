"""The paper's tests by the total form and by the incremental law, each run once.

Parameters come from the presets (`jointlaw.presets`), which hold those printed in the paper.

With K_n a power of the deformation the total form is homogeneous, but for the count of asperities
in touch: for delta = size (cos tilt, sin tilt), F = P(r0 + delta_1) size^(1+eta) f(tilt). So a test
is a walk along the tilt: f comes from `secant` once for each, the size from one scalar equation.
Beyond 90 degrees the joint has dilated above the closure at which it first touched.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from .. import presets
from ..laboratory.experiments import direct_shear
from ..laboratory.record import Record
from ..law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..parameters.resolution import Resolution
from ..support.checks import Array
from .secant import secant, touching

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
    stress = float(found.normal_stress(closure)) if closure else normal
    control = "closure" if closure else "stress"
    return direct_shear(found.joint(), to, stress, control, azimuth, steps=200)


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
    return test.shear_stress / test.F1


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


# ------------------------------------------------------------------ shear by the total form


@dataclass(frozen=True, eq=False)
class TotalShear:
    """Shear test by the total form: arrays over its rows (rows,).

    closure, shear in m; F1 and shear_stress (along the azimuth of the test) in Pa; sliding and
    separated as shares of all orientations.
    """

    closure: Array
    shear: Array
    F1: Array
    shear_stress: Array
    sliding: Array
    separated: Array


def total_shear(
    law: JointLaw,
    tilts: ArrayLike,
    azimuth: float = 0.0,
    closure: float | None = None,
    normal: float | None = None,
    contact: str = "exact",
) -> TotalShear:
    """Shear a joint by the total form to each tilt arctan(shear/closure).

    tilts: (rows,) in rad, ascending from 0; azimuth: direction of shear in rad; and either the
    closure (m) or the normal stress (Pa) that is kept. `contact` as in `secant`. The rows end where
    the normal stress cannot be kept. Raises ValueError unless exactly one of the two is given.
    """
    if (closure is None) == (normal is None):
        raise ValueError("give either the closure (m) or the normal stress (Pa) that is kept")
    unit = replace(law, heights=None, closure_range=1.0)
    rows = []
    for tilt in np.asarray(tilts, float):
        cos, sin = math.cos(tilt), math.sin(tilt)
        along = np.array([math.cos(azimuth), math.sin(azimuth)])
        result = secant(unit, (cos, *(sin * along)), contact)
        f1, shear = float(result.F[0]), float(result.F[1:] @ along)
        size = closure / cos if closure is not None else _size(law, cos, f1, float(normal or 0.0))
        if size is None:
            break
        scale = float(touching(law, size * cos)) * size ** (1 + law.asperity.eta)
        shares = (result.sliding, result.separated)
        rows.append((size * cos, size * sin, scale * f1, scale * shear, *shares))
    return TotalShear(*np.array(rows).reshape(-1, 6).T)


def total_closure(law: JointLaw, closure: Sequence[float] | Array) -> Array:
    """Normal stress (rows,) in Pa at each closure (m), without shear, by the total form."""
    size = np.asarray(closure, float)
    unit = replace(law, heights=None, closure_range=1.0)
    f1 = secant(unit, (1.0, 0.0, 0.0)).F[0]
    return np.asarray(f1 * touching(law, size) * size ** (1 + law.asperity.eta))


def _size(law: JointLaw, cos: float, f1: float, normal: float) -> float | None:
    """The least size (m) at which P(r0 + size cos) size^(1+eta) f1 is the normal stress."""
    power = 1 + law.asperity.eta
    if not f1 > 0:
        return None

    def misfit(log_size: float) -> float:
        share = float(touching(law, math.exp(log_size) * cos))
        return math.log(max(share, 1e-300)) + power * log_size + math.log(f1 / normal)

    high = 10.0
    if (
        law.heights is not None and cos < 0
    ):  # contacts are lost as the size grows: the stress has a maximum
        top = math.log(max(law.heights.overlap, 1e-12) / -cos)
        high = float(minimize_scalar(lambda x: -misfit(x), bounds=(top - 20, top)).x)
    if misfit(high) < 0:
        return None
    return math.exp(brentq(misfit, -80.0, high, xtol=1e-12))
