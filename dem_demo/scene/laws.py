"""Laws of a scene, built from its TOML tables. All are `jointlaw.JointLaw`."""

import tomllib
from typing import Any

import jointlaw as jl
from jointlaw.parameters.rock import require_rock

from ..errors import SceneError
from .files import Files
from .tables import Table, overlay

FLAT = 1e15  # orientation.a: no asperity is inclined by more than 2e-15 rad
STICKS = 1e30  # friction of a joint that never slides


def coulomb_law(normal_stiffness: float, shear_stiffness: float, friction: float) -> jl.JointLaw:
    """Plain Coulomb friction with constant stiffness, for comparison: level, linear asperities.

    normal_stiffness, shear_stiffness: per area, > 0 (Pa/m); friction: coefficient, >= 0, may be
    infinite. Raises ValueError for others.
    """
    asperity = jl.Asperity.linear(normal_stiffness, shear_stiffness, min(friction, STICKS))
    return jl.JointLaw(
        orientation=jl.Orientation(FLAT),
        asperity=asperity,
        asperity_density=1.0,
        resolution=jl.Resolution(1, 3, 1),
        plane=0.0,
    )


def is_coulomb(law: jl.JointLaw) -> bool:
    """Is it plain Coulomb friction, without asperity angles and heights?"""
    return law.orientation.a >= FLAT and law.heights is None and law.asperity.eta == 0


def law_table(data: dict[str, Any], where: str, files: Files) -> dict[str, Any]:
    """A law's table with the keys of the law that it is `from`, by name or from a file.

    Raises SceneError.
    """
    if "from" not in data:
        return data
    name = Table(data, where).take("from", str)
    try:
        if name not in files:
            path = files.folder / name
            files[name] = jl.presets.load_any(str(path) if path.is_file() else name).to_toml()
    except ValueError as error:
        raise SceneError(f"{where}.from: {error}") from None
    own = {key: value for key, value in data.items() if key != "from"}
    return overlay(tomllib.loads(files[name]), own)


def build_law(data: dict[str, Any], where: str, files: Files | None = None) -> jl.JointLaw:
    """A law from a scene's `[laws.NAME]` table; `kind` is "joint" (default) or "coulomb".

    Raises ValueError.
    """
    table = Table(data, where)
    kind = table.take("kind", str, "joint")
    if kind == "coulomb":
        friction = table.take("friction", float, least=0, infinite=True)
        require_rock({"friction": friction}, f"{where}.")
        law = coulomb_law(
            table.take("normal_stiffness", float, above=0, say="(Pa/m)"),
            table.take("shear_stiffness", float, above=0, say="(Pa/m)"),
            friction,
        )
        table.finish()
        return law
    if kind != "joint":
        raise table.error("kind", "must be 'joint' or 'coulomb'")
    whole = law_table(data, where, Files() if files is None else files)
    keys = {key: value for key, value in whole.items() if key != "kind"}
    if keys.get("closure_only"):
        raise SceneError(f"{where}.closure_only = true: joints between blocks shear; leave it out")
    law = jl.JointLaw.from_dict({"plane": 0.0, **keys}, where)
    require_rock({"mu": law.asperity.mu}, f"{where}.asperity.")
    require_rock({"plane": law.plane or 0.0}, f"{where}.")
    return law
