"""Section 4.3, shear at a constant closure of 1 um: Figures 14 to 16."""

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..laboratory.record import without_steps
from .runs import first_sliding, incremental, law, ratio, resistance, total
from .secant import secant
from .section import FORMS, LAW, TOTAL, Bound, Numbers, Section, near, rounding

SECTION = Section()
CLOSURE, TO = 1e-6, 4e-6  # m; the closure is printed, the end of the axis is not
AXIS = "shear displacement δ₂ (µm)"
FRICTION = 0.6


@SECTION.figure(
    14,
    title="effect of the orientation parameter a on shear resistance",
    caption=(
        "F₂/F₁ at a constant closure of 1 µm for linear asperities, λ = 1, μ = 0.6, b = c = 0. "
        "Neither K nor the contact density enters. In the right panel dotted lines repeat the "
        "total form. The paper does not print the end of its axis."
    ),
    panels=2,
)
def figure_14(left: Any, right: Any) -> None:
    names = [(f"linear-a{a}", f"a = {a}", f"C{i}") for i, a in enumerate((2, 3, 6, 9))]
    _side_by_side(left, right, names)


@SECTION.claim(
    "friction-tends-to-mu",
    "Fig. 14",
    "shear resistance tends to mu = 0.6 as a grows",
    "F₂/F₁ at 1, 2, 4 µm, incremental law (total form): "
    + "; ".join(
        f"a = {a} " + ", ".join(f"{{law_a{a}_{i}:.3f}} ({{total_a{a}_{i}:.3f}})" for i in range(3))
        for a in (2, 3, 6, 9)
    ),
    [
        bound
        for kind in FORMS
        for bound in (
            Bound(f"{kind}_a3_2", most=f"{kind}_a2_2"),
            Bound(f"{kind}_a6_2", most=f"{kind}_a3_2"),
            Bound(f"{kind}_a9_2", most=f"{kind}_a6_2"),
            near(f"{kind}_a9_2", FRICTION, 0.05, "the asperities still lean by 10° at a = 9"),
        )
    ],
)
def friction_tends_to_mu() -> Numbers:
    at = np.array([1e-6, 2e-6, 4e-6])
    return {
        f"{kind}_a{a}_{i}": float(x)
        for a in (2, 3, 6, 9)
        for kind, row in zip(
            FORMS, resistance(f"linear-a{a}", at, TO, closure=CLOSURE), strict=True
        )
        for i, x in enumerate(row)
    }


@SECTION.figure(
    15,
    title="effect of asperity nonlinearity on shear resistance",
    caption=(
        "F₂/F₁ at a constant closure of 1 µm for linear (η = 0) and nonlinear (η = 1/2) "
        "asperities, λ = 1, μ = 0.6. In the right panel dotted lines repeat the total form. At "
        "small shear the total form is softer for η = 1/2: it sees asperities that the closure "
        "has loaded in shear further along Eq. 35, while the incremental law gives new shear its "
        "full initial stiffness."
    ),
    panels=2,
)
def figure_15(left: Any, right: Any) -> None:
    names = [
        (f"{kind}-a{a}", f"{kind}, a = {a}", color)
        for a, colors in ((3, ("C0", "C3")), (6, ("C2", "C1")))
        for kind, color in zip(("linear", "nonlinear"), colors, strict=True)
    ]
    _side_by_side(left, right, names)


def _side_by_side(left: Any, right: Any, names: list[tuple[str, str, str]]) -> None:
    """Total form left; incremental law right, with the total form dotted behind it."""
    for name, label, color in names:
        printed = total(name, TO, closure=CLOSURE)
        ours = incremental(name, TO, closure=CLOSURE)
        x, y = printed.shear * 1e6, ratio(printed)
        left.plot(x, y, color=color, label=label)
        right.plot(ours.shear * 1e6, ratio(ours), color=color, label=label)
        right.plot(x, y, ":", color=color, label=f"_{label}, total")
    top = 1.1 * max(line.get_ydata().max() for line in (*left.get_lines(), *right.get_lines()))
    for axes, title in ((left, TOTAL), (right, LAW)):
        axes.plot([0.0, TO * 1e6], [FRICTION, FRICTION], ":", color="0.4", label="μ")
        axes.set(title=title, xlabel=AXIS, ylabel="F₂/F₁", ylim=(0.0, top))


@SECTION.claim(
    "nonlinear-above-linear",
    "Fig. 15",
    "nonlinear asperities give the higher resistance, more so for a = 3 than a = 6",
    "; ".join(
        f"{form}: excess at 4 µm {{{kind}_a3:.3f}} (a = 3) and {{{kind}_a6:.3f}} (a = 6), never "
        f"below {{{kind}_least:.3f}}, a = 3 ahead from {{{kind}_from:.1f}} µm on"
        for kind, form in zip(FORMS, ("total form", "incremental law"), strict=True)
    ),
    [
        bound
        for kind in FORMS
        for bound in (Bound(f"{kind}_least", least=0.0), Bound(f"{kind}_from", most=0.1))
    ],
    in_part=[
        bound
        for kind in FORMS
        for bound in (Bound(f"{kind}_least", least=0.0), Bound(f"{kind}_from", most=1.0))
    ],
)
def nonlinear_above_linear() -> Numbers:
    numbers: Numbers = {}
    x = np.linspace(0.1e-6, TO, 40)
    curves = {
        name: resistance(name, x, TO, closure=CLOSURE)
        for name in ("linear-a3", "nonlinear-a3", "linear-a6", "nonlinear-a6")
    }
    for i, kind in enumerate(FORMS):
        three, six = (curves[f"nonlinear-a{a}"][i] - curves[f"linear-a{a}"][i] for a in (3, 6))
        behind = x[three < six]
        numbers |= {
            f"{kind}_a3": float(three[-1]),
            f"{kind}_a6": float(six[-1]),
            f"{kind}_least": float(min(three.min(), six.min())),
            f"{kind}_from": float(behind[-1]) * 1e6 if len(behind) else 0.0,
        }
    return numbers


@SECTION.figure(
    16,
    title="sliding and separated asperities during shear",
    caption=(
        "Linear asperities at a constant closure of 1 µm, λ = 1, μ = 0.6. Dotted ticks: "
        "separation begins at δ₂ = δ₁ cot(π/2a). Sliding begins earlier for a = 3 but "
        "is complete earlier for a = 6. The shares of the incremental law change in "
        "steps, one for each of its orientations; its lines join the middles of the steps."
    ),
    panels=2,
)
def figure_16(*panels: Any) -> None:
    for axes, kind in zip(panels, (TOTAL, LAW), strict=True):
        for a, color in ((3, "C0"), (6, "C1")):
            run: Any = total if kind == TOTAL else incremental
            test = run(f"linear-a{a}", TO, closure=CLOSURE)
            x, onset = test.shear * 1e6, CLOSURE * 1e6 / math.tan(0.5 * math.pi / a)
            for name, style, share in (
                ("sliding", "-", test.sliding), ("separated", "--", test.separated),
            ):  # fmt: skip
                line = (x, share) if kind == TOTAL else without_steps(x, share)
                axes.plot(*line, style, color=color, label=f"{name}, a = {a}")
            label = f"_onset cot(pi/2a), a = {a}"
            axes.plot([onset, onset], [0.0, 0.08], ":", color=color, label=label)
        axes.set(title=kind, xlabel=AXIS, ylabel="share of asperities", ylim=(-0.02, 1.05))


@SECTION.claim(
    "sliding-complete",
    "Fig. 16",
    "sliding is mobilized at a lower shear displacement for a = 6",
    "complete (all in touch slide) at {full_a6:.3f} µm for a = 6, {full_a3:.3f} µm for a = 3 "
    "(incremental {law_a6:.2f}, {law_a3:.2f}); but it begins at {begin_a6:.3f} against "
    "{begin_a3:.3f} µm and is half done at {half_a6:.3f} against {half_a3:.3f} µm: earlier for "
    "a = 3",
    [Bound(f"{stage}_a6", most=f"{stage}_a3") for stage in ("begin", "half", "full", "law")],
    one_reading=[Bound(f"{stage}_a6", most=f"{stage}_a3") for stage in ("full", "law")],
)
def sliding_during_shear() -> Numbers:
    numbers: Numbers = {}
    for a in (3, 6):
        name, p, edge = f"linear-a{a}", law(f"linear-a{a}").asperity, 0.5 * math.pi / a
        cone = math.atan(p.mu * p.lam)

        def misfit(t: float, name: str = name) -> float:
            return secant(law(name), (1.0, t, 0.0)).sliding - 0.5

        full, run = math.tan(cone + edge), incremental(name, TO, closure=CLOSURE)
        row, F = first_sliding(run), secant(law(name), (1.0, full, 0.0)).F
        numbers |= {
            f"begin_a{a}": math.tan(max(cone - edge, 0.0)),
            f"half_a{a}": float(brentq(misfit, 0.01, 1.5)),
            f"full_a{a}": full,
            f"law_a{a}": float(run.shear[row]) * 1e6,
            f"total_at_a{a}": float(F[1] / F[0]),
            f"law_at_a{a}": float(ratio(run)[row]),
        }
    return numbers


SECTION.claim(
    "sliding-resistance",
    "Fig. 16",
    "and at a lower shear resistance, close to mu, for a = 6",
    "F₂/F₁ when sliding is complete: {law_at_a6:.3f} (a = 6) and {law_at_a3:.3f} (a = 3); total "
    "form {total_at_a6:.3f} and {total_at_a3:.3f}",
    [
        bound
        for kind in FORMS
        for bound in (
            Bound(f"{kind}_at_a6", most=f"{kind}_at_a3"),
            near(f"{kind}_at_a6", FRICTION, 0.03, "close: within 5 %"),
        )
    ],
)(sliding_during_shear)


@SECTION.claim(
    "separation-onset",
    "Fig. 16",
    "separation commences later for a = 6 than for a = 3",
    "begins at δ₂/δ₁ = cot(π/2a) exactly in the total form: {cot_a2:.3f} (a = 2), {cot_a3:.3f} "
    "(a = 3), {cot_a6:.3f} (a = 6); incremental law, steepest of 12 inclinations: {law_a2:.2f}, "
    "{law_a3:.2f}, {law_a6:.2f}",
    [
        rounding("before"),
        Bound("after", least=0.0),
        Bound("cot_a6", least="cot_a3"),
        Bound("law_a6", least="law_a3"),
    ],
)
def separation_onset() -> Numbers:
    numbers = {"before": 0.0, "after": 1.0}  # separated just before and after cot(pi/2a)
    for a in (2, 3, 6):
        found, onset = law(f"linear-a{a}"), 1 / math.tan(0.5 * math.pi / a)
        before, after = (
            secant(found, (1.0, onset * x, 0.0)).separated for x in (1 - 1e-9, 1 + 1e-3)
        )
        run = incremental(f"linear-a{a}", TO, closure=CLOSURE)
        rows = np.flatnonzero(run.separated > 0)
        numbers |= {
            "before": max(numbers["before"], before),
            "after": min(numbers["after"], after),
            f"cot_a{a}": onset,
            f"law_a{a}": float(run.shear[rows[0]] / CLOSURE) if len(rows) else math.inf,
        }
    return numbers
