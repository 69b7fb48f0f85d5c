"""The `[[rock]]` tables of a scene: an outline, the joint sets that cut it, what stays fixed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from shapely import Point, Polygon

from .cutting import JointSet, cut
from .shapes import Block
from .tables import SceneError, Table

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


def read_rocks(tables: list[Any], where: str, density: float, first: int):
    """Cut the rocks of a scene. Returns (list of Block, list of Rock); block numbers from `first`.

    Raises SceneError that names the key, its value, the bound and the remedy.
    """
    blocks: list[Block] = []
    rocks: list[Rock] = []
    known: dict[str, dict[str, Any]] = {}
    for n, data in enumerate(tables):
        place = f"{where}.rock[{n}]"
        table = Table(data, place)
        name, like = table.take("name", str), table.take("like", str, "")
        if name in known:
            raise SceneError(
                f"{place}.name = {name!r}: two rocks have this name; names must differ"
            )
        if like and like not in known:
            raise SceneError(f"{place}.like = {like!r}: must be the name of a rock further up")
        known[name] = {**known.get(like, {}), **data}
        table = Table(known[name], f"{where}.rock[{name!r}]")
        table.known |= {"name", "like"}
        shapes, rock = _one(table, name, density, first + len(blocks))
        blocks += shapes
        rocks.append(rock)
    return blocks, rocks


def _one(table: Table, name: str, density: float, first: int) -> tuple[list[Block], Rock]:
    outline = _polygon(table, "outline")
    shift = np.array(table.vector("at", (0.0, 0.0)))
    other = table.take("laws", dict, {})
    sets = [
        _set(Table(data, f"{table.where}.set[{i}]"))
        for i, data in enumerate(table.take("set", list, say="give [[rock.set]] tables"))
    ]
    fixed = []
    for i, data in enumerate(table.take("fixed", list, [])):
        part = Table(data, f"{table.where}.fixed[{i}]")
        fixed.append(Polygon(_polygon(part, "corners")))
        part.finish()
    least = LEAST * min((s.spacing for s in sets), default=0.0)
    least = table.take("least_width", float, least, above=0, say="m")
    seed = table.whole("seed", 0, least=0)
    density = table.take("density", float, density, above=0)
    table.finish()
    if not all(isinstance(law, str) for law in other.values()):
        raise SceneError(f"{table.path('laws')} = {other}: must name laws")
    if unknown := set(other) - {s.law for s in sets}:
        raise SceneError(f"{table.path('laws')}: no set of this rock has the law {unknown.pop()!r}")
    try:
        parts = cut(outline, sets, seed, least)
    except ValueError as error:
        raise SceneError(f"{table.path('outline')}: {error}") from None
    blocks, laws = [], {}
    for i, (corners, of) in enumerate(zip(parts.blocks, parts.sets, strict=True)):
        block = Block(f"{name} {i + 1}", corners + shift, density)
        stays = any(region.contains(Point(block.centroid - shift)) for region in fixed)
        blocks.append(Block(block.name, block.corners, density, fixed=stays))
        for edge, number in enumerate(of.tolist()):
            if number >= 0:
                laws[first + i, edge] = other.get(sets[number].law, sets[number].law)
    numbers = range(first, first + len(blocks))
    slivers = f"{parts.joined} slivers joined to neighbours"
    if parts.dropped:
        slivers += f", {len(parts.dropped)} left out ({sum(parts.dropped):.2g} m2)"
    free = [number for number, block in zip(numbers, blocks, strict=True) if not block.fixed]
    if not free:
        raise SceneError(f"{table.path('fixed')}: all blocks of the rock are fixed")
    return blocks, Rock(name, numbers, free, laws, slivers)


def _set(table: Table) -> JointSet:
    joints = JointSet(
        dip=table.take("dip", float),
        spacing=table.take("spacing", float, above=0, say="m"),
        law=table.take("law", str),
        persistence=table.take("persistence", float, 1.0, least=0),
        scatter=table.take("scatter", float, 0.0, least=0),
        through=table.vector("through", (0.0, 0.0)),
    )
    table.finish()
    if not -90 <= joints.dip <= 90:
        raise SceneError(f"{table.path('dip')} = {joints.dip}: must be within -90 and 90 degrees")
    if joints.persistence > 1:
        raise SceneError(f"{table.path('persistence')} = {joints.persistence}: must be <= 1")
    if joints.scatter >= 1:
        raise SceneError(
            f"{table.path('scatter')} = {joints.scatter}: must be < 1, or two joints could meet"
        )
    return joints


def _polygon(table: Table, key: str) -> np.ndarray:
    """Corners (m, 2) of a simple polygon, in either sense."""
    corners = table.corners(key, "give at least 3 corners [x, y] in m")
    if not Polygon(corners).is_valid:
        raise SceneError(f"{table.path(key)}: must not cross or touch itself")
    return corners
