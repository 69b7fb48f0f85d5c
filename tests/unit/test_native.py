"""The compiled kernel gives the numbers of the readable one, however it is called; its library is
made, found and refused."""

import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import kinds
import numpy as np
import pytest
from c_host import random_law, random_path

import jointlaw as jl
from jointlaw.kernels import engine, reference
from jointlaw.kernels.interlock import effective_closure
from jointlaw.kernels.threads import run_on_threads
from jointlaw.native import build, library
from jointlaw.support.thresholds import MIN_CHORD_STEP

# Either kernel sums a few hundred terms per facet in its own order and carries q over the path: a
# few hundred times the rounding of 1e-16. That is the share of the largest value that may differ.
SAME, SAME_C = 1e-12, 1e-10  # q of a slider carries three times as much
# C holds d(chord)/dy, a second difference of G: rounding grows by (y/dy)^2, up to
# MIN_CHORD_STEP^-2 = 1e10, in the few facets that a step hardly opens or closes; most joints agree
# far better.
WORST_C, USUAL_C = 2e-6, 1e-12
N = 17 * engine.JOINTS_PER_BLOCK + 3  # blocks of joints and part of another


@pytest.fixture(autouse=True)
def native(monkeypatch):
    monkeypatch.setenv("JOINTLAW_KERNEL", "native")


def path(law, seed, steps, n=N):
    """Increments (steps, n, dim): a closure, then all sizes and zeros, apart in the middle."""
    rng = np.random.default_rng(100 + seed)
    d = rng.normal(0.0, 10.0 ** rng.uniform(-9.0, -6.0, (steps, n, 1)), (steps, n, law.dim))
    d[rng.random(d.shape) < 0.1] = 0.0
    d[0, :, 0] = rng.uniform(2e-7, 1.5e-6, n)
    d[steps // 2, :, 0] = -rng.uniform(0.0, 4e-6, n)
    d[steps // 2 + 2, :, 0] = rng.uniform(0.0, 4e-6, n)
    return d


@pytest.fixture
def both(monkeypatch):
    """Makes two of the same: advanced by numpy and by the compiled law."""

    def make(build):
        for name in ("numpy", "native"):
            monkeypatch.setenv("JOINTLAW_KERNEL", name)
            made = build()
            assert made.kernel == name
            yield made

    return make


def worst(one, other, peak):
    return np.max(np.abs(np.asarray(one) - np.asarray(other)), initial=0.0) / peak


def given_by(batch, seed):
    """All that a batch of N gives while contacts come and go: tractions, and the rest."""
    d = path(batch.law, seed, 20, 400)
    results = [batch.update(d[0, :N]), batch.update(d[1, :40], where=np.arange(N)[::-1][:40])]
    batch.reset([0, 7, 64, N - 1])
    results += [batch.trial(d[2, :N]), batch.update(d[3, :N])]
    batch.resize(400)  # from two blocks to more
    mask = np.arange(400) % 3 == 0
    results += [batch.update(d[4]), batch.update(d[5, mask], where=mask)]
    results += [batch.trial(d[5, mask], where=mask)]
    batch.resize(30)
    batch.resize(150)
    results += [batch.update(step[:150]) for step in d[6:]]
    results += [batch.update(np.empty((0, batch.law.dim)), where=[])]
    tractions, tangents = zip(*results, strict=True)
    return [*tractions, batch.F], [*tangents, batch.snapshot().values, *batch.measures()]


@pytest.mark.parametrize(("seed", "track_dissipation"), [(9, True), (10, False)])
def test_same_numbers_while_contacts_come_and_go(both, seed, track_dissipation):
    law = random_law(seed)
    slow, fast = (given_by(one, seed)[0] for one in both(lambda: law.joints(N, track_dissipation)))
    peak = max(np.abs(F).max() for F in slow if F.size)
    for one, alternative in zip(slow, fast, strict=True):
        assert worst(one, alternative, peak) < SAME


@pytest.mark.parametrize("seed", [3, 8])
def test_the_tangent_exactly_at_the_friction_limit_is_that_of_sliding_on(both, make_law, seed):
    """A step of nothing leaves sliders exactly at their limit: rounding must not decide C."""
    law = random_law(seed)
    slow, fast = both(lambda: law.joints(N))
    for d in path(law, seed, 8):
        slow.update(d)
        fast.update(d)
        nothing = np.zeros_like(d)
        C, C2 = slow.trial(nothing)[1], fast.trial(nothing)[1]
        assert worst(C, C2, max(np.abs(C).max(), 1e-300)) < USUAL_C
    # pure shear, far: all slide, and a step of nothing has the C of a small step onward
    law = make_law(heights=None, eta=0.0, a=1e6, mu=0.3)  # one spring, no dilation
    for batch in both(lambda: law.joints(1)):
        batch.update([[1e-6, 0.0, 0.0]])
        batch.update([[0.0, 1e-5, 0.0]])
        onward, still = batch.trial([[0.0, 1e-12, 0.0]])[1], batch.trial(np.zeros((1, 3)))[1]
        assert worst(onward[:, :, :2], still[:, :, :2], np.abs(onward).max()) < 1e-5


@pytest.mark.parametrize("name", kinds.LAWS)
def test_zeros_of_states_are_positive(both, name):
    """States that are equal have equal bytes in either kernel, whichever joints are neighbours."""
    law = kinds.LAWS[name]
    d = path(law, len(name), 12)
    for batch in both(lambda: law.joints(N)):
        for increments in d:
            batch.update(increments)
            states = batch.snapshot().values
            assert not np.signbit(states[states == 0.0]).any()
        joint = law.joint()
        for increment in d[:, 3]:
            joint.update(increment)
        if batch.kernel == "native":
            assert joint.snapshot().values.tobytes() == states[3].tobytes()


def smallest_relative_closing(law, before, after):
    """Smallest (y1 - y0)/y1 (n,) over the facets in contact that close by a difference quotient.

    before, after: states (n, rows). Infinite where no facet closes; a smaller change than
    MIN_CHORD_STEP takes the slope of G instead of a difference.
    """
    k = law.tables
    old = reference.state_parts(k, before.T)
    new = reference.state_parts(k, after.T)
    y0 = effective_closure(k.asperities, old.delta, old.slope_retention)
    y1 = effective_closure(k.asperities, new.delta, new.slope_retention)
    closing = (y1 - y0) / np.where(y1 > 0.0, y1, np.inf)
    return np.where(closing > MIN_CHORD_STEP, closing, np.inf).min(axis=0)


@pytest.mark.parametrize("name", ["mating length", "degradation stress"])
def test_tangents_differ_by_the_rounding_of_a_second_difference_only(both, name):
    """Both kernels agree to 1e-12 where every facet closes by a hundredth of its closure or more.

    In smaller steps d(chord)/dy = (kappa - chord)/dy, chord = (G1 - G0)/dy, magnifies the rounding
    of y by up to (y/dy)^2: the difference grows so, with degradation by stress as without it.
    """
    law = kinds.LAWS[name]
    slow, fast = both(lambda: law.joints(N))
    tangents = []
    for d in path(law, 5, 60):
        before = slow.snapshot().values
        (F, C), (F2, C2) = slow.update(d), fast.update(d)
        closing = smallest_relative_closing(law, before, slow.snapshot().values)
        off = np.abs(C - C2).max(axis=(1, 2))
        tangents.append((np.abs(C).max(), np.abs(F).max(), np.abs(F - F2).max(), closing, off))
    peak = max(C for C, *_ in tangents)
    assert max(F_off for _, _, F_off, _, _ in tangents) < SAME * max(F for _, F, *_ in tangents)
    closing = np.concatenate([one[3] for one in tangents])
    off = np.concatenate([one[4] for one in tangents]) / peak
    assert off[closing > 1e-2].max() < SAME
    small = closing < 1e-2
    assert small.sum() > 500
    assert (off[small] * closing[small] ** 2).max() < 1e-16
    assert off[small].max() > SAME  # so the bound by the step is needed


def test_threads_change_no_bit(monkeypatch):
    law = random_law(10)
    monkeypatch.setattr(engine, "MIN_SLIDERS_FOR_THREADS", 0)
    monkeypatch.setenv("JOINTLAW_THREADS", "1")
    alone = given_by(law.joints(N), 10)
    for threads in ("2", "5"):
        monkeypatch.setenv("JOINTLAW_THREADS", threads)
        np.testing.assert_equal(given_by(law.joints(N), 10), alone)


def test_what_fails_on_another_thread_is_raised_after_all_have_ended():
    ended = []
    has_started = threading.Event()

    def work() -> None:
        if threading.current_thread() is not threading.main_thread():
            has_started.set()
            raise MemoryError("no memory")
        assert has_started.wait(60)
        ended.append(True)

    for _ in range(2):  # the thread that failed works on
        has_started.clear()
        with pytest.raises(MemoryError, match="no memory"):
            run_on_threads(work, 2)
    assert ended == [True, True]


def test_a_thread_that_comes_too_late_is_not_waited_for(monkeypatch):
    """The other thread is busy: this one does the whole work."""
    pool = ThreadPoolExecutor(1)
    monkeypatch.setattr("jointlaw.kernels.threads._executor", lambda _: pool)
    release = threading.Event()
    running = threading.Event()
    calls = []

    def occupy() -> None:
        if threading.current_thread() is not threading.main_thread():
            running.set()
            assert release.wait(60)
        else:
            assert running.wait(60)
            run_on_threads(lambda: calls.append(threading.current_thread()), 2)
            release.set()

    run_on_threads(occupy, 2)
    assert calls == [threading.main_thread()]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("JOINTLAW_KERNEL", "cuda", "choose one of numpy, native"),
        ("JOINTLAW_THREADS", "two", "a whole number >= 1"),
    ],
)
def test_bad_settings_are_named(law, monkeypatch, name, value, message):
    monkeypatch.setattr(engine, "MIN_SLIDERS_FOR_THREADS", 0)
    monkeypatch.setenv(name, value)
    with pytest.raises(ValueError, match=f"{name} = '{value}'.*{message}"):
        law.joints(N).update(np.zeros((N, 3)))


@pytest.mark.parametrize("plane", [None, 0.0])
def test_a_host_that_keeps_the_states_itself(make_law, plane):
    """`law.step` is a pure function: the same path as a joint's, and nothing given is changed."""
    law = make_law(plane=plane)
    joints, states = law.joints(2), np.zeros((2, law.state_size))
    for d in np.random.default_rng(4).normal(0.0, 1e-7, (20, 2, law.dim)):
        given = states.copy()
        new, alone = law.step(states, d), law.step(states[1], d[1])
        np.testing.assert_array_equal(states, given)
        for two, one in zip(new, alone, strict=True):
            assert worst(two[1], one, np.abs(one).max() + 1e-300) < WORST_C
        (states, F, C), (F_joint, C_joint) = new, joints.update(d)
        assert worst(F, F_joint, np.abs(F_joint).max() + 1.0) < SAME
        assert worst(C, C_joint, np.abs(C_joint).max() + 1.0) < 1e-9
    assert worst(states, joints.snapshot().values, np.abs(states).max()) < SAME


@pytest.mark.parametrize("seed", [9, 10, 21])
def test_a_step_shows_what_the_state_then_amounts_to(both, seed):
    """In the pass that advances: the same bits as measured afterwards."""
    law = random_law(seed)
    d, dim = path(law, seed, 12, N), law.tables.dim
    for batch in both(lambda: law.joints(N)):
        for increments in d:
            displayed = np.empty((N, 6 + dim))
            batch.advance(engine.Step(increments, np.empty((N, dim)), None, measures=displayed))
            measures = *batch.measures()[:4], batch.dissipated_energy, batch.damage
            np.testing.assert_array_equal(displayed, np.column_stack([*measures, batch.delta]))


def follows_the_reference(law, way):
    """A joint alone, and the same as the last of a batch, against `reference.step`."""
    k, dim = law.tables, law.dim
    batch, joint, state = law.joints(9), law.joint(), np.zeros((k.rows, 1))
    others = np.random.default_rng(0).normal(0.0, 1e-7, (8, dim))
    off, peak = np.zeros(4), np.full(4, 1e-300)
    for d in way:
        state, F, C = reference.step(k, state, d[:, None], True)
        F_alone, C_alone = joint.update(d)
        for alone, all_ in zip((F_alone, C_alone), batch.update([*others, d]), strict=True):
            np.testing.assert_array_equal(all_[-1], alone)
        mine, one = joint.snapshot().values[0], joint.measures()
        alternative = reference.measures(k, state)
        pairs = [
            (F[:, 0], F_alone), (C[..., 0], C_alone), (state[dim + 1 :, 0], mine[dim + 1 :]),
            ([alternative.stored_energy[0], state[dim, 0]], [one.stored_energy, mine[dim]]),
        ]  # fmt: skip
        off = np.maximum(off, [np.abs(np.subtract(a, b)).max() for a, b in pairs])
        peak = np.maximum(peak, [np.abs(a).max() for a, _ in pairs])
        assert np.ravel(one[:3]) == pytest.approx(np.ravel(alternative[:3]), abs=1e-9)
    assert (off < np.array([SAME, SAME_C, 3 * SAME, SAME]) * peak).all(), off / peak


@pytest.mark.parametrize(
    "seed", [*range(8), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(8, 200))]
)
def test_same_numbers_on_random_laws_and_paths(seed):
    law = random_law(seed)
    follows_the_reference(law, random_path(law.dim, seed))


def test_facets_that_shear_does_not_move():
    """At a right angle to the shear only rounding tells which of two opposite facets yields."""
    law = jl.JointLaw(
        orientation=jl.Orientation(2.0), asperity_density=1e10, closure_range=2e-6, plane=0.7,
        asperity=jl.Asperity(2e8, 1.2, 0.5, 0.3, yield_interference=6e-7), mating_length=5e-6,
        heights=jl.GammaHeights(3.0, 1e-6, 1e-6, "individual"), resolution=jl.Resolution(3, 6, 3),
    )  # fmt: skip
    steps = np.random.default_rng(7).normal(0.0, 1.2e-6, (4, 2))
    steps[:, 0] = np.abs(steps[:, 0])
    follows_the_reference(law, [*steps, np.array([0.0, 4e-7]), np.array([0.0, 4e-7])])


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
    # space and planes, mating length, yielding, wear, both
    laws = {seed: random_law(seed) for seed in (3, 7, 10, 14, 20)}
    first = {seed: given_by(law.joints(N), seed) for seed, law in laws.items()}
    loaded = library.load_file(build.build(compiler, tmp_path))
    monkeypatch.setattr(library, "load", lambda: loaded)
    engine._engine.cache_clear()
    widths = [lanes for lanes in build.LEVELS if lanes <= loaded.jlaw_lanes()]
    assert widths == [lanes for lanes in widths if lanes & loaded.jlaw_levels()]
    for lanes in widths:
        for seed, law in laws.items():
            batch = law.joints(N)
            batch._engine.lanes = lanes
            np.testing.assert_equal(given_by(batch, seed), first[seed])


OWN = build.BUILT / build.library_name(build.Compiler(()).machine[1])


@pytest.mark.parametrize(
    ("module", "name", "value", "told"),
    [
        (build, "hash_sources", "0" * 16, r"python -m jointlaw\.native"),
        (library, "vector_lanes", 0, "`JOINTLAW_LEVELS=all python -m joint"),
    ],
)
def test_a_library_of_other_sources_or_vectors_is_refused(monkeypatch, module, name, value, told):
    monkeypatch.setattr(module, name, lambda *_: value)
    with pytest.raises(library.UnfitLibraryError, match=told):
        library.load_file(OWN)


def test_a_library_serves_the_processors_that_have_its_vectors():
    """Widest vectors of the processor, those of the library: those that are taken; 0 is refused."""
    taken = {(8, 14): 8, (8, 4): 4, (4, 14): 4, (2, 14): 2, (2, 2): 2, (4, 8): 0, (2, 12): 0}
    for (here, built), lanes in taken.items():
        loaded = SimpleNamespace(jlaw_lanes=lambda n=here: n, jlaw_levels=lambda n=built: n)
        assert library.vector_lanes(loaded) == lanes
    assert library.vector_lanes(library.load_file(OWN)) == library.load().jlaw_lanes()


def test_a_file_that_is_no_library_of_this_machine_is_refused(tmp_path):
    (tmp_path / "libjointlaw.so").write_bytes(b"\x7fELF of another machine")
    with pytest.raises(library.UnfitLibraryError, match=r"cannot be loaded here .*rebuild it"):
        library.load_file(tmp_path / "libjointlaw.so")


def test_what_is_built_for_this_machine_and_for_others(monkeypatch):
    """One width of vectors for this machine; all for others, and where all are asked for."""
    monkeypatch.delenv("JOINTLAW_LEVELS", raising=False)
    compiler = build.find_compiler()
    assert build.select_levels(compiler) == (library.load().jlaw_lanes(),)
    assert build.select_levels(build.zig("x86_64-windows-gnu")) == tuple(build.LEVELS)
    assert build.select_levels(build.zig("aarch64-windows-gnu")) == (2,)
    monkeypatch.setenv("JOINTLAW_LEVELS", "all")
    alike = compiler.machine[0] == "x86_64"
    assert build.select_levels(compiler) == (tuple(build.LEVELS) if alike else (2,))
    monkeypatch.setenv("JOINTLAW_LEVELS", "both")
    with pytest.raises(ValueError, match="JOINTLAW_LEVELS = 'both' is unknown; set it to all"):
        build.select_levels(compiler)


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
    assert len(build.compilers_on_path()) == 4
    assert not any(map(build.works, build.compilers_on_path()))


LISTS = {  # of joints of a batch of N, from whole blocks to a single joint
    "all": np.arange(N),
    "few left out": np.delete(np.arange(N), [0, 13, 64, 100, N - 1]),
    "permutation": np.random.default_rng(1).permutation(N),
    "half": np.sort(np.random.default_rng(2).permutation(N)[: N // 2]),
    "half, any order": np.random.default_rng(3).permutation(N)[: N // 2],
    "one of a block": np.arange(N - 2, 0, -9),
    "one": np.array([N - 1]),
    "six of a block": np.array([29, 24, 31, 26, 30, 25]),
}


@pytest.mark.parametrize("listed", LISTS)
@pytest.mark.parametrize("threads", ["1", "3"])
@pytest.mark.parametrize("law_name", kinds.LAWS)
def test_listed_joints_get_the_bits_of_a_whole_step_and_others_keep_theirs(
    monkeypatch, law_name, threads, listed
):
    monkeypatch.setattr(engine, "MIN_SLIDERS_FOR_THREADS", 0)
    monkeypatch.setenv("JOINTLAW_THREADS", threads)
    law = kinds.LAWS[law_name]
    list_of_joints = LISTS[listed]
    is_listed = np.isin(np.arange(N), list_of_joints)
    d, d_next, *before = path(law, len(law_name), 6)[::-1]
    whole, by_list, untouched = (law.joints(N) for _ in range(3))
    for batch in whole, by_list, untouched:
        for increments in before[::-1]:
            batch.update(increments)
    for take_step in "trial", "update":
        F, C = getattr(whole, take_step)(d)
        F_listed, C_listed = getattr(by_list, take_step)(d[list_of_joints], where=list_of_joints)
        assert F_listed.tobytes() == F[list_of_joints].tobytes()
        assert C_listed.tobytes() == C[list_of_joints].tobytes()
        if take_step == "trial":
            states = by_list.snapshot().values
            assert states.tobytes() == untouched.snapshot().values.tobytes()
    expected_states = np.where(
        is_listed[:, None], whole.snapshot().values, untouched.snapshot().values
    )
    assert by_list.snapshot().values.tobytes() == expected_states.tobytes()
    # the numbers that a batch keeps beside the states are right, too
    expected = np.where(is_listed[:, None], whole.update(d_next)[0], untouched.update(d_next)[0])
    assert by_list.update(d_next)[0].tobytes() == expected.tobytes()


def test_few_joints_of_a_large_batch_in_any_order_get_the_bits_of_a_whole_step(make_law):
    """Numpy sorts lists of fewer joints than an eighth of the blocks."""
    law = make_law()
    joints = [900, 3, 901, 500]
    whole = law.joints(1000)
    by_list = law.joints(1000)
    d = np.random.default_rng(5).normal(0.0, 1e-7, (1000, law.dim))
    F, C = whole.update(d)
    F_listed, C_listed = by_list.update(d[joints], where=joints)
    assert F_listed.tobytes() == F[joints].tobytes()
    assert C_listed.tobytes() == C[joints].tobytes()


def test_a_list_in_any_order_of_a_batch_with_too_many_joints_is_refused(monkeypatch, law):
    monkeypatch.setenv("JOINTLAW_KERNEL", "native")
    monkeypatch.setattr(engine, "MAX_JOINTS_OF_ENTRIES", N - 1)
    batch = law.joints(N)
    d = np.full((2, law.dim), 1e-8)
    with pytest.raises(ValueError, match=f"more than {N - 1} joints: sort it"):
        batch.update(d, where=[1, 0])
    assert not batch.snapshot().values.any()
    batch.update(d, where=[0, 1])


def test_measures_of_a_list_are_in_its_order(make_law):
    law = make_law()
    whole = law.joints(N, track_dissipation=False)
    by_list = law.joints(N, track_dissipation=False)
    d = np.ascontiguousarray(path(law, 2, 6)[0])
    displayed = np.empty((N, 6 + law.dim))
    whole.advance(engine.Step(d, np.empty_like(d), None, measures=displayed))
    for joints in LISTS.values():
        m = len(joints)
        by_list.reset()
        step = engine.Step(
            d[joints], np.empty((m, law.dim)), None, joints, measures=np.empty((m, 6 + law.dim))
        )
        by_list.advance(step)
        assert step.measures.tobytes() == displayed[joints].tobytes()
        by_list.reset()
        step.measures[:] = 0.0
        by_list.advance(step)  # repeated, with the list as it was sorted
        assert step.measures.tobytes() == displayed[joints].tobytes()


@pytest.mark.parametrize("joints", [[3, 3], [5, 4, 3, 4], [*range(20), 7]])
def test_a_list_that_names_a_joint_twice_is_refused(law, joints):
    batch = law.joints(N)
    with pytest.raises(ValueError, match="where names a joint twice"):
        batch.update(np.full((len(joints), law.dim), 1e-8), where=joints)
    assert not batch.snapshot().values.any()


@pytest.mark.parametrize(
    ("joints", "message"),
    [([5, 4, 3, 4], "where names a joint twice"), ([3, 1, 999], "where names joint 999"),
     ([0, -1], "where names joint -1")],
)  # fmt: skip
@pytest.mark.parametrize("kernel", ["numpy", "native"])
def test_a_prepared_step_with_a_wrong_list_is_refused(monkeypatch, law, kernel, joints, message):
    """Also where the list was valid in another batch."""
    monkeypatch.setenv("JOINTLAW_KERNEL", kernel)
    d = np.full((len(joints), law.dim), 1e-8)
    step = engine.Step(d, np.empty_like(d), None, np.array(joints))
    batch = law.joints(N)
    if joints[-1] == 999:
        law.joints(1000).advance(step)
    with pytest.raises(ValueError, match=message):
        batch.advance(step)
    assert not batch.snapshot().values.any()
