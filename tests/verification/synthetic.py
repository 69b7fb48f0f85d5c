"""Surfaces whose asperities are known, to test what is read from a scan."""

import numpy as np


def synthetic_surface(orientation, heights, n=24, spacing=20e-6, noise=0.3e-6, seed=0, samples=20):
    """Heights (n samples, n samples) in m of a surface drawn from the law's densities.

    Every square of `samples` x `samples` points carries one asperity at a random place near its
    middle, its summit at a depth from `heights`; in each of its four quadrants one plane facet
    falls away from it, of an inclination and azimuth from `orientation`. noise: standard deviation
    of a height in m.
    """
    rng = np.random.default_rng(seed)
    z = np.empty((n, samples, n, samples))
    depth = rng.gamma(heights.alpha + 1, heights.beta, (n, n))
    place = np.arange(samples) - samples // 2
    for i, j in np.ndindex(n, n):
        off = rng.integers(-1, 2, 2)
        y, x = np.meshgrid(place - off[0], place - off[1], indexing="ij")
        theta, phi = draw_directions(orientation, 4, rng)
        quadrant = (x < 0).astype(int) + 2 * (y < 0)
        # the azimuth in the first quadrant that has the same cos 2 phi
        folded = np.arctan2(np.abs(np.sin(phi)), np.abs(np.cos(phi)))
        slope, azimuth = np.tan(theta)[quadrant], folded[quadrant]
        fall = slope * (np.abs(x) * np.cos(azimuth) + np.abs(y) * np.sin(azimuth))
        z[i, :, j, :] = -depth[i, j] - spacing * fall
    z = z.reshape(n * samples, n * samples)
    return z + noise * rng.standard_normal(z.shape)


def draw_directions(orientation, n, rng):
    """Inclinations and azimuths (n,) in rad drawn from Eq. 14, by rejection in u = cos(a theta)."""
    b, c = orientation.b, orientation.c
    u, phi = rng.uniform(size=60 * n), rng.uniform(0, 2 * np.pi, 60 * n)
    density = 1 + b / 2 * (3 * u**2 - 1) + 3 * c * (1 - u**2) * np.cos(2 * phi)
    highest = 1 + max(b, -b / 2) + 3 * abs(c)
    keep = np.flatnonzero(rng.uniform(size=60 * n) * highest < density)[:n]
    return np.arccos(u[keep]) / orientation.a, phi[keep]
