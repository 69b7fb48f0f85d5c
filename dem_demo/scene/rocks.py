"""The `[[rock]]` tables of a scene: an outline, the joint sets that cut it, what stays fixed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from shapely import Point, Polygon

from jointlaw.support.checks import remedy

from ..errors import SceneError
from .blocks import Block
from .cutting import JointSet, cut
from .tables import Table

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


def read_rocks(top: Table, density: float, first: int) -> tuple[list[Block], list[Rock]]:
    """Cut the rocks of a scene's `[[rock]]` tables; block numbers from `first`.

    Raises SceneError.
    """
    blocks: list[Block] = []
    rocks: list[Rock] = []
    known: dict[str, dict[str, Any]] = {}
    for table in top.tables("rock", []):
        name, like = table.take("name", str), table.take("like", str, "")
        if name in known:
            raise table.error("name", "two rocks have this name; names must differ")
        if like and like not in known:
            raise table.error("like", f"no rock further up; {remedy(like, known)}")
        known[name] = {**known.get(like, {}), **table.data}
        whole = Table(known[name], f"{top.path('rock')}[{name!r}]")
        whole.known |= {"name", "like"}
        shapes, rock = _rock(whole, name, density, first + len(blocks))
        blocks += shapes
        rocks.append(rock)
    return blocks, rocks


def _rock(table: Table, name: str, density: float, first: int) -> tuple[list[Block], Rock]:
    outline = _polygon(table, "outline")
    shift = np.array(table.vector("at", (0.0, 0.0)))
    other = table.take("laws", dict, {})
    sets = [_set(part) for part in table.tables("set", say="give [[rock.set]] tables")]
    fixed = []
    for part in table.tables("fixed", []):
        fixed.append(Polygon(_polygon(part, "corners")))
        part.finish()
    least = LEAST * min((s.spacing for s in sets), default=0.0)
    least = table.take("least_width", float, least, above=0, say="m")
    seed = table.whole("seed", 0, least=0)
    density = table.density(density)
    table.finish()
    if not all(isinstance(law, str) for law in other.values()):
        raise table.error("laws", "must name laws")
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
        blocks.append(replace(block, fixed=stays))
        for edge, number in enumerate(of.tolist()):
            if number >= 0:
                laws[first + i, edge] = other.get(sets[number].law, sets[number].law)
    slivers = f"{parts.joined} slivers joined to neighbours"
    if parts.dropped:
        slivers += f", {len(parts.dropped)} left out ({sum(parts.dropped):.2g} m2)"
    free = [first + i for i, block in enumerate(blocks) if not block.fixed]
    if not free:
        raise SceneError(f"{table.path('fixed')}: all blocks of the rock are fixed")
    return blocks, Rock(name, range(first, first + len(blocks)), free, laws, slivers)


def _set(table: Table) -> JointSet:
    dip = table.take("dip", float)
    if not -90 <= dip <= 90:
        raise table.error("dip", "must be within -90 and 90 degrees", dip)
    joints = JointSet(
        dip=dip,
        spacing=table.take("spacing", float, above=0, say="m"),
        law=table.take("law", str),
        persistence=table.take("persistence", float, 1.0, least=0, most=1),
        scatter=table.take("scatter", float, 0.0, least=0, below=1, say="(two joints could meet)"),
        through=table.vector("through", (0.0, 0.0)),
    )
    table.finish()
    return joints


def _polygon(table: Table, key: str) -> np.ndarray:
    """Corners (m, 2) of a simple polygon, in either sense."""
    corners = table.corners(key, "give at least 3 corners [x, y] in m")
    if not Polygon(corners).is_valid:
        raise SceneError(f"{table.path(key)}: must not cross or touch itself")
    return corners
