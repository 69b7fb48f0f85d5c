"""Section 4, one asperity and its power law: Eq. 33 to 36, and the limits of Eq. 37b."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad

from ..parameters.asperity import Asperity
from .closed_form import Shape, inelastic, sliding_angle
from .runs import simple
from .secant import secant, series_limit, shear_factor
from .section import Bound, Numbers, Section, near, rounding

SECTION = Section()


@SECTION.claim(
    "hertz-parameters",
    "section 4.1",
    "G = 20 GPa, nu = 0.3, R = 40 um give K = 200 GPa um^1/2, lambda = 1.2",
    "K = {K:.1f} GPa µm^1/2, λ = {lam:.3f}",
    [
        near("K", 200.0, 5.0, "printed with two digits"),
        near("lam", 1.2, 0.05, "printed with two digits"),
    ],
)
def hertz_parameters() -> Numbers:
    asperity = Asperity.hertz_mindlin(20e9, 0.3, 40e-6, 0.3)
    return {"K": asperity.K * 1e-6, "lam": asperity.lam}


@SECTION.claim(
    "shear-law",
    "Eq. 35",
    "K_s falls from 3 K_n/2 lambda to K_n/lambda at sliding",
    "factors {start:.6f} and {end:.6f}; the incremental law on a flat facet follows Eq. 35 to "
    "{law:.0e} μ f_n (64 depth cells)",
    [
        near("start", 1.5, 1e-11, "read at x = 1e-12"),
        rounding("end", 1.0),
        Bound("law", most=2e-3, why="64 depth cells; falls with their number"),
    ],
)
def shear_law() -> Numbers:
    mu, lam = 0.3, 1.2
    joint = simple(1e6, mu, eta=0.5, lam=lam).joint()  # facets that are nearly flat
    joint.update([1.0, 0.0, 0.0])
    worst = 0.0
    for x in np.linspace(0.0, 1.2, 61):
        F, _ = joint.trial([0.0, x * mu * lam, 0.0])
        exact = min(x, 1.0) * float(shear_factor(min(x, 1.0), 0.5))
        worst = max(worst, abs(float(F[1]) / (mu * float(F[0])) - exact))
    start, end = shear_factor([0.0, 1.0], 0.5).tolist()
    return {"start": start, "end": end, "law": worst}


@SECTION.claim(
    "shear-series",
    "Eq. 36",
    "the series falls from 3 K_n/2 lambda to 1.063 K_n/lambda at sliding",
    "{start:.4f} to {end:.4f}, so f_s would be {end:.4f} μ f_n at sliding (and up to {peak:.3f}): "
    "it must be capped, and the cap is reached at d_s = {limit:.3f} μλ d_n already",
    [
        rounding("start", 1.5),
        near("end", 1.063, 1e-3, "printed with four digits"),
        Bound("peak", most=1.0 + 1e-12, why="no more than friction, but for rounding"),
    ],
    one_reading=[rounding("start", 1.5), near("end", 1.063, 1e-3, "printed with four digits")],
)
def shear_series() -> Numbers:
    x = np.linspace(0.0, 2.0, 200001)
    factor = shear_factor(x, 0.5, "series")
    return {
        "start": float(factor[0]),
        "end": float(shear_factor(1.0, 0.5, "series")),
        "limit": series_limit(0.5),
        "peak": float((x * factor).max()),
    }


@SECTION.claim(
    "sliding-angle-power",
    "section 4",
    "theta_s = arctan(lambda mu) for the power law",
    "{exact:.3f}° with Eq. 35 (arctan λμ = {arctan:.3f}°; a = 3, λ = 1.2, μ = 0.3); {series:.3f}° "
    "with the capped series of Eq. 36",
    [Bound("miss", most=1e-9, why="arccos of a share that is known to rounding")],
)
def sliding_angle_power() -> Numbers:
    a, mu, lam = 3.0, 0.3, 1.2
    found = simple(a, mu, eta=0.5, lam=lam)
    numbers = {"arctan": math.degrees(math.atan(lam * mu))}
    for contact in ("exact", "series"):
        share = secant(found, (1.0, 0.0, 0.0), contact).sliding
        numbers[contact] = math.degrees(math.acos(share) / a)
    return numbers | {"miss": abs(numbers["exact"] - numbers["arctan"])}


@SECTION.claim(
    "sliding-limits",
    "Eq. 37b",
    "the sliding domain runs from 0 to theta_s",
    "the limits are those of the asperities that do not slide: at μ = 0 they would give C11p = "
    "{within:.0f} where Eq. 31 has {beyond:.4f} K_s; the text above it and Eq. 29 (θ_s to π/2a) "
    "are right",
    [rounding("within", 2 / 3)],
    misprint=[rounding("beyond", 2 / 3)],
)
def sliding_limits() -> Numbers:
    mu = 0.0
    within, _ = quad(lambda theta: math.sin(theta) ** 3, 0.0, sliding_angle(1.0, 1.0, mu))
    return {"within": within, "beyond": float(inelastic(Shape(1.0), 1.0, 1.0, mu)[0])}
