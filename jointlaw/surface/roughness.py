"""Roughness of a surface and of the law: rms slopes (Z2) along and across, and spikes of a scan."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..parameters.orientation import Orientation
from ..support.checks import Array

SPIKE = 3.0  # median steps between neighbours along both axes: farther out a point is a spike


def rms_slope(orientation: Orientation, azimuth: float = 0.0) -> float:
    """Root mean square slope (Z2) of profiles along an azimuth (rad), by facets of Eq. 14.

    The facets cover equal areas of the joint plane.
    """
    theta = np.pi / (2 * orientation.a) * (np.arange(200)[:, None] + 0.5) / 200
    phi = 2 * np.pi * (np.arange(16) + 0.5) / 16
    share = orientation.density(theta, phi) * np.sin(theta)
    along = np.tan(theta) * np.cos(phi - azimuth)
    return float(np.sqrt(np.sum(share * along**2) / np.sum(share)))


def measured_slopes(z: Array, spacing: float, samples: int) -> tuple[float, float]:
    """The same of level heights (ny, nx) in m, along the rows and across them.

    Of planes through squares of `samples` points, the facets of the whole surface.
    """
    ny, nx = (n // samples for n in z.shape)
    squares = z[: ny * samples, : nx * samples].reshape(ny, samples, nx, samples)
    arm = np.arange(samples) - (samples - 1) / 2
    rise = [np.einsum(f"isjt,{axis}->ij", squares, arm) for axis in "ts"]
    run = samples * float(arm @ arm) * spacing
    return float(np.sqrt(np.mean(rise[0] ** 2))) / run, float(np.sqrt(np.mean(rise[1] ** 2))) / run


def spikes(z: Array) -> NDArray[np.intp]:
    """Grid indices (n, 2) of points that lie far above or below all of their eight neighbours."""
    around = np.ones((3, 3), bool)
    around[1, 1] = False
    above = z - ndimage.maximum_filter(z, footprint=around, mode="nearest")
    below = ndimage.minimum_filter(z, footprint=around, mode="nearest") - z
    usual = np.median(np.abs(np.diff(z, axis=1))) + np.median(np.abs(np.diff(z, axis=0)))
    return np.argwhere(np.maximum(above, below) > SPIKE * usual)
