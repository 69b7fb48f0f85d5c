"""The law in C is bitwise identical to the law in Python, and rotates the axes of a joint.

Each declared parameter is tested at a value off its default, by header and by table file.
"""

import contextlib
import ctypes
import hashlib

import numpy as np
import pytest
from c_host import FAST, CLaw, at, library, random_law, random_path
from kinds import LAWS, PARAMETERS, ExponentialHeights, make_law, off_default

import jointlaw as jl
from jointlaw.hosts.c.export import header_text

BUILDS = {  # test_native.py tells the same of the library, which is made of the same text
    "gcc": ("gcc", [*FAST, "-std=c99"]),
    "gcc -O0, no vectors": ("gcc", ["-O0", "-ffp-contract=off", "-DJOINTLAW_SCALAR"]),
    "gcc, this machine": ("gcc", [*FAST, "-std=c99", "-march=native", "-DJOINTLAW_MANY"]),
    "clang, this machine": ("clang", [*FAST, "-march=native", "-DJOINTLAW_MANY"]),
    "C++": ("g++", [*FAST, "-std=c++17", "-march=x86-64-v3", "-DJOINTLAW_MANY"]),
}
DECLARED = [off_default(name)[0] for name in PARAMETERS]
DECLARED.append(make_law(heights=ExponentialHeights(1e-6)))  # without parameters as TOML
DECLARED.append(LAWS["bond and filling"])
DECLARED.append(random_law(6))  # heights of a density that is infinite at the point of contact
OTHER_ELEMENTS = "coulomb", "coulomb in a plane", "bond and filling"
CONSTANTS = """#include "law_{0}.h"
const jlaw_law *constants_{0}(void);
const jlaw_law *constants_{0}(void) {{ return &law_{0}; }}
"""


def digest(states):
    """Hash of the bytes of states, which tells 0.0 from -0.0, as a hashed checkpoint does."""
    return hashlib.sha256(np.ascontiguousarray(states).tobytes()).hexdigest()


def many_are_one_by_one(built, one, law):
    """Advance 21 joints of an array, each on its own path, until the step of one is invalid."""
    n = 21
    rows = len(one.state)
    dim = one.dim
    states = np.zeros((n, rows + 3))
    F = np.zeros((n, dim))
    C = np.zeros((n, dim, dim))
    paths = np.array([random_path(dim, seed, 12) for seed in range(n)])
    joints = law.joints(n)
    for step in range(12):
        d = np.ascontiguousarray(paths[:, step])
        tangent = step % 2
        stopped = n if step < 11 else 13
        d[stopped:] = np.nan
        stride = ctypes.c_size_t(rows + 3)
        out = at(F), at(C) if tangent else None
        advanced = built.jlaw_update_many(
            one.law, at(states), stride, at(d), *out, ctypes.c_size_t(n)
        )
        assert advanced == stopped
        expected = joints.update(d[:advanced], where=np.arange(advanced), tangent=bool(tangent))
        for a, b in zip((F, C), expected, strict=True):
            assert b is None or (a[:advanced] == b).all()
        assert digest(states[:, :rows]) == digest(joints.snapshot().values)
        assert not states[:, rows:].any()


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    """The law in C, with the tables of all declared parameters as constants."""
    folder = tmp_path_factory.mktemp("c")
    for i, law in enumerate(DECLARED):
        (folder / f"law_{i}.h").write_text(header_text(law, f"law_{i}"))
    more = "".join(map(CONSTANTS.format, range(len(DECLARED))))
    flags = "-O1", "-DJOINTLAW_SCALAR", "-ffp-contract=off", f"-I{folder}"
    return library(folder, *flags, more=more)


def goes_as_in_python(one, law, seed):
    """Compare F, C, state, energies and fractions; the run starts in Python and continues in C."""
    path = random_path(one.dim, seed)
    joint = law.joint()
    for step in path[:10]:
        joint.update(step)
    one.state[:] = joint.snapshot().values[0]
    for step in path[10:]:
        results = one.step(step)
        for a, b in zip(results, joint.update(step), strict=True):
            np.testing.assert_array_equal(a, b)
        assert digest(one.state) == digest(joint.snapshot().values[0])
        for traction in (traction_without_step(one), joint.F):
            np.testing.assert_array_equal(traction, results[0])
        shares, energies = np.split(one.measures(), [3])
        assert shares == pytest.approx(joint.measures()[:3], abs=1e-9)
        expected = [joint.stored_energy, joint.dissipated_energy]
        assert energies == pytest.approx(expected, rel=1e-12, abs=1e-300)


def traction_without_step(one):
    """`jlaw_traction` of the state, which must stay as it is."""
    before = one.state.tobytes()
    F = np.full(one.dim, 4711.0)
    one.lib.jlaw_traction(one.law, at(one.state), at(F))
    assert one.state.tobytes() == before
    return F


@pytest.mark.parametrize("name", BUILDS)
def test_the_bits_of_python(tmp_path, name):
    cc, flags = BUILDS[name]
    built = library(tmp_path, *flags, cc=cc)
    laws = map(random_law, (0, 3, 7, 10, 13, 14, 20))  # yielding, wear and both, planes
    for seed, law in enumerate([*map(LAWS.get, OTHER_ELEMENTS), *laws]):
        one = CLaw(built, law, tmp_path)
        goes_as_in_python(one, law, seed)
        many_are_one_by_one(built, one, law)


@pytest.mark.parametrize("i", range(len(DECLARED)))
def test_both_forms_of_the_tables_give_what_python_gives(lib, tmp_path, i):
    law, read, compiled = DECLARED[i], *(CLaw(lib, DECLARED[i], tmp_path) for _ in range(2))
    constants = getattr(lib, f"constants_{i}")
    constants.restype = ctypes.c_void_p
    compiled.law = ctypes.c_void_p(constants())
    for one in (read, compiled):
        goes_as_in_python(one, law, i)
        for closure in (-1e-6, 0.0, 1e-9, 3e-7, 2e-6):
            expected = law.normal_stress(closure), law.max_stiffness(closure)
            functions = lib.jlaw_normal_stress, lib.jlaw_max_stiffness
            values = [function(one.law, closure) for function in functions]
            assert values == pytest.approx(expected, rel=1e-12)
        for stress in (0.0, 1e3, 5e6):
            assert lib.jlaw_closure(one.law, stress) == pytest.approx(law.closure(stress), 1e-12)
        assert lib.jlaw_fingerprint(one.law).decode() == law.fingerprint
        assert np.isnan([lib.jlaw_closure(one.law, bad) for bad in (np.nan, -1.0, np.inf)]).all()
        assert np.isnan(lib.jlaw_normal_stress(one.law, 2 * law.max_effective_closure))
        unmated = law.joint()
        with contextlib.suppress(ValueError):  # of a law whose faces always fit
            unmated = law.joint(mated=False)
        assert lib.jlaw_init_unmated(one.law, at(one.state)) == (0 if unmated.delta.any() else -1)
        np.testing.assert_array_equal(one.state, unmated.snapshot().values[0])
        assert lib.jlaw_tensile_opening(one.law) == law.tensile_opening
        assert lib.jlaw_has_damage(one.law) == law.tables.breaks
        intact, broken = law.joints(1), law.joints(1)
        broken.break_bond([0])
        one.state[:] = intact.snapshot().values[0]
        lib.jlaw_break_bond(one.law, at(one.state))
        np.testing.assert_array_equal(one.state, broken.snapshot().values[0])


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (np.nan, "is not finite; the state is unchanged"),
        (-np.inf, "is not finite; the state is unchanged"),
        (1e200, "exceeds the admissible closure of .* m, above which forces overflow.* Use a smal"),
    ],
)
def test_a_refused_step_tells_why(lib, tmp_path, bad, words):
    """fuzz.c tests that an invalid step changes no state."""
    joint = CLaw(lib, random_law(0), tmp_path)
    for slot in range(joint.dim):
        with pytest.raises(ValueError, match=words):
            joint.step(np.where(np.arange(joint.dim) == slot, bad, 1e-8))
    joint.state[0] = np.nan
    with pytest.raises(ValueError, match=r"delta\[0\] \(number 0\) of the state is nan; "):
        joint.step(np.full(joint.dim, 1e-8))


def test_a_refused_state_is_told_with_its_number_and_bound(lib, tmp_path):
    law = LAWS["degradation by work and stress"]
    joint = CLaw(lib, law, tmp_path)
    row = law.tables.first_rows["lost_slopes"]
    joint.state[row] = 5.0
    words = rf"lost_slopes \(number {row}\) of the state is 5.0000e\+00, above its bound 1.0000e"
    with pytest.raises(ValueError, match=words):
        joint.step(np.zeros(joint.dim))
    joint.state[row] = 0.0
    row = law.tables.first_rows["q"]
    joint.state[row + 1] = 1e160
    with pytest.raises(ValueError, match=r"q of the state has a sum of squares above 1\.0000e"):
        joint.step(np.zeros(joint.dim))


@pytest.mark.parametrize("name", LAWS)
def test_a_joint_is_closed_to_a_normal_stress_as_in_python(lib, tmp_path, name):
    """To rounding in one step, although `jlaw_closure` is the limit of many steps."""
    law = LAWS[name]
    joint = CLaw(lib, law, tmp_path)
    for stress in (0.0, 1e2, 3e5, 2e7):
        F = joint.preload(stress)
        expected = law.joint(stress)
        assert F[0] == pytest.approx(stress, rel=1e-12, abs=1e-300)
        np.testing.assert_allclose(F, expected.F, rtol=1e-12, atol=1e-12 * stress)
        values = expected.snapshot().values[0]
        np.testing.assert_allclose(
            joint.state, values, rtol=1e-9, atol=1e-12 * np.abs(values).max()
        )
    joint.state[:] = 1.0  # whatever the state was
    for invalid in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="no closure"):
            joint.preload(invalid)


def test_one_step_to_the_closure_misses_where_slopes_decrease_by_stress(lib, tmp_path):
    law = LAWS["degradation stress"]
    joint = CLaw(lib, law, tmp_path)
    F, _ = joint.step([law.closure(1e9), *np.zeros(law.dim - 1)])
    assert 1e-3 < abs(F[0] / 1e9 - 1.0) < 0.004
    joint.state[:] = 0.0
    assert joint.preload(1e9)[0] == pytest.approx(1e9, rel=1e-13)


# ----------------------------------------------------------------- turned axes


def turned(angle):
    c = np.cos(angle)
    s = np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def isotropic(phi, **changes):
    resolution = jl.Resolution(2, phi, 3)
    return make_law(b=0.4, c=0.0, mu=0.4, heights=None, resolution=resolution, **changes)


# exact for every law: where bodies change their roles, shear along axis 2 changes its sign alone
CASES = [(random_law(seed), np.diag([1, -1, 1]), "swap_bodies", ()) for seed in (1, 2, 4, 7, 9)]
CASES += [  # by whole azimuths
    (isotropic(4, mating_length=length), turned(angle), "rotate", (angle,))
    for length in (np.inf, 8e-7)
    for angle in (np.pi / 4, -3 * np.pi / 4, np.pi)
]


@pytest.mark.parametrize(("law", "R", "turn", "angle"), CASES)
def test_turned_in_mid_path_is_as_in_turned_axes_from_the_start(lib, tmp_path, law, R, turn, angle):
    one = CLaw(lib, law, tmp_path)
    two = CLaw(lib, law, tmp_path)
    path = random_path(law.dim, 5, 30)
    for step in path[:15]:
        one.step(step)
        two.step(R[: law.dim, : law.dim] @ step)
    getattr(lib, f"jlaw_{turn}")(one.law, at(one.state), *angle)
    assert not np.signbit(one.state[one.state == 0.0]).any()
    F, F_two = ([joint.step(step)[0] for step in path[15:]] for joint in (one, two))
    for rotated, expected in ((one.state, two.state), (F, F_two)):
        error = np.abs(np.subtract(rotated, expected)).max()
        assert error <= 1e-11 * np.abs(expected).max()


def in_sliders(joint, end):
    """Energy stored in the shear springs, whose forces are the rows from 4 to `end`."""
    without = joint.state.copy()
    without[4:end] = 0.0
    return np.subtract(
        *(joint.lib.jlaw_stored_energy(joint.law, at(s)) for s in (joint.state, without))
    )


@pytest.mark.parametrize("damage", [{}, {"yield_interference": 1e-7}])
def test_axes_turned_between_azimuths(lib, tmp_path, damage):
    """Traction in turned axes: the better, the more azimuths. Sliders gain no energy."""
    errors = []
    for phi in (4, 8, 16):
        law = isotropic(phi, damage=damage)
        joint = CLaw(lib, law, tmp_path)
        end = 4 + law.tables.row_counts["q"]
        for _ in range(5):
            F, _ = joint.step([1e-7, 5e-8, 2e-8])
        stored = in_sliders(joint, end)
        before = joint.state.copy()
        lib.jlaw_rotate(joint.law, at(joint.state), 0.3)
        F_turned, _ = joint.step(np.zeros(3), keep=False)
        errors.append(np.abs(F_turned - turned(0.3) @ F).max() / np.abs(F).max())
        lost = joint.state[3] - before[3]
        assert lost >= 0.0
        assert in_sliders(joint, end) + lost == pytest.approx(stored, rel=1e-12)
        assert np.hypot(*joint.state[1:3]) == pytest.approx(np.hypot(*before[1:3]), rel=1e-15)
        if damage:
            assert 0 < joint.state[end:-1].max() <= before[end:-1].max()
    assert errors[2] < errors[1] < errors[0]
    # depths between azimuths lie on straight lines, off by an eighth of the square of the spacing
    assert errors[2] < (5e-3 if damage else 2e-3)
