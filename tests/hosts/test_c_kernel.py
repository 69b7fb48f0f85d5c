"""The law in C gives the bits of the law in Python, and turns the axes of a joint."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from c_host import FAST, CLaw, at, library, random_law, random_path

import jointlaw as jl
from jointlaw.kernels import reference
from jointlaw.kernels.asperities import effective_closure

BUILDS = {  # test_native.py tells the same of the library, which is made of the same text
    "gcc": ("gcc", [*FAST, "-std=c99"]),
    "gcc -O0, no vectors": ("gcc", ["-O0", "-ffp-contract=off", "-DJOINTLAW_PLAIN"]),
    "gcc, this machine": ("gcc", [*FAST, "-std=c99", "-march=native", "-DJOINTLAW_MANY"]),
    "clang, this machine": ("clang", [*FAST, "-march=native", "-DJOINTLAW_MANY"]),
    "C++": ("g++", [*FAST, "-std=c++17", "-march=x86-64-v3", "-DJOINTLAW_MANY"]),
}


def many_are_one_by_one(built, one, law):
    """21 joints of an array, each on a path of its own, until the step of one is refused."""
    n, rows, dim = 21, len(one.state), one.dim
    states, F, C = np.zeros((n, rows + 3)), np.zeros((n, dim)), np.zeros((n, dim, dim))
    paths = np.array([random_path(dim, seed, 12) for seed in range(n)])
    joints = law.joints(n)
    for step in range(12):
        d, tangent = np.ascontiguousarray(paths[:, step]), step % 2
        stopped = n if step < 11 else 13
        d[stopped:] = np.nan
        moved = built.jlaw_update_many(one.law, at(states), ctypes.c_size_t(rows + 3), at(d), at(F),
                                       at(C) if tangent else None, ctypes.c_size_t(n))  # fmt: skip
        assert moved == stopped
        asked = joints.update(d[:moved], where=np.arange(moved), tangent=bool(tangent))
        for a, b in zip((F, C), asked, strict=True):
            assert b is None or (a[:moved] == b).all()
        np.testing.assert_array_equal(states[:, :rows], joints.snapshot().values)
        assert not states[:, rows:].any()


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    cc, flags = BUILDS["gcc"]
    return library(tmp_path_factory.mktemp("c"), *flags, cc=cc)


@pytest.mark.parametrize("name", BUILDS)
def test_the_bits_of_python(lib, tmp_path, name):
    """F, C, state, energies and shares; the state of a Python joint goes on in C."""
    cc, flags = BUILDS[name]
    built = lib if name == "gcc" else library(tmp_path, *flags, cc=cc)
    for seed in (0, 3, 7, 10, 13, 14, 20):  # yielding, wear and both, mating length, planes
        law = random_law(seed)
        one, joint = CLaw(built, law, tmp_path), law.joint()
        path = random_path(one.dim, seed)
        for step in path[:10]:
            joint.update(step)
        one.state[:] = joint.snapshot().values[0]
        for step in path[10:]:
            for a, b in zip(one.step(step), joint.update(step), strict=True):
                np.testing.assert_array_equal(a, b)
            np.testing.assert_array_equal(one.state, joint.snapshot().values[0])
            shares = joint.measures()[:3]
            assert one.shares() == pytest.approx(shares, abs=1e-9)
            energies = [
                f(one.law, at(one.state)) for f in (built.jlaw_stored, built.jlaw_dissipated)
            ]
            asked = [joint.stored_energy, joint.dissipated_energy]
            assert energies == pytest.approx(asked, rel=1e-12, abs=1e-300)
        many_are_one_by_one(built, one, law)


def test_coulomb(lib, tmp_path):
    """Pressed, then sheared in space: kn u, and ks s up to c + mu sigma; the tangent of each."""
    law = jl.CoulombLaw(normal_stiffness=1e12, shear_stiffness=5e11, friction=0.6, cohesion=1e5)
    one, way, slip = CLaw(lib, law, tmp_path), np.array([0.6, 0.8]), 0.0
    assert one.step([2e-6, 0.0, 0.0])[0] == pytest.approx([2e6, 0.0, 0.0])
    for k in range(1, 11):
        F, C = one.step([0.0, *(5e-7 * way)])
        slip += 5e-7
        shear = min(5e11 * slip, 1e5 + 0.6 * 2e6)
        assert pytest.approx([2e6, *(shear * way)], rel=1e-12) == F
        assert way @ C[1:, 0] == pytest.approx(0.6e12 * (k > 5), abs=1.0)
    lost = shear * (slip - shear / 5e11)
    assert lib.jlaw_dissipated(one.law, at(one.state)) == pytest.approx(lost, rel=1e-12)


@pytest.mark.parametrize("seed", [0, 1, 3, 6, 15, 20])
def test_the_unsheared_joint(lib, tmp_path, seed):
    law = random_law(seed)
    joint = CLaw(lib, law, tmp_path)
    for closure in (-1e-6, 0.0, 1e-9, 3e-7, 2e-6):
        stress = lib.jlaw_normal_stress(joint.law, closure)
        assert stress == pytest.approx(law.normal_stress(closure), rel=1e-13)
        bound = lib.jlaw_max_stiffness(joint.law, closure)
        assert bound == pytest.approx(law.max_stiffness(closure), rel=1e-12)
    for stress in (0.0, 1e3, 5e6):
        assert lib.jlaw_closure(joint.law, stress) == pytest.approx(law.closure(stress), rel=1e-12)
    for bad in (np.nan, -1.0, np.inf):
        assert np.isnan(lib.jlaw_closure(joint.law, bad))
    assert np.isnan(lib.jlaw_normal_stress(joint.law, 2 * law.largest_reach))
    assert lib.jlaw_fingerprint(joint.law).decode() == law.fingerprint
    fades = np.isfinite(law.mating_length)
    joint.state[:] = 1.0  # what was there before is gone
    assert lib.jlaw_unmated(joint.law, at(joint.state)) == (0 if fades else -1)
    apart = law.joint(mated=law.bond is None and not fades).snapshot()
    np.testing.assert_array_equal(joint.state, apart.values[0])


def test_a_refused_step_moves_nothing_and_tells_why(lib, tmp_path):
    joint = CLaw(lib, random_law(0), tmp_path)
    joint.step(np.full(joint.dim, 1e-7))
    before = joint.state.copy()
    cases = {
        np.nan: "is not finite; nothing was moved",
        -np.inf: "is not finite; nothing was moved",
        1e200: "beyond the reach of .* m, where forces overflow; nothing was moved. Take a smaller",
    }
    for bad, words in cases.items():
        for slot in range(joint.dim):
            d = np.full(joint.dim, 1e-8)
            d[slot] = bad
            with pytest.raises(ValueError, match=words):
                joint.step(d)
            np.testing.assert_array_equal(joint.state, before)
    joint.state[0] = np.nan
    with pytest.raises(ValueError, match="the state holds numbers that are not finite"):
        joint.step(np.full(joint.dim, 1e-8))


# ----------------------------------------------------------------- turned axes


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def isotropic(phi, mating_length=np.inf):
    return jl.JointLaw(
        orientation=jl.Orientation(3.0, 0.4),
        asperity=jl.Asperity(2e8, 1.2, 0.5, 0.4),
        asperity_density=1e10,
        closure_range=1e-6,
        mating_length=mating_length,
        resolution=jl.Resolution(2, phi, 3),
    )


@pytest.mark.parametrize("mating_length", [np.inf, 8e-7])
def test_axes_turned_by_whole_azimuths(lib, tmp_path, mating_length):
    """Turning the axes in mid-path is the path in turned axes from the start."""
    law = isotropic(4, mating_length)
    one, two = CLaw(lib, law, tmp_path), CLaw(lib, law, tmp_path)
    d = random_path(3, 5, 30)
    for places in (1, -3, 4):
        one.state[:], two.state[:] = 0.0, 0.0
        angle = places * np.pi / 4
        R = turned(angle)
        for step in d[:15]:
            one.step(step)
            two.step(R @ step)
        lib.jlaw_rotate(one.law, at(one.state), angle)
        scale = np.abs(two.state).max()
        assert np.abs(one.state - two.state).max() < 1e-11 * scale
        for step in d[15:]:
            F, _ = one.step(R @ step)
            F_two, _ = two.step(R @ step)
            assert np.abs(F - F_two).max() <= 1e-11 * np.abs(F_two).max() + 1e-6


def sheared(joint, law):
    """Energy of the shear springs: what is stored, less the normal springs."""
    k = law.tables.asperities
    now = reference.parts(law.tables, joint.state[:, None])
    y = effective_closure(k, now.delta, now.slopes)
    squeezed = k.curve.energy(y)
    if k.yields:
        squeezed = squeezed - k.curve.energy(now.depth)
        squeezed -= k.curve.force(now.depth)[0] * (y - now.depth)
        squeezed = np.where(y > now.depth, squeezed, 0.0)
    normal = np.sum((k.area * k.c1)[:, None] * squeezed)
    return joint.lib.jlaw_stored(joint.law, at(joint.state)) - normal


@pytest.mark.parametrize("damage", [{}, {"yield_interference": 1e-7}])
def test_axes_turned_between_azimuths(lib, tmp_path, damage):
    """Traction in turned axes: the better, the more azimuths. Sliders gain no energy."""
    errors = []
    for phi in (4, 8, 16):
        law = isotropic(phi)
        law = replace(law, asperity=replace(law.asperity, **damage))
        joint = CLaw(lib, law, tmp_path)
        for _ in range(5):
            F, _ = joint.step([1e-7, 5e-8, 2e-8])
        depths = slice(-1 - len(law.tables.asperities.c1), -1)  # where asperities yield
        deepest, size = joint.state[depths].max(), np.hypot(*joint.state[1:3])
        before, lost = sheared(joint, law), joint.state[3]
        lib.jlaw_rotate(joint.law, at(joint.state), 0.3)
        F_turned, _ = joint.step(np.zeros(3), keep=False)
        errors.append(np.abs(F_turned - turned(0.3) @ F).max() / np.abs(F).max())
        assert joint.state[3] >= lost
        assert sheared(joint, law) + joint.state[3] == pytest.approx(before + lost, rel=1e-12)
        assert np.hypot(*joint.state[1:3]) == pytest.approx(size, rel=1e-15)
        if damage:
            assert 0 < joint.state[depths].max() <= deepest
    assert errors[2] < errors[1] < errors[0]
    # depths between azimuths lie on straight lines, off by an eighth of the square of the spacing
    assert errors[2] < (5e-3 if damage else 2e-3)


@pytest.mark.parametrize("seed", [1, 2, 4, 7, 9])
def test_bodies_that_change_their_roles(lib, tmp_path, seed):
    """Exact for every law: shear along axis 2 changes its sign, along axis 3 not."""
    law = random_law(seed)
    one, two = CLaw(lib, law, tmp_path), CLaw(lib, law, tmp_path)
    sign = np.array([1.0, -1.0, 1.0])[: one.dim]
    d = random_path(one.dim, seed, 30)
    for step in d[:15]:
        one.step(step)
        two.step(sign * step)
    lib.jlaw_swap_bodies(one.law, at(one.state))
    assert np.abs(one.state - two.state).max() <= 1e-11 * np.abs(two.state).max()
    peak = 1e-300
    for step in d[15:]:
        F, _ = one.step(step)
        F_two, _ = two.step(step)
        peak = max(peak, np.abs(F_two).max())
        assert np.abs(F - F_two).max() < 1e-11 * peak
