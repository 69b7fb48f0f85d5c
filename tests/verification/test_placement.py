"""`"balanced"` from docs/theory-incremental.md alone: where facets and cells stand.

Phi is that of a law without heights. With heights
the tables that a page makes in JavaScript, by the same section, are held against those of Python
(tests/hosts/test_browser.py).
"""

from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl


def placed(law):
    """theta, phi, weight and the beginnings of cells of each facet."""
    o, (rings, phi, depth) = law.orientation, (3, 6, 3)
    if law.mating_length < 2.5 * law.closure_range:
        rings, phi, depth = 2, 4, 4
    s = 2 if phi % 4 == 0 else 1
    theta = np.array(list(dict.fromkeys(law.facets.theta)))  # those that test_nodes.py holds
    w = np.array([law.facets.weight[law.facets.theta == ring].sum() for ring in theta])
    u = np.cos(o.a * theta)
    assert len(theta) == rings
    x = phi - phi / 2 * np.arange(rings) / (rings - 1)
    m = np.maximum(2 + s, s * np.ceil(x / s - 0.5)).astype(int)
    cells = np.maximum(np.rint(depth * np.cbrt((w / m) / max(w / m))), 1).astype(int)
    f = min(max(max(cells) / 8, 1), 2)
    reach = law.closure_range * (1 + f * np.minimum(np.tan(theta), 10))
    z = max(reach) * (np.arange(513) / 512) ** 4
    middle = (z[1:] + z[:-1]) / 2
    # Phi = z^1.5; `lowest` is 1: no z lies beyond
    density = np.sqrt(0.75 * middle**-0.5) * (middle**1.5) ** -0.15
    R = density * np.diff(z) / np.sum(density * np.diff(z)) + 1e-6 * np.diff(z) / z[-1]
    R = np.concatenate([[0.0], np.cumsum(R)])
    lean = 3 * o.c * (1 - u**2) / (1 + o.b / 2 * (3 * u**2 - 1))
    for k in range(rings):
        at = np.interp(reach[k], z, R) * np.arange(cells[k]) / (cells[k] + 0.8)
        for azimuth in np.arange(2 * m[k]) * np.pi / m[k]:
            weight = w[k] / (2 * m[k]) * (1 + lean[k] * np.cos(2 * azimuth))
            yield theta[k], azimuth, weight, np.interp(at, R, z)


@pytest.mark.parametrize("mating", [np.inf, 2.0])
def test_balanced_from_the_page_alone(mating):
    law = jl.presets.load("nonlinear-a3")
    law = replace(law, orientation=jl.Orientation(2.7, 0.4, 0.15), closure_range=None)
    law = replace(law, mating_length=mating * law.closure_range, resolution="balanced")
    theta, phi, weight, begin = zip(*placed(law), strict=True)
    k = law.tables.asperities
    np.testing.assert_allclose(k.theta, theta, rtol=1e-12)
    np.testing.assert_allclose(law.facets.phi, phi, rtol=1e-12)
    np.testing.assert_allclose(k.weight, weight, rtol=1e-12)
    for mine, its in zip(begin, k.depth, strict=True):
        np.testing.assert_allclose(its[1 : len(mine)], mine[1:], rtol=1e-12)
        assert its[len(mine)] > 1e290  # no more of them
    assert k.sliders == sum(map(len, begin))
