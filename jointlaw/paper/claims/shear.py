"""Claims of section 4.3 at a kept closure: Figures 14 to 16."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from ...laboratory.record import Record
from ...support.checks import Array
from ..figures.runs import incremental, law, ratio, total
from ..figures.shear import CLOSURE, TO
from ..secant import secant
from .registry import Finding, claim

AT = (1e-6, 2e-6, 4e-6)  # m


@claim("friction-tends-to-mu", "Fig. 14", "shear resistance tends to mu = 0.6 as a grows")
def friction_tends_to_mu() -> Finding:
    """F2/F1 at 1, 2, 4 um, both forms."""
    ours = {a: _at(f"linear-a{a}")[1] for a in (2, 3, 6, 9)}
    printed = {a: _at(f"linear-a{a}")[0] for a in (2, 3, 6, 9)}
    text = "F₂/F₁ at 1, 2, 4 µm, incremental law (total form): " + "; ".join(
        f"a = {a} "
        + ", ".join(f"{x:.3f} ({y:.3f})" for x, y in zip(ours[a], printed[a], strict=True))
        for a in ours
    )
    numbers = {f"law_a{a}_{i}": float(x) for a, row in ours.items() for i, x in enumerate(row)}
    numbers |= {
        f"total_a{a}_{i}": float(x) for a, row in printed.items() for i, x in enumerate(row)
    }
    return Finding("holds", text, numbers)


@claim(
    "nonlinear-above-linear",
    "Fig. 15",
    "nonlinear asperities give the higher resistance, more so for a = 3 than a = 6",
)
def nonlinear_above_linear() -> Finding:
    """Excess of F2/F1 of nonlinear over linear asperities."""
    numbers: dict[str, float] = {}
    parts = []
    x = np.linspace(0.1e-6, TO, 40)
    for i, kind in enumerate(("total form", "incremental law")):
        excess = {a: _curve(f"nonlinear-a{a}", x)[i] - _curve(f"linear-a{a}", x)[i] for a in (3, 6)}
        late = x >= 1e-6
        numbers |= {f"{kind}_least_a{a}": float(excess[a].min()) for a in (3, 6)} | {
            f"{kind}_4um_a{a}": float(excess[a][-1]) for a in (3, 6)
        }
        numbers[f"{kind}_order"] = float(np.min((excess[3] - excess[6])[late]))
        order = (
            x[np.flatnonzero(excess[3] < excess[6])[-1]] if (excess[3] < excess[6]).any() else 0.0
        )
        numbers[f"{kind}_order_from"] = float(order)
        parts.append(
            f"{kind}: excess at 4 µm {excess[3][-1]:.3f} (a = 3) and {excess[6][-1]:.3f} (a = 6), "
            f"never below {min(excess[3].min(), excess[6].min()):.3f}, a = 3 ahead from "
            f"{order * 1e6:.1f} µm on"
        )
    return Finding("in part", "; ".join(parts), numbers)


@claim(
    "sliding-complete", "Fig. 16", "sliding is mobilized at a lower shear displacement for a = 6"
)
def sliding_complete() -> Finding:
    """Displacement at which sliding begins, has reached half, and all asperities in touch."""
    begin, full, half = {}, {}, {}
    for a in (3, 6):
        found = law(f"linear-a{a}")
        cone, edge = math.atan(found.asperity.mu * found.asperity.lam), 0.5 * math.pi / a
        begin[a] = math.tan(max(cone - edge, 0.0))
        full[a] = math.tan(cone + edge)
        half[a] = float(
            brentq(lambda t, f=found: secant(f, (1.0, t, 0.0)).sliding - 0.5, 0.01, 1.5)
        )
    ours = {a: _complete(incremental(f"linear-a{a}", TO, closure=CLOSURE)) for a in (3, 6)}
    text = (
        f"complete (all in touch slide) at {full[6]:.3f} µm for a = 6, {full[3]:.3f} µm for a = 3 "
        f"(incremental {ours[6]:.2f}, {ours[3]:.2f}); but it begins at {begin[6]:.3f} against "
        f"{begin[3]:.3f} µm and is half done at {half[6]:.3f} against {half[3]:.3f} µm: earlier "
        "for a = 3"
    )
    numbers = {
        f"{name}_a{a}": values[a]
        for name, values in (("begin", begin), ("half", half), ("full", full), ("law", ours))
        for a in (3, 6)
    }
    return Finding("one reading", text, numbers)


@claim("sliding-resistance", "Fig. 16", "and at a lower shear resistance, close to mu, for a = 6")
def sliding_resistance() -> Finding:
    """F2/F1 at which sliding is complete."""
    numbers = {}
    for a in (3, 6):
        found = law(f"linear-a{a}")
        t = math.tan(math.atan(found.asperity.mu * found.asperity.lam) + 0.5 * math.pi / a)
        F = secant(found, (CLOSURE, t * CLOSURE, 0.0)).F
        run = incremental(f"linear-a{a}", TO, closure=CLOSURE)
        numbers[f"total_a{a}"] = float(F[1] / F[0])
        numbers[f"law_a{a}"] = float(np.interp(_complete(run) * 1e-6, run.shear, ratio(run)))
    text = (
        f"F₂/F₁ when sliding is complete: {numbers['law_a6']:.3f} (a = 6) and "
        f"{numbers['law_a3']:.3f} (a = 3); total form {numbers['total_a6']:.3f} and "
        f"{numbers['total_a3']:.3f}"
    )
    return Finding("holds", text, numbers)


@claim("separation-onset", "Fig. 16", "separation commences later for a = 6 than for a = 3")
def separation_onset() -> Finding:
    """Onset of separation against cot(pi/2a)."""
    worst, onset = 0.0, {}
    for a in (2, 3, 6):
        found, exact = law(f"linear-a{a}"), 1 / math.tan(0.5 * math.pi / a)
        before, after = (
            secant(found, (1.0, exact * x, 0.0)).separated for x in (1 - 1e-9, 1 + 1e-3)
        )
        worst = max(worst, before) if after > 0 else math.inf
        run = incremental(f"linear-a{a}", TO, closure=CLOSURE)
        rows = np.flatnonzero(run.separated > 0)
        onset[a] = (exact, float(run.shear[rows[0]] / CLOSURE) if len(rows) else math.inf)
    text = (
        "begins at δ₂/δ₁ = cot(π/2a) exactly in the total form: "
        + ", ".join(f"{onset[a][0]:.3f} (a = {a})" for a in onset)
        + "; incremental law, steepest of 12 inclinations: "
        + ", ".join(f"{onset[a][1]:.2f}" for a in onset)
    )
    numbers = {f"cot_a{a}": onset[a][0] for a in onset} | {f"law_a{a}": onset[a][1] for a in onset}
    return Finding("holds", text, numbers | {"before": worst})


def _at(name: str) -> tuple[Array, Array]:
    """F2/F1 at 1, 2, 4 um: total form, incremental law."""
    return _curve(name, np.array(AT))


def _curve(name: str, x: Array) -> tuple[Array, Array]:
    """F2/F1 at the displacements x (m): total form, incremental law."""
    printed, ours = total(name, TO, closure=CLOSURE), incremental(name, TO, closure=CLOSURE)
    return np.interp(x, printed.shear, ratio(printed)), np.interp(x, ours.shear, ratio(ours))


def _complete(run: Record) -> float:
    """Shear displacement (um) at which all asperities in touch slide."""
    rows = np.flatnonzero(run.sliding + run.separated > 1 - 1e-9)
    return float(run.shear[rows[0]]) * 1e6 if len(rows) else math.inf
