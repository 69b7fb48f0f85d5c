"""The price list of a law: what each resolution costs and how far its tractions are off."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.threads import thread_count
from ..parameters.resolution import Resolution, named, resolve
from ..support.checks import Array, integer
from ..support.files import replace_file
from ..support.progress import track
from ..support.pyplot import pyplot, style, written
from .suite import Suite, errors, reference_resolution, scaled, standard_suite, tangents

if TYPE_CHECKING:
    from ..law import JointLaw

SPREAD = tuple(
    Resolution(u, phi, depth)
    for u, phi in ((1, 3), (2, 3), (3, 3), (3, 5), (5, 6), (8, 8))
    for depth in (1, 2, 3, 4, 6, 10, 16)
)
ROUNDING = 1e-6  # a smaller share by which errors differ is none
_MEMORY = 100_000_000  # bytes of state that a timing may use; very fine laws get a smaller batch


@dataclass(frozen=True)
class Price:
    """One resolution: errors are shares of the largest traction (or tangent) of each path.

    `error`, `rms` (paths,): of the traction. `friction`, `dilation`: largest misses of the angles
    (degrees) at constant normal stress, from 0.2 mating lengths on. `tangent_rms`, `tangent_max`:
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

    def frontier(self, cost: str = "sliders") -> tuple[Price, ...]:
        """The prices that no other with as few sliders beats or equals in its largest error.

        cost: another attribute of the prices instead, such as "ns".
        """
        best: list[Price] = []
        for row in sorted(self.rows, key=lambda row: (getattr(row, cost), row.worst)):
            if not best or row.worst < (1.0 - ROUNDING) * best[-1].worst:
                best.append(row)
        return tuple(best)

    def __str__(self) -> str:
        lines = [
            f"{'u phi depth':>12s} {'sliders':>8s} {'bytes':>7s} {'max error':>10s} {'rms':>8s} "
            f"{'friction':>9s} {'dilation':>9s} {'tangent rms':>12s} "
            f"{'ns':>8s} {'with tangent':>13s}  {'worst path':16s}name"
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
                f"{row.worst:10.3%} {row.rms.max():8.2%} {row.friction:8.2f}° {row.dilation:8.2f}° "
                f"{row.tangent_rms:12.2%} {_ns(row.ns):>8s} "
                f"{_ns(row.ns_tangent):>13s}  {path:16s}{names.get(r, '')}".rstrip()
            )
        timed = f"ns per joint and update: up to {self.joints} joints, {self.how}"
        lines.append(
            f"{len(self.rows)} resolutions tried; listed are the named ones and the Pareto front "
            "of sliders and max error.\n"
            f"Uncertainty of the comparison solution {self.uncertainty.max():.2%}; "
            f"{timed if self.joints else 'nothing was timed'}"
        )
        return "\n".join(lines)

    def columns(self) -> dict[str, list[Any]]:
        """All prices by column name, one column of largest and of rms error per path."""
        rows = self.rows
        table: dict[str, list[Any]] = {
            "u": [r.resolution.u for r in rows],
            "phi": [r.resolution.phi for r in rows],
            "depth": [r.resolution.depth for r in rows],
            "sliders": [r.sliders for r in rows],
            "bytes": [r.bytes for r in rows],
            "ns": [r.ns for r in rows],
            "ns_tangent": [r.ns_tangent for r in rows],
            "error": [r.worst for r in rows],
            "rms": [float(r.rms.max()) for r in rows],
            "friction_deg": [r.friction for r in rows],
            "dilation_deg": [r.dilation for r in rows],
            "tangent_rms": [r.tangent_rms for r in rows],
            "tangent_max": [r.tangent_max for r in rows],
        }
        for i, path in enumerate(self.paths):
            table[f"error {path}"] = [float(r.error[i]) for r in rows]
            table[f"rms {path}"] = [float(r.rms[i]) for r in rows]
        return table

    def to_csv(self, path: str | Path) -> None:
        """All prices as CSV; errors are shares (1), angles degrees, times ns, sizes bytes."""
        stream = io.StringIO(newline="")
        writer, table = csv.writer(stream), self.columns()
        writer.writerow(table)
        writer.writerows(zip(*table.values(), strict=True))
        replace_file(Path(path), stream.getvalue().encode())

    @style()
    def plot(self, path: str | Path | None = None) -> Any:
        """Largest error against sliders and, where it was timed, against time per update.

        Needs matplotlib: extra `plot`. With `path` the figure is written there and closed.
        """
        timed = bool(self.joints)
        size = (9.5, 4.6) if timed else (5.5, 4.6)
        figure, axes = pyplot().subplots(
            1, 1 + timed, figsize=size, layout="constrained", sharey=True, squeeze=False
        )
        panels = [("sliders per joint", ["sliders"])]
        if timed:
            panels.append(("time per joint and update (ns)", ["ns", "ns_tangent"]))
        for axis, (label, costs) in zip(axes[0], panels, strict=True):
            for cost, color in zip(costs, ("C0", "C1"), strict=False):
                x, y = [getattr(r, cost) for r in self.rows], [100 * r.worst for r in self.rows]
                axis.loglog(x, y, ".", color=color, alpha=0.25, markeredgewidth=0)
                best = self.frontier(cost)
                x, y = [getattr(r, cost) for r in best], [100 * r.worst for r in best]
                what = "traction and tangent" if cost == "ns_tangent" else "traction"
                axis.loglog(x, y, "o-", color=color, ms=4, lw=1.2, label=what)
            for name, resolution in self.named.items():
                for row in self.rows:
                    if row.resolution == resolution:
                        at = (getattr(row, costs[0]), 100 * row.worst)
                        axis.plot(*at, "s", color="k", ms=6, mfc="none")
                        axis.annotate(name, at, (0, 6), textcoords="offset points", fontsize=8,
                                      ha="right" if name == "reference" else "left")  # fmt: skip
            floor = 100 * float(self.uncertainty.max())
            axis.axhline(floor, color="0.6", lw=1, ls=":", label="uncertainty of the reference")
            axis.set_xlabel(label)
            axis.grid(True, which="both", alpha=0.2)
        axes[0, 0].set_ylabel("largest error of the traction (% of the path's peak)")
        title = f"{self.joints} joints, {self.how}" if timed else None
        axes[0, -1].legend(title=title, fontsize=8, title_fontsize=8, loc="upper right")
        return written(figure, path)


def tradeoff(
    law: JointLaw,
    resolutions: Sequence[str | Resolution] | None = None,
    joints: int = 10_000,
    seconds: float = 0.2,
) -> Tradeoff:
    """See `JointLaw.tradeoff`."""
    joints = integer("joints", joints, 0)
    lengths = law.tables.mating_length, law.asperity.yield_interference, law.closure_range
    names = named(*lengths)
    if resolutions is None:
        resolutions = (*SPREAD, *names.values())
    chosen = [resolve(r, *lengths) for r in resolutions]
    found = sorted(dict.fromkeys(chosen), key=lambda r: (r.sliders, r.u, r.phi))
    if not found:
        raise ValueError("resolutions is empty; give some, or None for the usual spread")
    suite = standard_suite(law)
    fine = replace(law, resolution=scaled(reference_resolution(law), 0.5))
    exact = tangents(fine, suite.d)
    rows = tuple(
        _price(replace(law, resolution=r), suite, exact, joints, seconds)
        for r in track(found, "resolutions", len(found))
    )
    threads = thread_count()
    how = f"{law.joints(0).kernel}, up to {threads} thread{'s' * (threads > 1)}"
    return Tradeoff(suite.names, suite.uncertainty, rows, joints, how, names)


def _price(law: JointLaw, suite: Suite, exact: Array, joints: int, seconds: float) -> Price:
    miss = suite.miss(law)
    steps, paths = exact.shape[:2]
    C = tangents(law, suite.d).reshape(steps, paths, -1)
    tangent_max, tangent_rms = errors(C, exact.reshape(steps, paths, -1))
    ns = [_time(law, joints, tangent, seconds) for tangent in (False, True)]
    return Price(
        law.resolution, law.tables.sliders, *miss,
        float(np.sqrt(np.mean(tangent_rms**2))), float(tangent_max.max()), ns[0], ns[1],
        law.joints(0).bytes_per_joint,
    )  # fmt: skip


def _time(law: JointLaw, n: int, tangent: bool, seconds: float) -> float:
    """Least time of an update in ns per joint, of runs that take this long together."""
    if n == 0:
        return float("nan")
    n = min(n, max(_MEMORY // (8 * law.tables.rows), 1))
    batch, dim = law.joints(n, ledger=False), law.tables.dim
    rng = np.random.default_rng(0)
    steps = rng.normal(0.0, 0.1 * law.closure_range, (3, n, dim))
    steps = np.concatenate([steps, -steps])
    first = np.zeros((n, dim))
    first[:, 0] = law.closure_range * rng.uniform(0.3, 0.8, n)
    batch.update(first, tangent=tangent)
    best, k, end = float("inf"), 0, time.perf_counter() + seconds
    while k < 3 or time.perf_counter() < end:
        start = time.perf_counter()
        batch.update(steps[k % len(steps)], tangent=tangent)
        best, k = min(best, time.perf_counter() - start), k + 1
    return best / n * 1e9


def _ns(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.0f}"
