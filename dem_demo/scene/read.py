"""Read scenes from TOML files or text, and validate them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from shapely import Point, Polygon

import jointlaw as jl
from jointlaw.parameters import keys
from jointlaw.support.checks import one_of, remedy

from .blocks import LENGTH_TOLERANCE, Block, box, find_shape_error, median_width
from .cutting import INWARD_CUT, JointSet, cut, estimate_block_count
from .drives import read_drives
from .keys import LIST, NOT_NEGATIVE, SCENE, TABLE, Tables, overlay, some_of
from .laws import INTACT_ROCK, Files, build_law, intact_rock_law
from .point_files import fill_in_points
from .scene import SKIN_PER_MEDIAN_WIDTH, Rock, Run, Scene, Stress
from .supports import read_bolts, read_pressures

SCENES = Path(__file__).parent / "scenes"
TEMPLATE = Path(__file__).parent / "template.toml"
WATER_UNIT_WEIGHT = 9810.0  # N/m3
SIDES = {"left": (0, -1.0), "right": (0, 1.0), "bottom": (1, -1.0), "top": (1, 1.0)}
DEFAULTS = {  # of the top level; m/s2, kg/m3, m
    "gravity": (0.0, -9.81), "seismic": (0.0, 0.0), "density": 2600.0, "thickness": 1.0,
    "monitor": {},
    **dict.fromkeys(("block", "rock", "drive", "joint", "excavate", "bolt", "pressure"), ()),
}  # fmt: skip
CORNER_LENGTH_PER_WIDTH = 0.1  # of the narrowest block
SOFT_PER_SKIN = 0.25  # of the skin of the narrowest block
SLIVER_PER_WIDTH = 0.7  # of the median width: narrower blocks do not reduce the corner length
INTACT_OPENING_PER_SKIN = 0.5  # opening at which intact rock breaks
MAX_BLOCKS = 1e5  # of a scene: cutting and contact detection take hours beyond
MIN_WIDTH_PER_SPACING = 0.2  # of the smallest spacing: narrower blocks of a rock are slivers


@cache
def shipped() -> Mapping[str, tuple[Path, str]]:
    """List the scenes of the package: SCENE, and SCENE-VARIANT for each of its variants.

    Returns by name the file, and the line that chooses the variant. A process reads the files once.
    """
    scenes = {}
    for path in sorted(SCENES.glob("*.toml")):
        scenes[path.stem] = path, ""
        for variant in keys.read(path).get("variants", {}):
            scenes[f"{path.stem}-{variant}"] = path, f'variant = "{variant}"\n'
    return MappingProxyType(scenes)


def read_source(source: str | Path) -> tuple[str, str, Files]:
    """Text of a scene of the package by name, or of a TOML file; its name, and the files beside it.

    Raises ValueError.
    """
    path, variant_line = shipped().get(source, (Path(source), ""))
    if not path.is_file():
        raise ValueError(
            f"no scene {str(source)!r}: {remedy(source, shipped(), 'give a TOML file or one of')}"
        )
    try:
        text = variant_line + path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not UTF-8 text: {error}") from None
    return text, path.name, Files(path.parent)


def load(source: str | Path) -> Scene:
    """Read a scene of the package by name, or a TOML file. Raises ValueError."""
    return parse(*read_source(source))


def is_in_space(data: Tables) -> bool:
    """Whether tables of a scene describe blocks in space.

    They do if a block or a rock has three coordinates, or a shape that only solids have.
    """

    def has_three(value: Any) -> bool:
        if not isinstance(value, list):
            return False
        is_point = len(value) == 3 and not isinstance(value[0], list)
        return is_point or any(map(has_three, value))

    lists = [data.get(kind) for kind in ("block", "rock")]
    tables = [table for one in lists if isinstance(one, list) for table in one]
    return any(
        isinstance(table, dict)
        and ("file" in table or any(has_three(table.get(key)) for key in ("box", "at", "corners")))
        for table in tables
    )


def parse(text: str, where: str = "scene", files: Files | None = None) -> Scene:
    """Read a scene from TOML text.

    where: name of the scene in error messages. files: contents of the files that it names, by
    default read from the working directory.

    Raises ValueError.
    """
    return build(read_tables(text, where), where, files, text)


def read_tables(text: str, where: str = "scene") -> Tables:
    """Return the tables of a scene's text, with its `variant` laid over them and the keys of rocks
    that are `like` another one. Raises ValueError."""
    data = keys.parse(text, where)
    if "asperity_density" in data or "kind" in data:
        raise ValueError(f"{where} is the parameter file of a law, no scene: in a scene write "
                         f"[laws.NAME] with from = {where!r}")  # fmt: skip
    variants = data.pop("variants", {})
    variant = data.pop("variant", None)
    if variant is not None:
        data = overlay(data, variants[one_of(f"{where}: variant", variant, tuple(variants))])
    return {**data, "rock": [*_copy_rocks(data.get("rock", []), where)]}


def _copy_rocks(rocks: Any, where: str) -> Iterator[Tables]:
    """Yield tables of rocks, each with the keys of the rock that it is `like`."""
    tables: dict[str, Tables] = {}
    for i, table in enumerate(LIST(f"{where}: rock", rocks)):
        place = f"{where}: rock[{i}]"
        rock = {**TABLE(place, table)}
        name = str(table.get("name"))
        if like := rock.pop("like", None):
            if like not in list(tables):
                raise ValueError(f"{place}.like = {like!r}: no rock further up; "
                                 f"{remedy(like, tables)}")  # fmt: skip
            rock = {**tables[like], **rock}
        tables[name] = rock
        yield rock


def build(data: Tables, where: str = "scene", files: Files | None = None, text: str = "") -> Scene:
    """Build a scene from the tables of its file and the files that it names. Raises ValueError."""
    files = Files() if files is None else files
    if is_in_space(data):
        raise ValueError(
            f"{where}: blocks with three coordinates are in space: use dem_demo.space.load"
        )
    data = fill_in_points(data, files, where)
    top = DEFAULTS | keys.validate_table(data, SCENE, where)
    laws = {
        name: build_law(table, f"{where}: laws.{name}", files)
        for name, table in top["laws"].items()
    }
    pressure = {
        name: NOT_NEGATIVE(f"{where}: laws.{name}.pressure", table["pressure"])
        for name, table in top["laws"].items()
        if "pressure" in table
    }
    default = top.setdefault("law", next(iter(laws), ""))
    if any(top["seismic"]) and not any(top["gravity"]):
        raise ValueError(
            f"{where}: seismic = {list(top['seismic'])}: shares of the weight, which is zero "
            "without gravity; give gravity, or leave seismic out"
        )
    blocks = [_block(table, top["density"], where) for table in top["block"]]
    edge_laws: dict[tuple[int, int], str] = {}
    rocks = [_rock(table, blocks, edge_laws, top, where) for table in top["rock"]]
    water, in_situ = _stresses(top, blocks, where)
    number = {block.name: i for i, block in enumerate(blocks)}
    if len(number) < len(blocks):
        names = [block.name for block in blocks]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{where}: two blocks have the same name {twice!r}; names must differ")
    if all(block.fixed for block in blocks):
        raise ValueError(f"{where}: no block can move; give [[block]] or [[rock]], not all fixed")
    drives = read_drives(top["drive"], number, blocks, files, where)
    pairs = _pairs(top["joint"], number, blocks, where)
    run = _run(top["run"], blocks)
    stages = tuple(_stages(top["excavate"], blocks, where))
    monitors = _monitors(
        top["monitor"], number, blocks, run.corner_length, stages, f"{where}: monitor"
    )
    joint_laws = {*edge_laws.values()} - {INTACT_ROCK}
    for law in [default, *pairs.values(), *sorted(joint_laws)]:
        one_of(f"{where}: law", law, tuple(laws))
    scene = Scene(
        top.get("title", where), tuple(blocks), laws, run, default, pairs,
        tuple(replace(r, free=[i for i in r.blocks if not blocks[i].fixed]) for r in rocks),
        edge_laws, drives, top["gravity"], top["seismic"], top["thickness"], water, in_situ,
        pressure, stages, **monitors,
        water_changes=read_water_changes(top.get("water", {}), where),
        bolts=tuple(read_bolts(top["bolt"], blocks, stages, where)),
        face_pressures=tuple(read_pressures(top["pressure"], blocks, where)),
    )  # fmt: skip
    skin = scene.skins.min()
    if INTACT_ROCK in edge_laws.values():
        joints = [laws[law] for law in joint_laws or [default]]
        laws.setdefault(INTACT_ROCK, intact_rock_law(joints, INTACT_OPENING_PER_SKIN * skin))
    _require_openings(laws, skin, where)
    for name, value in (("files", files), ("text", text)):  # not copied by `replace`
        object.__setattr__(scene, name, value)
    return scene


def _run(table: Tables, blocks: Sequence[Block]) -> Run:
    """Build the settings of a run; lengths that the table does not give follow from the blocks."""
    narrowest = min(block.width for block in blocks)
    width = max(narrowest, SLIVER_PER_WIDTH * median_width(blocks))
    skin = table.get("skin") or SKIN_PER_MEDIAN_WIDTH * narrowest
    lengths = {"corner_length": CORNER_LENGTH_PER_WIDTH * width, "soft": SOFT_PER_SKIN * skin}
    return Run(**lengths | table)


def _require_openings(laws: dict[str, jl.Law], skin: float, where: str) -> None:
    """Require that the contact of a joint is kept until its tension breaks. Raises ValueError."""
    for name, law in laws.items():
        opening = law.tensile_opening
        if opening > skin:
            raise ValueError(
                f"{where}: laws.{name} holds until the joint is {opening:.3g} m open, but "
                f"contacts are followed to {skin:.3g} m: set a larger run.skin, or "
                "a smaller tension or energy_I"
            )


def _block(table: Tables, density: float, where: str) -> Block:
    """Build a block from its table; density (kg/m3): of the scene. Raises ValueError."""
    name = f"{where}: block[{table['name']!r}]"
    shape_keys = {"corners", "box", "at", "angle"} & {*table}
    if shape_keys != {"corners"} and ("box" not in shape_keys or "corners" in shape_keys):
        raise ValueError(f"{name}: give `corners` alone, or `box` with `at` and `angle`")
    if "box" in table:
        center = table.pop("at", (0.0, 0.0))
        angle = table.pop("angle", 0.0)
        table["corners"] = box(*table.pop("box"), center, angle)
    if table.get("fixed") and {"velocity", "spin"} & {*table}:
        raise ValueError(f"{name}: a fixed block has no velocity or spin; let a [[drive]] move it")
    if error := find_shape_error(table["corners"]):
        raise ValueError(f"{name}.corners (or box) {error}")
    fixed_motions = tuple(table.pop("fixed_motions", ()))
    return Block(**{"density": density, **table, "prescribed": fixed_motions})


def _stresses(top: Tables, blocks: list[Block], where: str) -> tuple[Stress | None, Stress | None]:
    """Build the stresses of the tables `[water]` and `[in_situ]` of a scene.

    blocks: blocks on the sides are fixed or get rollers as `[in_situ]` says. Edges that the in-situ
    stress loads from outside carry no water pressure, because that stress is the total one.

    Raises ValueError.
    """
    water = top.get("water")
    table = top.get("in_situ", {})
    gravity = top["gravity"]
    stress = np.ravel(table.get("stress", ()))
    if "in_situ" in top and ("k0" in table, len(stress)) not in ((True, 0), (False, 3)):
        raise ValueError(f"{where}: in_situ: give either k0 or stress = [sxx, syy, sxy]")
    if (water or "k0" in table) and (gravity[0] or gravity[1] > 0):
        raise ValueError(f"{where}: gravity = {list(gravity)} must point down, [0, -9.81], for a "
                         "water table and for k0")  # fmt: skip
    corners = np.concatenate([block.corners for block in blocks])
    loaded = _apply_sides(table, blocks, corners)
    if water:
        unit_weight = water.get("unit_weight", WATER_UNIT_WEIGHT)
        water = Stress(np.eye(2), water["table"], unit_weight, 0.0, ~loaded)
    if not table:
        return water, None
    is_uniform = len(stress) > 0
    line = np.array(table.get("surface", [[0.0, corners[:, 1].max()]]))
    x, y, shear = stress if is_uniform else (table["k0"], 1.0, 0.0)
    tensor = np.array([[x, shear], [shear, y]])
    weight = -top["density"] * gravity[1] * (not is_uniform)
    return water, Stress(tensor, line, weight, float(is_uniform), loaded)


def read_water_changes(table: Tables, where: str) -> tuple[tuple[float, np.ndarray], ...]:
    """Return times and lines of the later water tables of `[water]`. Raises ValueError."""
    changes = tuple((part["time"], part["table"]) for part in table.get("at", ()))
    times = [time for time, _ in changes]
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ValueError(f"{where}: water.at: times {times} s must increase")
    return changes


def _apply_sides(table: Tables, blocks: list[Block], corners: np.ndarray) -> np.ndarray:
    """Fix the blocks on the sides of a scene as `[in_situ]` says.

    corners (c, 2): of all blocks in order. Returns whether each edge (c,) is loaded from outside.
    """
    number = np.repeat(np.arange(len(blocks)), [len(block.corners) for block in blocks])
    ends = np.concatenate([np.roll(block.corners, -1, axis=0) for block in blocks])
    loaded = np.zeros(len(corners), bool)
    for side, (axis, sign) in SIDES.items():
        kind = table.get(side)
        outward = sign * np.stack([corners, ends])[..., axis]
        tolerance = LENGTH_TOLERANCE * np.ptp(corners)
        on_side = (outward > outward.max() - tolerance).all(axis=0)
        loaded |= on_side & (kind == "loaded")
        for i in np.unique(number[on_side & (kind in ("fixed", "rollers"))]).tolist():
            fixed = blocks[i].fixed or kind == "fixed"
            motions = {*blocks[i].prescribed, "xy"[axis], "turn"}
            prescribed = () if fixed else tuple(sorted(motions))
            blocks[i] = replace(blocks[i], fixed=fixed, prescribed=prescribed)
    return loaded


def _pairs(
    tables: list[Tables], number: dict[str, int], blocks: Sequence[Block], where: str
) -> dict[frozenset, str]:
    """Return the laws of `[[joint]]` tables by two blocks, or by one for all of its joints."""
    pairs: dict[frozenset, str] = {}
    for i, table in enumerate(tables):
        name = f"{where}: joint[{i}]"
        if "around" in table:
            numbers = [_block_at(f"{name}.around", table["around"], blocks)]
        else:
            names = some_of(f"{name}.between", table.get("between"), number, 2)
            numbers = [number[block] for block in names]
        if pairs.setdefault(frozenset(numbers), table["law"]) != table["law"]:
            raise ValueError(f"{name}: another [[joint]] gives these blocks another law")
    return pairs


def _block_at(name: str, point: tuple[float, float], blocks: Sequence[Block]) -> int:
    """Return the number of the movable block that contains a point (m). Raises ValueError."""
    for i, block in enumerate(blocks):
        if not block.fixed and Polygon(block.corners).contains(Point(point)):
            return i
    raise ValueError(f"{name} = {list(point)}: must lie inside a block that can move")


def _monitors(
    table: Tables, number: dict[str, int], blocks: Sequence[Block], reach: float,
    stages: Sequence[Tables], where: str,
) -> dict[str, tuple[Any, ...]]:  # fmt: skip
    """Return the fields of a `Scene` that the `[monitor]` table gives.

    reach: largest gap (m) of a monitored joint. stages: of excavation. Raises ValueError.
    """
    pairs: dict[str, tuple[Any, ...]] = {}
    for kind in ("slip", "shear"):
        names = [some_of(f"{where}.{kind}", pair, number, 2) for pair in table.get(kind, ())]
        pairs[kind] = tuple((number[moving], number[base]) for moving, base in names)
    joints = {*pairs["slip"], *pairs["shear"]}
    if len({moving for moving, _ in joints}) < len(joints):
        raise ValueError(f"{where}: slip and shear monitor one block on two bases; name one")
    points = [
        (_block_at(f"{where}.points", point, blocks), point) for point in table.get("points", ())
    ]
    point_joints = [
        _joint_at(f"{where}.joints", point, blocks, reach) for point in table.get("joints", ())
    ]
    removed = {i for stage in stages for i in stage["blocks"]}
    convergences = []
    for i, pair in enumerate(table.get("convergence", ())):
        name = f"{where}.convergence[{i}]"
        ends = tuple((_wall_at(name, point, blocks, removed), point) for point in pair)
        if ends[0][0] == ends[1][0] or not any(blocks[end[0]].moves for end in ends):
            names = " and ".join(repr(blocks[end[0]].name) for end in ends)
            raise ValueError(
                f"{name}: its points lie in {names}; must lie in two blocks, of which one moves"
            )
        convergences.append(ends)
    return pairs | {
        "points": tuple(points),
        "point_joints": tuple(point_joints),
        "convergences": tuple(convergences),
    }


def _wall_at(
    name: str, point: tuple[float, float], blocks: Sequence[Block], removed: set[int]
) -> int:
    """Return the number of the block that a point (m) lies in or on, and that no stage removes.

    Raises ValueError.
    """
    extent = max(float(np.ptp(block.corners)) for block in blocks)
    shapes = {i: Polygon(block.corners) for i, block in enumerate(blocks) if i not in removed}
    distances = {i: shape.distance(Point(point)) for i, shape in shapes.items()}
    nearest = min(distances, key=lambda i: (distances[i], not blocks[i].moves))
    if distances[nearest] > LENGTH_TOLERANCE * extent:
        raise ValueError(
            f"{name}: {list(point)} lies in no block that stays; give a point on a wall"
        )
    return nearest


def _joint_at(
    name: str, point: tuple[float, float], blocks: Sequence[Block], reach: float
) -> tuple[int, int]:
    """Return the two blocks nearest to a point (m), in the order of the scene.

    Raises ValueError where their gap is larger than `reach` (m) or neither of them can move.
    """
    distances = [Polygon(block.corners).distance(Point(point)) for block in blocks]
    nearest = sorted(np.argsort(distances, kind="stable")[:2].tolist())
    shapes = [Polygon(blocks[i].corners) for i in nearest]
    is_joint = len(nearest) == 2 and shapes[0].distance(shapes[1]) <= reach
    if not is_joint or all(blocks[i].fixed for i in nearest):
        raise ValueError(f"{name} = {list(point)}: must lie at a joint of a block that can move")
    return nearest[0], nearest[1]


def _stages(tables: list[Tables], blocks: Sequence[Block], where: str) -> Iterator[Tables]:
    """Yield excavation stages; each removes the blocks whose centroids lie within its corners."""
    remaining = {i: Point(block.centroid) for i, block in enumerate(blocks)}
    for i, table in enumerate(tables):
        region = Polygon(table["corners"])
        removed = [j for j, centroid in remaining.items() if region.contains(centroid)]
        if not removed:
            raise ValueError(f"{where}: excavate[{i}].corners: no block is left there")
        for j in removed:
            del remaining[j]
        yield {"start": None, **table, "blocks": removed}


def _rock(
    table: Tables, blocks: list[Block], laws: dict[tuple[int, int], str], top: Tables, where: str
) -> Rock:
    """Cut a rock mass; its blocks are appended to `blocks`, the laws of its edges to `laws`.

    top: tables of the scene, for defaults. The list of movable blocks is left empty.

    Raises ValueError.
    """
    name = table["name"]
    where = f"{where}: rock[{name!r}]"
    sets = [JointSet(**{"law": top["law"], **part}) for part in table["set"]]
    replaced_laws = table.get("laws", {})
    if unknown := set(replaced_laws) - {s.law for s in sets}:
        raise ValueError(f"{where}.laws: no set of this rock has the law {unknown.pop()!r}")
    count = len(blocks) + estimate_block_count(table["outline"], sets)
    if count > MAX_BLOCKS:
        raise ValueError(
            f"{where}: its sets cut about {count:.2g} blocks; must be at most {MAX_BLOCKS:.0e}: "
            "give a larger spacing (m) or a smaller outline"
        )
    shift = np.array(table.get("at", (0.0, 0.0)))
    extent = float(np.ptp(table["outline"], axis=0).min())
    spacing = min([extent, *(s.spacing for s in sets)])
    min_width = table.get("min_width", MIN_WIDTH_PER_SPACING * spacing * bool(sets))
    holes = [part["corners"] for part in table.get("hole", ())]
    regions = [part["corners"] - shift for part in top["excavate"]]
    try:
        pieces = cut(table["outline"], sets, table.get("seed", 0), min_width, holes, regions)
    except ValueError as error:
        raise ValueError(f"{where}.outline: {error}") from None
    if not pieces.shapes:
        raise ValueError(
            f"{where}: all blocks would be slivers: give a min_width below {min_width:.3g} m"
        )
    first = len(blocks)
    cut_law = table.get("cut_law", INTACT_ROCK)
    law_of_set = {i: replaced_laws.get(s.law, s.law) for i, s in enumerate(sets)}
    law_of_set[INWARD_CUT] = cut_law
    fixed_regions = [Polygon(part["corners"]) for part in table.get("fixed", ())]
    for i, (corners, sets_of_edges) in enumerate(zip(pieces.shapes, pieces.edge_sets, strict=True)):
        density = table.get("density", top["density"])
        block = Block(f"{name} {i + 1}", corners + shift, density)
        centroid = Point(block.centroid - shift)
        fixed = any(region.contains(centroid) for region in fixed_regions)
        blocks.append(replace(block, fixed=fixed))
        for edge, number in enumerate(sets_of_edges.tolist()):
            if number >= 0:
                laws[first + i, edge] = law_of_set[number]
    messages = [f"slivers merged with neighbours: {pieces.merged}"]
    for sliver in pieces.dropped:
        x = sliver.centroid.x + shift[0]
        y = sliver.centroid.y + shift[1]
        messages.append(f"a gap of {sliver.area:.2g} m2 at ({x:.3g}, {y:.3g}), a sliver left out")
    cuts = sum(int((numbers == INWARD_CUT).sum()) for numbers in pieces.edge_sets) // 2
    if cuts:
        messages.append(f"cuts at inward corners that are no joints: {cuts}, law {cut_law!r}")
    return Rock(name, range(first, len(blocks)), [], messages)
