"""Claims of sections 4.1 and 4.2: closure and initial shear stiffness, Figures 11 to 13."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from ...law import JointLaw
from ..figures.normal import TOP_STRESS, initial_shear_stiffness
from ..figures.runs import changed, law
from ..figures.total import total_closure
from .registry import Finding, claim

SMOOTH, ROUGH, REPLICA = "westerly-smooth", "westerly-rough", "jing-replica"
LADDER = (0.1e6, 1e6, 10e6, 50e6)  # Pa


@claim("closure-stiffer", "Fig. 11", "the smooth interface is stiffer in closure")
def closure_stiffer() -> Finding:
    """Closure at equal stress, and the closure at which the two curves cross."""
    smooth, rough = law(SMOOTH), law(ROUGH)
    cross = _crossing(smooth, rough)
    printed = _total_crossing(smooth, rough)
    alone = _crossing(
        changed(SMOOTH, formation="individual"), changed(ROUGH, formation="individual")
    )
    at = float(smooth.normal_stress(cross))
    two = [float(found.closure(TOP_STRESS)) * 1e6 for found in (smooth, rough)]
    text = (
        f"beyond a crossing at {cross * 1e6:.3f} µm, {at / 1e6:.1f} MPa (total form "
        f'{printed * 1e6:.3f} µm; formation "individual" {alone * 1e6:.3f} µm), softer before it, '
        "since fewer of its asperities touch at zero closure; at 50 MPa it has closed "
        f"{two[0]:.3f} µm, the rough one {two[1]:.3f} µm"
    )
    numbers = {
        "crossing": cross, "stress": at, "total": printed, "individual": alone,
        "smooth": two[0], "rough": two[1],
    }  # fmt: skip
    return Finding("in part", text, numbers)


@claim("closure-hardening", "Fig. 11", "the smooth interface hardens more with closure")
def closure_hardening() -> Finding:
    """Gain of tangent stiffness from 0.1 to 0.4 um."""
    gain = {}
    for name, label in ((SMOOTH, "smooth"), (ROUGH, "rough")):
        low, high = (_stiffness(law(name), closure) for closure in (0.1e-6, 0.4e-6))
        gain[label] = high / low
    text = (
        f"dF₁/dδ₁ grows by a factor {gain['smooth']:.2f} (smooth) and {gain['rough']:.2f} (rough) "
        "from 0.1 to 0.4 µm"
    )
    return Finding("holds", text, gain)


@claim(
    "closure-reasons", "section 4.1", "narrow heights and concentrated orientations both stiffen"
)
def closure_reasons() -> Finding:
    """Stress at 0.4 um with heights or orientation of the rough interface changed alone."""
    base = float(law(ROUGH).normal_stress(0.4e-6))
    heights = float(changed(ROUGH, heights=SMOOTH).normal_stress(0.4e-6)) / base
    turned = float(changed(ROUGH, orientation=SMOOTH).normal_stress(0.4e-6)) / base
    text = (
        f"at 0.4 µm: heights of the smooth interface alone × {heights:.3f}, its orientations alone "
        f"× {turned:.3f}"
    )
    return Finding("holds", text, {"heights": heights, "orientation": turned})


@claim("shear-stiffness", "Fig. 12a", "the smooth interface has the higher initial shear stiffness")
def shear_stiffness() -> Finding:
    """Ratio smooth over rough at equal normal stress, both forms."""
    ratios = {
        stress: [
            s / r
            for s, r in zip(
                initial_shear_stiffness(law(SMOOTH), stress),
                initial_shear_stiffness(law(ROUGH), stress),
                strict=True,
            )
        ]
        for stress in LADDER
    }
    text = "smooth/rough at 0.1, 1, 10, 50 MPa: " + "; ".join(
        f"{kind} " + ", ".join(f"{ratios[s][i]:.2f}" for s in LADDER)
        for i, kind in enumerate(("total form", "incremental law"))
    )
    numbers = {
        f"{kind}_{s / 1e6:g}": ratios[s][i]
        for s in LADDER
        for i, kind in enumerate(("total", "law"))
    }
    return Finding("in part", text, numbers)


@claim(
    "shear-stiffness-slows", "Fig. 12a", "shear stiffness grows ever more slowly with normal stress"
)
def shear_stiffness_slows() -> Finding:
    """Slope of stiffness against stress at three stresses, both forms."""
    stress = np.array([1e6, 5e6, 10e6, 20e6, 50e6])
    numbers: dict[str, float] = {}
    parts = []
    for i, kind in enumerate(("total form", "incremental law")):
        values = np.array([initial_shear_stiffness(law(SMOOTH), float(s))[i] for s in stress])
        slope = np.diff(values) / np.diff(stress) * 1e-6  # (MPa/um)/MPa
        parts.append(f"{kind} " + ", ".join(f"{x:.1f}" for x in slope))
        numbers |= {f"{kind}_{k}": float(x) for k, x in enumerate(slope)}
    text = "smooth, slope in 1/µm between 1, 5, 10, 20, 50 MPa: " + "; ".join(parts)
    return Finding("holds", text, numbers)


@claim("contacts-form-early", "section 4.2", "most new contacts form at low normal stress")
def contacts_form_early() -> Finding:
    """Share of the contacts new between 0 and 50 MPa that have formed by 12.5 and 25 MPa."""
    shares = {}
    for name, label in ((SMOOTH, "smooth"), (ROUGH, "rough")):
        found = law(name)
        count = [float(found.contacts(found.closure(s))) for s in (0.0, 12.5e6, 25e6, 50e6)]
        start = found.asperity_density * float(found.heights.cdf(found.heights.overlap))  # type: ignore[union-attr]
        new = [(c - start) / (count[-1] - start) for c in count[1:3]]
        shares[label] = new
    text = (
        "of the contacts new up to 50 MPa, by 12.5 and 25 MPa have formed "
        f"{shares['smooth'][0]:.0%} and {shares['smooth'][1]:.0%} (smooth), "
        f"{shares['rough'][0]:.0%} and {shares['rough'][1]:.0%} (rough)"
    )
    numbers = {f"{k}_{i}": v for k, pair in shares.items() for i, v in enumerate(pair)}
    return Finding("holds", text, numbers)


@claim("slowing-reason", "section 4.2", "the nonlinearity comes from the forming of contacts")
def slowing_reason() -> Finding:
    """Local exponent of shear stiffness against stress at 10 MPa, with and without formation."""
    formed, without = _exponent(law(SMOOTH)), _exponent(changed(SMOOTH, heights="none"))
    text = (
        f"stiffness goes with stress to the power {formed:.2f} at 10 MPa; without any forming of "
        f"contacts to the power {without:.2f} (Hertz: 1/3), slower still: forming straightens it"
    )
    return Finding("fails", text, {"with": formed, "without": without})


@claim(
    "replica-stiffness", "Fig. 13", "initial shear stiffness of the replica depends on direction"
)
def replica_stiffness() -> Finding:
    """Ratio of initial shear stiffness along axes 2 and 3 at three stresses."""
    ratio = {}
    for stress in (0.5e6, 2e6, 10e6):
        two = initial_shear_stiffness(law(REPLICA), stress)
        three = initial_shear_stiffness(law(REPLICA), stress, math.pi / 2)
        ratio[stress] = [x / y for x, y in zip(two, three, strict=True)]
    text = (
        f"axis 2 over axis 3: total form {ratio[2e6][0]:.3f}, incremental law {ratio[2e6][1]:.3f}, "
        "the same at every stress. Axis 2 is stiffer though c < 0, because λ = 0.33 makes K_s > "
        "K_n"
    )
    numbers = {
        f"{k}_{s / 1e6:g}": r[i] for s, r in ratio.items() for i, k in enumerate(("total", "law"))
    }
    return Finding("holds", text, numbers)


def _crossing(smooth: JointLaw, rough: JointLaw) -> float:
    """Closure (m) beyond which the smooth interface carries more."""
    return float(
        brentq(
            lambda u: float(smooth.normal_stress(u)) / float(rough.normal_stress(u)) - 1,
            0.02e-6, 2e-6, xtol=1e-12,
        )
    )  # fmt: skip


def _total_crossing(smooth: JointLaw, rough: JointLaw) -> float:
    """The same by the total form."""

    def excess(u: float) -> float:
        return float(total_closure(smooth, [u])[0] / total_closure(rough, [u])[0]) - 1

    return float(brentq(excess, 0.02e-6, 2e-6, xtol=1e-11))


def _stiffness(found: JointLaw, closure: float) -> float:
    """dF1/d delta_1 (Pa/m) of the virgin curve."""
    step = 1e-4 * closure
    high, low = found.normal_stress(closure + step), found.normal_stress(closure - step)
    return float(high - low) / (2 * step)


def _exponent(found: JointLaw) -> float:
    """d log(initial shear stiffness)/d log(normal stress) at 10 MPa, incremental law."""
    low, high = (initial_shear_stiffness(found, s)[1] for s in (9e6, 11e6))
    return math.log(high / low) / math.log(11 / 9)
