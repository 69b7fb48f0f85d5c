"""The compiled kernel gives the numbers of the readable one, however it is called."""

import threading

import numpy as np
import pytest
from c_host import random_law

from jointlaw.kernels import engine
from jointlaw.kernels.threads import share_out

# Either kernel sums a few hundred terms per facet in its own order and carries q over the path: a
# few hundred times the rounding of 1e-16. That is the share of the largest value that may differ.
SAME = 1e-12
# C holds d(chord)/dy, a second difference of G: rounding grows by (y/dy)^2, up to (1/NEAR)^2 =
# 1e10, in the few facets that a step hardly opens or closes, and is usual in nearly all joints.
SAME_C, USUAL_C = 2e-6, 1e-12
N = 17 * engine.LANES + 3  # blocks of joints and part of another


def path(law, seed, steps=25, n=N):
    """Increments (steps, n, dim): a closure, then anything, apart in the middle."""
    rng = np.random.default_rng(100 + seed)
    d = rng.normal(0.0, 3e-7, (steps, n, law.tables.dim))
    d[0, :, 0] = rng.uniform(2e-7, 1.5e-6, n)
    d[steps // 2, :, 0] = -rng.uniform(0.0, 4e-6, n)
    d[steps // 2 + 2, :, 0] = rng.uniform(0.0, 4e-6, n)
    return d


@pytest.fixture
def both(monkeypatch):
    """Makes two of the same: advanced by numpy and by the compiled law."""

    def make(build):
        made = []
        for name in ("numpy", "native"):
            monkeypatch.setenv("JOINTLAW_KERNEL", name)
            made.append(build())
            assert made[-1].kernel == name
        return made

    return make


def worst(one, other, peak):
    return np.max(np.abs(np.asarray(one) - np.asarray(other)), initial=0.0) / peak


@pytest.mark.parametrize(("seed", "ledger"), [(9, True), (10, False)])
def test_same_numbers_while_contacts_come_and_go(both, seed, ledger):
    law = random_law(seed)
    d, dim = path(law, seed, 20, 400), law.tables.dim
    results = []
    for batch in both(lambda: law.joints(N, ledger)):
        given = [batch.update(d[0, :N], tangent=False)[0]]
        given += batch.update(d[1, :40], where=np.arange(N)[::-1][:40], tangent=False)[:1]
        batch.reset([0, 7, 64, N - 1])
        given += batch.trial(d[2, :N], tangent=False)[:1]
        given += batch.update(d[3, :N])[:1]
        batch.resize(400)  # from two blocks to more
        given += batch.update(d[4])[:1]
        mask = np.arange(400) % 3 == 0
        given += batch.update(d[5, mask], where=mask)[:1]
        given += batch.trial(d[5, mask], where=mask)[:1]
        batch.resize(30)
        batch.resize(150)
        given += [batch.update(step[:150])[0] for step in d[6:]]
        given += batch.update(np.empty((0, dim)), where=[])[:1]
        results.append([*given, batch.F])
    peak = max(np.abs(F).max() for F in results[0] if F.size)
    for one, other in zip(*results, strict=True):
        assert worst(one, other, peak) < SAME


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


def test_threads_change_no_bit(monkeypatch):
    seed = 10
    law = random_law(seed)
    monkeypatch.setattr(engine, "SERIAL", 0)
    monkeypatch.setenv("JOINTLAW_KERNEL", "native")
    d, index = path(law, seed, 6, 500), np.random.default_rng(0).permutation(500)[:333]
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("JOINTLAW_THREADS", threads)
        batch, given = law.joints(500), []
        for step in d[:4]:
            given += batch.update(step)
        given += batch.update(d[4, :333], where=index)
        given += batch.trial(d[5])
        results.append([*given, batch.snapshot().values, *batch.measures()])
    for one, two, five in zip(*results, strict=True):
        np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(one, five)


def test_what_fails_on_another_thread_is_raised_after_all_have_ended():
    ended = []

    def work() -> None:
        if threading.current_thread() is not threading.main_thread():
            raise MemoryError("no memory")
        ended.append(True)

    for _ in range(2):  # the thread that failed works on
        with pytest.raises(MemoryError, match="no memory"):
            share_out(work, 2)
    assert ended == [True, True]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("JOINTLAW_KERNEL", "cuda", "choose one of numpy, native"),
        ("JOINTLAW_THREADS", "two", "a whole number >= 1"),
    ],
)
def test_bad_settings_are_named(law, monkeypatch, name, value, message):
    monkeypatch.setattr(engine, "SERIAL", 0)
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
            assert worst(two[1], one, np.abs(one).max() + 1e-300) < SAME_C
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
            shown = np.empty((N, 6 + dim))
            batch.take(engine.Step(increments, np.empty((N, dim)), None, shown=shown))
            measures = *batch.measures()[:4], batch.dissipated_energy, batch.damage
            np.testing.assert_array_equal(shown, np.column_stack([*measures, batch.delta]))
