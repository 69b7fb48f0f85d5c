"""Cost and error of the resolutions of a law."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from timeit import Timer

import numpy as np

from ..kernels.threads import thread_count
from ..parameters.resolution import Resolution, named_resolutions, resolve
from ..support.checks import Array, integer
from ..support.progress import track
from .slip import JointLaw
from .suite import Suite, standard_suite

DEFAULT_RESOLUTIONS = tuple(
    Resolution(u, phi, depth)
    for u, phi in ((1, 3), (2, 3), (3, 3), (3, 5), (5, 6), (8, 8))
    for depth in (1, 2, 3, 4, 6, 10, 16)
)
EQUAL_ERRORS = 1e-6  # relative difference below which two errors count as equal
MAX_TIMING_MEMORY = 100_000_000  # bytes of state of a timed batch; very fine laws get fewer joints


@dataclass(frozen=True)
class ResolutionCost:
    """Cost and error of one resolution.

    resolution: its nodes. sliders: their number.
    traction_error: (paths,), over the largest traction of each path.
    friction_error, dilation_error: largest errors of the angles (degrees) at constant normal
        stress, from 0.2 mating lengths on.
    update_ns, tangent_update_ns: nanoseconds per joint and update without and with tangent, without
        tracking dissipation, minimum of several runs; NaN without timing.
    bytes_per_joint: size of the state.
    """

    resolution: Resolution
    sliders: int
    traction_error: Array
    friction_error: float
    dilation_error: float
    update_ns: float
    tangent_update_ns: float
    bytes_per_joint: int

    @property
    def max_error(self) -> float:
        """Largest error of the traction on the standard paths."""
        return float(self.traction_error.max())


@dataclass(frozen=True)
class Tradeoff:
    """Costs of resolutions by ascending sliders; `print` shows the Pareto front and the named ones.

    paths: names of the standard paths.
    uncertainty: (paths,), of the reference solution.
    rows: one for each resolution.
    joints: size of the timed batch, 0 without timing. kernel: compiled or numpy, and its threads.
    named: the resolutions of this law that have names.
    """

    paths: tuple[str, ...]
    uncertainty: Array
    rows: tuple[ResolutionCost, ...]
    joints: int
    kernel: str
    named: dict[str, Resolution]

    def pareto_front(self) -> tuple[ResolutionCost, ...]:
        """The resolutions that no cheaper one equals: each has a smaller largest error than all
        resolutions with at most as many sliders. In the order of their sliders.
        """
        front: list[ResolutionCost] = []
        for row in sorted(self.rows, key=lambda row: (row.sliders, row.max_error)):
            if not front or row.max_error < (1.0 - EQUAL_ERRORS) * front[-1].max_error:
                front.append(row)
        return tuple(front)

    def __str__(self) -> str:
        lines = [
            f"{'u phi depth':>12s} {'sliders':>8s} {'bytes':>7s} {'max error':>10s} "
            f"{'friction':>9s} {'dilation':>9s} {'ns':>8s} {'with tangent':>13s}  "
            f"{'worst path':16s}name"
        ]
        names = {r: name for name, r in self.named.items()}
        selected = {row.resolution for row in self.pareto_front()} | set(names)
        for row in sorted(self.rows, key=lambda row: row.sliders):
            r = row.resolution
            if r not in selected:
                continue
            path = self.paths[int(row.traction_error.argmax())]
            lines.append(
                f"{f'{r.u} {r.phi} {r.depth}':>12s} {row.sliders:8d} {row.bytes_per_joint:7d} "
                f"{row.max_error:10.3%} {row.friction_error:8.2f}° {row.dilation_error:8.2f}° "
                f"{row.update_ns:8.0f} {row.tangent_update_ns:13.0f}  "
                f"{path:16s}{names.get(r, '')}".rstrip()
            )
        timing = f"ns per joint and update: up to {self.joints} joints, {self.kernel}"
        return "\n".join([
            *lines,
            f"{len(self.rows)} resolutions; listed are the named ones and the Pareto front of "
            "sliders and max error.",
            f"Uncertainty of the reference solution {self.uncertainty.max():.2%}; "
            f"{timing if self.joints else 'not timed'}",
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
    names = named_resolutions(*lengths)
    if resolutions is None:
        resolutions = (*DEFAULT_RESOLUTIONS, *names.values())
    unique = {resolve(r, *lengths) for r in resolutions}
    ordered = sorted(unique, key=lambda r: (r.sliders, r.u, r.phi, r.lowest))
    suite = standard_suite(law)
    rows = tuple(
        _measure_cost(replace(law, resolution=r), suite, joints, seconds)
        for r in track(ordered, "resolutions", len(ordered))
    )
    threads = thread_count()
    kernel = f"{law.joints(0).kernel}, up to {threads} thread{'s' * (threads > 1)}"
    return Tradeoff(suite.names, suite.uncertainty, rows, joints, kernel, names)


def _measure_cost(law: JointLaw, suite: Suite, joints: int, seconds: float) -> ResolutionCost:
    """Cost and error of the resolution of a law."""
    errors = suite.errors(law)
    return ResolutionCost(
        law.resolution,
        law.tables.sliders,
        errors.traction,
        errors.friction,
        errors.dilation,
        _time_update(law, joints, False, seconds),
        _time_update(law, joints, True, seconds),
        law.joints(0).bytes_per_joint,
    )


def _time_update(law: JointLaw, n: int, tangent: bool, seconds: float) -> float:
    """Minimum time in ns per joint of updating a batch of n joints by random increments.

    The minimum is over at least three repetitions, for about `seconds` in total. A batch that would
    not fit into memory is measured with fewer joints. NaN for n = 0.
    """
    if n == 0:
        return float("nan")
    n = min(n, max(MAX_TIMING_MEMORY // (8 * law.tables.rows), 1))
    batch = law.joints(n, track_dissipation=False)
    dim = law.tables.dim
    rng = np.random.default_rng(0)
    steps = rng.normal(0.0, 0.1 * law.closure_range, (3, n, dim))
    increments = cycle([*steps, *-steps])
    first = np.zeros((n, dim))
    first[:, 0] = law.closure_range * rng.uniform(0.3, 0.8, n)
    batch.update(first, tangent=tangent)
    timer = Timer(lambda: batch.update(next(increments), tangent=tangent))
    return min(timer.repeat(max(3, round(seconds / timer.timeit(1))), 1)) / n * 1e9
