"""Where to put the nodes: rules tried, and the frontier with plain nodes and with ours.

    python benchmarks/nodes.py [--laws 16] [--picture docs/pictures/frontier.png]

Largest error of the traction on the standard paths, in per cent: median over the laws, and the 90th
percentile in brackets; then that of the named resolutions for each preset. Laws are drawn as in
benchmarks/tolerance.py, a >= 1.4, with the presets, motion in one plane. Plain nodes are
Gauss-Legendre inclinations, and depths (i/n)^1.5 of closure_range (1 + tan theta).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from tolerance import random_law

import jointlaw as jl
from jointlaw.accuracy.suite import Suite, standard_suite
from jointlaw.discretisation import facets as rings
from jointlaw.discretisation import tables
from jointlaw.discretisation.nodes import UNUSED
from jointlaw.parameters.resolution import named
from jointlaw.support.progress import track

Rule = Callable[..., Any]
NOW = rings.inclinations
CELLS = (1, 2, 3, 4, 6, 10, 16)
RULES = ((1, 3), (1, 4), (2, 3), (2, 4), (3, 4), (4, 6), (6, 8))
GRID = [(u, phi, n) for u, phi in ((1, 3), (2, 3), (2, 4), (3, 4), (4, 5), (4, 6), (6, 6), (6, 8))
        for n in CELLS]  # fmt: skip


@contextmanager
def placed(inclinations: Rule | None = None, depths: Rule | None = None,
           ring: Rule | None = None) -> Iterator[None]:  # fmt: skip
    """Other rules while the block runs."""
    kept = rings.inclinations, tables.depth_nodes, rings._ring
    rings.inclinations = inclinations or kept[0]
    tables.depth_nodes = by_facet(depths) if depths else kept[1]
    rings._ring = ring or kept[2]
    try:
        yield
    finally:
        rings.inclinations, tables.depth_nodes, rings._ring = kept


def by_facet(rule: Rule) -> Rule:
    """A rule for one number of cells, applied to facets of several."""

    def made(curve: Any, closure_range: float, slope: np.ndarray, cells: np.ndarray) -> np.ndarray:
        zeta = np.full((len(slope), cells.max() + 1), UNUSED)
        zeta[:, -1] = np.inf
        for n in np.unique(cells):
            zeta[cells == n, :n] = rule(curve, closure_range, slope[cells == n], n)[:, :n]
        return zeta

    return made


# ------------------------------------------------------------------ inclinations: u and shares


def density(u: np.ndarray, b: float) -> np.ndarray:
    return 1 + b / 2 * (3 * u**2 - 1)


def mapped(place: Rule, rate: Rule) -> Rule:
    """Gauss-Legendre in v, u = place(v)."""

    def rule(b: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        x, w = np.polynomial.legendre.leggauss(count)
        v = 0.5 * (x + 1)
        return place(v), 0.5 * w * rate(v) * density(place(v), b)

    return rule


def legendre(b: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    return mapped(lambda v: v, np.ones_like)(b, count)


def midpoints(b: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    u = (np.arange(count) + 0.5) / count
    return u, density(u, b) / count


def radau(steepest: bool) -> Rule:
    """The density's rule with one node fixed at u = 0 (steepest) or 1 (flat)."""

    def rule(b: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        if count == 1:
            return NOW(b, 1)
        x, w = np.polynomial.legendre.leggauss(2 * count + 2)
        x = 0.5 * (x + 1)
        w = 0.5 * w * density(x, b)
        end = 1e-6 if steepest else 1 - 1e-6  # at the very end the density may be zero
        u, share = gauss(x, w * np.abs(x - end), count - 1)
        share = share / np.abs(u - end)
        return np.append(u, end), np.append(share, w.sum() - share.sum())

    return rule


def gauss(x: np.ndarray, w: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss rule of a discrete weight w at x, by Lanczos' recurrence."""
    middle, side = np.zeros(count), np.zeros(count)
    before, now = np.zeros_like(x), np.sqrt(w / w.sum())
    for k in range(count):
        middle[k] = np.sum(x * now**2)
        after = (x - middle[k]) * now - (side[k - 1] * before if k else 0.0)
        side[k] = np.linalg.norm(after)
        before, now = now, after / side[k]
    u, vectors = np.linalg.eigh(np.diag(middle) + np.diag(side[:-1], 1) + np.diag(side[:-1], -1))
    return u, w.sum() * vectors[0] ** 2


INCLINATIONS: dict[str, Rule | None] = {
    "Gauss rule of the density in v (ours)": None,
    "Gauss-Legendre in u (plain)": legendre,
    "Gauss-Legendre in sqrt(u)": mapped(lambda v: v**2, lambda v: 2 * v),
    "Gauss-Legendre in theta": mapped(
        lambda v: np.sin(np.pi / 2 * v), lambda v: np.pi / 2 * np.cos(np.pi / 2 * v)
    ),
    "midpoints in u": midpoints,
    "density, a node at the steepest": radau(True),
    "density, a node at the flattest": radau(False),
}


def midway(m: int, whole: bool) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths half a spacing away from the line of shear."""
    count = 2 * m if whole else m
    return (np.arange(count) + 0.5) * (math.pi / m), np.full(count, 1.0 / count)


# --------------------------------------------------------------------------------- depth cells


def limits(inner: np.ndarray) -> np.ndarray:
    zero = np.zeros((len(inner), 1))
    return np.concatenate([zero, inner, zero + np.inf], axis=1)


def graded(power: float, share: float = 1.0) -> Rule:
    def rule(curve: Any, closure_range: float, slope: np.ndarray, cells: int) -> np.ndarray:
        reach = share * closure_range * (1 + np.minimum(slope, 10.0))
        return limits(reach[:, None] * (np.arange(1, cells) / cells) ** power)

    return rule


def geometric(curve: Any, closure_range: float, slope: np.ndarray, cells: int) -> np.ndarray:
    """The fair start of the first design: 30^-(1 - i/n)."""
    reach = closure_range * (1 + np.minimum(slope, 10.0))
    return limits(reach[:, None] * 30.0 ** -(1 - np.arange(1, cells) / cells))


def quantiles(power: float, low: float, beyond: float) -> Rule:
    """Equal shares of int Phi''^power Phi^-low dz, the last cell `beyond` of them."""

    def rule(curve: Any, closure_range: float, slope: np.ndarray, cells: int) -> np.ndarray:
        reach = closure_range * (1 + np.minimum(slope, 10.0))
        edges = reach.max() * (np.arange(513) / 512) ** 4
        z = 0.5 * (edges[1:] + edges[:-1])
        with np.errstate(all="ignore"):
            w = np.maximum(curve.curvature(z), 0.0) ** power * curve.force(z)[0] ** -low
        w = np.where(np.isfinite(w), w, 0.0)
        w = w / w.max() + 1e-6 if w.max() > 0 else np.ones_like(w)
        total = np.concatenate([[0.0], np.cumsum(w * np.diff(edges))])
        share = np.arange(1, cells) / (cells - 1 + beyond)
        return limits(np.interp(np.interp(reach, edges, total)[:, None] * share, total, edges))

    return rule


DEPTHS: dict[str, Rule | None] = {
    "sqrt(Phi'') Phi^-0.15, last 1.8 (ours)": None,
    "(i/n)^1.5 (plain)": graded(1.5),
    "(i/n)^1.2": graded(1.2),
    "(i/n)^1": graded(1.0),
    "(i/n)^1.2 of 0.8": graded(1.2, 0.8),
    "30^-(1 - i/n)": geometric,
    "Phi'' (equal stiffness), last 1": quantiles(1.0, 0.0, 1.0),
    "sqrt(Phi''), last 1": quantiles(0.5, 0.0, 1.0),
    "sqrt(Phi''), last 1.8": quantiles(0.5, 0.0, 1.8),
    "sqrt(Phi'') Phi^-0.1, last 1": quantiles(0.5, 0.1, 1.0),
    "sqrt(Phi'') Phi^-0.1, last 2.5": quantiles(0.5, 0.1, 2.5),
    "sqrt(Phi'') Phi^-0.2, last 1.8": quantiles(0.5, 0.2, 1.8),
}


# ------------------------------------------------------------------------------------- measure


def worst(cases: list[tuple[jl.JointLaw, Suite]], rule: tuple[int, int, int]) -> np.ndarray:
    """Largest error in per cent of each law."""
    r = jl.Resolution(*rule)
    return np.array([100 * s.errors(replace(law, resolution=r))[0].max() for law, s in cases])


def row(name: str, errors: list[np.ndarray]) -> str:
    cells = [f"{np.median(e):.2f} ({np.quantile(e, 0.9):.2f})" for e in errors]
    return f"| {name} | {' | '.join(cells)} |"


def head(title: str, labels: list[str]) -> str:
    return f"| {title} | {' | '.join(labels)} |\n|---|{'---:|' * len(labels)}"


def frontier(cases: list[tuple[jl.JointLaw, Suite]]) -> dict[int, np.ndarray]:
    """By sliders: per law the least error with as many or fewer."""
    found: dict[int, np.ndarray] = {}
    best = np.full(len(cases), np.inf)
    for rule in sorted(GRID, key=lambda r: r[0] * r[1] * r[2]):
        found[rule[0] * rule[1] * rule[2]] = best = np.minimum(best, worst(cases, rule))
    return found


def picture(path: str, plain: Any, ours: Any) -> None:
    """Median and 90th percentile of both frontiers."""
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(6.5, 4.5), layout="constrained")
    for found, color, label in ((plain, "0.5", "plain nodes"), (ours, "C0", "our nodes")):
        x, errors = list(found), np.array(list(found.values()))
        axis.loglog(x, np.median(errors, axis=1), "o-", ms=3, color=color, label=label)
        axis.loglog(x, np.quantile(errors, 0.9, axis=1), "--", color=color, lw=1,
                    label=f"{label}, 90 % of the laws")  # fmt: skip
    axis.set_xlabel("sliders per joint, motion in one plane")
    axis.set_ylabel("largest error on the standard paths (% of the peak)")
    axis.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.grid(True, which="both", alpha=0.2)
    axis.legend()
    figure.savefig(path, dpi=150)


@dataclass
class Laws:
    """The laws measured, each with its standard paths; all tables are Markdown."""

    random: list[tuple[jl.JointLaw, Suite]]
    presets: list[tuple[jl.JointLaw, Suite]]

    @classmethod
    def draw(cls, count: int) -> Laws:
        """That many random laws and all presets, for motion in one plane."""
        rng, laws = np.random.default_rng(4), []
        while len(laws) < count:
            if (law := random_law(rng)).orientation.a >= 1.4:
                laws.append(replace(law, plane=0.0))
        presets = [replace(jl.presets.load(name), plane=0.0) for name in jl.presets.names()]
        cases = [(law, standard_suite(law)) for law in track([*laws, *presets], "references",
                                                             count + len(presets))]  # fmt: skip
        return cls(cases[:count], cases[count:])

    def depths(self) -> str:
        lines = [head("depth cells, at 6 x 6 orientations", [str(n) for n in CELLS[1:]])]
        for name, rule in DEPTHS.items():
            with placed(depths=rule):
                lines.append(row(name, [self._worst((6, 6, n)) for n in CELLS[1:]]))
        return "\n".join(lines)

    def inclinations(self) -> str:
        lines = [head("inclinations, u x phi at 16 cells", [f"{u} x {p}" for u, p in RULES])]
        for name, rule in INCLINATIONS.items():
            with placed(inclinations=rule):
                lines.append(row(name, [self._worst((u, p, 16)) for u, p in RULES]))
        return "\n".join(lines)

    def azimuths(self) -> str:
        lines = [head("azimuths, u x phi at 16 cells", [f"{u} x {p}" for u, p in RULES])]
        for name, rule in (("one on the line of shear (ours)", None), ("midway", midway)):
            with placed(ring=rule):
                lines.append(row(name, [self._worst((u, p, 16)) for u, p in RULES]))
        return "\n".join(lines)

    def frontier(self, path: str | None = None) -> str:
        """With plain nodes and with ours, and the picture of both where a path is given."""
        cases = self.random + self.presets
        ours = frontier(cases)
        with placed(inclinations=legendre, depths=graded(1.5)):
            plain = frontier(cases)
        if path:
            picture(path, plain, ours)
        rows = [row(str(n), [plain[n], ours[n]]) for n in (6, 12, 24, 48, 96, 200, 576)]
        return "\n".join([head("sliders", ["plain nodes", "our nodes"]), *rows])

    def named(self) -> str:
        lines = [head("name", ["sliders, at most", *jl.presets.names()])]
        for name, r in named().items():
            errors = worst(self.presets, (r.u, r.phi, r.depth))
            sliders = max(replace(law, resolution=r).tables.sliders for law, _ in self.presets)
            lines.append(f"| {name} | {sliders} | {' | '.join(f'{e:.2f}' for e in errors)} |")
        return "\n".join(lines)

    def _worst(self, rule: tuple[int, int, int]) -> np.ndarray:
        return worst(self.random + self.presets, rule)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--laws", type=int, default=16, help="random ones, beside the presets")
    parser.add_argument("--picture", help="file for the picture of the frontiers")
    options = parser.parse_args()
    laws = Laws.draw(options.laws)
    for made in (laws.depths, laws.inclinations, laws.azimuths,
                 lambda: laws.frontier(options.picture), laws.named):  # fmt: skip
        print(made(), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
