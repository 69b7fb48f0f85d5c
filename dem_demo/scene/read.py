"""Reads scenes: TOML files, or their text, checked."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from shapely import Point, Polygon

from jointlaw.parameters import keys
from jointlaw.support.checks import one_of, remedy

from .blocks import EXACT, Block, box, check_convex, usual_width
from .cutting import CUT, JointSet, cut
from .drives import read_drives
from .keys import LIST, NOT_NEGATIVE, SCENE, TABLE, Tables, overlay, some_of
from .laws import WHOLE, Files, build_law, opens_to, whole_rock
from .scene import SKIN, Rock, Run, Scene, Stress

SCENES = Path(__file__).parent / "scenes"
TEMPLATE = Path(__file__).parent / "template.toml"
UNIT_WEIGHT = 9810.0  # N/m3, of water
SIDES = {"left": (0, -1.0), "right": (0, 1.0), "bottom": (1, -1.0), "top": (1, 1.0)}
DEFAULTS = {  # of a scene that says nothing else; m/s2, kg/m3, m
    "gravity": (0.0, -9.81), "density": 2600.0, "thickness": 1.0, "watch": {},
    **dict.fromkeys(("block", "rock", "drive", "joint", "excavate"), ()),
}  # fmt: skip
CORNER = 0.1  # of the least width of a block
SOFT = 0.25  # of the skin, that of the narrowest block where none is given
SLIVER = 0.7  # of the usual width: narrower blocks do not count
HELD = 0.5  # of the skin that whole rock may open
LEAST = 0.2  # narrowest block of a rock as a share of the smallest spacing


def shipped() -> dict[str, tuple[Path, str]]:
    """Scenes that come with the package: SCENE, and SCENE-VARIANT for each of its variants.

    By name: the file, and the line that chooses the variant.
    """
    found = {}
    for path in sorted(SCENES.glob("*.toml")):
        found[path.stem] = path, ""
        for variant in keys.read(path).get("variants", {}):
            found[f"{path.stem}-{variant}"] = path, f'variant = "{variant}"\n'
    return found


def load(source: str | Path) -> Scene:
    """A scene by name, or from a TOML file. Raises ValueError."""
    path, chosen = shipped().get(source, (Path(source), ""))
    if not path.is_file():
        raise ValueError(
            f"no scene {str(source)!r}: {remedy(source, shipped(), 'give a TOML file or one of')}"
        )
    try:
        return parse(chosen + path.read_text(encoding="utf-8"), path.name, Files(path.parent))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not UTF-8 text: {error}") from None


def parse(text: str, where: str = "scene", files: Files | None = None) -> Scene:
    """A scene from TOML text; `where` is named in error messages. Raises ValueError.

    files: those that it names, by default read from the working folder.
    """
    return build(read_tables(text, where), where, files, text)


def read_tables(text: str, where: str = "scene") -> Tables:
    """The tables of a scene's text: its `variant` laid over them, rocks with the keys that they
    copy. Raises ValueError."""
    data = keys.parse(text, where)
    if "asperity_density" in data or "kind" in data:
        raise ValueError(f"{where} is the parameter file of a law, no scene: in a scene write "
                         f"[laws.NAME] with from = {where!r}")  # fmt: skip
    variants, chosen = data.pop("variants", {}), data.pop("variant", None)
    if chosen is not None:
        data = overlay(data, variants[one_of(f"{where}: variant", chosen, tuple(variants))])
    return {**data, "rock": [*_copied(data.get("rock", []), where)]}


def _copied(rocks: Any, where: str) -> Iterator[Tables]:
    """Tables of rocks, each with the keys of the rock that it is `like`."""
    known: dict[str, Tables] = {}
    for i, table in enumerate(LIST(f"{where}: rock", rocks)):
        place = f"{where}: rock[{i}]"
        own, name = {**TABLE(place, table)}, str(table.get("name"))
        if like := own.pop("like", None):
            if like not in list(known):
                raise ValueError(f"{place}.like = {like!r}: no rock further up; "
                                 f"{remedy(like, known)}")  # fmt: skip
            own = {**known[like], **own}
        known[name] = own
        yield own


def build(data: Tables, where: str = "scene", files: Files | None = None, text: str = "") -> Scene:
    """A scene from the tables of its file and the files that it names. Raises ValueError."""
    top, files = DEFAULTS | keys.checked(data, SCENE, where), Files() if files is None else files
    laws = {name: build_law(table, f"{where}: laws.{name}", files)
            for name, table in top["laws"].items()}  # fmt: skip
    pressure = {name: NOT_NEGATIVE(f"{where}: laws.{name}.pressure", table["pressure"])
                for name, table in top["laws"].items() if "pressure" in table}  # fmt: skip
    default = top.setdefault("law", next(iter(laws), ""))
    blocks = [_block(table, top["density"], where) for table in top["block"]]
    edge_laws: dict[tuple[int, int], str] = {}
    rocks = [_rock(table, blocks, edge_laws, top, where) for table in top["rock"]]
    water, in_situ = _stresses(top, blocks, where)
    number = {block.name: i for i, block in enumerate(blocks)}
    if len(number) < len(blocks):
        raise ValueError(f"{where}: two blocks have the same name; names must differ")
    if all(block.fixed for block in blocks):
        raise ValueError(f"{where}: no block can move; give [[block]] or [[rock]], not all fixed")
    drives = read_drives(top["drive"], number, blocks, files, where)
    pairs = _pairs(top["joint"], number, blocks, where)
    least, skin = min(block.width for block in blocks), top["run"].get("skin")
    lengths = {"corner_length": CORNER * max(least, SLIVER * usual_width(blocks)),
               "soft": SOFT * (skin or SKIN * least)}  # fmt: skip
    run = Run(**lengths | top["run"])
    watched = _watched(top["watch"], number, blocks, run.corner_length, f"{where}: watch")
    jointed = {*edge_laws.values()} - {WHOLE}
    for law in [default, *pairs.values(), *sorted(jointed)]:
        one_of(f"{where}: law", law, tuple(laws))
    scene = Scene(
        top.get("title", where), tuple(blocks), laws, run, default, pairs,
        tuple(replace(r, free=[i for i in r.blocks if not blocks[i].fixed]) for r in rocks),
        edge_laws, drives, top["gravity"], top["thickness"], water, in_situ, pressure,
        tuple(_stages(top["excavate"], blocks, where)), **watched,
    )  # fmt: skip
    if WHOLE in edge_laws.values():
        joints = [laws[law] for law in jointed or [default]]
        laws.setdefault(WHOLE, whole_rock(joints, HELD * scene.skins.min()))
    for name, law in laws.items():
        if (opening := opens_to(law)) > scene.skins.min():
            raise ValueError(
                f"{where}: laws.{name} holds until the joint is {opening:.3g} m open, but "
                f"contacts are followed to {scene.skins.min():.3g} m: set a larger run.skin, or "
                "a smaller tension or energy_I"
            )
    for name, value in (("files", files), ("text", text)):  # `replace` leaves both out
        object.__setattr__(scene, name, value)
    return scene


def _block(table: Tables, density: float, where: str) -> Block:
    name, drawn = f"{where}: block[{table['name']!r}]", {"corners", "box", "at", "angle"} & {*table}
    if drawn != {"corners"} and ("box" not in drawn or "corners" in drawn):
        raise ValueError(f"{name}: give `corners` alone, or `box` with `at` and `angle`")
    if "box" in table:
        at, angle = table.pop("at", (0.0, 0.0)), table.pop("angle", 0.0)
        table["corners"] = box(*table.pop("box"), at, angle)
    if table.get("fixed") and {"velocity", "spin"} & {*table}:
        raise ValueError(f"{name}: a fixed block has no velocity or spin; let a [[drive]] move it")
    if trouble := check_convex(table["corners"]):
        raise ValueError(f"{name}.corners (or box) {trouble}")
    return Block(**{"density": density, **table, "held": tuple(table.get("held", ()))})


def _stresses(top: Tables, blocks: list[Block], where: str) -> tuple[Stress | None, Stress | None]:
    """The stresses of the tables `[water]` and `[in_situ]` of a scene.

    Blocks on its sides are fixed or held as `[in_situ]` says. On a side that the stress loads there
    is no water, which is part of the stress. Raises ValueError.
    """
    water, given, gravity = top.get("water"), top.get("in_situ", {}), top["gravity"]
    stress = np.ravel(given.get("stress", ()))
    if "in_situ" in top and ("k0" in given, len(stress)) not in ((True, 0), (False, 3)):
        raise ValueError(f"{where}: in_situ: give either k0 or stress = [sxx, syy, sxy]")
    if (water or "k0" in given) and (gravity[0] or gravity[1] > 0):
        raise ValueError(f"{where}: gravity = {list(gravity)} must point down, [0, -9.81], for a "
                         "water table and for k0")  # fmt: skip
    corners = np.concatenate([block.corners for block in blocks])
    loaded = _sides(given, blocks, corners)
    if water:
        water = Stress(
            np.eye(2), water["table"], water.get("unit_weight", UNIT_WEIGHT), 0.0, ~loaded
        )
    if not given:
        return water, None
    uniform, line = len(stress) > 0, given.get("surface", [[0.0, corners[:, 1].max()]])
    x, y, shear = stress if uniform else (given["k0"], 1.0, 0.0)
    weight, tensor = -top["density"] * gravity[1], np.array([[x, shear], [shear, y]])
    return water, Stress(tensor, np.array(line), weight * (not uniform), float(uniform), loaded)


def _sides(given: Tables, blocks: list[Block], corners: np.ndarray) -> np.ndarray:
    """Hold the blocks on the sides of a scene as `[in_situ]` says; which edges (c,) are loaded."""
    number = np.repeat(np.arange(len(blocks)), [len(block.corners) for block in blocks])
    ends = np.concatenate([np.roll(block.corners, -1, axis=0) for block in blocks])
    loaded = np.zeros(len(corners), bool)
    for side, (axis, way) in SIDES.items():
        reach, kind = way * np.stack([corners, ends])[..., axis], given.get(side)
        on = (reach > reach.max() - EXACT * np.ptp(corners)).all(axis=0)
        loaded |= on & (kind == "loaded")
        for i in np.unique(number[on & (kind in ("held", "rollers"))]).tolist():
            fixed, held = blocks[i].fixed or kind == "held", {*blocks[i].held, "xy"[axis], "turn"}
            blocks[i] = replace(blocks[i], fixed=fixed, held=() if fixed else tuple(sorted(held)))
    return loaded


def _pairs(
    tables: list[Tables], number: dict[str, int], blocks: Sequence[Block], where: str
) -> dict[frozenset, str]:
    """Laws named by [[joint]] tables, for two blocks or for all joints of one."""
    pairs: dict[frozenset, str] = {}
    for i, table in enumerate(tables):
        name = f"{where}: joint[{i}]"
        if "around" in table:
            meant = [_block_at(f"{name}.around", table["around"], blocks)]
        else:
            two = some_of(f"{name}.between", table.get("between"), number, 2)
            meant = [number[block] for block in two]
        if pairs.setdefault(frozenset(meant), table["law"]) != table["law"]:
            raise ValueError(f"{name}: another [[joint]] gives these blocks another law")
    return pairs


def _block_at(name: str, point: tuple[float, float], blocks: Sequence[Block]) -> int:
    for i, block in enumerate(blocks):
        if not block.fixed and Polygon(block.corners).contains(Point(point)):
            return i
    raise ValueError(f"{name} = {list(point)}: must lie inside a block that can move")


def _watched(
    table: Tables, number: dict[str, int], blocks: Sequence[Block], reach: float, where: str
) -> dict[str, tuple[Any, ...]]:
    watched: dict[str, tuple[Any, ...]] = {}
    for kind in ("slip", "shear"):
        pairs = [some_of(f"{where}.{kind}", pair, number, 2) for pair in table.get(kind, ())]
        watched[kind] = tuple((number[moving], number[base]) for moving, base in pairs)
    joints = {*watched["slip"], *watched["shear"]}
    if len({moving for moving, _ in joints}) < len(joints):
        raise ValueError(f"{where}: slip and shear watch one block on two bases; name one")
    pins = ((_block_at(f"{where}.pins", at, blocks), at) for at in table.get("pins", ()))
    near = (_joint_at(f"{where}.joints", at, blocks, reach) for at in table.get("joints", ()))
    return watched | {"pins": tuple(pins), "near": tuple(near)}


def _joint_at(
    name: str, point: tuple[float, float], blocks: Sequence[Block], reach: float
) -> tuple[int, int]:
    """The two blocks nearest to a point, in the order of the scene."""
    away = [Polygon(block.corners).distance(Point(point)) for block in blocks]
    two = sorted(np.argsort(away, kind="stable")[:2].tolist())
    shapes = [Polygon(blocks[i].corners) for i in two]
    if len(two) < 2 or shapes[0].distance(shapes[1]) > reach or all(blocks[i].fixed for i in two):
        raise ValueError(f"{name} = {list(point)}: must lie at a joint of a block that can move")
    return two[0], two[1]


def _stages(tables: list[Tables], blocks: Sequence[Block], where: str) -> Iterator[Tables]:
    """The stages of an excavation: each takes the blocks whose centroids lie in its corners."""
    left = dict(enumerate(Point(block.centroid) for block in blocks))
    for i, table in enumerate(tables):
        region = Polygon(table["corners"])
        taken = [j for j, at in left.items() if region.contains(at)]
        if not taken:
            raise ValueError(f"{where}: excavate[{i}].corners: no block is left there")
        left = {j: at for j, at in left.items() if j not in taken}
        yield {"at": None, **table, "blocks": taken}


def _rock(
    table: Tables, blocks: list[Block], laws: dict[tuple[int, int], str], top: Tables, where: str
) -> Rock:
    """Cut a rock, and add its blocks and the laws of their edges to those of the scene; top: the
    scene's tables, for what the rock does not say. Which blocks can move is left open."""
    name, where = table["name"], f"{where}: rock[{table['name']!r}]"
    sets = [JointSet(**{"law": top["law"], **part}) for part in table["set"]]
    shift, other = np.array(table.get("at", (0.0, 0.0))), table.get("laws", {})
    fixed = [Polygon(part["corners"]) for part in table.get("fixed", ())]
    wide = min([float(np.ptp(table["outline"], axis=0).min()), *(s.spacing for s in sets)])
    least = table.get("least_width", LEAST * wide * bool(sets))
    if unknown := set(other) - {s.law for s in sets}:
        raise ValueError(f"{where}.laws: no set of this rock has the law {unknown.pop()!r}")
    try:
        holes = [part["corners"] for part in table.get("hole", ())]
        regions = [part["corners"] - shift for part in top["excavate"]]
        shapes, numbers, joined, dropped = cut(
            table["outline"], sets, table.get("seed", 0), least, holes, regions
        )
    except ValueError as error:
        raise ValueError(f"{where}.outline: {error}") from None
    if not shapes:
        raise ValueError(
            f"{where}: all blocks would be slivers: give a least_width below {least:.3g} m"
        )
    first, names = len(blocks), [other.get(s.law, s.law) for s in sets]
    of_edge = dict(enumerate(names)) | {CUT: table.get("cut_law", WHOLE)}
    for i, (shape, of) in enumerate(zip(shapes, numbers, strict=True)):
        block = Block(f"{name} {i + 1}", shape + shift, table.get("density", top["density"]))
        stays = any(region.contains(Point(block.centroid - shift)) for region in fixed)
        blocks.append(replace(block, fixed=stays))
        laws.update(((first + i, edge), of_edge[number])
                    for edge, number in enumerate(of.tolist()) if number >= 0)  # fmt: skip
    cuts = sum(int((of == CUT).sum()) for of in numbers) // 2
    return Rock(name, range(first, len(blocks)), [], [
        f"{joined} slivers joined to neighbours",
        *(f"a gap of {sliver.area:.2g} m2 at ({sliver.centroid.x + shift[0]:.3g}, "
          f"{sliver.centroid.y + shift[1]:.3g}), a sliver left out" for sliver in dropped),
        *[f"{cuts} cuts that are no joints, at inward corners: law {of_edge[CUT]!r}"] * (cuts > 0),
    ])  # fmt: skip
