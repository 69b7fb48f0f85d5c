"""A scene: blocks, laws, drives and how to run them, read from TOML and checked."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .drives import AXES, Drive, read_drives
from .laws import build_law
from .rocks import Rock, read_rocks
from .shapes import Block, box, check_convex
from .tables import SceneError, Table, distinct

SCENES = Path(__file__).parent / "scenes"


@dataclass(frozen=True)
class Run:
    """How to run a scene; times in s, lengths in m."""

    end: float
    fraction: float = 0.3  # time step as a share of the limit
    step: float | None = None  # or the time step itself
    seat: bool = True  # start at the gravity closure
    record: float = 0.05  # time between records
    dashpot_normal: float = 0.05  # shares of critical
    dashpot_shear: float = 0.05
    law_steps: int = 1  # steps of the law per time step: 4 keeps the books within 0.5 % in impacts
    largest_stress: float = 0.0  # Pa, expected in impacts: sets the step before anything touches
    skin: float | None = None  # reach of the search for contacts; default 0.02 of the least width
    point_spacing: float = np.inf  # largest distance of law points along a joint
    corner_length: float | None = None  # of a corner on an edge; default 0.1 of the least width
    max_overlap: float = 0.03  # share of the smaller block's width


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that a simulation needs. `text` is the file it came from."""

    title: str
    blocks: tuple[Block, ...]
    laws: dict[str, Any]
    run: Run
    default_law: str
    pairs: dict[frozenset, str] = field(default_factory=dict)
    rocks: tuple[Rock, ...] = ()
    edge_laws: dict[tuple[int, int], str] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    gravity: tuple[float, float] = (0.0, -9.81)
    thickness: float = 1.0
    watch: dict[str, Any] = field(default_factory=dict)
    text: str = ""

    def law_of(self, key: tuple[int, int, int, int]) -> str:
        """Name of the law of an interface (block, edge, block, edge).

        The law of a [[joint]] table if one names the blocks; else that of the joint set that cut
        both edges; else the scene's.
        """
        one, other = key[0], key[2]
        for blocks in ((one, other), (one,), (other,)):
            if law := self.pairs.get(frozenset(blocks)):
                return law
        law = self.edge_laws.get((one, key[1]))
        same = law is not None and law == self.edge_laws.get((other, key[3]))
        return law if same else self.default_law


def names() -> list[str]:
    """Scenes that come with the package."""
    return sorted(path.stem for path in SCENES.glob("*.toml"))


def load(source: str | Path) -> Scene:
    """A scene by name, or from a TOML file."""
    path = SCENES / f"{source}.toml"
    if not (isinstance(source, str) and path.is_file()):
        path = Path(source)
    if not path.is_file():
        raise SceneError(
            f"no scene {str(source)!r}: give a TOML file or one of {', '.join(names())}"
        )
    try:
        return parse(path.read_text(encoding="utf-8"), path.name)
    except UnicodeDecodeError as error:
        raise SceneError(f"{path} is not UTF-8 text: {error}") from None


def parse(text: str, where: str = "scene") -> Scene:
    """A scene from TOML text; `where` is named in error messages."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{where} is not valid TOML: {error}") from None
    return build(data, where, text)


def build(data: dict[str, Any], where: str = "scene", text: str = "") -> Scene:
    """A scene from the tables of its file; `text` is kept for states saved to files."""
    top = Table(data, where)
    laws = {}
    for name, table in top.take("laws", dict, say="give at least one [laws.NAME] table").items():
        try:
            laws[name] = build_law(table, f"{where}.laws.{name}")
        except (ValueError, TypeError, AttributeError, OverflowError) as error:
            raise SceneError(str(error)) from None
    default = top.take("law", str, next(iter(laws), ""))
    thickness = top.take("thickness", float, 1.0, above=0)
    density = top.take("density", float, 2600.0, above=0)
    tables = top.take("block", list, [])
    blocks = [_block(Table(t, f"{where}.block[{i}]"), density) for i, t in enumerate(tables)]
    cut, rocks = read_rocks(top.take("rock", list, []), where, density, len(blocks))
    blocks += cut
    if not blocks:
        raise SceneError(f"{where}: no blocks; give [[block]] or [[rock]] tables")
    number = {block.name: i for i, block in enumerate(blocks)}
    if len(number) < len(blocks):
        raise SceneError(f"{where}.block: two blocks have the same name; names must differ")
    if all(block.fixed for block in blocks):
        raise SceneError(f"{where}.block: all blocks are fixed; at least one must be free to move")
    drives = read_drives(top, where, number, blocks)
    run = _run(Table(top.take("run", dict, say="give a [run] table with `end`"), f"{where}.run"))
    scene = Scene(
        title=top.take("title", str, where),
        blocks=tuple(_hold(block, i, drives) for i, block in enumerate(blocks)),
        laws=laws,
        run=run,
        default_law=default,
        pairs=_pairs(top, where, number, blocks),
        rocks=tuple(rocks),
        edge_laws={edge: law for rock in rocks for edge, law in rock.laws.items()},
        drives=drives,
        gravity=top.vector("gravity", (0.0, -9.81)),
        thickness=thickness,
        watch=_watch(top, where, number, blocks),
        text=text,
    )
    top.finish()
    for law in [default, *scene.pairs.values(), *scene.edge_laws.values()]:
        if law not in laws:
            raise SceneError(f"{where}: law {law!r} is not among [laws]: {', '.join(laws)}")
    return scene


def _block(table: Table, density: float) -> Block:
    name = table.take("name", str)
    table.where = f"{table.where.rsplit('[', 1)[0]}[{name!r}]"
    if "box" in table.data:
        size = table.vector("box")
        if min(size) <= 0:
            raise SceneError(f"{table.path('box')} = {list(size)}: width and height must be > 0")
        corners = box(*size, table.vector("at", (0.0, 0.0)), table.take("angle", float, 0.0))
    else:
        corners = table.corners("corners", "give `corners`, or `box` with `at` and `angle`")
    if trouble := check_convex(corners):
        raise SceneError(f"{table.path('corners')} {trouble}")
    held = table.take("held", list, [])
    if not distinct(held, AXES):
        raise SceneError(f"{table.path('held')} = {held!r}: must be some of x, y, turn, each once")
    block = Block(
        name=name,
        corners=corners,
        density=table.take("density", float, density, above=0),
        fixed=table.take("fixed", bool, False),
        velocity=table.vector("velocity", (0.0, 0.0)),
        spin=table.take("spin", float, 0.0),
        load=table.vector("load", (0.0, 0.0)),
        held=tuple(held),
    )
    table.finish()
    return block


def _hold(block: Block, number: int, drives) -> Block:
    name = {value: key for key, value in AXES.items()}
    held = tuple(name[d.axis] for d in drives if d.block == number)
    return Block(**{**block.__dict__, "held": held})


def _pairs(top: Table, where: str, number: dict[str, int], blocks) -> dict[frozenset, str]:
    """Laws named by [[joint]] tables, for two blocks or for all joints of one."""
    pairs = {}
    for n, data in enumerate(top.take("joint", list, [])):
        table = Table(data, f"{where}.joint[{n}]")
        if "around" in data:
            point = table.vector("around")
            block = _block_at(point, blocks, table.path("around"))
            pairs[frozenset([block])] = table.take("law", str)
            table.finish()
            continue
        between = table.take("between", list, say="or give `around`, a point of one block")
        if not distinct(between, number, 2):
            raise SceneError(f"{table.path('between')} = {between}: must name two blocks")
        pairs[frozenset(number[b] for b in between)] = table.take("law", str)
        table.finish()
    return pairs


def _block_at(point, blocks, path: str) -> int:
    for i, block in enumerate(blocks):
        if not block.fixed and block.holds(point):
            return i
    raise SceneError(f"{path} = {list(point)}: must lie inside a block that can move")


def _run(table: Table) -> Run:
    run = Run(
        end=table.take("end", float, above=0, say="s"),
        fraction=table.take("fraction", float, Run.fraction, above=0),
        step=table.take("step", float, None, above=0, say="s"),
        seat=table.take("seat", bool, Run.seat),
        record=table.take("record", float, Run.record, above=0, say="s"),
        dashpot_normal=table.take("dashpot_normal", float, Run.dashpot_normal, least=0),
        dashpot_shear=table.take("dashpot_shear", float, Run.dashpot_shear, least=0),
        law_steps=table.whole("law_steps", Run.law_steps, least=1),
        largest_stress=table.take("largest_stress", float, Run.largest_stress, least=0, say="Pa"),
        skin=table.take("skin", float, None, above=0, say="m"),
        point_spacing=table.take("point_spacing", float, Run.point_spacing, above=0, say="m"),
        corner_length=table.take("corner_length", float, None, above=0, say="m"),
        max_overlap=table.take("max_overlap", float, Run.max_overlap, above=0),
    )
    table.finish()
    if not run.fraction <= 0.95:
        raise SceneError(f"{table.path('fraction')} = {run.fraction}: must be <= 0.95 of the limit")
    return run


def _watch(top: Table, where: str, number: dict[str, int], blocks) -> dict[str, list]:
    """Joints to report on, as pairs of block numbers (moving, base); pins as (block, point)."""
    table, out = Table(top.take("watch", dict, {}), f"{where}.watch"), {}
    for kind in ("slip", "shear"):
        out[kind] = []
        for pair in table.take(kind, list, []):
            if not distinct(pair, number, 2):
                raise SceneError(f"{table.path(kind)}: {pair!r} must be [moving block, its base]")
            out[kind].append((number[pair[0]], number[pair[1]]))
    places = table.take("pins", list, [])
    pins = [Table({"pins": point}, table.where).vector("pins") for point in places]
    out["pins"] = [(_block_at(point, blocks, table.path("pins")), point) for point in pins]
    table.finish()
    return out
