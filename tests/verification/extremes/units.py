"""The law knows no units: lengths in any unit, forces in any unit, the same joint."""

import numpy as np

from extremes.checks import path
from extremes.laws import HEIGHTS, ORDINARY, SCALE, build

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
