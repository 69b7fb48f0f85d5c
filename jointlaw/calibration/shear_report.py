"""What a fit says of its shear curves: strength, band, and whether they soften as the law does."""

from typing import Any

import numpy as np

from ..support.checks import Array
from .estimate import WANDERS, Estimate
from .forward import build_for_shear
from .measured import ShearCurve
from .problem import derivative

SOFTER = 0.05  # of the peak: more than this beyond what the law loses is a softening of its own
END = 0.1  # share of the points that count as the end of a curve
WEAR = ("mu_residual", "wear_slip")


def model(fit: Estimate, curve: ShearCurve) -> Array:
    """Shear stress (Pa) of the fitted law along the path of a shear curve, (n,)."""
    return curve.predict(build_for_shear(fit.parameters, fit.problem.settings, curve.azimuth))


def band(fit: Estimate, curve: ShearCurve, level: float = 0.95) -> tuple[Array, Array]:
    """Band (low, high) in Pa, (n,), that holds a point yet to be measured with this probability."""
    problem, x = fit.problem, fit.solution.x

    def along(x: Array) -> Array:
        return curve.residuals(problem.unpack(x), problem.settings)

    slope = derivative(along, x, *problem.bounds())
    variance = np.einsum("ip,pq,iq->i", slope, fit.solution.covariance, slope)
    noise = next(n for n, c in zip(fit.noise, problem.curves, strict=True) if c is curve)
    reach = fit.solution.quantile(level) * np.sqrt(variance + noise.share**2)
    reach = reach * np.max(np.abs(curve.shear_stress))
    centre = model(fit, curve)
    return centre - reach, centre + reach


def describe(fit: Estimate) -> list[str]:
    """Peak and end of every shear curve against the law (Markdown), and what does not agree."""
    curves = [curve for curve in fit.problem.curves if isinstance(curve, ShearCurve)]
    if not curves:
        return []
    lines = [
        "",
        "Shear curves, measured and by the law:",
        "",
        "| normal stress (MPa) | peak (MPa) | law | end (MPa) | law | misfit of neighbours |",
        "|---|---|---|---|---|---|",
    ]
    softer, otherwise = [], []
    for curve in curves:
        law, at = model(fit, curve), f"{curve.normal / 1e6:.4g} MPa"
        (top, end), (law_top, law_end) = _peak_and_end(curve.shear_stress), _peak_and_end(law)
        r = (law - curve.shear_stress) / np.max(np.abs(curve.shear_stress))
        wander = float(np.sqrt(max(np.mean(r[1:] * r[:-1]), 0.0)))
        lines.append(
            f"| {curve.normal / 1e6:.4g} | {top / 1e6:.4g} | {law_top / 1e6:.4g} | "
            f"{end / 1e6:.4g} | {law_end / 1e6:.4g} | {100 * wander:.2g} % |"
        )
        if end / top < law_end / law_top - SOFTER:
            softer.append(f"at {at} by {100 * (1 - end / top):.0f} % of the peak")
        elif wander > WANDERS * curve.expected.share:
            otherwise.append(f"at {at} by {100 * wander:.2g} % of the peak")
    if softer:
        free = ",".join([n for n in fit.free if not n.startswith("seating")] + list(WEAR))
        lines += ["", f"**These curves soften after their peak**, {', '.join(softer)}: " + (
            "more than the law with its wear."
            if set(WEAR) & set(fit.free)
            else f"but a law without wear does not soften. Fit the wear too: --free {free}"
        )]  # fmt: skip
    if otherwise:
        lines += [
            "",
            "**These curves do not bend as the law does**: neighbouring points deviate to the same "
            f"side, {', '.join(otherwise)}. Use the law with this error, and only between points.",
        ]
    return lines


def draw(axis: Any, fit: Estimate, curve: ShearCurve) -> None:
    """Points, law and band of a shear curve."""
    low, high = band(fit, curve)
    factor, unit = (1e3, "mm") if np.ptp(curve.shear) >= 5e-4 else (1e6, "µm")
    x, measured = factor * curve.shear, {"marker": "o", "ls": "none", "color": "C0", "zorder": 3}
    axis.fill_between(x, low / 1e6, high / 1e6, color="C1", alpha=0.25, label="95 % band")
    axis.plot(x, model(fit, curve) / 1e6, color="C1", label="law")
    axis.plot(x, curve.shear_stress / 1e6, ms=4, label="measured", **measured)
    axis.set(
        xlabel=f"shear displacement ({unit})", ylabel="shear stress (MPa)",
        title=f"Direct shear at {curve.normal / 1e6:.3g} MPa",
    )  # fmt: skip
    axis.legend(loc="lower right")


def _peak_and_end(stress: Array) -> tuple[float, float]:
    """Largest shear stress (Pa), either sense, of three neighbours' mean; and mean of the end."""
    size = np.convolve(np.abs(stress), np.ones(3) / 3, "valid")
    return float(size.max()), float(np.mean(np.abs(stress)[-max(int(END * stress.size), 3) :]))
