"""States that no joint has: Python and the C header refuse the same ones and change nothing."""

import re

import numpy as np
import pytest
from c_host import CLaw, library, random_path
from kinds import LAWS

import jointlaw as jl

FORGED = [
    -1e-9,
    -1.0,
    0.5,
    1.0 + 1e-9,
    1.5,
    2.0,
    2.5,
    5.0,
    1e40,
    1e80,
    1e155,
    -1e155,
    1e200,
    -1e200,
]
FORGED += [np.nan, np.inf, -np.inf, np.finfo(float).max]


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    return library(tmp_path_factory.mktemp("c"), "-O1", "-DJOINTLAW_SCALAR", "-ffp-contract=off")


def refusal(step, *arguments):
    """Message of the refusal of a step or state; empty if it is accepted."""
    try:
        step(*arguments)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", LAWS)
def test_python_and_c_accept_the_same_states(lib, tmp_path, name):
    """Every named part of a state takes every forged value, and random numbers of it do."""
    law = LAWS[name]
    one = CLaw(lib, law, tmp_path)
    joints = law.joints(2)
    for d in random_path(law.dim, 3, 15):
        joints.update(np.tile(d, (2, 1)))
    states = joints.snapshot().values
    before = joints.F.copy()
    rng = np.random.default_rng(7)
    counts = law.tables.row_counts
    firsts = law.tables.first_rows
    verdicts = []
    zero = np.zeros((2, law.dim))
    for value in FORGED:
        for part, count in counts.items():
            if not count:
                continue
            row = firsts[part] + int(rng.integers(count))
            forged = states.copy()
            forged[1, row] = value
            one.state[:] = forged[1]
            state = jl.JointState(law.fingerprint, forged)
            in_c = refusal(one.step, zero[0])
            messages = refusal(law.step, forged, zero), refusal(law.joints(2).restore, state)
            assert [bool(message) for message in messages] == [bool(in_c)] * 2, (part, value)
            if in_c:
                assert re.match(rf"{part}\b.* of the state .*Start from zeros", in_c), in_c
                pattern = rf"joint 1: .*{part}.* out of bounds: .*virgin state"
                for message in messages:
                    assert re.match(pattern, message), message
                np.testing.assert_array_equal(one.state, forged[1])
                assert refusal(joints.restore, state)
                np.testing.assert_array_equal(joints.snapshot().values, states)
                np.testing.assert_array_equal(joints.F, before)
            verdicts.append(not in_c)
    assert any(verdicts)
    assert not all(verdicts)
