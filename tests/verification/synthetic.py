"""Surfaces whose asperities are known, to test what is read from a scan."""

import numpy as np

from jointlaw import GammaHeights, Orientation


def synthetic_surface(
    orientation: Orientation,
    heights: GammaHeights,
    *,
    rows: int = 24,
    columns: int = 24,
    spacing: float = 5e-6,
    samples: int = 20,
    noise: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """Heights (rows*samples, columns*samples) in m of a surface drawn from the law's densities.

    Every square of `samples` x `samples` points carries one asperity at a random place near its
    middle, its summit at a depth from `heights`; in each of its four quadrants one plane facet
    falls away from it, of an inclination and azimuth from `orientation`.

    Parameters
    ----------
    orientation, heights: the densities (overlap and formation do not matter).
    rows, columns: asperities along y and x; spacing: of the points in m; samples: points per
        asperity along either axis, >= 14; noise: standard deviation of a height in m.
    seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    z = np.empty((rows * samples, columns * samples))
    depth = rng.gamma(heights.alpha + 1, heights.beta, (rows, columns))
    place = np.arange(samples) - samples // 2
    for i in range(rows):
        for j in range(columns):
            off = rng.integers(-1, 2, 2)
            y, x = np.meshgrid(place - off[0], place - off[1], indexing="ij")
            theta, phi = draw_directions(orientation, 4, rng)
            quadrant = (x < 0).astype(int) + 2 * (y < 0)
            # the azimuth in the first quadrant that has the same cos 2 phi
            folded = np.arctan2(np.abs(np.sin(phi)), np.abs(np.cos(phi)))
            slope, azimuth = np.tan(theta)[quadrant], folded[quadrant]
            fall = slope * (np.abs(x) * np.cos(azimuth) + np.abs(y) * np.sin(azimuth))
            block = -depth[i, j] - spacing * fall
            z[i * samples : (i + 1) * samples, j * samples : (j + 1) * samples] = block
    z += noise * rng.standard_normal(z.shape)
    return z


def draw_directions(
    orientation: Orientation, n: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Inclinations and azimuths (n,) in rad drawn from Eq. 14, by rejection in u = cos(a theta)."""
    b, c = orientation.b, orientation.c
    highest = 1 + max(b, -b / 2) + 3 * abs(c)
    u, phi = np.empty(0), np.empty(0)
    while u.size < n:
        ut, pt = rng.uniform(size=4 * n + 16), rng.uniform(0, 2 * np.pi, 4 * n + 16)
        density = 1 + b / 2 * (3 * ut**2 - 1) + 3 * c * (1 - ut**2) * np.cos(2 * pt)
        keep = rng.uniform(size=ut.size) * highest < density
        u, phi = np.concatenate([u, ut[keep]]), np.concatenate([phi, pt[keep]])
    return np.arccos(u[:n]) / orientation.a, phi[:n]
