"""What turning a joint must not change, nor what a law leaves out under an assumption
that holds. And where facets and cells of `"balanced"` stand, from docs/theory-incremental.md alone.

Phi is that of a law without heights there. With heights the tables that a page makes in JavaScript,
by the same section, are held against those of Python (tests/hosts/test_browser.py).
"""

from dataclasses import replace

import numpy as np
import pytest
from builders import increments, law, random_corners
from c_host import random_law

import jointlaw as jl


def run(one, d):
    """Tractions (n, steps, dim) along increments d (n, steps, dim)."""
    joints = one.joints(len(d))
    return np.stack([joints.update(step, tangent=False)[0] for step in np.moveaxis(d, 1, 0)], 1)


def turned(d, angle):
    """Vectors (..., 3) turned about the joint normal."""
    c, s = np.cos(angle), np.sin(angle)
    return d @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def paths(seed, n=4, steps=8):
    return increments(random_corners(np.random.default_rng(seed), n), steps)


@pytest.mark.parametrize("mating_length", [np.inf, 0.3])
def test_motion_in_the_plane_of_an_axis_is_the_half_circle(mating_length):
    more = {"formation": "population", "mating_length": mating_length}
    d = paths(5) * [1.0, 1.0, 0.0]
    whole = run(law(**more), d)
    half = run(law(**more, plane=0.0), d[..., :2])
    scale = np.abs(whole).max()
    # mirror images across the plane carry the same force: only the order of sums differs
    assert np.allclose(half, whole[..., :2], rtol=0.0, atol=1e-12 * scale)
    assert np.allclose(whole[..., 2], 0.0, rtol=0.0, atol=1e-12 * scale)


@pytest.mark.parametrize("azimuth", [0.5, 2.0])
def test_motion_in_any_plane_is_the_half_circle_with_c_cos_2psi(azimuth):
    d = paths(6) * [1.0, 1.0, 0.0]
    errors = []
    for phi in (4, 16, 48):
        rule = jl.Resolution(3, phi, 3)
        full = turned(run(law(c=0.25, b=0.0, resolution=rule), turned(d, azimuth)), -azimuth)
        half = run(law(c=0.25, b=0.0, resolution=rule, plane=azimuth), d[..., :2])
        errors.append(np.abs(half - full[..., :2]).max() / np.abs(full).max())
    # only the places of the azimuths differ: (1/48)^2 = 4e-4 of what they resolve. A wrong c would
    # be off by several per cent at any number. Contacts that slip one by one make it waver
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 1e-4


# The full law sums the same terms over all azimuths, a reduced one over one of them: what differs
# is the rounding of a few hundred sums, carried along the path.
EXACT = 1e-12


def followed(law, d):
    """F1, C11, measures and ledger of a batch along closure increments d (steps, n)."""
    batch, rows = law.joints(d.shape[1]), []
    for closing in d:
        step = np.zeros((d.shape[1], law.tables.dim))
        step[:, 0] = closing
        F, C = batch.update(step)
        rows.append([F[:, 0], C[:, 0, 0], *batch.measures(), batch.dissipated_energy])
    return np.array(rows)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 8, 12])
def test_closure_only_is_the_whole_law_on_a_path_of_closure(seed):
    """Traction, tangent, energies and shares, against the law in 3-D and in a plane."""
    d, law = 1e-6 * paths(seed, 7)[..., 0].T, random_law(seed)
    short = replace(law, plane=None, closure_only=True)
    assert len(short.facets.weight) == law.resolution.u
    found = followed(short, d)
    peak = np.abs(found).max(axis=(0, 2))
    for plane in (None, 0.9):
        full = followed(replace(law, plane=plane), d)
        gap = np.abs(found - full).max(axis=(0, 2)) / np.where(peak > 0, peak, 1.0)
        assert np.delete(gap, 1).max() < EXACT
        # C holds second differences of G in the few facets that hardly move: see test_kernels.py
        assert gap[1] < 2e-6
        assert np.median(np.abs(found - full)[:, 1]) < EXACT * peak[1]


def test_closure_only_is_refused_where_joints_shear():
    law = replace(random_law(2), plane=None, closure_only=True)
    for use in (
        lambda: replace(law, plane=0.0),
        lambda: jl.direct_shear(law.joint(), to=0.1, normal=0.1),
        lambda: jl.tabulate(law, shear_limit=1.0),
    ):
        with pytest.raises(ValueError, match="closure_only"):
            use()


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
