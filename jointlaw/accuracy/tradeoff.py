"""The price list of a law: what each resolution costs and how far its tractions are off."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from timeit import Timer

import numpy as np

from ..kernels.threads import thread_count
from ..parameters.resolution import Resolution, named, resolve
from ..support.checks import Array, integer
from ..support.progress import track
from .slip import JointLaw
from .suite import Suite, standard_suite

SPREAD = tuple(
    Resolution(u, phi, depth)
    for u, phi in ((1, 3), (2, 3), (3, 3), (3, 5), (5, 6), (8, 8))
    for depth in (1, 2, 3, 4, 6, 10, 16)
)
ROUNDING = 1e-6  # a smaller share by which errors differ is none
_MEMORY = 100_000_000  # bytes of state that a timing may use; very fine laws get a smaller batch


@dataclass(frozen=True)
class Price:
    """One resolution: `error` (paths,) is that of the traction, over the largest of each path.

    `friction`, `dilation`: largest misses of the angles (degrees) at constant normal stress, from
    0.2 mating lengths on. `ns`, `ns_tangent`: nanoseconds per joint and update without and with
    tangent, no ledger, least of several runs; NaN where nothing was timed. `bytes`: per joint.
    """

    resolution: Resolution
    sliders: int
    error: Array
    friction: float
    dilation: float
    ns: float
    ns_tangent: float
    bytes: int

    @property
    def worst(self) -> float:
        """Largest error of the traction on the standard paths."""
        return float(self.error.max())


@dataclass(frozen=True)
class Tradeoff:
    """Prices by ascending sliders; print it to read its frontier and the named ones.

    `uncertainty` (paths,) is that of the reference that errors are measured against; `joints` the
    size of the batch that was timed, on the kernel and threads named in `how`; `named` are the
    resolutions of this law that have names.
    """

    paths: tuple[str, ...]
    uncertainty: Array
    rows: tuple[Price, ...]
    joints: int
    how: str
    named: dict[str, Resolution]

    def frontier(self) -> tuple[Price, ...]:
        """The prices that no other with as few sliders beats or equals in its largest error."""
        best: list[Price] = []
        for row in sorted(self.rows, key=lambda row: (row.sliders, row.worst)):
            if not best or row.worst < (1.0 - ROUNDING) * best[-1].worst:
                best.append(row)
        return tuple(best)

    def __str__(self) -> str:
        lines = [
            f"{'u phi depth':>12s} {'sliders':>8s} {'bytes':>7s} {'max error':>10s} "
            f"{'friction':>9s} {'dilation':>9s} {'ns':>8s} {'with tangent':>13s}  "
            f"{'worst path':16s}name"
        ]
        names = {r: name for name, r in self.named.items()}
        shown = {row.resolution for row in self.frontier()} | set(names)
        for row in sorted(self.rows, key=lambda row: row.sliders):
            r = row.resolution
            if r not in shown:
                continue
            path = self.paths[int(row.error.argmax())]
            lines.append(
                f"{f'{r.u} {r.phi} {r.depth}':>12s} {row.sliders:8d} {row.bytes:7d} "
                f"{row.worst:10.3%} {row.friction:8.2f}° {row.dilation:8.2f}° {row.ns:8.0f} "
                f"{row.ns_tangent:13.0f}  {path:16s}{names.get(r, '')}".rstrip()
            )
        timed = f"ns per joint and update: up to {self.joints} joints, {self.how}"
        return "\n".join([
            *lines,
            f"{len(self.rows)} resolutions tried; listed are the named ones and the Pareto front "
            "of sliders and max error.",
            f"Uncertainty of the comparison solution {self.uncertainty.max():.2%}; "
            f"{timed if self.joints else 'nothing was timed'}",
        ])  # fmt: skip


def tradeoff(
    law: JointLaw,
    resolutions: Sequence[str | Resolution] | None = None,
    joints: int = 10_000,
    seconds: float = 0.2,
) -> Tradeoff:
    """See `JointLaw.tradeoff`."""
    joints = integer("joints", joints, 0)
    lengths = law.mating_length, law.asperity.yield_interference, law.closure_range
    names = named(*lengths)
    if resolutions is None:
        resolutions = (*SPREAD, *names.values())
    chosen = {resolve(r, *lengths) for r in resolutions}
    found = sorted(chosen, key=lambda r: (r.sliders, r.u, r.phi, r.lowest))
    suite = standard_suite(law)
    rows = tuple(
        _price(replace(law, resolution=r), suite, joints, seconds)
        for r in track(found, "resolutions", len(found))
    )
    threads = thread_count()
    how = f"{law.joints(0).kernel}, up to {threads} thread{'s' * (threads > 1)}"
    return Tradeoff(suite.names, suite.uncertainty, rows, joints, how, names)


def _price(law: JointLaw, suite: Suite, joints: int, seconds: float) -> Price:
    size = law.joints(0).bytes_per_joint
    ns, with_tangent = (_time(law, joints, tangent, seconds) for tangent in (False, True))
    return Price(law.resolution, law.tables.sliders, *suite.miss(law), ns, with_tangent, size)


def _time(law: JointLaw, n: int, tangent: bool, seconds: float) -> float:
    """Least time of an update in ns per joint, of runs that take this long together."""
    if n == 0:
        return float("nan")
    n = min(n, max(_MEMORY // (8 * law.tables.rows), 1))
    batch, dim = law.joints(n, ledger=False), law.tables.dim
    rng = np.random.default_rng(0)
    steps = rng.normal(0.0, 0.1 * law.closure_range, (3, n, dim))
    moves = cycle([*steps, *-steps])
    first = np.zeros((n, dim))
    first[:, 0] = law.closure_range * rng.uniform(0.3, 0.8, n)
    batch.update(first, tangent=tangent)
    timer = Timer(lambda: batch.update(next(moves), tangent=tangent))
    return min(timer.repeat(max(3, round(seconds / timer.timeit(1))), 1)) / n * 1e9
