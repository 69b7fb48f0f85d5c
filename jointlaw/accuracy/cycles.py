"""Small cycles: what a cycle of shear loses, its stiffness, and the shear that normal cycles leave.

At CLOSURE of the closure range the joint is sheared to and fro at constant closure, by AMPLITUDES
of the closure range; what counts is the CYCLES-th cycle. Then shear is locked in by a shear of
LOCKED closure ranges, or half the critical slip if that is less, and the joint opens and closes
TURNS times by OPENINGS of its closure.

A cell of touch depth is elastic until all of it slides. So cells miss what slips first: the
asperities that have just touched. The exact bed has the cells of any law, placed ever closer
towards the closure at which the cycles are made.
"""

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np

from ..discretisation.tables import with_depths
from ..parameters.resolution import Resolution
from ..support.checks import Array, frozen
from .suite import Law, reference_resolution, scaled

AnyLaw = TypeVar("AnyLaw", bound=Law)

AMPLITUDES = frozen((10.0 ** np.linspace(-3.0, 0.0, 25),))[0]
OPENINGS = frozen((np.array([0.001, 0.01, 0.1]),))[0]
CLOSURE, CYCLES, LOCKED, TURNS = 0.7, 4, 0.1, 100
AZIMUTH = 20.0  # degrees, of the shear in space
NEGLIGIBLE = 1e-4  # damping ratio: where the exact one is less, the loss is missed by shares of it
_STEPS = 8  # of a quarter cycle: 60 change the loss by 3e-4
_LEAST, _FACTOR = 1e-5, 1.15  # of the closure: the thinnest cells; each is so much thicker


class Cycles(NamedTuple):
    """Cycles of each of AMPLITUDES (n,), and the shear that those of OPENINGS (m,) leave.

    amplitude: in m. loss: work of the cycle, the area of its loop, in J/m2. secant: slope of the
    line between its ends in Pa/m. kept: share of the locked-in shear stress.
    """

    amplitude: Array
    loss: Array
    secant: Array
    kept: Array

    @property
    def damping(self) -> Array:
        """Damping ratio (n,): loss over 4 pi times the energy secant amplitude^2/2."""
        return self.loss / (2 * np.pi * self.secant * self.amplitude**2)

    def missed(self, exact: "Cycles") -> tuple[Array, Array, Array]:
        """Misses of loss and secant, as shares, and of the kept shear."""
        least = 2 * np.pi * NEGLIGIBLE * exact.secant * exact.amplitude**2
        loss = np.abs(self.loss - exact.loss) / np.maximum(exact.loss, least)
        return loss, np.abs(self.secant / exact.secant - 1.0), np.abs(self.kept - exact.kept)


def cycles(law: Law, closure_range: float) -> Cycles:
    """The cycles of a law, at its own nodes."""
    amplitude = closure_range * AMPLITUDES
    way = _way(law)
    batch = law.joints(len(amplitude))
    to = CLOSURE * closure_range * _normal(law) * np.ones((len(amplitude), 1))
    batch.update(to, tangent=False)
    quarter = amplitude[:, None] / _STEPS * way

    def sheared(sign: float, quarters: int) -> Array:
        for _ in range(quarters * _STEPS):
            F, _ = batch.update(sign * quarter, tangent=False)
        return np.asarray(F @ way)

    sheared(1.0, 1)
    for _ in range(CYCLES):
        before = batch.dissipated_energy + batch.stored_energy
        low, high = sheared(-1.0, 2), sheared(1.0, 2)
    loss = batch.dissipated_energy + batch.stored_energy - before
    return Cycles(amplitude, loss, (high - low) / (2.0 * amplitude), _kept(law, closure_range))


def exact_cycles(law: Law, facets: Resolution | None = None) -> Cycles:
    """The cycles of the exact bed: facets of a resolution, and depth cells where they count.

    Half the rings and azimuths of the reference are enough for facets, and are the default.
    """
    facets = facets or scaled(reference_resolution(law), 0.5)
    return _exact(replace(law, resolution=replace(facets, depth=1, front=False)))


@lru_cache(maxsize=64)
def _exact(law: Law) -> Cycles:
    R = law.closure_range
    closed = CLOSURE * R * _normal(law)
    found = cycles(_crowded(law, closed), R)
    locked = _crowded(law, closed + _locked(law, R) * _way(law))
    return found._replace(kept=_kept(locked, R))


def _kept(law: Law, closure_range: float) -> Array:
    """Share of the locked-in shear stress that normal cycles leave."""
    normal, way = _normal(law), _way(law)
    batch = law.joints(len(OPENINGS), ledger=False)
    closure = CLOSURE * closure_range
    batch.update(closure * normal * np.ones((len(OPENINGS), 1)), tangent=False)
    shear = _locked(law, closure_range) * way * np.ones((len(OPENINGS), 1))
    before, _ = batch.update(shear, tangent=False)
    opening = closure * OPENINGS[:, None] * normal
    for _ in range(TURNS):
        batch.update(-opening, tangent=False)
        after, _ = batch.update(opening, tangent=False)
    return np.asarray((after @ way) / (before @ way))


def _locked(law: Law, closure_range: float) -> float:
    """How far (m) the joint is sheared to lock in shear."""
    return min(LOCKED * closure_range, law.tables.critical_slip / 2.0)


def _normal(law: Law) -> Array:
    return np.eye(law.tables.dim)[0]


def _way(law: Law) -> Array:
    """The direction of shear."""
    turn = math.radians(AZIMUTH)
    return np.array([0.0, 1.0] if law.tables.dim == 2 else [0.0, math.cos(turn), math.sin(turn)])


def _crowded(law: AnyLaw, at: Array) -> AnyLaw:
    """The law with depth cells crowded where a displacement `at` (dim,), in m, just touches.

    And at zero, where slip ends when all asperities slide, and Phi'' may be singular.
    """
    made = replace(law)
    if made.tables.curve.linear:  # all asperities touch at once: one cell is exact
        return made
    y = np.maximum(made.tables.m.T @ at, 0.0)[:, None]
    count = math.ceil(math.log(1.0 / _LEAST) / math.log(_FACTOR))
    off = at[0] * np.geomspace(_LEAST, 1.0, count)
    low = np.tile(off[count // 2 :], (len(y), 1))
    limits = np.sort(np.maximum(np.concatenate([low, y - off, y, y + off], axis=1), 0.0), axis=1)
    zero, end = np.zeros_like(y), np.full_like(y, np.inf)
    vars(made)["tables"] = with_depths(made.tables, np.concatenate([zero, limits, end], axis=1))
    return made
