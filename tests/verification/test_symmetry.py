"""What turning and mirroring a joint must not change."""

import numpy as np
import pytest
from builders import increments, law, random_corners

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


@pytest.mark.parametrize("mirror", [[1.0, 1.0, -1.0], [1.0, -1.0, 1.0]])
def test_mirror_images_across_the_principal_axes(mirror):
    one = law(c=-0.2, formation="population", mating_length=0.8)
    d = paths(3)
    F = run(one, d)
    # cos 2 phi is even about both axes, and so are the azimuths: rounding
    assert np.allclose(run(one, d * mirror), F * mirror, rtol=0.0, atol=1e-12 * np.abs(F).max())


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
