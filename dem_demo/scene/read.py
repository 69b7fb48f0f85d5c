"""Reads scenes: TOML files, or their text, checked."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from shapely import Point, Polygon

from jointlaw.support.checks import one_of, remedy

from ..errors import SceneError
from .blocks import Block, box, check_convex
from .cutting import JointSet, cut
from .drives import read_drives
from .keys import ROCK, SCENE, Tables, checked, overlay, some_of, vector
from .laws import Files, build_law
from .scene import Monitors, Rock, Run, Scene

SCENES = Path(__file__).parent / "scenes"
TEMPLATE = Path(__file__).parent / "template.toml"
GRAVITY, DENSITY = (0.0, -9.81), 2600.0  # m/s2, kg/m3
LEAST = 0.2  # narrowest block of a rock as a share of the smallest spacing


def names() -> list[str]:
    """Scenes that come with the package: SCENE, and SCENE-VARIANT for each of its variants."""
    found = []
    for path in SCENES.glob("*.toml"):
        variants = tomllib.loads(path.read_text(encoding="utf-8")).get("variants", {})
        found += [path.stem, *(f"{path.stem}-{variant}" for variant in variants)]
    return sorted(found)


def load(source: str | Path) -> Scene:
    """A scene by name, or from a TOML file. Raises SceneError."""
    path, chosen = Path(source), ""
    if isinstance(source, str) and source in names():
        path = SCENES / f"{source}.toml"
        if not path.is_file():
            stem, _, variant = source.rpartition("-")
            path, chosen = SCENES / f"{stem}.toml", f'variant = "{variant}"\n'
    if not path.is_file():
        known = remedy(source, names(), "give a TOML file or one of")
        raise SceneError(f"no scene {str(source)!r}: {known}")
    try:
        return parse(chosen + path.read_text(encoding="utf-8"), path.name, Files(path.parent))
    except UnicodeDecodeError as error:
        raise SceneError(f"{path} is not UTF-8 text: {error}") from None


def parse(text: str, where: str = "scene", files: Files | None = None) -> Scene:
    """A scene from TOML text; `where` is named in error messages. Raises SceneError.

    files: those that it names, by default read from the working folder.
    """
    scene = build(read_tables(text, where), where, files)
    object.__setattr__(scene, "text", text)
    return scene


def read_tables(text: str, where: str = "scene") -> Tables:
    """The tables of a scene's text, those of its `variant` laid over the others."""
    try:
        data = tomllib.loads(text)
        variants, chosen = data.pop("variants", {}), data.pop("variant", None)
        if chosen is None:
            return data
        return overlay(data, variants[one_of(f"{where}.variant", chosen, tuple(variants))])
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from None


def build(data: Tables, where: str = "scene", files: Files | None = None) -> Scene:
    """A scene from the tables of its file and the files that it names. Raises SceneError."""
    top, laws, files = checked(data, SCENE, where), {}, Files() if files is None else files
    for name, table in top["laws"].items():
        try:
            laws[name] = build_law(table, f"{where}.laws.{name}", files)
        except (ValueError, TypeError, AttributeError, OverflowError) as error:
            raise SceneError(str(error)) from None
    density = top.get("density", DENSITY)
    blocks = [_block(table, density, where) for table in top.get("block", ())]
    rocks = _rocks(top.get("rock", ()), blocks, density, where)
    number = {block.name: i for i, block in enumerate(blocks)}
    if len(number) < len(blocks):
        raise SceneError(f"{where}: two blocks have the same name; names must differ")
    if all(block.fixed for block in blocks):
        raise SceneError(f"{where}: no block can move; give [[block]] or [[rock]], not all fixed")
    try:
        drives = read_drives(top.get("drive", ()), number, blocks, files, where)
        pairs = _pairs(top.get("joint", ()), number, blocks, where)
        monitors = _monitors(top.get("watch", {}), number, blocks, f"{where}.watch")
    except ValueError as error:
        raise SceneError(str(error)) from None
    edge_laws = {edge: law for rock in rocks for edge, law in rock.laws.items()}
    default = top.get("law", next(iter(laws), ""))
    for law in [default, *pairs.values(), *edge_laws.values()]:
        if law not in list(laws):
            raise SceneError(f"{where}: law {law!r} is not among [laws]; {remedy(law, laws)}")
    scene = Scene(
        top.get("title", where), tuple(blocks), laws, Run(**top["run"]), default, pairs,
        tuple(rocks), edge_laws, drives, top.get("gravity", GRAVITY), top.get("thickness", 1.0),
        monitors,
    )  # fmt: skip
    object.__setattr__(scene, "files", files)
    return scene


def _block(table: Tables, density: float, where: str) -> Block:
    shape, at = table.pop("corners", None), table.pop("at", (0.0, 0.0))
    if "box" in table:
        shape = box(*table.pop("box"), at, table.pop("angle", 0.0))
    if shape is None:
        raise SceneError(f"{where}.block[{table['name']!r}]: give `corners`, or `box` and `at`")
    if trouble := check_convex(shape):
        raise SceneError(f"{where}.block[{table['name']!r}].corners (or box) {trouble}")
    held = tuple(table.pop("held", ()))
    return Block(**{"corners": shape, "density": density, "held": held, **table})


def _pairs(
    tables: list[Tables], number: dict[str, int], blocks: Sequence[Block], where: str
) -> dict[frozenset, str]:
    """Laws named by [[joint]] tables, for two blocks or for all joints of one."""
    pairs: dict[frozenset, str] = {}
    for i, table in enumerate(tables):
        name = f"{where}.joint[{i}]"
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
        if not block.fixed and block.holds(point):
            return i
    raise ValueError(f"{name} = {list(point)}: must lie inside a block that can move")


def _monitors(
    table: Tables, number: dict[str, int], blocks: Sequence[Block], where: str
) -> Monitors:
    watched: dict[str, tuple[Any, ...]] = {}
    for kind in ("slip", "shear"):
        pairs = [some_of(f"{where}.{kind}", pair, number, 2) for pair in table.get(kind, ())]
        watched[kind] = tuple((number[moving], number[base]) for moving, base in pairs)
    joints = {*watched["slip"], *watched["shear"]}
    if len({moving for moving, _ in joints}) < len(joints):
        raise ValueError(f"{where}: slip and shear watch one block on two bases; name one")
    points = [vector(f"{where}.pins", point) for point in table.get("pins", ())]
    pins = tuple((_block_at(f"{where}.pins", point, blocks), point) for point in points)
    return Monitors(**watched, pins=pins)


def _rocks(tables: list[Tables], blocks: list[Block], density: float, where: str) -> list[Rock]:
    """Cut the rocks of a scene's `[[rock]]` tables, and add their blocks. Raises SceneError."""
    rocks: list[Rock] = []
    known: dict[str, Tables] = {}
    for i, table in enumerate(tables):
        place = f"{where}.rock[{i}]"
        like = table.get("like", "") if isinstance(table, dict) else ""
        if like and like not in known:
            raise SceneError(f"{place}.like = {like!r}: no rock further up; {remedy(like, known)}")
        whole = checked({**known[like], **table} if like else table, ROCK, place)
        if whole["name"] in known:
            raise SceneError(f"{place}.name = {whole['name']!r}: names of rocks must differ")
        known[whole["name"]] = {**known.get(like, {}), **table}
        rocks.append(_rock(whole, blocks, density, f"{where}.rock[{whole['name']!r}]"))
    return rocks


def _rock(table: Tables, blocks: list[Block], density: float, where: str) -> Rock:
    sets = [JointSet(**part) for part in table["set"]]
    shift, other = np.array(table.get("at", (0.0, 0.0))), table.get("laws", {})
    fixed = [Polygon(part["corners"]) for part in table.get("fixed", ())]
    least = table.get("least_width", LEAST * min((s.spacing for s in sets), default=0.0))
    if unknown := set(other) - {s.law for s in sets}:
        raise SceneError(f"{where}.laws: no set of this rock has the law {unknown.pop()!r}")
    try:
        parts = cut(table["outline"], sets, table.get("seed", 0), least)
    except ValueError as error:
        raise SceneError(f"{where}.outline: {error}") from None
    first, name, laws = len(blocks), table["name"], {}
    for i, (shape, of) in enumerate(zip(parts.blocks, parts.sets, strict=True)):
        block = Block(f"{name} {i + 1}", shape + shift, table.get("density", density))
        stays = any(region.contains(Point(block.centroid - shift)) for region in fixed)
        blocks.append(replace(block, fixed=stays))
        for edge, number in enumerate(of.tolist()):
            if number >= 0:
                laws[first + i, edge] = other.get(sets[number].law, sets[number].law)
    slivers = f"{parts.joined} slivers joined to neighbours"
    if parts.dropped:
        slivers += f", {len(parts.dropped)} left out ({sum(parts.dropped):.2g} m2)"
    free = [i for i in range(first, len(blocks)) if not blocks[i].fixed]
    if not free:
        raise SceneError(f"{where}.fixed: all blocks of the rock are fixed")
    return Rock(name, range(first, len(blocks)), free, laws, slivers)
