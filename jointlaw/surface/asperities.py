"""Asperities of a scanned surface: summits, and the facets around them.

A scan is a surface z(x, y), but the law needs discrete asperities: the density of summit heights
(Eq. 12), the density of facet inclinations and azimuths (Eq. 14) and the number of asperities per
area. Three properties of scans make their extraction hard, and explain the steps of
`extract_asperities`:

- Rock is rough at every scale, so a summit is defined only at a sampling length. Summits are local
  maxima within one sampling length, and facets are planes of that size.
- Measurement noise creates additional local maxima on gentle facets. Summits are therefore found on
  smoothed heights (3 x 3 points), and a summit whose facets do not descend by more than the noise
  is rejected.
- Noise also displaces a summit from its true position, so that two or more quadrants lie on one
  facet, which would then be counted several times. Quadrants with the same gradient are merged.

The noise itself is estimated from the same data: the misfit of a plane through n points of white
noise has a chi-squared distribution with n - 3 degrees of freedom. Its median is used, because
squares across an edge between two facets have much larger misfits.
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from ..support.checks import Array

MIN_SUMMITS = 8  # for the fit of the densities
RIM = 2  # points; summits within a sampling length and `RIM` of the edge of a scan are not used
MAX_MISFIT = 9.0  # times the median of the squared misfits: planes with more lie across an edge
MIN_FALL = 6.0  # standard errors of a gradient by which the facets of a summit descend
MIN_DIFFERENCE = 3.0  # standard errors of a difference by which the gradients of facets differ


class MeasuredAsperities(NamedTuple):
    """Measured properties of the n summits of a surface and of their facets."""

    depth: Array  # (n,) m below the highest summit
    slope: Array  # (facets, 2) gradients along the columns and along the rows
    summit: NDArray[np.intp]  # (facets,) index of the summit of each facet
    slope_noise: float  # standard error of one component of a gradient
    density: float  # summits per m2
    size: float  # sampling length: edge of a facet in m
    grid_indices: NDArray[np.intp]  # (n, 2) row and column of each summit


def extract_asperities(z: Array, spacing: float, samples: int) -> MeasuredAsperities:
    """Find the summits and facets of a surface.

    1. The mean plane is subtracted.
    2. A summit is the highest point within `samples` points along both axes, of heights averaged
       over 3 x 3 points; its position is the highest measured point of these nine.
    3. The facets of a summit are the squares of `samples` x `samples` points in its four quadrants:
       a plane is fitted to each.
    4. Facets whose misfit exceeds three times the median lie across an edge and are left out; the
       median misfit of all facets gives the standard error of a gradient.
    5. A summit is left out, with its facets, if these do not descend from it by six standard errors
       of a gradient.
    6. Facets of one summit whose gradients agree within three standard errors are counted once.

    Parameters
    ----------
    z: heights (ny, nx) in m.
    spacing: spacing of the points in m.
    samples: sampling length in points.

    Raises ValueError if fewer than eight summits are found.
    """
    z = remove_mean_plane(z)
    length = samples * spacing
    summits = _find_summits(z, samples)
    _require_several(len(summits), length)
    quadrants = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    gradient, misfit, moment = _fit_planes(z, summits, quadrants, samples)
    gradient = gradient / spacing
    chi_squared_median = special.chdtri(samples**2 - 3, 0.5)
    noise = float(np.sqrt(np.median(misfit) / chi_squared_median / moment)) / spacing

    is_facet = misfit <= MAX_MISFIT * np.median(misfit)
    fall = -np.einsum("qnd,qd->qn", gradient, quadrants) / np.sqrt(2)
    facets_of_summit = np.maximum(np.sum(is_facet, axis=0), 1)
    is_summit = np.sum(fall * is_facet, axis=0) > MIN_FALL * noise * np.sqrt(facets_of_summit)
    _require_several(int(is_summit.sum()), length)

    for first, second in combinations(range(4), 2):
        difference = np.max(np.abs(gradient[first] - gradient[second]), axis=-1)
        is_same_facet = difference < MIN_DIFFERENCE * np.sqrt(2) * noise
        is_facet[second] &= ~(is_facet[first] & is_same_facet)
    is_facet &= is_summit
    summit_of_facet = np.broadcast_to(np.cumsum(is_summit) - 1, is_facet.shape)[is_facet]
    summits = summits[is_summit]
    height = z[tuple(summits.T)]
    area = float(np.prod([(n - 2 * (samples + RIM)) * spacing for n in z.shape]))
    return MeasuredAsperities(
        depth=height.max() - height,
        slope=gradient[is_facet],
        summit=summit_of_facet,
        slope_noise=noise,
        density=len(summits) / area,
        size=length,
        grid_indices=summits,
    )


def _require_several(summits: int, length: float) -> None:
    if summits < MIN_SUMMITS:
        raise ValueError(
            f"z has {summits} summits at a sampling length of {length:g} m: at least {MIN_SUMMITS} "
            "are needed; scan a larger area or change sampling_length"
        )


def _find_summits(z: Array, samples: int) -> NDArray[np.intp]:
    """Grid indices (n, 2) of the summits: step 2 of `extract_asperities`.

    z: heights (ny, nx). A summit is the highest point within `samples` points of heights smoothed
    over 3 by 3 points, at least `samples + RIM` points from the rim; of these 3 by 3 points the one
    that is highest in z itself is returned.
    """
    smooth = ndimage.uniform_filter(z, 3, mode="nearest")
    # a slight ramp, so that only one of several equal points is the maximum
    ramp = np.arange(z.size).reshape(z.shape) * (1e-12 * float(np.std(z)) / z.size + 1e-300)
    ranked = smooth + ramp
    is_maximum = ranked == ndimage.maximum_filter(ranked, size=2 * samples + 1, mode="nearest")
    rim = samples + RIM
    maxima = np.argwhere(is_maximum[rim:-rim, rim:-rim]) + rim
    neighbours = maxima[:, None, :] + np.array(list(np.ndindex(3, 3))) - 1
    highest = np.argmax(z[neighbours[..., 0], neighbours[..., 1]], axis=1)
    return np.asarray(neighbours[np.arange(len(maxima)), highest])


def _fit_planes(
    z: Array, summits: NDArray[np.intp], quadrants: NDArray[np.intp], samples: int
) -> tuple[Array, Array, float]:
    """Fit planes to the squares of points in the quadrants of the summits.

    Returns the gradients in m per point (quadrants, n, 2), the sums of squared misfits
    (quadrants, n) in m2, and the second moment of a square about its central line in points
    squared.
    """
    axis = np.arange(1, samples + 1)
    arm = axis - axis.mean()
    moment = samples * float(arm @ arm)
    row, column = summits.T[:, None, :, None] + quadrants.T[:, :, None, None] * axis
    patch = z[row[..., None], column[..., None, :]]
    residual = patch - patch.mean(axis=(2, 3), keepdims=True)
    along_columns = residual.sum(axis=3) @ arm / moment
    along_rows = residual.sum(axis=2) @ arm / moment
    residual = residual - along_columns[..., None, None] * arm[:, None]
    residual = residual - along_rows[..., None, None] * arm
    gradient: Array = np.stack([along_columns, along_rows], -1) * quadrants[:, None]
    return gradient, np.sum(residual**2, axis=(2, 3)), moment


def remove_mean_plane(z: Array) -> Array:
    """Heights (ny, nx) less the plane that fits them best by least squares."""
    y, x = (np.linspace(-1.0, 1.0, n) for n in z.shape)
    level: Array = z - z.mean()
    level = level - np.outer(y, np.ones(x.size)) * (y @ level.sum(1) / (y @ y) / x.size)
    return level - x * (level.sum(0) @ x / (x @ x) / y.size)
