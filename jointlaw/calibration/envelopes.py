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


def normal_at_peak_and_last(curve: ShearCurve) -> Array:
    """The normal stress (2,) in Pa at the row of the largest shear stress, and at the last row.

    Under constant normal stiffness dilation raises the normal stress, and the strength belongs to
    the normal stress of its own row, not to the mean.
    """
    normal = np.broadcast_to(curve.normal, curve.shear.shape)
    return np.array([normal[np.argmax(np.abs(curve.shear_stress))], normal[-1]])


def envelope_strength(name: str, curves: Sequence[ShearCurve], normal: Any) -> Array:
    """Peak and last shear stress (2,) in Pa by envelopes fitted to tests (least squares).

    The envelope of peaks is fitted to the largest shear stress of each test and the normal stress
    in its row, the envelope of last stresses to both in the last row.

    Parameters
    ----------
    name: one of `ENVELOPES`.
    curves: two or more tests to fit.
    normal: normal stress in Pa of the result; (2,) at the peak and at the last row, or one number.
    """
    envelope = ENVELOPES[name]
    normal = np.broadcast_to(normal, 2)
    s = np.stack([normal_at_peak_and_last(curve) for curve in curves])
    tau = np.stack([peak_and_last(curve.shear_stress) for curve in curves])
    strengths = []
    for k in range(2):
        line = np.polyfit(envelope.x(s[:, k]), envelope.y(s[:, k], tau[:, k]), 1)
        strengths.append(envelope.inverse(normal[k], np.polyval(line, envelope.x(normal[k]))))
    return np.array(strengths)
