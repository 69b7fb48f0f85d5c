"""Reads scenes: TOML files, or their text, checked."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jointlaw.support.checks import one_of, remedy

from ..errors import SceneError
from .blocks import Block, box, check_convex
from .drives import read_drives
from .keys import SCENE, Tables, checked, overlay, some_of, vector
from .laws import Files, build_law
from .rocks import read_rocks
from .scene import Monitors, Run, Scene

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
    rocks = read_rocks(top.get("rock", ()), blocks, density, where)
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
