"""Laws of a scene, built from its TOML tables."""

import tomllib
from collections.abc import Iterable
from pathlib import Path

import jointlaw as jl
from jointlaw.parameters.rock import require_rock

from .keys import TABLE, Tables, overlay

Law = jl.JointLaw | jl.CoulombLaw
WHOLE = "whole rock"  # name of the law of cuts that are no joints
USUAL = 1e5  # Pa: normal stress of a joint where it is not known
STRONG = 1e3  # cohesion of whole rock over its tension


class Files(dict[str, str]):
    """Texts of the files that a scene names, by their names; read from `folder` when first used.

    A name is a path relative to the scene's file.
    """

    def __init__(self, folder: str | Path = "", known: dict[str, str] | None = None) -> None:
        super().__init__(known or {})
        self.folder = Path(folder)

    def __missing__(self, name: str) -> str:
        return self.setdefault(name, (self.folder / name).read_text(encoding="utf-8-sig"))


def build_law(data: Tables, where: str, files: Files) -> Law:
    """A law from a scene's `[laws.NAME]` table; `kind` is "joint" (default) or "coulomb". Its keys
    are laid over those of the law that it is `from`, by name or from a file. Its `pressure` is that
    of water in the joints, no part of the law.

    Raises ValueError.
    """
    if TABLE(where, data).get("closure_only"):
        raise ValueError(f"{where}.closure_only = true: joints between blocks shear; leave it out")
    own = {key: value for key, value in data.items() if key not in ("from", "pressure")}
    if "from" in data:
        name = str(data["from"])
        if name not in files:
            path = files.folder / name
            files[name] = jl.presets.load_any(str(path) if path.is_file() else name).to_toml()
        own = overlay(tomllib.loads(files[name]), own)
    law: Law = jl.JointLaw.from_dict({"plane": 0.0, **own}, where)
    if isinstance(law, jl.CoulombLaw):
        require_rock({**vars(law), "plane": 0.0}, f"{where}.")
    else:
        require_rock({"stiffness at 1 MPa": springs(law, 1e6)[0]}, f"{where}: ")
        require_rock({"mu": law.asperity.mu}, f"{where}.asperity.")
    require_rock({"plane": law.plane or 0.0}, f"{where}.")
    return law


def springs(law: Law, stress: float) -> tuple[float, float]:
    """Stiffnesses in closure and shear (Pa/m): of a joint law that is closed by a stress (Pa)."""
    if isinstance(law, jl.CoulombLaw):
        return law.normal_stiffness, law.shear_stiffness
    stiffness = float(stress / law.closure(stress))
    return stiffness, stiffness / law.asperity.lam


def whole_rock(laws: Iterable[Law], opening: float) -> jl.CoulombLaw:
    """A joint as stiff as the stiffest of some laws at the usual stress, which holds until it is
    open by `opening` (m)."""
    normal, shear = max(springs(law, USUAL) for law in laws)
    tension = normal * opening
    return jl.CoulombLaw(normal, shear, 1.0, STRONG * tension, tension, plane=0.0)


def opens_to(law: Law) -> float:
    """How far (m) a joint opens before tension no longer holds it."""
    if isinstance(law, jl.CoulombLaw):
        return law.tension / law.normal_stiffness
    return 0.0 if law.bond is None else 1.0 / law.bond.limits[1][0]
