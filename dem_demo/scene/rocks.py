"""The `[[rock]]` tables of a scene: an outline, the joint sets that cut it, what stays fixed."""

from dataclasses import dataclass, replace

import numpy as np
from shapely import Point, Polygon

from jointlaw.support.checks import remedy

from ..errors import SceneError
from .blocks import Block
from .cutting import JointSet, cut
from .keys import ROCK, Tables, checked

LEAST = 0.2  # narrowest block as a share of the smallest spacing


@dataclass(frozen=True, eq=False)
class Rock:
    """A rock mass of a scene, cut into blocks.

    blocks: their numbers in the scene; free: those that can move; laws: of each (block, edge) that
    lies on a joint, the law of its set; slivers: what became of them, for a person.
    """

    name: str
    blocks: range
    free: list[int]
    laws: dict[tuple[int, int], str]
    slivers: str


def read_rocks(tables: list[Tables], blocks: list[Block], density: float, where: str) -> list[Rock]:
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
