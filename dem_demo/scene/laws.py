"""Laws of a scene, built from its TOML tables."""

import tomllib
from collections.abc import Iterable
from pathlib import Path

import jointlaw as jl
from jointlaw.parameters.about import ABOUT_TABLE, About
from jointlaw.parameters.rock import require_rock

from .keys import TABLE, Tables, overlay

INTACT_ROCK = "intact rock"  # name of the law of cuts that are no joints
TYPICAL_STRESS = 1e5  # Pa: normal stress of a joint where it is unknown
COHESION_PER_TENSION = 1e3  # of intact rock
CONSTANTS = "normal_stiffness", "shear_stiffness", "friction"  # parameters of Coulomb's law


class Files(dict[str, str]):
    """Contents of the files that a scene names, by name; each is read when it is first used.

    folder: of the scene file, which names are relative to. known: contents that are not read.
    """

    def __init__(self, folder: str | Path = "", known: dict[str, str] | None = None) -> None:
        super().__init__(known or {})
        self.folder = Path(folder)

    def __missing__(self, name: str) -> str:
        return self.setdefault(name, (self.folder / name).read_text(encoding="utf-8-sig"))


def build_law(data: Tables, where: str, files: Files) -> jl.Law:
    """Build a law from a `[laws.NAME]` table; `kind` is "joint" (default) or "coulomb".

    With `from`, the name of a preset or a parameter file, the keys of the table are laid over the
    keys of that law. The water `pressure` in the joints is not a part of the law. where: name of
    the table, for error messages.

    Raises ValueError naming the key.
    """
    if TABLE(where, data).get("closure_only"):
        raise ValueError(f"{where}.closure_only = true: joints between blocks shear; leave it out")
    own = {key: value for key, value in data.items() if key not in ("from", "pressure")}
    if "from" in data:
        name = str(data["from"])
        if name not in files:
            path = files.folder / name
            law_file = str(path) if path.is_file() else name
            files[name] = "\n".join(
                [jl.presets.load_any(law_file).to_toml(), _about_of(path).to_toml()]
            )
        own = overlay(tomllib.loads(files[name]), own)
    law: jl.Law = jl.JointLaw.from_dict({"plane": 0.0, **own}, where)
    own = {name: value for name, value in vars(law).items() if name in CONSTANTS}
    require_rock(own, f"{where}.")
    require_rock({"stiffness at 1 MPa": law.secant_stiffness(1e6)[0]}, f"{where}: ")
    if law.tables.asperities is not None:
        require_rock({"mu": law.tables.asperities.mu}, f"{where}.asperity.")
    require_rock({"plane": law.plane or 0.0}, f"{where}.")
    return law


def _about_of(path: Path) -> About:
    """Origin and caveats in a parameter file; empty for the name of a preset."""
    if not path.is_file():
        return About()
    table = tomllib.loads(path.read_text(encoding="utf-8")).get(ABOUT_TABLE, {})
    return About.from_table(table, str(path))


def law_warnings(files: Files) -> list[str]:
    """Warnings in the parameter files of laws among the files of a scene, each with its file."""
    warnings = []
    for name, text in files.items():
        if f"[{ABOUT_TABLE}]" in text:
            about = About.from_table(tomllib.loads(text).get(ABOUT_TABLE, {}), name)
            warnings += [f"{name}: {warning}" for warning in about.warnings]
    return warnings


def intact_rock_law(laws: Iterable[jl.Law], opening: float) -> jl.CoulombLaw:
    """Build the law of a cut that is no joint, as stiff as the stiffest of some laws.

    opening: distance (m) at which its tension breaks.
    """
    normal, shear = max(law.secant_stiffness(TYPICAL_STRESS) for law in laws)
    tension = normal * opening
    return jl.CoulombLaw(normal, shear, 1.0, COHESION_PER_TENSION * tension, tension, plane=0.0)
