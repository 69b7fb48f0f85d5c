"""A fit in words and tables, and as a preset."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..support.files import replace_file
from .estimate import Estimate
from .measured import ClosureCurve
from .priors import transform_of


def report(fit: Estimate, not_identifiable: Mapping[str, str]) -> str:
    """Parameters with intervals, what the data fix and what not, noise, and stiffness."""
    lines = [
        "# Fit of the joint law",
        "",
        "| parameter | value | 95 % interval | unit | from the priors | fixed by the data |",
        "|---|---|---|---|---|---|",
    ]
    for name, share in fit.prior_share.items():
        low, high = fit.interval(name)
        lines.append(
            f"| {name} | {fit.parameters[name]:.4g} | {low:.3g} to {high:.3g} | "
            f"{transform_of(name).unit} | {100 * share:.0f} % | "
            f"{'no' if name in not_identifiable else 'yes'} |"
        )
    finite = [name for name in fit.parameters if math.isfinite(fit.parameters[name])]
    worn = "wear_slip" in finite
    held = [n for n in finite if n not in fit.free and (worn or n != "mu_residual")]
    lines += ["", "Held: " + ", ".join(f"{n} = {fit.parameters[n]:.4g}" for n in held) + "."]
    lines += ["", "Not identifiable from these data:", ""]
    grouped: dict[str, list[str]] = {}
    for name, reason in not_identifiable.items():
        grouped.setdefault(reason, []).append(name)
    lines += [f"- {', '.join(names)}: {reason}" for reason, names in grouped.items()]
    for number, noise in enumerate(fit.noise, 1):
        text = f"Curve {number}: scatter {100 * noise.share:.2g} % of the stress"
        if noise.absolute:
            text += f" and {1e6 * noise.absolute:.2g} um of closure"
        lines += ["", text + (" (given)." if noise.known else " (estimated).")]
    for number, (seating, curve) in enumerate(fit.problem.closures, 1):
        lines += ["", *_curve(fit, fit.parameters[seating], curve, number)]
    return "\n".join(lines) + "\n"


def preset(
    fit: Estimate, not_identifiable: Mapping[str, str], title: str, path: str | Path | None
) -> str:
    """The law as TOML with title, source and what is not identifiable in its table `about`."""
    closures = len(fit.problem.closures)
    others = len(fit.problem.curves) - closures
    source = f"fitted by jointlaw to {closures} closure and {others} shear curves"
    clean = title.replace("\\", "/").replace('"', "'")
    text = fit.law.to_toml() + (
        f'\n[about]\ntitle = "{clean}"\nsource = "{source}"\n'
        f'assumptions = "not identifiable from these data: {", ".join(not_identifiable)}"\n'
    )
    if path is not None:
        replace_file(Path(path), text.encode())
    return text


def _curve(fit: Estimate, seating: float, curve: ClosureCurve, number: int) -> list[str]:
    """What a closure curve does fix: stress and stiffness along it."""
    at = np.array([0.5, 1.0]) * curve.closure[-1]
    low, high = fit.band(at, curve=number, measured=False)
    lines = [
        f"Closure curve {number} (seating closure {1e6 * seating:.3g} um):",
        "",
        "| closure (um) | stress (MPa) | 95 % band (MPa) | normal stiffness (GPa/m) |",
        "|---|---|---|---|",
    ]
    for u, lo, hi in zip(at, low, high, strict=True):
        stress = float(fit.predict(u, number))
        step = 1e-4 * float(curve.closure[-1])
        rise = float(fit.predict(u + step, number)) - float(fit.predict(u - step, number))
        lines.append(
            f"| {1e6 * u:.4g} | {stress / 1e6:.4g} | {lo / 1e6:.4g} to {hi / 1e6:.4g} | "
            f"{rise / (2 * step) / 1e9:.4g} |"
        )
    if fit.bends_otherwise[number - 1]:
        lines += [
            "",
            f"**This curve does not bend as the law does**: neighbouring points miss it together, "
            f"by {100 * fit.wander[number - 1]:.2g} % of the stress. Between the points use it "
            "with that error; beyond them trust neither the curve nor its band: a hyperbola (mated "
            "joints) or a logarithm (unmated ones) may follow this rock better.",
        ]
    return lines
