"""Claims on one asperity and its power law: Eq. 33 to 36 and the limits of Eq. 37b."""

from __future__ import annotations

import math

import numpy as np

from ...law import JointLaw
from ...parameters.asperity import Asperity
from ...parameters.orientation import Orientation
from ...parameters.resolution import Resolution
from ..closed_form import Shape, inelastic
from ..secant import secant, series_limit, shear_factor
from .normal import simple
from .registry import Finding, claim


@claim(
    "hertz-parameters",
    "section 4.1",
    "G = 20 GPa, nu = 0.3, R = 40 um give K = 200 GPa um^1/2, lambda = 1.2",
)
def hertz_parameters() -> Finding:
    """Eq. 34."""
    asperity = Asperity.hertz_mindlin(20e9, 0.3, 40e-6, 0.3)
    K = asperity.K * 1e-6
    text = f"K = {K:.1f} GPa µm^1/2, λ = {asperity.lam:.3f}"
    return Finding("holds", text, {"K": K, "lam": asperity.lam})


@claim("shear-law", "Eq. 35", "K_s falls from 3 K_n/2 lambda to K_n/lambda at sliding")
def shear_law() -> Finding:
    """Secant factor of Eq. 35, and the incremental law at constant normal load."""
    start, end = (float(shear_factor(x, 0.5)) for x in (0.0, 1.0))
    worst = _flat_contact_error()
    text = (
        f"factors {start:.6f} and {end:.6f}; the incremental law on a flat facet follows Eq. 35 to "
        f"{worst:.0e} μ f_n (64 depth cells)"
    )
    return Finding("holds", text, {"start": start, "end": end, "law": worst})


@claim(
    "shear-series", "Eq. 36", "the series falls from 3 K_n/2 lambda to 1.063 K_n/lambda at sliding"
)
def shear_series() -> Finding:
    """Secant factor of Eq. 36 and the point where it reaches friction."""
    start, end = (float(shear_factor(x, 0.5, "series")) for x in (0.0, 1.0))
    limit = series_limit(0.5)
    x = np.linspace(0.0, 2.0, 200001)
    force = x * shear_factor(x, 0.5, "series")
    peak = float(force.max())
    text = (
        f"{start:.4f} to {end:.4f}, so f_s would be {end:.4f} μ f_n at sliding (and up to "
        f"{peak:.3f}): it must be capped, and the cap is reached at d_s = {limit:.3f} μλ d_n "
        "already"
    )
    return Finding("one reading", text, {"start": start, "end": end, "limit": limit, "peak": peak})


@claim("sliding-angle-power", "section 4", "theta_s = arctan(lambda mu) for the power law")
def sliding_angle_power() -> Finding:
    """Sliding share of both contact forms in closure."""
    a, mu, lam = 3.0, 0.3, 1.2
    found = simple(a, mu, eta=0.5, lam=lam)
    edge = {}
    for contact in ("exact", "series"):
        share = secant(found, (1.0, 0.0, 0.0), contact).sliding
        edge[contact] = math.degrees(math.acos(share) / a)
    exact = math.degrees(math.atan(lam * mu))
    text = (
        f"{edge['exact']:.3f}° with Eq. 35 (arctan λμ = {exact:.3f}°; a = 3, λ = 1.2, μ = 0.3); "
        f"{edge['series']:.3f}° with the capped series of Eq. 36"
    )
    return Finding("holds", text, {"arctan": exact, **edge})


@claim("sliding-limits", "Eq. 37b", "the sliding domain runs from 0 to theta_s")
def sliding_limits() -> Finding:
    """C11p at mu = 0 over both domains."""
    beyond = float(inelastic(Shape(1.0), 1.0, 1.0, 0.0)[0])
    text = (
        "the limits are those of the asperities that do not slide: at μ = 0 they would give C11p "
        f"= 0 where Eq. 31 has {beyond:.4f} K_s; the text above it and Eq. 29 (θ_s to π/2a) are "
        "right"
    )
    return Finding("misprint", text, {"beyond": beyond})


def _flat_contact_error() -> float:
    """Largest miss of Eq. 35 by the incremental law on nearly flat facets, over mu f_n."""
    mu, lam = 0.3, 1.2
    found = JointLaw(
        orientation=Orientation(1e6),
        asperity=Asperity(K=1.0, lam=lam, eta=0.5, mu=mu),
        asperity_density=1.0,
        closure_range=1.0,
        resolution=Resolution(1, 3, 64),
    )
    joint = found.joint()
    joint.update([1.0, 0.0, 0.0])
    worst = 0.0
    for x in np.linspace(0.0, 1.2, 61):
        F, _ = joint.trial([0.0, x * mu * lam, 0.0])
        exact = min(x, 1.0) * float(shear_factor(min(x, 1.0), 0.5))
        worst = max(worst, abs(float(F[1]) / (mu * float(F[0])) - exact))
    return worst
