"""The law in C gives the bits of the law in Python, and turns the axes of a joint."""

import ctypes

import numpy as np
import pytest
from c_host import FAST, CLaw, at, library, random_law, random_path
from kinds import LAWS, make_law

import jointlaw as jl

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
    laws = map(random_law, (0, 3, 7, 10, 13, 14, 20))  # yielding, wear and both, planes
    for seed, law in enumerate([LAWS["coulomb"], LAWS["coulomb in a plane"], *laws]):
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
            with pytest.raises(ValueError, match=words):
                joint.step(np.where(np.arange(joint.dim) == slot, bad, 1e-8))
            np.testing.assert_array_equal(joint.state, before)
    joint.state[0] = np.nan
    with pytest.raises(ValueError, match="the state holds numbers that are not finite"):
        joint.step(np.full(joint.dim, 1e-8))


# ----------------------------------------------------------------- turned axes


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def isotropic(phi, **changes):
    resolution = jl.Resolution(2, phi, 3)
    return make_law(b=0.4, c=0.0, mu=0.4, heights=None, resolution=resolution, **changes)


def as_from_the_start(lib, law, folder, seed, R, turn, *angle):
    """What is turned in mid-path goes on as what has moved in axes R from the start."""
    one, two = CLaw(lib, law, folder), CLaw(lib, law, folder)
    path = random_path(law.dim, seed, 30)
    for step in path[:15]:
        one.step(step)
        two.step(R @ step)
    turn(one.law, at(one.state), *angle)
    F, F_two = ([joint.step(step)[0] for step in path[15:]] for joint in (one, two))
    for mine, other in ((one.state, two.state), (F, F_two)):
        assert np.abs(np.subtract(mine, other)).max() <= 1e-11 * np.abs(other).max()


@pytest.mark.parametrize("mating_length", [np.inf, 8e-7])
@pytest.mark.parametrize("places", [1, -3, 4])
def test_axes_turned_by_whole_azimuths(lib, tmp_path, mating_length, places):
    law, angle = isotropic(4, mating_length=mating_length), places * np.pi / 4
    as_from_the_start(lib, law, tmp_path, 5, turned(angle), lib.jlaw_rotate, angle)


@pytest.mark.parametrize("seed", [1, 2, 4, 7, 9])
def test_bodies_that_change_their_roles(lib, tmp_path, seed):
    """Exact for every law: shear along axis 2 changes its sign, along axis 3 not."""
    law = random_law(seed)
    sign = np.diag([1.0, -1.0, 1.0][: law.dim])
    as_from_the_start(lib, law, tmp_path, seed, sign, lib.jlaw_swap_bodies)


def in_sliders(joint, sliders):
    """Energy stored in the shear springs, whose forces are these rows of the state."""
    without = joint.state.copy()
    without[sliders] = 0.0
    return np.subtract(*(joint.lib.jlaw_stored(joint.law, at(s)) for s in (joint.state, without)))


@pytest.mark.parametrize("damage", [{}, {"yield_interference": 1e-7}])
def test_axes_turned_between_azimuths(lib, tmp_path, damage):
    """Traction in turned axes: the better, the more azimuths. Sliders gain no energy."""
    errors = []
    for phi in (4, 8, 16):
        law = isotropic(phi, damage=damage)
        joint, end = CLaw(lib, law, tmp_path), 4 + law.tables.names["q"]
        for _ in range(5):
            F, _ = joint.step([1e-7, 5e-8, 2e-8])
        sliders, depths = slice(4, end), slice(end, -1)
        stored, before = in_sliders(joint, sliders), joint.state.copy()
        lib.jlaw_rotate(joint.law, at(joint.state), 0.3)
        F_turned, _ = joint.step(np.zeros(3), keep=False)
        errors.append(np.abs(F_turned - turned(0.3) @ F).max() / np.abs(F).max())
        lost = joint.state[3] - before[3]
        assert lost >= 0.0
        assert in_sliders(joint, sliders) + lost == pytest.approx(stored, rel=1e-12)
        assert np.hypot(*joint.state[1:3]) == pytest.approx(np.hypot(*before[1:3]), rel=1e-15)
        if damage:
            assert 0 < joint.state[depths].max() <= before[depths].max()
    assert errors[2] < errors[1] < errors[0]
    # depths between azimuths lie on straight lines, off by an eighth of the square of the spacing
    assert errors[2] < (5e-3 if damage else 2e-3)
