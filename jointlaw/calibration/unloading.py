"""What of measured hysteresis loops friction and yielding explain, and what they do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import trapezoid  # numpy renamed its own between versions

from ..law import JointLaw
from ..parameters.resolution import NAMED
from ..support.checks import Array
from ..support.progress import track
from .measured import cycles

Result = tuple[float, float]  # share of the work lost, closure kept (m)
_FRICTIONS = (0.1, 0.15, 0.2, 0.3, 0.45)


@dataclass(frozen=True)
class Loop:
    """A cycle against the law above a stress, as shares of the work of its loading.

    stress (Pa): the lowest, above zero, that both branches of the test reach;
    measured: loss of the measured cycle; friction: loss of the law, that of yielding included;
    largest_friction: the largest of several friction coefficients at these inclinations, that of
    `worst_mu`; open_closure (m): closure the test did not recover on the way back to `stress`;
    law_closure (m): that of the law; yields: whether the law yields; top (Pa): the largest stress.
    """

    stress: float
    measured: float
    friction: float
    largest_friction: float
    worst_mu: float
    open_closure: float
    law_closure: float
    yields: bool = False
    top: float = 0.0

    def text(self) -> str:
        """The same in words."""
        what = "Friction on the asperities, the only loss in this law, takes"
        rest = (
            "Other causes of the rest are flattened asperities (fit a yield_interference to whole "
            "cycles), crushed ones, seating of the halves and gouge."
        )
        if self.yields:
            what = "Friction and yielding of the asperities together take"
            rest = (
                "The loop fixes one length, the yield_interference. It cannot tell yielding from "
                "friction, crushing, seating of the halves or gouge, which also take work."
            )
        return (
            f"Up to {self.top / 1e6:.4g} MPa the measured cycle loses {100 * self.measured:.0f} % "
            f"of the work of loading; {1e6 * self.open_closure:.1f} um of closure remain at "
            f"{self.stress / 1e6:.3g} MPa. {what} {100 * self.friction:.2g} %; by the law "
            f"{1e6 * self.law_closure:.2f} um remain. Of friction coefficients from "
            f"{_FRICTIONS[0]} to {_FRICTIONS[-1]}, {self.worst_mu:g} loses most at these "
            f"inclinations, {100 * self.largest_friction:.1f} %. {rest} Use the "
            "fitted law for loading, and for small cycles below the largest stress with care."
        )


def summed_up(loops: Sequence[Loop]) -> str:
    """The cycles of a test in words: the largest one, and a table if there are several."""
    text = max(loops, key=lambda loop: loop.top).text()
    if len(loops) == 1:
        return text
    rows = [
        f"| {k} | {loop.top / 1e6:.4g} | {100 * loop.measured:.0f} | {100 * loop.friction:.2g} | "
        f"{1e6 * loop.open_closure:.1f} | {1e6 * loop.law_closure:.1f} |"
        for k, loop in enumerate(loops, 1)
    ]
    head = "| cycle | up to (MPa) | work lost (%) | by the law | closure kept (um) | by the law |"
    return "\n".join([head, "|---|---|---|---|---|---|", *rows, "", text])


def explain(law: JointLaw, stress: ArrayLike, closure: ArrayLike, steps: int = 100) -> Loop:
    """Compare the first measured cycle with the law, as `explain_each` does."""
    return explain_each(law, stress, closure, steps)[0]


def explain_each(
    law: JointLaw, stress: ArrayLike, closure: ArrayLike, steps: int = 100
) -> list[Loop]:
    """Compare every measured cycle that unloads with what a law does on all of them in turn.

    stress: Pa, (n,), loading and unloading; closure: m, (n,); law: such as that of a fit to the
    first loading; steps: of the law per branch. The law unloads to zero stress each time.

    Raises ValueError when the data do not load and unload above zero stress, or when the law does
    not reach their stress.
    """
    s, u = np.asarray(stress, float), np.asarray(closure, float)
    parts = [slice(first, last + 1) for first, top, last in cycles(s) if last > top + 1]
    tests = [(s[part], u[part], _lowest(s[part])) for part in parts]
    if not tests or not all(low < part.max() for part, _, low in tests):
        raise ValueError("stress does not rise and fall above 0: give one cycle, both branches")
    of_law = _of_law(law, tests, steps)
    others = []
    for mu in track(_FRICTIONS, "friction", len(_FRICTIONS)):
        other = replace(law.asperity, mu=mu, mu_residual=None, wear_slip=np.inf)
        others.append(_of_law(replace(law, asperity=other), tests, steps))
    loops = []
    for k, (part, closures, low) in enumerate(tests):
        measured, open_closure = _loss(part, closures, low)
        friction, law_closure = of_law[k]
        losses = [friction, *(other[k][0] for other in others)]
        worst = int(np.argmax(losses))
        loops.append(
            Loop(
                low, measured, friction, losses[worst], (law.asperity.mu, *_FRICTIONS)[worst],
                open_closure, law_closure, law.asperity.yield_interference < np.inf,
                float(part.max()),
            )
        )  # fmt: skip
    return loops


def _of_law(law: JointLaw, tests: list[tuple[Array, Array, float]], steps: int) -> list[Result]:
    """Loss and closure kept of a law in every cycle.

    At the finest resolution: few depth cells lock whole contacts where the law locks their rims,
    and lose too much, also where friction is so high that no asperity slides.
    """
    finest = replace(law, resolution=NAMED["reference"], plane=None, closure_only=True)
    joint, found = finest.joint(), []
    greatest, back = 0.0, np.zeros((2, 1))
    shape = np.concatenate([np.arange(steps + 1), np.arange(steps)[::-1]]) / steps
    for part, _, low in tests:
        peak = float(part.max())
        # below the largest stress so far a joint that has yielded reloads as it unloaded
        to = law.closure(peak) if peak >= greatest else np.interp(peak, *back)
        closure = float(to) * shape
        moves = np.diff(closure)
        stress = np.array([0.0, *(joint.update([d], tangent=False)[0][0] for d in moves)])
        found.append(_loss(stress, closure, low))
        if peak >= greatest:
            greatest, back = peak, np.stack([stress, closure])[:, : steps - 1 : -1]
    return found


def _lowest(stress: Array) -> float:
    """The lowest stress (Pa) above zero that both branches of a cycle reach."""
    top = int(np.argmax(stress))
    up = stress[: top + 1]
    return float(max(up[0], stress[top:].min(), up[up > 0].min(initial=stress[top])))


def _loss(stress: Array, closure: Array, low: float) -> Result:
    """What a cycle loses above the stress `low`, as a share of the work of loading.

    With it the closure (m) that it keeps back there.
    """
    top = int(np.argmax(stress))
    up = _above(stress[: top + 1], closure[: top + 1], low)
    down = _above(stress[top:][::-1], closure[top:][::-1], low)
    return 1 - float(trapezoid(*down) / trapezoid(*up)), float(down[1][0] - up[1][0])


def _above(stress: Array, closure: Array, low: float) -> tuple[Array, Array]:
    """An ascending branch from where it leaves the stress `low`, at or below which it begins."""
    at = int(np.flatnonzero(stress <= low)[-1])
    first = float(np.interp(low, stress[at : at + 2], closure[at : at + 2]))
    return np.concatenate([[low], stress[at + 1 :]]), np.concatenate([[first], closure[at + 1 :]])
