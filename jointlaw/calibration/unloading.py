"""What of a measured hysteresis loop the law's friction explains, and what it does not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import trapezoid  # numpy renamed its own between versions

from ..law import JointLaw
from ..parameters.resolution import NAMED
from ..support.checks import Array
from ..support.progress import track
from .measured import first_loading

_FRICTIONS = (0.1, 0.15, 0.2, 0.3, 0.45)


@dataclass(frozen=True)
class Loop:
    """A loading cycle against the law above a stress, as shares of the work of loading.

    stress (Pa): the lowest, above zero, that both branches of the test reach;
    measured: loss of the measured cycle; friction: loss of the law; largest_friction: the largest
    of several friction coefficients at these inclinations, that of `worst_mu`; open_closure
    (m): closure the test did not recover on the way back to `stress`; law_closure (m): that of the
    law.
    """

    stress: float
    measured: float
    friction: float
    largest_friction: float
    worst_mu: float
    open_closure: float
    law_closure: float
    yields: bool = False

    def text(self) -> str:
        """The same in words."""
        what = "Friction on the asperities, all that the law has, loses"
        rest = "crushed and flattened asperities, seating of the halves, gouge"
        if self.yields:
            what = "Friction and yielding of the asperities, as the law has them, lose"
            rest = "crushed asperities, seating of the halves, gouge"
        return (
            f"The measured cycle loses {100 * self.measured:.0f} % of the work of loading and "
            f"keeps {1e6 * self.open_closure:.1f} um of closure back at {self.stress / 1e6:.3g} "
            "MPa. "
            f"{what} {100 * self.friction:.2g} % "
            f"and keeps {1e6 * self.law_closure:.2f} um; of friction coefficients from "
            f"{_FRICTIONS[0]} to {_FRICTIONS[-1]}, {self.worst_mu:g} loses most at these "
            f"inclinations, {100 * self.largest_friction:.1f} %. "
            f"The rest is not in the law: {rest}. Use the fitted law for loading, and for small "
            "cycles below the largest stress with care."
        )


def explain(law: JointLaw, stress: ArrayLike, closure: ArrayLike, steps: int = 100) -> Loop:
    """Compare one measured loading cycle with what a law does on it.

    stress: Pa, (n,), loading and unloading; closure: m, (n,); law: such as that of a fit to the
    loading branch; steps: of the law per branch.

    Raises ValueError when the data do not load and unload above zero stress.
    """
    s_up, _, s_down, _ = first_loading(stress, closure)
    high = float(s_up[-1])
    low = float(max(s_up[0], s_down.min(), s_up[s_up > 0].min(initial=high)))
    if s_down.size < 3 or not low < high:
        raise ValueError("stress does not rise and fall above 0: give one cycle, both branches")
    measured, open_closure = _loss(stress, closure, low)
    friction, law_closure = _loss(*_cycle(law, high, steps), low)
    largest, worst_mu = friction, law.asperity.mu
    for mu in track(_FRICTIONS, "friction", len(_FRICTIONS)):
        other = replace(
            law, asperity=replace(law.asperity, mu=mu, mu_residual=None, wear_slip=np.inf)
        )
        loss, _ = _loss(*_cycle(other, high, steps), low)
        if loss > largest:
            largest, worst_mu = loss, mu
    yields = law.asperity.yield_interference < np.inf
    return Loop(low, measured, friction, largest, worst_mu, open_closure, law_closure, yields)


def _cycle(law: JointLaw, high: float, steps: int) -> tuple[Array, Array]:
    """Stress (Pa) and closure (m), (n,), of a law loaded to a stress and unloaded.

    At the finest resolution: few depth cells lock whole contacts where the law locks their rims,
    and lose up to ten times too much when friction is high.
    """
    finest = replace(law, resolution=NAMED["reference"], plane=None, closure_only=True)
    joint, step = finest.joint(), float(law.closure(high)) / steps
    rows = [(float(joint.F[0]), float(joint.delta[0]))]
    for increment in [step] * steps + [-step] * steps:
        joint.update([increment], tangent=False)
        rows.append((float(joint.F[0]), float(joint.delta[0])))
    stress, closure = np.array(rows).T
    return stress, closure


def _loss(stress: ArrayLike, closure: ArrayLike, low: float) -> tuple[float, float]:
    """What a cycle loses above the stress `low`, as a share of the work of loading.

    With it the closure (m) that it keeps back there.
    """
    s_up, u_up, s_down, u_down = first_loading(stress, closure)
    up, down = _above(s_up, u_up, low), _above(s_down[::-1], u_down[::-1], low)
    return 1 - float(trapezoid(*down) / trapezoid(*up)), float(down[1][0] - up[1][0])


def _above(stress: Array, closure: Array, low: float) -> tuple[Array, Array]:
    """An ascending branch from where it leaves the stress `low`, at or below which it begins."""
    at = int(np.flatnonzero(stress <= low)[-1])
    first = float(np.interp(low, stress[at : at + 2], closure[at : at + 2]))
    return np.concatenate([[low], stress[at + 1 :]]), np.concatenate([[first], closure[at + 1 :]])
