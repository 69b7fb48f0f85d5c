"""Laws written to TOML and read again; a write that fails leaves the old file."""

import math

import kinds
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl

HISTOGRAM = ([1, 2.5, 1 / 3], [0.1e-6, 2e-6, 4e-6, 5e-6])
LAWS = kinds.LAWS | {
    "thirds": kinds.make_law(heights=jl.Heights(HISTOGRAM, 1e-6, "individual"), K=1e8 / 3),
    "brittle bond": kinds.make_law(bond=jl.Bond(1e10, 1 / 3e-10, 0.0, 1e6)),
    "own resolution": kinds.make_law(resolution=jl.Resolution(3, 5, 7)),
    "cells for small loads": kinds.make_law(resolution=jl.Resolution(3, 5, 7, lowest=0.02)),
    "named resolution": kinds.make_law(resolution="fine"),
    "default range": kinds.make_law(closure_range=None),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_file_round_trip(law, tmp_path):
    path = tmp_path / "law.toml"
    assert law.to_toml(path) == path.read_text(encoding="utf-8")
    back = jl.JointLaw.from_toml(path)
    assert (back, back.fingerprint) == (law, law.fingerprint)


@given(
    a=st.floats(1, 1e3), b=st.floats(-1, 2), share=st.floats(-1, 1), K=st.floats(1e-100, 1e100),
    mu=st.floats(0, 1e3), plane=st.none() | st.floats(-10, 10), slip=st.floats(1e-7, math.inf),
)  # fmt: skip
def test_every_number_is_kept_to_the_last_bit(make_law, a, b, share, K, mu, plane, slip):
    law = make_law(a=a, b=b, c=share * (1 / 3 - b / 6), K=K, mu=mu, plane=plane, mating_length=slip)
    assert jl.JointLaw.from_text(law.to_toml()) == law


@pytest.mark.parametrize(
    "write",
    [lambda law, path: law.to_toml(path), lambda law, path: law.joint().snapshot().save(path)],
)
def test_an_interrupted_write_leaves_the_old_file(law, make_law, tmp_path, monkeypatch, write):
    """The disk is full after nine bytes."""
    path = tmp_path / "old.npz"
    write(law, path)
    before, write_bytes = path.read_bytes(), type(path).write_bytes

    def fail(file, data):
        write_bytes(file, data[:9])
        raise OSError("disk full")

    monkeypatch.setattr(type(path), "write_bytes", fail)
    with pytest.raises(OSError, match="disk full"):
        write(make_law(a=5.0), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
