"""A scan in words and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .estimate import SurfaceEstimate

UNITS = {"beta": "m", "overlap": "m", "asperity_density": "1/m2"}


def report(fit: SurfaceEstimate, at_lengths: Sequence[SurfaceEstimate]) -> str:
    """Parameters with errors, quality, what is not identifiable, dependence on sampling length.

    at_lengths: the same scan read at several sampling lengths.
    """
    found = fit.asperities
    lines = [
        "# Asperities of a scanned surface",
        "",
        f"{found.depth.size} summits and {len(found.slope)} facets at a sampling length of "
        f"{fit.sampling_length:.3g} m ({'profile' if fit.is_profile else 'surface'}, spacing "
        f"{fit.spacing:.3g} m).",
        "",
        "| parameter | value | standard error | unit | fixed by this scan |",
        "|---|---|---|---|---|",
    ]
    left = fit.not_identifiable
    for name, value in fit.parameters.items():
        error = fit.standard_error[name]
        shown = "-" if math.isnan(error) else f"{error:.2g}"
        lines.append(
            f"| {name} | {value:.4g} | {shown} | {UNITS.get(name, '1')} | "
            f"{'yes' if name in fit.identifiable else 'no'} |"
        )
    lines += ["", "Not identifiable from this scan:", ""]
    lines += [f"- {name}: {reason}" for name, reason in left.items()]
    lines += [
        "- K, lam, eta, mu: no scan measures stiffness or friction; take them from the rock or "
        "from a closure and a shear test",
        "",
        f"Largest difference of the cumulative curves: heights {fit.distance_heights:.3f}, "
        f"inclinations {fit.distance_inclinations:.3f}.",
    ]
    lines += [f"Warning: {text}." for text in fit.warnings]
    lines += [
        "",
        "## Dependence on the sampling length",
        "",
        "Rock is rough at every scale: a finer look finds more, smaller and steeper asperities. "
        "These parameters hold at their sampling length and no other; choose the size of the "
        "contacts that carry the load, and state it with the result.",
        "",
        "| sampling length (m) | summits | density | mean inclination (deg) | a | b | c | alpha "
        "| beta (m) |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for other in at_lengths:
        p = other.parameters
        mean = math.degrees(other.orientation.mean)
        lines.append(
            f"| {other.sampling_length:.3g} | {other.asperities.depth.size} | "
            f"{other.asperities.density:.3g} | {mean:.1f} | {p['a']:.2f} | {p['b']:.2f} | "
            f"{p['c']:.3f} | {p['alpha']:.2f} | {p['beta']:.3g} |"
        )
    return "\n".join(lines) + "\n"
