"""The law knows no units: lengths in any unit, forces in any unit, the same joint."""

import numpy as np
import pytest
from extremes.checks import path
from extremes.laws import HEIGHTS, ORDINARY, SCALE, build, name
from extremes.matrix import COMPARED, kept_digits

pytestmark = pytest.mark.slow

DECIMAL = (1e6, 1e-9)


def scaled(changes, length, force):
    """The same law with lengths `length` times and forces `force` times as large a number."""
    p = ORDINARY | changes
    heights = HEIGHTS.get(p["heights"], p["heights"])
    if heights:
        heights = (heights[0], heights[1] * length, heights[2] * length, heights[3])
    return p | {
        "heights": heights,
        "K": p["K"] * force / length ** (1 + p["eta"]),
        "density": p["density"] / length**2,
        "range": p["range"] * length,
        "mating_length": p["mating_length"] * length,
        "yields at": p["yields at"] * length,
        "wears over": p["wears over"] * force / length,
    }


def compare(changes, length, force, seed=3, n=8, steps=24):
    """Largest differences in F and C, each of its peak, in stored and dissipated energy, of the
    peak of both together."""
    one, other = build(**changes).joints(n), build(**scaled(changes, length, force)).joints(n)
    d, _ = path(np.random.default_rng(seed), n, steps, SCALE)
    d = np.where(np.abs(d) < 1e-130, 0.0, d)  # 1e-140 of any unit is nothing: that has one
    gap, peak = np.zeros(4), np.zeros((4, n))
    for step in d:
        F, C = one.update(step)
        G, D = other.update(step * length)
        pairs = [
            (F, G / force * length**2),
            (C, D / force * length**3),
            (one.stored_energy, other.stored_energy / force * length),
            (one.dissipated_energy, other.dissipated_energy / force * length),
        ]
        for k, (a, b) in enumerate(pairs):
            away = np.abs(a - b).reshape(n, -1).max(axis=1)
            size = a if k < 2 else pairs[2][0] + pairs[3][0]
            peak[k] = np.maximum(peak[k], np.abs(size).reshape(n, -1).max(axis=1))
            gap[k] = max(gap[k], np.max(away / np.where(peak[k] > 0, peak[k], 1.0)))
    return gap


@pytest.mark.parametrize("changes", COMPARED, ids=name)
def test_results_scale(changes, record):
    """1e-12 is asked. Far from mate a joint is sheared by a whole closure while y moves by 1e-5 of
    itself. There the chord (G1 - G0)/(y1 - y0) keeps 11 digits, as a quotient and as the mean
    slope alike, and so does the loss of that step."""
    force, _, stored, lost = compare(changes, *DECIMAL)
    record("units, F", force, name(changes))
    record("units, energy", max(stored, lost), name(changes))
    grazing = "mating_length" in changes or "wears over" in changes
    kept = kept_digits(changes)  # the chord of what is left of G loses digits, too
    assert max(force, stored) < (1e-12 if kept == 1.0 else 1e-11 / kept)
    assert lost < (1e-11 / kept if grazing or kept < 1.0 else 1e-12)
