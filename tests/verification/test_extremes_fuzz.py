"""Random laws on random paths: 1e6 updates in the report, a part of them here."""

import numpy as np
import pytest
from extreme_checks import refused, run
from extreme_laws import COMPILED, build, random_changes

# what this very suite found: caps of sizes whose squares underflow (56, 61), and cells beyond the
# last height, where the slope of the table wavers by its rounding (238, 594)
FOUND = [56, 61, 238, 594]


def fuzz(seed, n=8, steps=32):
    """Faults of the law and path of a seed; None when the law is refused."""
    changes, size = random_changes(np.random.default_rng(seed))
    try:
        law = build(**changes)
    except ValueError as error:
        if "not convex" in str(error) or "cannot be tabulated" in str(error):
            return None
        raise
    return run(law, size, seed, n, steps) + refused(law, size)


@pytest.fixture(autouse=True)
def replays(tmp_path, monkeypatch):
    monkeypatch.setenv("JOINTLAW_REPLAY_DIR", str(tmp_path))


@pytest.mark.parametrize("seed", FOUND)
def test_what_was_found_stays_mended(seed):
    assert fuzz(seed) == []


@pytest.mark.parametrize("first", range(10_000, 10_100, 20))
def test_random_laws_on_random_paths(first):
    count = 20 if COMPILED else 8
    found = {seed: fuzz(seed) for seed in range(first, first + count)}
    assert not {seed: faults for seed, faults in found.items() if faults}
    # one law in eight is refused: heights too narrow for a population, or too steep for a table
    assert sum(faults is None for faults in found.values()) < count / 2
