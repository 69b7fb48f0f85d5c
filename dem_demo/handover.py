"""The books where a law point goes on to a corner that stands for another length of joint.

Lengths match wherever an edge that lies on another, or a corner that stands on an edge, goes on to
the same. Else a joint that became shorter drops what it stored on the rest. One that became longer
would make energy: it is crushed instead, that is, it starts anew at a closure at which it holds
what the shorter one held.
"""

from __future__ import annotations

import numpy as np

from .geometry import Points

MATCH = 1e-6  # relative: lengths that are equal but for rounding


def hand_over(sim, before: np.ndarray, points: Points) -> None:
    """Adapt joints and books to the lengths of `points`, which were `before` (n,) in m."""
    now, thick = sim.joints.now, sim.scene.thickness
    held, ratio = now["stored"] * before, points.length / np.maximum(before, 1e-300)
    for i in np.flatnonzero((np.abs(ratio - 1) > MATCH) & (held > 0)).tolist():
        length, kept = points.length[i], now["stored"][i]
        if ratio[i] > 1:
            most = sim.interfaces.closure(points)[i]
            closure = min(sim.joints.closure_at_work(i, held[i] / length), most)
            sim.interfaces.crushed[i] += most - closure
            kept = sim.joints.work_at(i, closure)
            sim.joints.forget(i)
            sim.ledger.e_lost[i] = 0.0
        sim.ledger.value["dropped"] += max(float(held[i] - kept * length), 0.0) * thick
        sim.area[i] = length * thick
