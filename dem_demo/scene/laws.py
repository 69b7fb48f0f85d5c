"""Laws of a scene, built from its TOML tables. All are `jointlaw.JointLaw`."""

import tomllib
from collections.abc import Iterable
from pathlib import Path

import jointlaw as jl
from jointlaw.parameters.keys import checked
from jointlaw.parameters.rock import require_rock
from jointlaw.support.checks import one_of

from .keys import COULOMB, TABLE, Tables, overlay

FLAT = 1e15  # orientation.a: no asperity is inclined by more than 2e-15 rad
STICKS = 1e30  # friction of a joint that never slides


class Files(dict[str, str]):
    """Texts of the files that a scene names, by their names; read from `folder` when first used.

    A name is a path relative to the scene's file.
    """

    def __init__(self, folder: str | Path = "", known: Iterable[tuple[str, str]] = ()) -> None:
        super().__init__(known)
        self.folder = Path(folder)

    def __missing__(self, name: str) -> str:
        return self.setdefault(name, (self.folder / name).read_text(encoding="utf-8-sig"))


def coulomb_law(
    normal_stiffness: float, shear_stiffness: float, friction: float, bond: jl.Bond | None = None
) -> jl.JointLaw:
    """Plain Coulomb friction with constant stiffness, for comparison: level, linear asperities.

    normal_stiffness, shear_stiffness: per area, > 0 (Pa/m); friction: coefficient, >= 0, may be
    infinite; bond: cohesion and tension. Raises ValueError for others.
    """
    return jl.JointLaw(
        orientation=jl.Orientation(FLAT),
        asperity=jl.Asperity.linear(normal_stiffness, shear_stiffness, min(friction, STICKS)),
        asperity_density=1.0,
        resolution=jl.Resolution(1, 3, 1),
        plane=0.0,
        bond=bond,
    )


def is_coulomb(law: jl.JointLaw) -> bool:
    """Is it plain Coulomb friction, without asperity angles and heights?"""
    return law.orientation.a >= FLAT and law.heights is None and law.asperity.eta == 0


def law_table(data: Tables, files: Files) -> Tables:
    """A law's table with the keys of the law that it is `from`, by name or from a file.

    Raises ValueError.
    """
    if "from" not in data:
        return data
    name = str(data["from"])
    if name not in files:
        path = files.folder / name
        files[name] = jl.presets.load_any(str(path) if path.is_file() else name).to_toml()
    own = {key: value for key, value in data.items() if key != "from"}
    return overlay(tomllib.loads(files[name]), own)


def build_law(data: Tables, where: str, files: Files) -> jl.JointLaw:
    """A law from a scene's `[laws.NAME]` table; `kind` is "joint" (default) or "coulomb".

    Raises ValueError.
    """
    kind = one_of(f"{where}.kind", TABLE(where, data).get("kind", "joint"), ("joint", "coulomb"))
    if kind == "coulomb":
        keys = checked(data, COULOMB, where)
        require_rock({"friction": keys["friction"]}, f"{where}.")
        return coulomb_law(**{key: value for key, value in keys.items() if key != "kind"})
    if data.get("closure_only"):
        raise ValueError(f"{where}.closure_only = true: joints between blocks shear; leave it out")
    keys = {key: value for key, value in law_table(data, files).items() if key != "kind"}
    law = jl.JointLaw.from_dict({"plane": 0.0, **keys}, where)
    require_rock({"mu": law.asperity.mu}, f"{where}.asperity.")
    require_rock({"plane": law.plane or 0.0}, f"{where}.")
    return law
