"""Transfer of history where a law point goes on to a corner with another length of joint.

Lengths match wherever an edge that lies on another, or a corner that stands on an edge, goes on to
the same. Else a joint that became shorter drops what it stored on the rest. One that became longer
would make energy: it starts anew instead, at a closure at which it holds what the shorter one held;
the rest of the depth becomes its closure offset.
"""

from dataclasses import replace

import numpy as np

from ..contact import Joints, LawPoints, Points
from .state import State

MATCH = 1e-6  # relative: lengths that are equal but for rounding


def transferred(
    joints: Joints, now: State, law_points: LawPoints, points: Points, before: np.ndarray,
    thickness: float,
) -> State:  # fmt: skip
    """The state with joints and books for the lengths of `points`, `before` (n,) in m."""
    stored = joints.now["stored"]
    held, ratio = stored * before, points.length / np.maximum(before, 1e-300)
    changed = np.flatnonzero((np.abs(ratio - 1) > MATCH) & (held > 0)).tolist()
    ledger = now.ledger
    area, lost = ledger.area.copy(), ledger.lost.copy()
    offset = law_points.closure_offset.copy()
    for i in changed:
        length, kept = points.length[i], stored[i]
        if ratio[i] > 1:
            point = now.layout.identities[i]
            curve, depth = joints.curve(point), law_points.closure(points)[i]
            closure = min(curve.closure_at_work(held[i] / length), depth)
            offset[i] += depth - closure
            kept = curve.work_at(closure)
            joints.renew(point)
            lost[i] = 0.0
        ledger = ledger.dropping(max(float(held[i] - kept * length), 0.0) * thickness)
        area[i] = length * thickness
    law_points = replace(law_points, closure_offset=offset)
    return replace(now, law_points=law_points, ledger=replace(ledger, area=area, lost=lost))
