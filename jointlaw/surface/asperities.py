"""Asperities of a scanned surface: summits, and the facets that fall away from them."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..support.checks import Array

FEWEST = 8  # summits that a fit can stand on


class Asperities(NamedTuple):
    """What is measured on n asperities of a surface (or profile, which has one direction only)."""

    depth: Array  # (n,) m below the highest summit
    slope: Array  # (facets, dim) gradients
    summit: NDArray[np.intp]  # (facets,) the summit that each belongs to
    slope_noise: float  # standard error of one component of a gradient
    density: float  # per m2, or per m of a profile
    size: float  # edge of a facet in m
    places: NDArray[np.intp]  # (n, dim) grid indices of the summits


def extract(z: Array, spacing: float, samples: int) -> Asperities:
    """Summits and facets of a surface (ny, nx) or profile (nx,) of heights in m.

    1. The mean plane is taken away.
    2. A summit is the highest point within `samples` along either axis, of heights averaged over
       3 x 3 points (noise makes summits of its own on gentle facets), and the highest measured
       point of those nine.
    3. The facets of a summit are the squares of `samples` x `samples` points in the four quadrants
       beside it (in a profile the stretches on its two sides): a plane is fitted to each.
    4. Facets that miss their plane by more than three times the median lie across an edge and are
       left out; the median of the others gives the error of a gradient.
    5. Facets of one summit whose gradients agree within three standard errors are one facet: noise
       has put the summit down beside its true place, and one plane surrounds it.
    6. A summit whose facets together do not fall away from it by six times the error of a gradient
       is a bump of noise and left out with them.

    Summits within `samples` and two of the rim are left out.
    """
    m, dim = samples, z.ndim
    z = _levelled(z)
    smooth = ndimage.uniform_filter(z, 3, mode="nearest")
    ramp = np.arange(z.size).reshape(z.shape) * (1e-12 * float(np.std(z)) / z.size + 1e-300)
    ranked = smooth + ramp  # of equal points one is the summit
    top = ranked == ndimage.maximum_filter(ranked, size=2 * m + 1, mode="nearest")
    rim = m + 2
    summits = np.argwhere(top[tuple(slice(rim, n - rim) for n in z.shape)]) + rim
    summits = _highest_near(z, summits)
    area = float(np.prod([(n - 2 * rim) * spacing for n in z.shape]))
    height = z[tuple(summits.T)]
    _enough(len(summits), m * spacing)
    axis = np.arange(1, m + 1)
    centred = axis - axis.mean()
    arms = m ** (dim - 1) * float(centred @ centred)
    slopes, missed, falls = [], [], []
    for signs in np.ndindex(*(2,) * dim):
        steps = [axis if s == 0 else -axis for s in signs]
        offsets = np.stack(np.meshgrid(*steps, indexing="ij"), -1)  # (m, .., dim)
        index = summits.reshape(-1, *(1,) * dim, dim) + offsets
        patch = z[tuple(np.moveaxis(index, -1, 0))]
        within = tuple(range(1, dim + 1))
        flat = patch - patch.mean(axis=within, keepdims=True)
        gradient = []
        for k in range(dim):
            shape = [1] * (dim + 1)
            shape[k + 1] = m
            arm = centred.reshape(shape) * (1 if signs[k] == 0 else -1)
            g = (flat * arm).sum(axis=within) / arms
            gradient.append(g / spacing)
            flat = flat - arm * g.reshape(-1, *(1,) * dim)
        slopes.append(np.stack(gradient, -1))
        falls.append(-slopes[-1] @ (1 - 2 * np.array(signs)) / np.sqrt(dim))
        missed.append(np.sum(flat**2, axis=within))
    left, count = np.concatenate(missed), m**dim - dim - 1
    keep = left <= 9 * np.median(left)
    # the median of chi^2 with n degrees of freedom is n (1 - 2/(9n))^3
    middle = count * (1 - 2 / (9 * count)) ** 3
    noise = float(np.sqrt(np.median(left) / middle / arms)) / spacing
    sides, gradients = keep.reshape(2**dim, -1), np.stack(slopes)
    fall, kept = np.sum(np.stack(falls) * sides, axis=0), np.sum(sides, axis=0)
    hill = fall > 6 * noise * np.sqrt(np.maximum(kept, 1))
    for first, second in combinations(range(2**dim), 2):
        apart = np.max(np.abs(gradients[first] - gradients[second]), axis=-1)
        sides[second] &= ~(sides[first] & (apart < 3 * np.sqrt(2) * noise))
    keep = sides.ravel()
    _enough(int(hill.sum()), m * spacing)
    keep &= np.tile(hill, 2**dim)
    number = np.cumsum(hill) - 1
    of = np.tile(number, 2**dim)[keep]
    depth = height[hill].max() - height[hill]
    density, slope = int(hill.sum()) / area, np.concatenate(slopes)[keep]
    return Asperities(depth, slope, of, noise, density, m * spacing, summits[hill])


def _enough(summits: int, length: float) -> None:
    if summits < FEWEST:
        raise ValueError(
            f"z has {summits} summits at a sampling length of {length:g} m: at least {FEWEST} are "
            "needed; scan a larger area or change sampling_length"
        )


def _highest_near(z: Array, places: NDArray[np.intp]) -> NDArray[np.intp]:
    """The highest point among the neighbours of each place (n, dim), itself included."""
    steps = np.array(list(np.ndindex(*(3,) * z.ndim))) - 1
    near = places[:, None, :] + steps
    best = np.argmax(z[tuple(np.moveaxis(near, -1, 0))], axis=1)
    return np.asarray(near[np.arange(len(places)), best])


def _levelled(z: Array) -> Array:
    """Heights above the mean plane."""
    axes = [np.linspace(-1.0, 1.0, n) for n in z.shape]
    grid = np.meshgrid(*axes, indexing="ij")
    level = z - z.mean()
    for g in grid:
        level = level - g * (np.sum(g * level) / np.sum(g * g))
    levelled: Array = level
    return levelled
