"""`jointlaw card`: parameters, origin and caveats of a law, for the appendix of a paper."""

import argparse
from collections.abc import Iterator
from dataclasses import is_dataclass
from typing import Any

from ..laws.joint_law import JointLaw
from ..laws.law import Law
from ..parameters.about import About
from ..parameters.declared import parameters_of
from ..support.markdown import table
from ..support.version import __version__
from .command import JSON, LAW, Command, print_json, read_about, read_law

STRESSES = (1e5, 1e6, 1e7)  # Pa, of the properties in the card
BIBTEX = """\
@article{misra1999,
  author = {Misra, Anil},
  title = {Micromechanical model for anisotropic rock joints},
  journal = {Journal of Geophysical Research: Solid Earth},
  volume = {104}, number = {B10}, pages = {23175--23187}, year = {1999},
  doi = {10.1029/1999JB900210},
}
@software{jointlaw,
  author = {{The jointlaw developers}},
  title = {jointlaw: a micromechanical, anisotropic, path-dependent rock-joint law},
  version = {VERSION},
}
"""


def list_parameters(values: Any, path: str = "") -> Iterator[tuple[str, Any, str]]:
    """Yield name, value and unit of every parameter of a law, also inside its parts."""
    for name, declaration in parameters_of(values).items():
        value = getattr(values, name)
        if is_dataclass(value) and parameters_of(value):
            yield from list_parameters(value, f"{path}{name}.")
        elif value is not None:
            yield f"{path}{name}", value, declaration.unit


def describe(law: Law, about: About, name: str) -> str:
    """The card of a law (Markdown)."""
    lines = [f"# Rock joint {name}", ""]
    lines += [f"- {key}: {text}" for key, text in about.notes.items()]
    lines += ["", "## Parameters", ""]
    rows = []
    for parameter, value, unit in list_parameters(law):
        short = parameter.rpartition(".")[2]
        origin = about.origin.get(parameter, about.origin.get(short, "not stated"))
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        rows.append(f"{parameter} | {text} | {unit or '1'} | {origin}")
    lines += table("parameter | value | unit | origin", rows)
    lines += ["", "## Properties of the joint", ""]
    lines += table("normal stress (MPa) | closure (mm) | secant stiffness: normal, shear (GPa/m)",
                   _properties(law))  # fmt: skip
    lines += ["", "## Limits", "", *(f"- {text}" for text in _limits(law))]
    lines += ["", "## Warnings", "", *(f"- {text}" for text in about.warnings or ("none stated",))]
    if about.sha256:
        files = [f"{file} | `{digest}`" for file, digest in about.sha256.items()]
        lines += ["", "## Input files", "", *table("file | SHA-256", files)]
    lines += ["", "## References", "", "```bibtex", BIBTEX.replace("VERSION", __version__) + "```"]
    return "\n".join(lines)


def _properties(law: Law) -> list[str]:
    """Rows of the table of properties at some normal stresses."""
    rows = []
    for stress in STRESSES:
        try:
            closure = float(law.closure(stress))
            normal, shear = law.secant_stiffness(stress)
        except ValueError:  # plastic asperities bear a limited stress
            rows.append(f"{stress / 1e6:g} | not reached | ")
        else:
            stiffness = f"{normal / 1e9:.4g}, {shear / 1e9:.4g}"
            rows.append(f"{stress / 1e6:g} | {1e3 * closure:.4g} | {stiffness}")
    return rows


def _limits(law: Law) -> Iterator[str]:
    """Yield the limits within which the law is meant to be used."""
    if isinstance(law, JointLaw):
        stress = float(law.normal_stress(law.closure_range)) / 1e6
        yield (
            f"the cells are placed for closures up to {1e3 * law.closure_range:.4g} mm, at "
            f"{stress:.4g} MPa: beyond it the law is valid, but less accurate"
        )
    yield "isotropic rock on both sides; no rate, temperature or gouge (docs/limits.md)"


def _run(options: argparse.Namespace) -> None:
    law = read_law(options)
    about = read_about(options)
    if options.json:
        parameters = {name: value for name, value, _ in list_parameters(law)}
        origin = {"notes": about.notes, "origin": about.origin, "sha256": about.sha256}
        print_json({"parameters_SI": parameters, "warnings": about.warnings, **origin})
    else:
        print(describe(law, about, options.law))


COMMAND = Command(
    "card",
    "print parameters, origin, limits and references of a law, for the appendix of a paper",
    "jointlaw card biegel-rough > appendix.md",
    _run,
    (*LAW, JSON),
)
