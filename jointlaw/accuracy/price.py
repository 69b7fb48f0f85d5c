"""What one resolution costs, and how far its tractions are off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..parameters.resolution import Resolution
from ..support.checks import Array


@dataclass(frozen=True)
class Price:
    """One resolution: errors are shares of the largest traction (or tangent) of each path.

    `error`, `rms` (paths,): of the traction. `friction`, `dilation`: largest misses of the angles
    (degrees) at constant normal stress, from 0.2 critical slips on. `tangent_rms`, `tangent_max`:
    of the tangent, over all paths; it jumps between stick and slip, and the largest error is that
    of a jump that comes one step early or late. `ns`, `ns_tangent`: nanoseconds per joint and
    update without and with tangent, no ledger, least of several runs; NaN where nothing was timed.
    `bytes`: per joint.
    """

    resolution: Resolution
    sliders: int
    error: Array
    rms: Array
    friction: float
    dilation: float
    tangent_rms: float
    tangent_max: float
    ns: float
    ns_tangent: float
    bytes: int

    @property
    def worst(self) -> float:
        """Largest error of the traction on any path."""
        return float(self.error.max())


def frontier(prices: Sequence[Price]) -> tuple[Price, ...]:
    """The prices that no other with as few sliders beats in its largest error."""
    best: list[Price] = []
    for row in sorted(prices, key=lambda row: (row.sliders, row.worst)):
        if not best or row.worst < best[-1].worst:
            best.append(row)
    return tuple(best)
