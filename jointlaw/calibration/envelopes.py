"""Empirical strength envelopes fitted to the same tests, for comparison with a fitted law."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..support.checks import Array
from .measured import ShearCurve


class Envelope(NamedTuple):
    """An empirical strength envelope, a straight line in transformed variables.

    x: transform of the normal stress s.
    y: transform of normal stress and shear stress tau.
    inverse: the shear stress from s and y.
    """

    x: Callable[[Any], Any]
    y: Callable[[Any, Any], Any]
    inverse: Callable[[Any, Any], Any]


ENVELOPES = {
    "Coulomb": Envelope(lambda s: s, lambda s, tau: tau, lambda s, y: y),
    # tau = s tan(A - JRC log10 s)
    "Barton": Envelope(np.log10, lambda s, tau: np.arctan(tau / s), lambda s, y: s * np.tan(y)),
    "power law": Envelope(np.log, lambda s, tau: np.log(tau), lambda s, y: np.exp(y)),
}


def peak_and_last(stress: Array) -> Array:
    """The largest and the last absolute shear stress (2,) in Pa of a curve (n,)."""
    return np.array([np.max(np.abs(stress)), abs(stress[-1])])


def envelope_strength(name: str, curves: Sequence[ShearCurve], normal: float) -> Array:
    """Peak and last shear stress (2,) in Pa by an envelope fitted to tests (least squares).

    Parameters
    ----------
    name: one of `ENVELOPES`.
    curves: two or more tests to fit.
    normal: normal stress in Pa of the result.
    """
    envelope = ENVELOPES[name]
    s = np.array([np.mean(curve.normal) for curve in curves])
    tau = np.stack([peak_and_last(curve.shear_stress) for curve in curves])
    slope, intercept = np.polyfit(envelope.x(s), envelope.y(s[:, None], tau), 1)
    return np.asarray(envelope.inverse(normal, slope * envelope.x(normal) + intercept))
