"""Symmetries: a rotated joint, and laws that leave out motion that does not occur. Facets and cells
of `"balanced"`, computed from docs/theory-incremental.md alone.

These facets are of a law without heights. With heights the tables that a page computes in
JavaScript are compared with the tables of Python (tests/hosts/test_browser.py).
"""

from dataclasses import replace

import numpy as np
import pytest
from builders import increments, law, random_corners
from c_host import random_law

import jointlaw as jl


def tractions(one, d):
    """Tractions (n, steps, dim) along increments d (n, steps, dim)."""
    joints = one.joints(len(d))
    return np.stack([joints.update(step, tangent=False)[0] for step in np.moveaxis(d, 1, 0)], 1)


def rotated(d, angle):
    """Vectors (..., 3) rotated about the joint normal."""
    c = np.cos(angle)
    s = np.sin(angle)
    return d @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def random_increments(seed, n=4, steps=8):
    """Increments (n, legs * steps, 3) of random paths."""
    return increments(random_corners(np.random.default_rng(seed), n), steps)


@pytest.mark.parametrize("mating_length", [np.inf, 0.3])
def test_a_plane_on_a_symmetry_axis_equals_the_law_in_3d(mating_length):
    parameters = {"formation": "population", "mating_length": mating_length}
    d = random_increments(5) * [1.0, 1.0, 0.0]
    spatial = tractions(law(**parameters), d)
    planar = tractions(law(**parameters, plane=0.0), d[..., :2])
    scale = np.abs(spatial).max()
    # mirror images across the plane have the same force: only the order of sums differs
    assert np.allclose(planar, spatial[..., :2], rtol=0.0, atol=1e-12 * scale)
    assert np.allclose(spatial[..., 2], 0.0, rtol=0.0, atol=1e-12 * scale)


@pytest.mark.parametrize("azimuth", [0.5, 2.0])
def test_any_plane_converges_to_the_law_in_3d(azimuth):
    d = random_increments(6) * [1.0, 1.0, 0.0]
    errors = []
    for phi in (4, 16, 48):
        one = law(c=0.25, b=0.0, resolution=jl.Resolution(3, phi, 3))
        spatial = rotated(tractions(one, rotated(d, azimuth)), -azimuth)
        planar = tractions(replace(one, plane=azimuth), d[..., :2])
        errors.append(np.abs(planar - spatial[..., :2]).max() / np.abs(spatial).max())
    # only the azimuths of the facets differ: an error of (1/48)^2 = 4e-4 of the resolved variation.
    # A wrong c would err by several per cent at any number. Contacts that slip one after the other
    # make the error irregular
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 1e-4


# The law in 3-D sums the same terms over all azimuths, a reduced law over one of them: they differ
# by the rounding of a few hundred sums, accumulated along the path.
ROUNDING = 1e-12


def follow_closure(law, d):
    """F1, C11, measures and dissipated energy of a batch along closure increments d (steps, n)."""
    batch = law.joints(d.shape[1])
    rows = []
    for closing in d:
        step = np.zeros((d.shape[1], law.tables.dim))
        step[:, 0] = closing
        F, C = batch.update(step)
        rows.append([F[:, 0], C[:, 0, 0], *batch.measures(), batch.dissipated_energy])
    return np.array(rows)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 8, 12])
def test_closure_only_equals_the_full_law_on_paths_of_closure(seed):
    """Traction, tangent, energies and fractions, against the law in 3-D and in a plane."""
    d = 1e-6 * random_increments(seed, 7)[..., 0].T
    law = random_law(seed)
    reduced_law = replace(law, plane=None, closure_only=True)
    assert len(reduced_law.facets.weight) == law.resolution.u
    reduced = follow_closure(reduced_law, d)
    peak = np.abs(reduced).max(axis=(0, 2))
    for plane in (None, 0.9):
        full = follow_closure(replace(law, plane=plane), d)
        error = np.abs(reduced - full).max(axis=(0, 2)) / np.where(peak > 0, peak, 1.0)
        assert np.delete(error, 1).max() < ROUNDING
        # C has second differences of G in the facets that hardly move
        assert error[1] < 2e-6
        assert np.median(np.abs(reduced - full)[:, 1]) < ROUNDING * peak[1]


def test_closure_only_is_refused_where_joints_shear():
    law = replace(random_law(2), plane=None, closure_only=True)
    with pytest.raises(ValueError, match="closure_only"):
        replace(law, plane=0.0)
    with pytest.raises(ValueError, match="closure_only"):
        jl.direct_shear(law.joint(), to=0.1, normal=0.1)
    with pytest.raises(ValueError, match="closure_only"):
        jl.tabulate(law, shear_limit=1.0)


def facets_of_the_page(law):
    """theta, phi, weight and the first depths of the cells of each facet."""
    o = law.orientation
    has_short_mating_length = law.mating_length < 2.5 * law.closure_range
    rings, phi, depth = (2, 4, 4) if has_short_mating_length else (3, 6, 3)
    s = 2 if phi % 4 == 0 else 1
    theta = np.array(list(dict.fromkeys(law.facets.theta)))  # tested by test_nodes.py
    w = np.array([law.facets.weight[law.facets.theta == ring].sum() for ring in theta])
    u = np.cos(o.a * theta)
    assert len(theta) == rings
    x = phi - phi / 2 * np.arange(rings) / (rings - 1)
    m = np.maximum(2 + s, s * np.ceil(x / s - 0.5)).astype(int)
    cells = np.maximum(np.rint(depth * np.cbrt((w / m) / max(w / m))), 1).astype(int)
    f = min(max(max(cells) / 8, 1), 2)
    largest_depth = law.closure_range * (1 + f * np.minimum(np.tan(theta), 10))
    z = max(largest_depth) * (np.arange(513) / 512) ** 4
    middle = (z[1:] + z[:-1]) / 2
    # Phi = z^1.5; `lowest` is 1: no z lies beyond
    density = np.sqrt(0.75 * middle**-0.5) * (middle**1.5) ** -0.15
    R = density * np.diff(z) / np.sum(density * np.diff(z)) + 1e-6 * np.diff(z) / z[-1]
    R = np.concatenate([[0.0], np.cumsum(R)])
    lean = 3 * o.c * (1 - u**2) / (1 + o.b / 2 * (3 * u**2 - 1))
    for k in range(rings):
        positions = np.interp(largest_depth[k], z, R) * np.arange(cells[k]) / (cells[k] + 0.8)
        for azimuth in np.arange(2 * m[k]) * np.pi / m[k]:
            weight = w[k] / (2 * m[k]) * (1 + lean[k] * np.cos(2 * azimuth))
            yield theta[k], azimuth, weight, np.interp(positions, R, z)


@pytest.mark.parametrize("mating", [np.inf, 2.0])
def test_facets_and_cells_of_balanced_follow_from_the_page(mating):
    law = jl.presets.load("nonlinear-a3")
    law = replace(law, orientation=jl.Orientation(2.7, 0.4, 0.15), closure_range=None)
    law = replace(law, mating_length=mating * law.closure_range, resolution="balanced")
    theta, phi, weight, depths = zip(*facets_of_the_page(law), strict=True)
    k = law.tables.asperities
    np.testing.assert_allclose(k.theta, theta, rtol=1e-12)
    np.testing.assert_allclose(law.facets.phi, phi, rtol=1e-12)
    np.testing.assert_allclose(k.weight, weight, rtol=1e-12)
    for expected, depth in zip(depths, k.cell_depth, strict=True):
        np.testing.assert_allclose(depth[1 : len(expected)], expected[1:], rtol=1e-12)
        assert depth[len(expected)] > 1e290  # no more cells
    assert k.sliders == sum(map(len, depths))
