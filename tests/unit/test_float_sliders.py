"""Batches that store slider forces as float: accuracy, small increments, states and refusals."""

import pickle
from copy import copy
from functools import cache

import numpy as np
import pytest
from kinds import LAWS

import jointlaw as jl
from jointlaw.kernels.float_sliders import round_sliders

FLOAT = np.float32
JOINTS = 11
# of the largest traction: sixty roundings of each slider by at most 2^-23 of its force
TRACTION_ERROR = 2e-7
LEDGER_ERROR = 2e-6  # of the dissipated energy: a rounding over the slip of a step, D/50 on average
BITS_OF_FLOAT = 24


@pytest.fixture(params=["numpy", "native"])
def kernel(request, monkeypatch):
    """Both kernels, the second one if it was built."""
    monkeypatch.setenv("JOINTLAW_KERNEL", request.param)
    return request.param


def joints_of(law, dtype=FLOAT, n=JOINTS):
    """A batch, unless the law runs in numpy alone."""
    try:
        return law.joints(n, slider_dtype=dtype)
    except ImportError as error:
        pytest.skip(str(error))


def increments(law, steps=60, seed=1):
    """Steps (steps, n, dim) in m that close, shear, reverse and separate joints."""
    rng = np.random.default_rng(seed)
    size = 1e-6 if isinstance(law, jl.CoulombLaw) else 0.1 * law.closure_range
    d = size * rng.normal(size=(steps, JOINTS, law.dim))
    d[:, :, 0] += 0.02 * size
    return d


def sliders_of(joints):
    """Slider forces q (n, rows) of a batch."""
    first = joints.law.tables.first_rows["q"]
    return joints.snapshot().values[:, first : first + joints.law.tables.row_counts["q"]]


def run(joints, d):
    """Tractions (steps, n, dim) of a path, each the traction of the state after its step.

    In every fifth step the state is asked for its traction: the numpy kernel is slow.
    """
    tractions = []
    for number, step in enumerate(d):
        F, _ = joints.update(step, tangent=False)
        if number % 5 == 0:
            rounding = 0.0 if joints.kernel == "native" else 1e-13 * np.abs(F).max()
            np.testing.assert_allclose(joints.F, F, rtol=0, atol=rounding)
        tractions.append(F)
    return np.array(tractions)


@cache
def after_run(name, kernel, dtype=FLOAT):
    """Joints of a law after a path of a kernel, which the environment chooses, and tractions."""
    joints = joints_of(LAWS[name], dtype)
    return joints, run(joints, increments(LAWS[name]))


@pytest.mark.parametrize(
    ("kernel", "name"), [*(("native", name) for name in LAWS), ("numpy", "bond and filling")]
)
def test_tractions_and_energy_are_close_to_double_storage(kernel, name, monkeypatch):
    """In numpy one law: its other ones round as in C (`test_both_kernels_round_alike`)."""
    monkeypatch.setenv("JOINTLAW_KERNEL", kernel)
    single, F = after_run(name, kernel)
    double, expected = after_run(name, kernel, np.float64)
    assert np.abs(F - expected).max() <= TRACTION_ERROR * np.abs(expected).max()
    lost = double.dissipated_energy
    assert np.abs(single.dissipated_energy - lost).max() <= LEDGER_ERROR * lost.max()
    largest = np.abs(double.delta).max()
    np.testing.assert_array_equal(single.delta, double.delta)  # a double in both
    np.testing.assert_array_equal(single.damage, double.damage)
    assert largest > 0.0


@pytest.mark.parametrize("name", LAWS)
def test_both_kernels_round_alike(name, monkeypatch):
    tractions = []
    states = []
    for kernel in ("numpy", "native"):
        monkeypatch.setenv("JOINTLAW_KERNEL", kernel)
        joints, F = after_run(name, kernel)
        tractions.append(F)
        states.append(joints.snapshot().values)
    # kernels differ by 1e-14 of a force; where a number lies so close to the random threshold that
    # they round it to different floats, they differ by one float for a few steps
    np.testing.assert_allclose(*tractions, rtol=0, atol=1e-8 * np.abs(tractions[0]).max())
    changed = np.abs(states[0] - states[1]) > 1e-12 * np.abs(states[0]).max(axis=0)
    assert changed.mean() < 0.01


@pytest.mark.parametrize("name", ["population", "yielding", "bond and filling", "plane"])
def test_a_zero_increment_changes_nothing(name, kernel):
    joints = copy(after_run(name, kernel)[0])
    F = joints.F
    before = joints.snapshot().values
    for _ in range(3):
        again, _ = joints.update(np.zeros((JOINTS, joints.law.dim)), tangent=False)
        np.testing.assert_array_equal(again, F)
        np.testing.assert_array_equal(joints.snapshot().values, before)


def test_increments_far_below_the_resolution_of_a_float_are_not_lost():
    """Shear in 20 000 increments, each too small to change a float that is rounded to nearest."""
    law = LAWS["individual"]
    D = law.closure_range
    steps = 20_000
    d = np.array([[0.0, 2e-10 * D, 0.0]])
    changes = {}
    for dtype in (np.float64, FLOAT):
        joints = law.joints(1, slider_dtype=dtype)
        joints.update([[0.3 * D, 0.0, 0.0]], tangent=False)
        joints.update([[0.0, 0.02 * D, 0.0]], tangent=False)
        start = joints.F[0]
        q = sliders_of(joints)[0]
        for _ in range(steps):
            joints.update(d, tangent=False)
        changes[dtype] = joints.F[0, 1] - start[1]
        loaded = np.abs(q) > 1e-3 * np.abs(q).max()
        per_step = np.abs(sliders_of(joints)[0] - q)[loaded] / steps
        assert (per_step < 0.5 * np.spacing(np.abs(q[loaded]).astype(FLOAT))).all()
    # a random walk of each slider by sqrt(interval x path), 4 % of the path, over sqrt(sliders)
    assert changes[np.float64] > 0.0
    assert abs(changes[FLOAT] - changes[np.float64]) < 0.03 * changes[np.float64]


def test_repeated_cycles_do_not_drift():
    """1000 equal cycles of shear below the friction limit have other roundings in each cycle."""
    law = LAWS["individual"]
    D = law.closure_range
    amplitudes = 1e-3 * D * np.array([1.0, 0.37, -1.37])  # no floats, and not symmetric
    tractions = []
    for dtype in (np.float64, FLOAT):
        joints = law.joints(8, slider_dtype=dtype)
        d = np.zeros((8, 3))
        d[:, 0] = np.linspace(0.2, 0.5, 8) * D
        joints.update(d, tangent=False)
        d[:, 0] = 0.0
        for _ in range(1000):
            for d[:, 1] in amplitudes:
                joints.update(d, tangent=False)
        tractions.append(joints.F)
    double, single = tractions
    # 3000 roundings of at most 2^-24: their sum is 1.8e-4 if all are equal, 2e-6 if independent
    assert np.abs(single - double).max() < 2e-6 * np.abs(double).max()


def test_rounding_is_unbiased_and_moves_to_a_neighbour():
    rng = np.random.default_rng(5)
    B = 20_000
    q = rng.normal(size=(2, 3, 2, 1)) * 10.0 ** rng.uniform(-8.0, 8.0, (2, 3, 2, 1))
    q = np.broadcast_to(q, (2, 3, 2, B))
    rounded = round_sliders(q, q, rng.normal(size=(3, B)))
    np.testing.assert_array_equal(rounded, rounded.astype(FLOAT))
    interval = np.spacing(np.abs(q).astype(FLOAT)).astype(float)
    error = (rounded - q) / interval
    assert np.abs(error).max() < 1.0
    # the variance of one rounding is at most 1/4
    assert np.abs(error.mean(axis=3)).max() < 5.0 * 0.5 / np.sqrt(B)
    assert np.abs(np.corrcoef(error.reshape(12, B)) - np.eye(12)).max() < 5.0 / np.sqrt(B)
    floats = rounded.copy()
    np.testing.assert_array_equal(round_sliders(q, floats, rng.normal(size=(3, B))), floats)


def test_a_state_takes_half_of_the_memory():
    for preset in jl.presets.names():
        law = jl.presets.load(preset)
        joints = law.joints(3, slider_dtype=FLOAT)
        doubles = 8 * law.state_size
        others = doubles - 8 * law.tables.row_counts["q"]
        assert joints.bytes_per_joint == others + (doubles - others) // 2
        assert joints.bytes_per_joint < 0.6 * doubles
        assert joints._state.nbytes == 8 * joints.bytes_per_joint  # one block of eight joints


def test_states_continue_bit_for_bit(tmp_path, kernel):
    law = LAWS["yielding"]
    d = increments(law)
    joints = joints_of(law)
    run(joints, d[:30])
    state = joints.snapshot()
    joints_of(law).restore(state)
    state.save(tmp_path / "state.npz")
    restored = joints_of(law)
    restored.restore(jl.load_state(tmp_path / "state.npz"))
    pool = jl.JointPool(law, slider_dtype=FLOAT)
    pool.restore(range(JOINTS), state)
    others = {
        "file": restored,
        "pickle": pickle.loads(pickle.dumps(joints)),
        "copy": copy(joints),
        "pool": pool.batch,
    }
    expected = run(joints, d[30:])
    for name, other in others.items():
        assert other.slider_dtype == FLOAT, name
        np.testing.assert_array_equal(run(other, d[30:]), expected, name)
        np.testing.assert_array_equal(other.snapshot().values, joints.snapshot().values, name)


def test_a_saved_state_takes_half_of_the_space(tmp_path):
    law = LAWS["population"]
    sizes = []
    for dtype in (np.float64, FLOAT):
        law.joints(1000, slider_dtype=dtype).snapshot().save(tmp_path / "state.npz")
        sizes.append((tmp_path / "state.npz").stat().st_size)
    assert sizes[1] < 0.56 * sizes[0]


def test_states_of_both_storages_are_exchanged():
    law = LAWS["population"]
    double = law.joints(JOINTS)
    single = law.joints(JOINTS, slider_dtype=FLOAT)
    run(double, increments(law))
    state = double.snapshot()
    single.restore(state)
    first, end = single.snapshot().float_rows
    expected = state.values.copy()
    expected[:, first:end] = expected[:, first:end].astype(FLOAT)
    np.testing.assert_array_equal(single.snapshot().values, expected)
    double.restore(single.snapshot())
    np.testing.assert_array_equal(double.snapshot().values, expected)


def test_listed_joints_and_threads_have_the_same_bits(monkeypatch):
    law = LAWS["mating length"]
    rng = np.random.default_rng(3)
    n = 3000
    d = 1e-7 * rng.normal(size=(5, n, law.dim))
    whole = law.joints(n, slider_dtype=FLOAT)
    listed = law.joints(n, slider_dtype=FLOAT)
    monkeypatch.setenv("JOINTLAW_THREADS", "1")
    for step in d:
        monkeypatch.setenv("JOINTLAW_THREADS", "2")
        F, _ = whole.update(step, tangent=False)
        monkeypatch.setenv("JOINTLAW_THREADS", "1")
        for part in np.array_split(rng.permutation(n), 3):
            np.testing.assert_array_equal(
                listed.update(step[part], where=part, tangent=False)[0], F[part]
            )
    np.testing.assert_array_equal(listed.snapshot().values, whole.snapshot().values)
    one = law.joints(1, slider_dtype=FLOAT)
    for step in d:
        one.update(step[7:8], tangent=False)
    np.testing.assert_array_equal(one.snapshot().values, whole.snapshot(where=[7]).values)


def test_a_batch_grows_resets_and_breaks_bonds():
    law = LAWS["bond"]
    pool = jl.JointPool(law, slider_dtype=FLOAT)
    places = pool.assign(range(20))
    pool.batch.update(np.full((20, 3), 1e-7), where=places, tangent=False)
    batch = pool.batch
    F = batch.F
    pool.add(range(20, 40))
    np.testing.assert_array_equal(batch.F[:20], F)
    assert not batch.F[20:].any()
    batch.break_bond([3])
    assert batch.damage[3] == 1.0
    assert (batch.damage[[2, 4]] < 1.0).all()
    batch.reset([3])
    assert not batch.snapshot(where=[3]).values.any()


def test_what_does_not_fit_is_refused():
    law = LAWS["population"]
    for dtype in (np.float16, int, "single precision", object):
        with pytest.raises(ValueError, match=r"slider_dtype = .* numpy.float64 or numpy.float32"):
            law.joints(3, slider_dtype=dtype)
    joints = law.joints(3, slider_dtype="float32")
    state = joints.snapshot()
    state.values[1, 7] = 2e38
    with pytest.raises(ValueError, match=r"2e.38 Pa, .* at most 1e.38 Pa.*numpy.float64"):
        joints.restore(state)
    far = 10.0 * law.tables.max_closure_with_float_sliders
    with pytest.raises(jl.NonFiniteError, match="not finite as float32; nothing was moved"):
        joints.update(np.full((3, 3), far))
    assert not joints.snapshot().values.any()
    law.joints(3).update(np.full((3, 3), far))  # is finite as double
