"""Asperities of a scanned surface: summits, and the facets that fall away from them."""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from ..support.checks import Array

FEWEST = 8  # summits that a fit can stand on
RIM = 2  # points beyond a sampling length from the rim in which no summit is looked for


class Asperities(NamedTuple):
    """What is measured on n asperities of a surface."""

    depth: Array  # (n,) m below the highest summit
    slope: Array  # (facets, 2) gradients along the columns and along the rows
    summit: NDArray[np.intp]  # (facets,) the summit that each belongs to
    slope_noise: float  # standard error of one component of a gradient
    density: float  # per m2
    size: float  # edge of a facet in m
    places: NDArray[np.intp]  # (n, 2) grid indices of the summits


def extract(z: Array, spacing: float, samples: int) -> Asperities:
    """Summits and facets of a surface (ny, nx) of heights in m.

    1. The mean plane is taken away.
    2. A summit is the highest point within `samples` along either axis, of heights averaged over
       3 x 3 points (noise makes summits of its own on gentle facets), and the highest measured
       point of those nine.
    3. The facets of a summit are the squares of `samples` x `samples` points in the four quadrants
       beside it: a plane is fitted to each.
    4. Facets that miss their plane by more than three times the median lie across an edge and are
       left out; the median of the others gives the error of a gradient.
    5. Facets of one summit whose gradients agree within three standard errors are one facet: noise
       has put the summit down beside its true place, and one plane surrounds it.
    6. A summit whose facets together do not fall away from it by six times the error of a gradient
       is a bump of noise and left out with them.

    Summits within `samples` and two of the rim are left out.
    """
    z, length = levelled(z), samples * spacing
    summits = _summits(z, samples)
    _require_several(len(summits), length)
    quadrants = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    gradient, misfit, moment = _planes(z, summits, quadrants, samples)
    gradient = gradient / spacing
    middle = special.chdtri(samples**2 - 3, 0.5)  # the median of chi^2
    noise = float(np.sqrt(np.median(misfit) / middle / moment)) / spacing
    keep = misfit <= 9 * np.median(misfit)
    fall = -np.einsum("qnd,qd->qn", gradient, quadrants) / np.sqrt(2)
    kept = np.maximum(np.sum(keep, axis=0), 1)
    hill = np.sum(fall * keep, axis=0) > 6 * noise * np.sqrt(kept)
    _require_several(int(hill.sum()), length)
    for first, second in combinations(range(4), 2):
        apart = np.max(np.abs(gradient[first] - gradient[second]), axis=-1)
        keep[second] &= ~(keep[first] & (apart < 3 * np.sqrt(2) * noise))
    keep &= hill
    summit = np.broadcast_to(np.cumsum(hill) - 1, keep.shape)[keep]
    summits = summits[hill]
    height = z[tuple(summits.T)]
    area = float(np.prod([(n - 2 * (samples + RIM)) * spacing for n in z.shape]))
    return Asperities(
        height.max() - height, gradient[keep], summit, noise, len(summits) / area, length, summits
    )


def _require_several(summits: int, length: float) -> None:
    if summits < FEWEST:
        raise ValueError(
            f"z has {summits} summits at a sampling length of {length:g} m: at least {FEWEST} are "
            "needed; scan a larger area or change sampling_length"
        )


def _summits(z: Array, samples: int) -> NDArray[np.intp]:
    """Grid indices (n, dim) of the summits, step 2 of `extract`."""
    smooth = ndimage.uniform_filter(z, 3, mode="nearest")
    ramp = np.arange(z.size).reshape(z.shape) * (1e-12 * float(np.std(z)) / z.size + 1e-300)
    ranked = smooth + ramp  # of equal points one is the summit
    top = ranked == ndimage.maximum_filter(ranked, size=2 * samples + 1, mode="nearest")
    rim = samples + RIM
    places = np.argwhere(top[rim:-rim, rim:-rim]) + rim
    near = places[:, None, :] + np.array(list(np.ndindex(3, 3))) - 1
    best = np.argmax(z[near[..., 0], near[..., 1]], axis=1)
    return np.asarray(near[np.arange(len(places)), best])


def _planes(
    z: Array, summits: NDArray[np.intp], quadrants: NDArray[np.intp], samples: int
) -> tuple[Array, Array, float]:
    """Planes through the squares in the quadrants beside the summits.

    Gradients in m per point (quadrants, n, 2), sums of squared misfits (quadrants, n) in m2, and
    the sum over a square of squared distances from its middle line, in points squared.
    """
    axis = np.arange(1, samples + 1)
    arm = axis - axis.mean()
    moment = samples * float(arm @ arm)
    row, column = summits.T[:, None, :, None] + quadrants.T[:, :, None, None] * axis
    patch = z[row[..., None], column[..., None, :]]
    left = patch - patch.mean(axis=(2, 3), keepdims=True)
    down, along = (left.sum(axis=3) @ arm / moment, left.sum(axis=2) @ arm / moment)
    left = left - down[..., None, None] * arm[:, None] - along[..., None, None] * arm
    gradient: Array = np.stack([down, along], -1) * quadrants[:, None]
    return gradient, np.sum(left**2, axis=(2, 3)), moment


def levelled(z: Array) -> Array:
    """Heights above the mean plane."""
    y, x = (np.linspace(-1.0, 1.0, n) for n in z.shape)
    level: Array = z - z.mean()
    level = level - np.outer(y, np.ones(x.size)) * (y @ level.sum(1) / (y @ y) / x.size)
    return level - x * (level.sum(0) @ x / (x @ x) / y.size)
