"""The C header with slider forces as float: the bits of a batch in Python, changes of axes,
refusals, finite elements, CUDA; test_float_sliders.py has the accuracy."""

import ctypes

import numpy as np
import pytest
from c_host import FAST, CLaw, at, build, library, random_law, random_path
from extremes import laws as extreme_laws
from kinds import LAWS
from programs import run_program
from test_c_files import DEVICE, FUZZ, PAGE, SANE

import jointlaw as jl
from jointlaw.hosts.c.export import header_text, table_text
from jointlaw.hosts.fem.export import export_fem

STORE = "-DJOINTLAW_FLOAT_SLIDERS"
BUILDS = {
    "gcc": ("gcc", [*FAST, "-std=c99"]),
    "gcc, no vectors": ("gcc", ["-O0", "-std=c99", "-ffp-contract=off", "-DJOINTLAW_SCALAR"]),
    "clang, this machine": ("clang", [*FAST, "-march=native", "-DJOINTLAW_MANY"]),
    "C++, AVX2": ("g++", [*FAST, "-std=c++17", "-march=x86-64-v3", "-DJOINTLAW_MANY"]),
}
CONSTANTS = '#include "law.h"\nconst jlaw_law *constants(void);\n'
CONSTANTS += "const jlaw_law *constants(void) { return &law; }\n"
JOINTS = 21


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    folder = tmp_path_factory.mktemp("c")
    (folder / "law.h").write_text(header_text(LAWS["plane"], "law"))
    flags = "-O1", "-std=c99", "-DJOINTLAW_SCALAR", "-ffp-contract=off", f"-I{folder}", STORE
    return library(folder, *flags, more=CONSTANTS)


def in_doubles(one, law):
    """State of a joint in C as the row of a snapshot."""
    return law.tables.slider_packing.unpack(one.state[None])[0]


def goes_as_in_python(built, one, law, seed):
    """One joint by jlaw_update, many by jlaw_update_many: F, C, states, measures of a batch."""
    joints = law.joints(JOINTS, slider_dtype=np.float32)
    rows = len(one.state)
    states = np.zeros((JOINTS, rows + 3))
    F = np.zeros((JOINTS, law.dim))
    C = np.zeros((JOINTS, law.dim, law.dim))
    paths = np.array([random_path(law.dim, seed + k, 40) for k in range(JOINTS)])
    for k in range(40):
        d = np.ascontiguousarray(paths[:, k])
        expected = joints.update(d)
        count = ctypes.c_size_t(JOINTS)
        stride = ctypes.c_size_t(rows + 3)
        done = built.jlaw_update_many(one.law, at(states), stride, at(d), at(F), at(C), count)
        assert done == JOINTS
        for a, b, c in zip(one.step(d[0]), (F, C), expected, strict=True):
            np.testing.assert_array_equal(a, c[0])
            np.testing.assert_array_equal(b, c)
        traction = np.zeros(law.dim)
        built.jlaw_traction(one.law, at(one.state), at(traction))
        np.testing.assert_array_equal(traction, F[0])
    values = joints.snapshot().values
    np.testing.assert_array_equal(law.tables.slider_packing.unpack(states[:, :rows]), values)
    np.testing.assert_array_equal(in_doubles(one, law), values[0])
    measures = [*(m[0] for m in joints.measures()[:4]), joints.dissipated_energy[0]]
    assert one.measures() == pytest.approx(measures, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("name", BUILDS)
def test_the_bits_of_python(tmp_path, name):
    cc, flags = BUILDS[name]
    built = library(tmp_path, *flags, STORE, cc=cc)
    laws = [LAWS[kind] for kind in ("population", "coulomb", "bond and filling", "closure only")]
    laws += map(random_law, (3, 7, 10, 14, 20))  # yielding, wear and both, planes
    laws.append(LAWS["degradation by work and stress"])
    for seed, law in enumerate(laws):
        goes_as_in_python(built, CLaw(built, law, tmp_path), law, seed)


def test_sizes_and_hashes(lib, tmp_path):
    for law in LAWS.values():
        one = CLaw(lib, law, tmp_path)
        assert len(one.state) == law.state_size - law.tables.row_counts.get("q", 0) // 2
        assert lib.jlaw_fingerprint(one.law).decode() == f"{law.fingerprint}:float"
    lib.constants.restype = ctypes.c_void_p
    fingerprint = lib.jlaw_fingerprint(ctypes.c_void_p(lib.constants()))
    assert fingerprint.decode() == f"{LAWS['plane'].fingerprint}:float"


@pytest.mark.parametrize("seed", [1, 2, 4, 7, 9])
def test_exchanged_bodies(lib, tmp_path, seed):
    """Twice is exact; a path continues as in the other axes, but for roundings to float."""
    law = random_law(seed)
    one = CLaw(lib, law, tmp_path)
    two = CLaw(lib, law, tmp_path)
    R = np.diag([1.0, -1.0, 1.0])[: law.dim, : law.dim]
    path = random_path(law.dim, 5, 30)
    for step in path[:15]:
        one.step(step)
        two.step(R @ step)
    before = one.state.copy()
    for _ in range(2):
        lib.jlaw_swap_bodies(one.law, at(one.state))
    np.testing.assert_array_equal(one.state.view(np.int64), before.view(np.int64))
    lib.jlaw_swap_bodies(one.law, at(one.state))
    F, F_two = ([joint.step(step)[0] for step in path[15:]] for joint in (one, two))
    assert np.abs(np.subtract(F, F_two)).max() <= 2e-7 * np.abs(F_two).max()


def test_many_small_rotations_are_not_lost(lib, tmp_path):
    """10 000 rotations, each below the resolution of a float, are one rotation by their sum."""
    law = LAWS["individual"]
    tractions = []
    for angles in (np.full(10_000, 2e-9), [2e-5]):
        one = CLaw(lib, law, tmp_path)
        for step in ([5e-7, 0.0, 0.0], [0.0, 1e-7, 0.0], [0.0, 3e-8, 8e-8]):
            start, _ = one.step(step)
        for angle in angles:
            lib.jlaw_rotate(one.law, at(one.state), angle)
        F = np.zeros(3)
        lib.jlaw_traction(one.law, at(one.state), at(F))
        tractions.append(F - start)
    # a random walk of each slider by sqrt(interval x path), 5 % of the path, over sqrt(sliders)
    change = np.linalg.norm(tractions[1][1:])
    assert change > 0.0
    assert np.linalg.norm(np.subtract(*tractions)[1:]) < 0.05 * change


def test_what_does_not_fit_is_refused(lib, tmp_path):
    law = LAWS["population"]
    one = CLaw(lib, law, tmp_path)
    one.step(np.full(3, 1e-7))
    before = one.state.copy()
    far = 10.0 * law.tables.max_closure_with_float_sliders
    with pytest.raises(ValueError, match="forces overflow; the state is unchanged"):
        one.step([far, 0.0, 0.0])
    np.testing.assert_array_equal(one.state, before)
    for half in range(2):
        for bad in (np.nan, np.inf, -np.inf):
            one.state[:] = before
            one.state.view(np.float32)[2 * (law.dim + 1) + half] = bad
            with pytest.raises(ValueError, match="q of the state has a float that is not finite"):
                one.step(np.full(3, 1e-8))


def test_hostile_steps(tmp_path):
    """fuzz.c with sanitizers: extreme laws, steps of all sizes, damaged states, changed axes."""
    flags = [*SANE, "-fsanitize=address,undefined,float-cast-overflow", "-lpthread", STORE]
    program = build(tmp_path, FUZZ, *flags)
    rng = np.random.default_rng(7)
    tested = 0
    while tested < 5:
        changes, size = extreme_laws.random_changes(rng)
        try:
            law = extreme_laws.build(**changes)
        except ValueError:
            continue
        (tmp_path / "x.jlaw").write_text(table_text(law))
        text = run_program(program, "steps", tmp_path / "x.jlaw", size, 2000, tested)
        assert text.startswith("2000 steps")
        tested += 1


def test_it_compiles_as_cuda(tmp_path):
    """By clang, without a CUDA toolkit: the kernel of the page."""
    (tmp_path / "rock.h").write_text(header_text(jl.presets.load("westerly-smooth"), "rock"))
    kernel = PAGE.partition('RawModule(code=r"""\n')[2].partition('\n"""')[0]
    flags = [
        "-x", "cuda", "--cuda-device-only", "--cuda-gpu-arch=sm_80", "-nocudalib", "-nocudainc",
        "-O1", "-S", f"-I{tmp_path}", STORE,
    ]  # fmt: skip
    assembly = build(tmp_path, DEVICE + kernel, *flags, cc="clang").read_text()
    assert ".entry advance" in assembly
    assert "cvt.rn.f32.f64" in assembly


def test_finite_elements_refuse_it(tmp_path):
    export_fem(LAWS["population"], tmp_path, "rock")
    flags = ["-c", "-O0", f"-I{tmp_path}", STORE]
    with pytest.raises(AssertionError, match="compile without JOINTLAW_FLOAT_SLIDERS"):
        build(tmp_path, tmp_path / "umat.c", *flags, name="umat.o")
