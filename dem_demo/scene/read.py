"""Reads scenes: TOML files, or their text, checked."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from jointlaw.support.checks import remedy

from ..errors import SceneError
from .blocks import Block, box, check_convex
from .drives import AXES, read_drives
from .files import Files
from .laws import build_law
from .rocks import read_rocks
from .scene import Monitors, Run, Scene
from .tables import Table, distinct, overlay

SCENES = Path(__file__).parent / "scenes"
TEMPLATE = Path(__file__).parent / "template.toml"
GRAVITY, DENSITY = (0.0, -9.81), 2600.0  # m/s2, kg/m3


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
        raise SceneError(
            f"no scene {str(source)!r}: {remedy(source, names(), 'give a TOML file or one of')}"
        )
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


def read_tables(text: str, where: str = "scene") -> dict[str, Any]:
    """The tables of a scene's text, those of its `variant` laid over the others."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{where} is not valid TOML: {error}") from None
    variants = data.pop("variants", {})
    if "variant" not in data:
        return data
    variant = data.pop("variant")
    if not (isinstance(variants, dict) and isinstance(variant, str) and variant in variants):
        raise SceneError(
            f"{where}.variant = {variant!r} is none of [variants]: {remedy(variant, variants)}"
        )
    return overlay(data, variants[variant])


def build(data: dict[str, Any], where: str = "scene", files: Files | None = None) -> Scene:
    """A scene from the tables of its file and the files that it names. Raises SceneError."""
    top, files = Table(data, where), Files() if files is None else files
    laws = {}
    for name, table in top.take("laws", dict, say="give at least one [laws.NAME] table").items():
        try:
            laws[name] = build_law(table, f"{where}.laws.{name}", files)
        except (ValueError, TypeError, AttributeError, OverflowError) as error:
            raise SceneError(str(error)) from None
    density = top.density(DENSITY)
    blocks = [_block(table, density) for table in top.tables("block", [])]
    cut, rocks = read_rocks(top, density, len(blocks))
    blocks += cut
    if not blocks:
        raise SceneError(f"{where}: no blocks; give [[block]] or [[rock]] tables")
    number = {block.name: i for i, block in enumerate(blocks)}
    if len(number) < len(blocks):
        raise SceneError(f"{where}.block: two blocks have the same name; names must differ")
    if all(block.fixed for block in blocks):
        raise SceneError(f"{where}.block: all blocks are fixed; at least one must be free to move")
    drives = read_drives(top, number, blocks, files)
    name = dict(zip(AXES.values(), AXES, strict=True))
    for drive in drives:
        block = blocks[drive.block]
        held = tuple(name[d.axis] for d in drives if d.block == drive.block)
        blocks[drive.block] = replace(block, held=held)
    scene = Scene(
        title=top.take("title", str, where),
        blocks=tuple(blocks),
        laws=laws,
        run=_run(Table(top.take("run", dict, say="give a [run] table with `end`"), f"{where}.run")),
        default_law=top.take("law", str, next(iter(laws), "")),
        pairs=_pairs(top, number, blocks),
        rocks=tuple(rocks),
        edge_laws={edge: law for rock in rocks for edge, law in rock.laws.items()},
        drives=drives,
        gravity=top.vector("gravity", GRAVITY),
        thickness=top.take("thickness", float, 1.0, above=0),
        monitors=_monitors(Table(top.take("watch", dict, {}), f"{where}.watch"), number, blocks),
    )
    top.finish()
    for law in [scene.default_law, *scene.pairs.values(), *scene.edge_laws.values()]:
        if law not in laws:
            raise SceneError(f"{where}: law {law!r} is not among [laws]; {remedy(law, laws)}")
    object.__setattr__(scene, "files", files)
    return scene


def _block(table: Table, density: float) -> Block:
    name = table.take("name", str)
    table.where = f"{table.where.rsplit('[', 1)[0]}[{name!r}]"
    if "box" in table.data:
        size = table.vector("box")
        if min(size) <= 0:
            raise table.error("box", "width and height must be > 0")
        corners = box(*size, table.vector("at", (0.0, 0.0)), table.take("angle", float, 0.0))
    else:
        corners = table.corners("corners", "give `corners`, or `box` with `at` and `angle`")
    if trouble := check_convex(corners):
        raise SceneError(f"{table.path('corners')} {trouble}")
    held = table.take("held", list, [])
    if not distinct(held, AXES):
        raise table.error("held", "must be some of x, y, turn, each once")
    block = Block(
        name=name,
        corners=corners,
        density=table.density(density),
        fixed=table.take("fixed", bool, False),
        velocity=table.vector("velocity", (0.0, 0.0)),
        spin=table.take("spin", float, 0.0),
        load=table.vector("load", (0.0, 0.0)),
        held=tuple(held),
    )
    table.finish()
    return block


def _pairs(top: Table, number: dict[str, int], blocks: Sequence[Block]) -> dict[frozenset, str]:
    """Laws named by [[joint]] tables, for two blocks or for all joints of one."""
    pairs = {}
    for table in top.tables("joint", []):
        if "around" in table.data:
            meant = [_block_at(table.vector("around"), blocks, table, "around")]
        else:
            named = table.take("between", list, say="or give `around`, a point of one block")
            if not distinct(named, number, 2):
                raise table.error("between", "must name two blocks")
            meant = [number[name] for name in named]
        law = table.take("law", str)
        if pairs.setdefault(frozenset(meant), law) != law:
            raise table.error("law", "another [[joint]] gives these blocks another law")
        table.finish()
    return pairs


def _block_at(point, blocks: Sequence[Block], table: Table, key: str) -> int:
    for i, block in enumerate(blocks):
        if not block.fixed and block.holds(point):
            return i
    raise table.error(key, "must lie inside a block that can move", list(point))


def _run(table: Table) -> Run:
    run = Run(
        end=table.take("end", float, above=0, say="s"),
        fraction=table.take(
            "fraction", float, Run.fraction, above=0, most=0.95, say="of the limit"
        ),
        step=table.take("step", float, None, above=0, say="s"),
        seat=table.take("seat", bool, Run.seat),
        record=table.take("record", float, Run.record, above=0, say="s"),
        dashpot_normal=table.take("dashpot_normal", float, Run.dashpot_normal, least=0),
        dashpot_shear=table.take("dashpot_shear", float, Run.dashpot_shear, least=0),
        law_steps=table.whole("law_steps", Run.law_steps, least=1),
        largest_stress=table.take("largest_stress", float, Run.largest_stress, least=0, say="Pa"),
        skin=table.take("skin", float, None, above=0, say="m"),
        corner_length=table.take("corner_length", float, None, above=0, say="m"),
        max_overlap=table.take("max_overlap", float, Run.max_overlap, above=0),
    )
    table.finish()
    return run


def _monitors(table: Table, number: dict[str, int], blocks: Sequence[Block]) -> Monitors:
    joints = {}
    for kind in ("slip", "shear"):
        pairs = table.take(kind, list, [])
        for pair in pairs:
            if not distinct(pair, number, 2):
                raise SceneError(f"{table.path(kind)}: {pair!r} must be [moving block, its base]")
        joints[kind] = tuple((number[moving], number[base]) for moving, base in pairs)
    watched = {*joints["slip"], *joints["shear"]}
    if len({moving for moving, _ in watched}) < len(watched):
        raise SceneError(f"{table.where}: slip and shear watch one block on two bases; name one")
    points = [table.two_numbers("pins", value) for value in table.take("pins", list, [])]
    pins = tuple((_block_at(point, blocks, table, "pins"), point) for point in points)
    table.finish()
    return Monitors(**joints, pins=pins)
