"""Read scenes in space from TOML files or text, and validate them."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import jointlaw as jl
from jointlaw.parameters import keys
from jointlaw.support.checks import one_of

from ..scene import Files, Scene, Tables, build_law, read_tables
from ..scene import build as build_in_plane
from ..scene.keys import NOT_NEGATIVE, some_of
from ..scene.read import (
    MAX_BLOCKS,
    MIN_WIDTH_PER_SPACING,
    WATER_UNIT_WEIGHT,
    is_in_space,
    read_source,
    read_water_changes,
)
from .cutting import PlaneSet, cut_rock, estimate_block_count, plane_normal
from .keys import SCENE
from .loads import SpaceStress
from .meshes import read_solid
from .scene import MAX_OVERLAP, SpaceBlock, SpaceRock, SpaceScene, is_anisotropic
from .solids import OUTLINE, Solid, box, convex_solid

SHAPES = "box", "corners", "file"
REGIONS = "box", "corners", "dip"
DEFAULTS: Tables = {
    "gravity": np.array([0.0, 0.0, -9.81]), "seismic": np.zeros(3), "density": 2600.0, "run": {},
    **dict.fromkeys(("block", "rock", "joint"), ()),
}  # fmt: skip


def load(source: str | Path) -> Scene | SpaceScene:
    """Read a scene of the package by name, or a TOML file, in the plane or in space.

    Raises ValueError.
    """
    text, where, files = read_source(source)
    return parse(text, where, files)


def parse(text: str, where: str = "scene", files: Files | None = None) -> Scene | SpaceScene:
    """Read a scene from TOML text, in the plane or in space.

    where: name of the scene in error messages. files: contents of the files that it names, by
    default read from the working directory.

    Raises ValueError.
    """
    data = read_tables(text, where)
    build_scene = build if is_in_space(data) else build_in_plane
    return build_scene(data, where, files, text)


def build(
    data: Tables, where: str = "scene", files: Files | None = None, text: str = ""
) -> SpaceScene:
    """Build a scene in space from the tables of its file and the files that it names.

    Raises ValueError.
    """
    files = Files() if files is None else files
    top = DEFAULTS | keys.validate_table(data, SCENE, where)
    laws = {
        name: _law(table, f"{where}: laws.{name}", files) for name, table in top["laws"].items()
    }
    pressure = {
        name: NOT_NEGATIVE(f"{where}: laws.{name}.pressure", table["pressure"])
        for name, table in top["laws"].items()
        if "pressure" in table
    }
    default = top.setdefault("law", next(iter(laws), ""))
    one_of(f"{where}: law", default, tuple(laws))
    if top["seismic"].any() and not top["gravity"].any():
        raise ValueError(
            f"{where}: seismic = {top['seismic'].tolist()}: shares of the weight, which is zero "
            "without gravity; give gravity, or leave seismic out"
        )
    blocks = [_block(table, top["density"], where, files) for table in top["block"]]
    rocks = [_rock(table, blocks, top, laws, where, files) for table in top["rock"]]
    number = _require_names(blocks, rocks, where)
    pairs = _pairs(top["joint"], number, laws, where)
    water = _stresses(top, blocks, where)
    scene = SpaceScene(
        top.get("title", where), tuple(blocks), laws, default, top.get("rough", 0.0), pairs,
        tuple(rocks), top["gravity"], top["seismic"], skin=top["run"].get("skin"),
        max_overlap=top["run"].get("max_overlap", MAX_OVERLAP), water=water, pressure=pressure,
        water_changes=read_water_changes(top.get("water", {}), where),
    )  # fmt: skip
    _require_rough(scene, "rough" in top, where)
    for name, value in (("files", files), ("text", text)):  # not copied by `replace`
        object.__setattr__(scene, name, value)
    return scene


def _law(table: Any, where: str, files: Files) -> jl.Law:
    """Build a law for motion in space. Raises ValueError."""
    if isinstance(table, dict) and "plane" in table:
        raise ValueError(
            f"{where}.plane: joints in space shear in all directions; leave it out, and give "
            "`rough` for the direction of axis 2"
        )
    return replace(build_law(table, where, files), plane=None)


def _shape(table: Tables, where: str, files: Files, kinds: Iterable[str] = SHAPES) -> Solid:
    """The solid that `box` and `at`, `corners` or `file` of a table describe.

    Takes these keys out of the table. Raises ValueError.
    """
    given = [kind for kind in kinds if kind in table]
    if len(given) != 1 or ("at" in table and given != ["box"]):
        raise ValueError(f"{where}: give one of `box` (with `at`), `corners` and `file`")
    try:
        if given == ["box"]:
            return box(table.pop("box"), table.pop("at", np.zeros(3)))
        if given == ["corners"]:
            return convex_solid(table.pop("corners"))
        return read_solid(table.pop("file"), files)
    except ValueError as error:
        raise ValueError(f"{where}.{given[0]}: {error}") from None


def _block(table: Tables, density: float, where: str, files: Files) -> SpaceBlock:
    """Build a block from its table; density (kg/m3): of the scene. Raises ValueError."""
    solid = _shape(table, f"{where}: block[{table['name']!r}]", files)
    faces = len(solid.faces)
    return SpaceBlock(
        **{"density": density, **table, "solid": solid},
        face_laws=(None,) * faces, face_axes=np.zeros((faces, 3)),
    )  # fmt: skip


def _rock(
    table: Tables, blocks: list[SpaceBlock], top: Tables, laws: dict[str, jl.Law], where: str,
    files: Files,
) -> SpaceRock:  # fmt: skip
    """Cut a rock mass; its blocks are appended to `blocks`. top: tables of the scene, for defaults.

    Raises ValueError.
    """
    name = table["name"]
    where = f"{where}: rock[{name!r}]"
    solid = _shape(table, where, files)
    sets = [PlaneSet(**{"law": top["law"], **part}) for part in table["set"]]
    replaced_laws = table.get("laws", {})
    if unknown := set(replaced_laws) - {s.law for s in sets}:
        raise ValueError(f"{where}.laws: no set of this rock has the law {unknown.pop()!r}")
    sets = [replace(one, law=replaced_laws.get(one.law, one.law)) for one in sets]
    for i, one in enumerate(sets):
        law = laws[one_of(f"{where}.set[{i}].law", one.law, tuple(laws))]
        if one.rough is None and is_anisotropic(law):
            raise ValueError(
                f"{where}.set[{i}].rough is missing: the law {one.law!r} is anisotropic "
                "(orientation.c); give the angle of its axis 2 from the dip line (degrees)"
            )
    count = len(blocks) + estimate_block_count(solid, sets)
    if count > MAX_BLOCKS:
        raise ValueError(
            f"{where}: its sets cut about {count:.2g} blocks; must be at most {MAX_BLOCKS:.0e}: "
            "give a larger spacing (m) or a smaller rock"
        )
    extent = float(np.ptp(solid.vertices, axis=0).min())
    spacing = min([extent, *(one.spacing for one in sets)])
    min_width = table.get("min_width", MIN_WIDTH_PER_SPACING * spacing * bool(sets))
    pieces = cut_rock(solid, sets, table.get("seed", 0), min_width)
    if not pieces.solids:
        raise ValueError(
            f"{where}: all blocks would be slivers: give a min_width below {min_width:.3g} m"
        )
    regions = [
        _Region(part, f"{where}.fixed[{i}]", files) for i, part in enumerate(table.get("fixed", ()))
    ]
    first = len(blocks)
    density = table.get("density", top["density"])
    for i, piece in enumerate(pieces.solids):
        fixed = any(region.contains(piece.centroid) for region in regions)
        face_laws = tuple(None if n == OUTLINE else sets[n].law for n in piece.face_sets)
        axes = np.array(
            [np.zeros(3) if n == OUTLINE else sets[n].rough_direction for n in piece.face_sets]
        )
        blocks.append(
            SpaceBlock(
                f"{name} {i + 1}", piece, density, fixed, face_laws=face_laws, face_axes=axes
            )
        )
    messages = [f"slivers merged with neighbours: {pieces.merged}"]
    for sliver in pieces.dropped:
        x, y, z = sliver.centroid
        messages.append(
            f"a gap of {sliver.volume:.2g} m3 at ({x:.3g}, {y:.3g}, {z:.3g}), a sliver left out"
        )
    numbers = range(first, len(blocks))
    return SpaceRock(name, numbers, [i for i in numbers if not blocks[i].fixed], messages)


class _Region:
    """A part of space in which blocks are fixed: a box, a convex hull, or below a plane."""

    def __init__(self, table: Tables, where: str, files: Files) -> None:
        """Raises ValueError for a table that gives none or several of them."""
        given = [kind for kind in REGIONS if kind in table]
        if len(given) != 1 or (given == ["dip"]) != ({"dip_direction", "through"} <= {*table}):
            raise ValueError(
                f"{where}: give one of `box` (with `at`), `corners`, and `dip` with "
                "`dip_direction` and `through`"
            )
        self.solid: Solid | None = None
        if given == ["dip"]:
            self.normal = plane_normal(table["dip"], table["dip_direction"])
            self.through = table["through"]
        else:
            self.solid = _shape(table, where, files, ("box", "corners"))

    def contains(self, point: np.ndarray) -> bool:
        """Whether a point (3,) in m lies in the region."""
        if self.solid is not None:
            return self.solid.contains(point)
        return bool((point - self.through) @ self.normal < 0)


def _stresses(top: Tables, blocks: list[SpaceBlock], where: str) -> SpaceStress | None:
    """Build the stress of the table `[water]` of a scene. Raises ValueError."""
    water = top.get("water")
    gravity = top["gravity"]
    if water and (gravity[:2].any() or gravity[2] > 0):
        raise ValueError(
            f"{where}: gravity = {gravity.tolist()} must point down, [0, 0, -9.81], for a water "
            "table"
        )
    if not water:
        return None
    faces = sum(len(block.solid.faces) for block in blocks)
    unit_weight = water.get("unit_weight", WATER_UNIT_WEIGHT)
    return SpaceStress(np.eye(3), water["table"], unit_weight, 0.0, np.ones(faces, bool))


def _require_names(blocks: list[SpaceBlock], rocks: list[SpaceRock], where: str) -> dict[str, int]:
    """Return the numbers of blocks by name.

    Raises ValueError for a name that is given twice, and if no block can move.
    """
    for named in (blocks, rocks):
        counts = Counter(one.name for one in named)
        if twice := [name for name, count in counts.items() if count > 1]:
            raise ValueError(f"{where}: the name {twice[0]!r} is given twice; names must differ")
    if all(block.fixed for block in blocks):
        raise ValueError(f"{where}: no block can move; give [[block]] or [[rock]], not all fixed")
    return {block.name: i for i, block in enumerate(blocks)}


def _pairs(
    tables: Iterable[Tables], number: dict[str, int], laws: dict[str, jl.Law], where: str
) -> dict[frozenset, tuple[str, float]]:
    """Return law and angle of axis 2 of `[[joint]]` tables by two blocks. Raises ValueError."""
    pairs: dict[frozenset, tuple[str, float]] = {}
    for i, table in enumerate(tables):
        name = f"{where}: joint[{i}]"
        names = some_of(f"{name}.between", table["between"], number, 2)
        law = one_of(f"{name}.law", table["law"], tuple(laws))
        if "rough" not in table and is_anisotropic(laws[law]):
            raise ValueError(f"{name}.rough is missing: the law {law!r} is anisotropic")
        joint = law, table.get("rough", 0.0)
        if pairs.setdefault(frozenset(number[one] for one in names), joint) != joint:
            raise ValueError(f"{name}: another [[joint]] gives these blocks another law")
    return pairs


def _require_rough(scene: SpaceScene, is_given: bool, where: str) -> None:
    """Require `rough` of joints in no set, if their law is anisotropic. Raises ValueError."""
    has_single_blocks = len(scene.blocks) > sum(len(rock.blocks) for rock in scene.rocks)
    needs_default = has_single_blocks or len(scene.rocks) > 1
    if needs_default and not is_given and is_anisotropic(scene.laws[scene.default_law]):
        raise ValueError(
            f"{where}: rough is missing: the law {scene.default_law!r} of joints in no set is "
            "anisotropic (orientation.c); give the angle of its axis 2 from the dip line (degrees)"
        )
