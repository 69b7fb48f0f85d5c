"""Read scenes in space from TOML files or text, and validate them."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import jointlaw as jl
from jointlaw.parameters import keys
from jointlaw.support.checks import one_of

from ..scene import Drive, Files, Run, Scene, Tables, build_law, read_tables
from ..scene import build as build_in_plane
from ..scene.drives import read_drive
from ..scene.keys import NOT_NEGATIVE, some_of
from ..scene.laws import INTACT_ROCK, intact_rock_law
from ..scene.read import (
    INTACT_OPENING_PER_SKIN,
    MAX_BLOCKS,
    MIN_WIDTH_PER_SPACING,
    WATER_UNIT_WEIGHT,
    is_in_space,
    read_source,
    read_water_changes,
)
from .cutting import PlaneSet, cut_rock, estimate_block_count, excavation_cuts, plane_normal
from .keys import DRIVEN_AXES, FIXED_MOTIONS, SCENE, SIDES
from .loads import SpaceStress
from .meshes import read_solid
from .scene import MAX_OVERLAP, SpaceBlock, SpaceRock, SpaceScene, is_anisotropic
from .solids import LENGTH_TOLERANCE, Solid, box, convex_solid

SHAPES = "box", "corners", "file"
REGIONS = "box", "corners", "dip"
DEFAULTS: Tables = {
    "gravity": np.array([0.0, 0.0, -9.81]), "seismic": np.zeros(3), "density": 2600.0, "run": {},
    **dict.fromkeys(("block", "rock", "joint", "excavate", "drive"), ()),
    "monitor": {},
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
    regions = [
        _shape(table, f"{where}: excavate[{i}]", files, ("box", "corners"))
        for i, table in enumerate(top["excavate"])
    ]
    blocks = [_block(table, top["density"], where, files) for table in top["block"]]
    rocks = [_rock(table, blocks, regions, top, laws, where, files) for table in top["rock"]]
    water, in_situ = _stresses(top, blocks, where)
    number = _require_names(blocks, rocks, where)
    pairs = _pairs(top["joint"], number, laws, where)
    stages = tuple(_stages(regions, top["excavate"], blocks, where))
    drives = _drives(top["drive"], number, blocks, files, where)
    for pair in (pair for rock in rocks for pair in rock.intact_pairs):
        pairs.setdefault(pair, (INTACT_ROCK, 0.0))
    scene = SpaceScene(
        top.get("title", where), tuple(blocks), laws, default, top.get("rough", 0.0), pairs,
        tuple(replace(r, free=[i for i in r.blocks if not blocks[i].fixed]) for r in rocks),
        top["gravity"], top["seismic"], skin=top["run"].get("skin"),
        corner_length=top["run"].get("corner_length"),
        max_overlap=top["run"].get("max_overlap", MAX_OVERLAP), water=water, in_situ=in_situ,
        pressure=pressure, stages=stages,
        water_changes=read_water_changes(top.get("water", {}), where),
        run=_run(top["run"], where), drives=drives,
        points=_history_points(top["monitor"].get("points", ()), blocks, f"{where}: monitor"),
    )  # fmt: skip
    _require_end(scene, where)
    _require_rough(scene, "rough" in top, where)
    if any(name == INTACT_ROCK for name, _ in pairs.values()):
        opening = INTACT_OPENING_PER_SKIN * float(scene.skins.min())
        intact = intact_rock_law(list(laws.values()), opening)
        laws.setdefault(INTACT_ROCK, replace(intact, plane=None))
    for name, value in (("files", files), ("text", text)):  # not copied by `replace`
        object.__setattr__(scene, name, value)
    return scene


def _run(table: Tables, where: str) -> Run | None:
    """Build the settings of a run, None if the blocks do not move. Raises ValueError."""
    motion_keys = sorted({*table} - {"skin", "max_overlap", "corner_length", "end"})
    if "end" in table:
        return Run(**{"corner_length": 0.0, "soft": 0.0} | table)
    if motion_keys:
        raise ValueError(
            f"{where}: run.end is missing, without which the blocks do not move: give it in s, or "
            f"leave out {', '.join(motion_keys)}"
        )
    return None


def _drives(
    tables: list[Tables], number: dict[str, int], blocks: list[SpaceBlock], files: Files, where: str
) -> tuple[Drive, ...]:
    """Build the drives of the `[[drive]]` tables; the `prescribed` motions of blocks are completed.

    Of a fixed block that a drive moves all motions are prescribed, and of a block that a drive
    rotates all rotations. Raises ValueError for a motion that is prescribed twice.
    """
    fixed_rock = tuple(i for i, block in enumerate(blocks) if block.fixed)
    drives = [
        read_drive(table, number, fixed_rock, DRIVEN_AXES, files, f"{where}: drive[{i}]")
        for i, table in enumerate(tables)
    ]
    motion_of_axis = {axis: name[:4] for name, axis in DRIVEN_AXES.items()}  # "turn" of any axis
    driven = [(i, motion_of_axis[drive.axis]) for drive in drives for i in drive.blocks]
    fixed = [(i, name) for i, block in enumerate(blocks) for name in block.prescribed]
    if len({*driven, *fixed}) < len(driven) + len(fixed):
        raise ValueError(f"{where}: drive: a motion of a block is prescribed twice")
    for i in sorted({i for i, _ in driven}):
        motions = FIXED_MOTIONS if blocks[i].fixed else blocks[i].prescribed
        names = {*motions, *(name for block, name in driven if block == i)}
        blocks[i] = replace(blocks[i], prescribed=tuple(sorted(names)))
    return tuple(drives)


def _history_points(
    points: list[np.ndarray], blocks: list[SpaceBlock], where: str
) -> tuple[tuple[int, tuple[float, float, float]], ...]:
    """Find the block of each history point (3,) in m, one that moves where several touch it.

    Raises ValueError for a point in no block.
    """
    found = []
    for i, point in enumerate(points):
        inside = [n for n, block in enumerate(blocks) if block.solid.contains(point)]
        if not inside:
            raise ValueError(f"{where}.points[{i}] = {point.tolist()}: lies in no block")
        found.append((min(inside, key=lambda n: not blocks[n].moves), tuple(point.tolist())))
    return tuple(found)


def _require_end(scene: SpaceScene, where: str) -> None:
    """Require `run.end` where blocks have a velocity or a drive. Raises ValueError."""
    moving = [
        f"block[{block.name!r}] has a velocity or spin"
        for block in scene.blocks
        if block.velocity.any() or block.spin.any()
    ]
    moving += ["drives move blocks"] * bool(scene.drives)
    if moving and scene.run is None:
        raise ValueError(
            f"{where}: {moving[0]}, but run.end is missing, without which the blocks do not move: "
            "give it in s"
        )


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
    prescribed = tuple(table.pop("fixed_motions", ()))  # of free blocks, see `_apply_sides`
    return SpaceBlock(
        **{"density": density, **table, "solid": solid}, prescribed=prescribed,
        face_laws=(None,) * faces, face_axes=np.zeros((faces, 3)),
    )  # fmt: skip


def _rock(
    table: Tables, blocks: list[SpaceBlock], regions: list[Solid], top: Tables,
    laws: dict[str, jl.Law], where: str, files: Files,
) -> SpaceRock:  # fmt: skip
    """Cut a rock mass; its blocks are appended to `blocks`.

    regions: that are excavated later, along whose faces the rock is cut. top: tables of the scene,
    for defaults. The list of movable blocks is left empty.

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
    pieces = cut_rock(solid, sets, table.get("seed", 0), min_width, regions)
    if not pieces.solids:
        raise ValueError(
            f"{where}: all blocks would be slivers: give a min_width below {min_width:.3g} m"
        )
    fixed_regions = [
        _Region(part, f"{where}.fixed[{i}]", files) for i, part in enumerate(table.get("fixed", ()))
    ]
    first = len(blocks)
    density = table.get("density", top["density"])
    for i, piece in enumerate(pieces.solids):
        fixed = any(region.contains(piece.centroid) for region in fixed_regions)
        face_laws = tuple(None if n < 0 else sets[n].law for n in piece.face_sets)
        axes = np.array(
            [np.zeros(3) if n < 0 else sets[n].rough_direction for n in piece.face_sets]
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
    intact_pairs = [
        frozenset((first + i, first + j)) for i, j in excavation_cuts(pieces.solids, regions)
    ]
    if intact_pairs:
        messages.append(
            f"cuts at an excavation that are no joints: {len(intact_pairs)}, intact rock"
        )
    return SpaceRock(name, range(first, len(blocks)), [], messages, intact_pairs)


def _stages(
    regions: list[Solid], tables: Iterable[Tables], blocks: list[SpaceBlock], where: str
) -> Iterator[Tables]:
    """Yield excavation stages; each removes the blocks whose centroids lie in its region.

    Raises ValueError.
    """
    remaining = {i: block.centroid for i, block in enumerate(blocks)}
    for i, (region, table) in enumerate(zip(regions, tables, strict=True)):
        removed = [j for j, centroid in remaining.items() if region.contains(centroid)]
        if not removed:
            raise ValueError(f"{where}: excavate[{i}]: no block is left there; move its region")
        for j in removed:
            del remaining[j]
        yield {"start": None, **table, "blocks": removed}


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


def _stresses(
    top: Tables, blocks: list[SpaceBlock], where: str
) -> tuple[SpaceStress | None, SpaceStress | None]:
    """Build the stresses of the tables `[water]` and `[in_situ]` of a scene.

    blocks: blocks on the sides are fixed or get rollers as `[in_situ]` says. Faces that the in-situ
    stress loads from outside carry no water pressure, because that stress is the total one.

    Raises ValueError.
    """
    water = top.get("water")
    table = top.get("in_situ", {})
    gravity = top["gravity"]
    if "in_situ" in top and ("k0" in table) == ("stress" in table):
        raise ValueError(
            f"{where}: in_situ: give either k0 or stress = [sxx, syy, szz, sxy, syz, szx]"
        )
    if (water or "k0" in table) and (gravity[:2].any() or gravity[2] > 0):
        raise ValueError(
            f"{where}: gravity = {gravity.tolist()} must point down, [0, 0, -9.81], for a water "
            "table and for k0"
        )
    loaded = _apply_sides(table, blocks)
    if water:
        unit_weight = water.get("unit_weight", WATER_UNIT_WEIGHT)
        water = SpaceStress(np.eye(3), water["table"], unit_weight, 0.0, ~loaded)
    if not table:
        return water, None
    highest = max(float(block.solid.vertices[:, 2].max()) for block in blocks)
    surface = table.get("surface", np.array([highest, 0.0, 0.0]))
    if "stress" in table:
        return water, SpaceStress(table["stress"], surface, 0.0, 1.0, loaded)
    weight = -top["density"] * gravity[2]
    return water, SpaceStress(np.diag([*table["k0"], 1.0]), surface, weight, 0.0, loaded)


def _apply_sides(table: Tables, blocks: list[SpaceBlock]) -> np.ndarray:
    """Fix the blocks on the sides of a scene as `[in_situ]` says.

    Returns whether each face (f,) of all blocks in order is loaded from outside.
    """
    vertices = np.concatenate([block.solid.vertices for block in blocks])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    tolerance = LENGTH_TOLERANCE * float((high - low).max())
    loaded: list[bool] = []
    for i, block in enumerate(blocks):
        solid = block.solid
        sides = [
            {
                side
                for side, (axis, sign) in SIDES.items()
                if abs(solid.vertices[list(face), axis] - (high if sign > 0 else low)[axis]).max()
                < tolerance
            }
            for face in solid.faces
        ]
        loaded += [any(table.get(side) == "loaded" for side in on_face) for on_face in sides]
        fixed = block.fixed
        motions = {*block.prescribed}
        for side in set().union(*sides):
            fixed |= table.get(side) == "fixed"
            if table.get(side) == "rollers":
                motions |= {"xyz"[SIDES[side][0]], "turn"}
        prescribed = () if fixed else tuple(sorted(motions))
        blocks[i] = replace(block, fixed=fixed, prescribed=prescribed)
    return np.array(loaded, bool)


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
