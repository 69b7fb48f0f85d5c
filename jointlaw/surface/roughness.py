"""Roughness: rms slopes (Z2) of surfaces and of Eq. 14, and spikes of a scan."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..parameters.orientation import Orientation
from ..support.checks import Array

SPIKE_HEIGHT = 3.0  # sum of the median steps along both axes: higher points are spikes


def rms_slope(orientation: Orientation, azimuth: float = 0.0) -> float:
    """Root mean square slope (Z2) of profiles along an azimuth (rad) for facets of Eq. 14.

    The facets cover equal areas of the joint plane.
    """
    theta = np.pi / (2 * orientation.a) * (np.arange(200)[:, None] + 0.5) / 200
    phi = 2 * np.pi * (np.arange(16) + 0.5) / 16
    weight = orientation.density(theta, phi) * np.sin(theta)
    slope = np.tan(theta) * np.cos(phi - azimuth)
    return float(np.sqrt(np.sum(weight * slope**2) / np.sum(weight)))


def measured_slopes(z: Array, spacing: float, samples: int) -> tuple[float, float]:
    """Root mean square slopes (Z2) of a measured surface, along the rows and across them.

    They are slopes of planes fitted to adjoining squares, the facets of the whole surface.

    Parameters
    ----------
    z: heights (ny, nx) in m relative to their mean plane.
    spacing: spacing of the points in m.
    samples: points along the edge of a square.
    """
    ny, nx = (n // samples for n in z.shape)
    squares = z[: ny * samples, : nx * samples].reshape(ny, samples, nx, samples)
    arm = np.arange(samples) - (samples - 1) / 2
    moment = samples * float(arm @ arm) * spacing
    along, across = (np.einsum(f"isjt,{axis}->ij", squares, arm) for axis in "ts")
    return float(np.sqrt(np.mean(along**2))) / moment, float(np.sqrt(np.mean(across**2))) / moment


def find_spikes(z: Array) -> NDArray[np.intp]:
    """Grid indices (n, 2) of points that are far above or far below all eight neighbours."""
    neighbours = np.ones((3, 3), bool)
    neighbours[1, 1] = False
    above = z - ndimage.maximum_filter(z, footprint=neighbours, mode="nearest")
    below = ndimage.minimum_filter(z, footprint=neighbours, mode="nearest") - z
    median_step = np.median(np.abs(np.diff(z, axis=1))) + np.median(np.abs(np.diff(z, axis=0)))
    return np.argwhere(np.maximum(above, below) > SPIKE_HEIGHT * median_step)
