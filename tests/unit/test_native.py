"""The library of the compiled law: how it is made, found and refused, and its bits."""

from types import SimpleNamespace

import numpy as np
import pytest
from c_host import random_law, random_path

import jointlaw as jl
from jointlaw.kernels import engine, reference
from jointlaw.native import build, library

SAME, SAME_C = 1e-12, 1e-10  # of the largest on the path; q of a slider carries three times as much
SEEDS = (3, 7, 10, 14, 20)  # space and planes, mating length, yielding, wear, both


@pytest.fixture(autouse=True)
def native(monkeypatch):
    monkeypatch.setenv("JOINTLAW_KERNEL", "native")


@pytest.mark.parametrize(
    "seed", [*range(16), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(16, 200))]
)
def test_same_numbers_on_random_laws_and_paths(seed):
    """A joint alone, and the same as the last of a batch, against `reference.step`."""
    law = random_law(seed)
    k, dim = law.tables, law.dim
    batch, joint, state = law.joints(9), law.joint(), np.zeros((k.rows, 1))
    others = np.random.default_rng(0).normal(0.0, 1e-7, (8, dim))
    off, peak = np.zeros(4), np.full(4, 1e-300)
    for d in random_path(dim, seed):
        state, F, C = reference.step(k, state, d[:, None], True)
        F_alone, C_alone = joint.update(d)
        for alone, all_ in zip((F_alone, C_alone), batch.update([*others, d]), strict=True):
            np.testing.assert_array_equal(all_[-1], alone)
        mine, one, other = (
            joint.snapshot().values[0],
            joint.measures(),
            reference.measures(k, state),
        )
        pairs = [
            (F[:, 0], F_alone), (C[..., 0], C_alone), (state[dim + 1 :, 0], mine[dim + 1 :]),
            ([other.stored[0], state[dim, 0]], [one.stored, mine[dim]]),
        ]  # fmt: skip
        off = np.maximum(off, [np.abs(np.subtract(a, b)).max() for a, b in pairs])
        peak = np.maximum(peak, [np.abs(a).max() for a, _ in pairs])
        assert np.ravel(one[:3]) == pytest.approx(np.ravel(other[:3]), abs=1e-9)
    assert (off < np.array([SAME, SAME_C, 3 * SAME, SAME]) * peak).all(), off / peak


def test_facets_that_shear_does_not_move():
    """At a right angle to the shear only rounding tells which of two opposite facets yields."""
    law = jl.JointLaw(
        orientation=jl.Orientation(2.0), asperity_density=1e10, closure_range=2e-6, plane=0.7,
        asperity=jl.Asperity(2e8, 1.2, 0.5, 0.3, yield_interference=6e-7), mating_length=5e-6,
        heights=jl.GammaHeights(3.0, 1e-6, 1e-6, "individual"), resolution=jl.Resolution(3, 6, 3),
    )  # fmt: skip
    joint, state = law.joint(), np.zeros((law.state_size, 1))
    steps = np.random.default_rng(7).normal(0.0, 1.2e-6, (4, 2))
    steps[:, 0] = np.abs(steps[:, 0])
    for d in [*steps, [0.0, 4e-7], [0.0, 4e-7]]:
        state, _, C = reference.step(law.tables, state, np.array(d)[:, None], True)
        mine = joint.update(d)[1]
        assert np.abs(mine - C[..., 0]).max() < SAME_C * np.abs(C).max()
    assert joint.dissipated_energy == pytest.approx(state[2, 0], rel=SAME)


def numbers(law, seed, lanes=None):
    """All that a batch gives along a path, by vectors of so many lanes."""
    batch, given = law.joints(19), []
    if lanes is not None:
        batch._engine.lanes = lanes
    steps = [random_path(law.dim, seed + 1000 * k, 25) for k in range(19)]
    for d in np.stack(steps, axis=1):
        given += batch.update(d)
    return [*given, batch.snapshot().values, *batch.measures()]


@pytest.fixture
def engines_anew():
    """Engines of one test are not those of others."""
    engine._engine.cache_clear()
    yield
    engine._engine.cache_clear()
    engine._warn_once.cache_clear()


COMPILERS = {  # the header is compiled in test_c_kernel.py
    "clang": ("clang",),
    "gcc -O2": ("gcc", "-O2"),
    "g++": ("g++", "-x", "c++", "-fno-exceptions"),
    "clang -O2": ("clang", "-O2"),
    "zig": build.zig().command,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPILERS)
def test_same_bits_by_every_compiler_and_width(engines_anew, monkeypatch, tmp_path, name):
    compiler = build.Compiler(COMPILERS[name])
    if not build.works(compiler):
        pytest.skip(f"{name} does not work here")
    if "-O2" in compiler.command:  # the last of two counts
        monkeypatch.setattr(build, "FLAGS", (*build.FLAGS, "-O2"))
    monkeypatch.setenv("JOINTLAW_LEVELS", "all")
    laws = {seed: random_law(seed) for seed in SEEDS}
    first = {seed: numbers(law, seed) for seed, law in laws.items()}
    loaded = library.load_file(build.build(compiler, tmp_path))
    monkeypatch.setattr(library, "load", lambda: loaded)
    engine._engine.cache_clear()
    widths = [lanes for lanes in build.LEVELS if lanes <= loaded.jlaw_lanes()]
    assert widths == [lanes for lanes in widths if lanes & loaded.jlaw_levels()]
    for lanes in widths:
        for seed, law in laws.items():
            for one, other in zip(first[seed], numbers(law, seed, lanes), strict=True):
                np.testing.assert_array_equal(one, other)


def test_a_library_of_other_sources_is_refused(monkeypatch):
    path = build.BUILT / build.library_name(build.Compiler(()).machine[1])
    monkeypatch.setattr(build, "sources", lambda: "0" * 16)
    with pytest.raises(library.UnfitLibraryError, match=r"python -m jointlaw\.native"):
        library.load_file(path)


def test_a_library_serves_the_processors_that_have_its_vectors(monkeypatch):
    """Widest vectors of the processor, those of the library: those that are taken; 0 is refused."""
    taken = {(8, 14): 8, (8, 4): 4, (4, 14): 4, (2, 14): 2, (2, 2): 2, (4, 8): 0, (2, 12): 0}
    for (here, built), lanes in taken.items():
        loaded = SimpleNamespace(jlaw_lanes=lambda n=here: n, jlaw_levels=lambda n=built: n)
        assert library.lanes(loaded) == lanes
    own = build.BUILT / build.library_name(build.Compiler(()).machine[1])
    assert library.lanes(library.load_file(own)) == library.load().jlaw_lanes()
    monkeypatch.setattr(library, "lanes", lambda loaded: 0)
    with pytest.raises(library.UnfitLibraryError, match=r"`JOINTLAW_LEVELS=all python -m joint"):
        library.load_file(own)


def test_a_file_that_is_no_library_of_this_machine_is_refused(tmp_path):
    (tmp_path / "libjointlaw.so").write_bytes(b"\x7fELF of another machine")
    with pytest.raises(library.UnfitLibraryError, match=r"cannot be loaded here .*build it anew"):
        library.load_file(tmp_path / "libjointlaw.so")


def test_what_is_built_for_this_machine_and_for_others(monkeypatch):
    """One width of vectors for this machine; all for others, and where all are asked for."""
    monkeypatch.delenv("JOINTLAW_LEVELS", raising=False)
    compiler = build.find_compiler()
    assert build.chosen_levels(compiler) == (library.load().jlaw_lanes(),)
    assert build.chosen_levels(build.zig("x86_64-windows-gnu")) == tuple(build.LEVELS)
    assert build.chosen_levels(build.zig("aarch64-windows-gnu")) == (2,)
    monkeypatch.setenv("JOINTLAW_LEVELS", "all")
    alike = compiler.machine[0] == "x86_64"
    assert build.chosen_levels(compiler) == (tuple(build.LEVELS) if alike else (2,))
    monkeypatch.setenv("JOINTLAW_LEVELS", "both")
    with pytest.raises(ValueError, match="JOINTLAW_LEVELS = 'both' is unknown; write all"):
        build.chosen_levels(compiler)


def test_without_a_library_numpy_remains_and_that_is_said_once(engines_anew, monkeypatch, recwarn):
    monkeypatch.setattr(library, "load", lambda: None)
    law = jl.presets.load("westerly-smooth")
    with pytest.raises(ImportError, match="ziglang"):
        law.joint()
    monkeypatch.delenv("JOINTLAW_KERNEL")
    assert [law.joint().kernel, jl.presets.load("linear-a3").joint().kernel] == ["numpy", "numpy"]
    said = [str(warning.message) for warning in recwarn]
    assert len(said) == 1
    assert "install a C compiler" in said[0]
    assert "\n" not in said[0]


def test_a_compiler_that_is_there_may_be_a_stub(monkeypatch, tmp_path):
    for name in ("clang", "g++", "gcc", "cc"):
        (tmp_path / name).write_text("#!/bin/sh\nexit 0\n")  # makes nothing, and says it did
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert len(build.installed()) == 4
    assert not any(map(build.works, build.installed()))
