"""How far a scene is from failing: its factor of safety and its critical tilt.

Both are looked for on the initial equilibrium, without running the blocks: a scene fails where no
displacements are found with which the joints carry the loads. A search starts where the scene
holds, and looks for every equilibrium from the one before, with shorter steps where none is found.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from shapely import Point, Polygon
from tqdm import tqdm

from jointlaw.support.files import write_json

from ..dynamics.equilibrium import equilibrium_displacements
from ..dynamics.simulation import Simulation
from ..output.pictures import Pictures
from ..output.record import named, told
from ..output.run import to_failure
from ..scene import Scene, Tables, build, median_size, read_tables, rotation
from .limit_analysis import limit_factor

FILE, VERSION = "trials.json", 2
TILT = 8.0, 60.0, 0.05  # degrees: first step, largest, to which it is found
FACTOR = np.log(2.0), np.log(64.0), 0.006  # logarithms: the same of a factor
TWICE = 2.0  # where all blocks are loose: times the strength, with which fewer are
FIRST = 0.01  # of the usual size of a block: who has moved by half of the most then moves first
BELOW_BOUND = 0.06  # first step of a search below a bound, of the logarithm
STEP_GROWTH = 1.5  # of its further steps
SHOWN = 1.02  # times the factor: what the strength of the failing run is divided by


class Trials:
    """What has been found about a scene, by name; with a `folder` also in its trials.json.

    Raises ValueError for a folder with trials of another scene.
    """

    def __init__(self, scene: Scene, folder: Path | None = None) -> None:
        self.path = folder and folder / FILE
        self.of = {"version": VERSION, "scene": scene.text, "files": dict(scene.files)}
        self.known: dict[str, Any] = {}
        if self.path and self.path.exists():
            kept = json.loads(self.path.read_text(encoding="utf-8"))
            self.known = kept.pop("trials")
            if kept != self.of:
                raise ValueError(
                    f"{self.path} holds trials of another scene: give another --out, or --force to "
                    "replace them"
                )

    def ask(self, name: str, find: Callable[[], Any]) -> Any:
        """What `find` says; known from before, it is not asked again. Of the file arrays are
        lists."""
        if name not in self.known:
            self.known[name] = find()
            if self.path:
                write_json(self.path, {**self.of, "trials": self.known})
        return self.known[name]


def strength_reduction(
    scene: Scene, until: float, folder: Path, picture_format: str, tell: Callable[[str], None]
) -> Iterator[dict]:
    """Factor of safety and critical tilt of every rock alone, or of a scene without rocks.

    Yields `rock`; `loose`: blocks that cannot be held as drawn, names and centroids (m);
    `without`: the same, or where all are loose, those that twice the strength does not hold either;
    `factor_of_safety`; with such blocks `factor_without`: of all others, while these move away;
    `critical_tilt` (degrees); each None where none is found. `picture`: the file in `folder` that
    shows how it fails, None without a factor; `first`: the blocks that move first there. That run
    has the strength divided by 1.02 times the factor (without loose blocks, if there are any), and
    ends at `until` (s) or once a block has moved by the size of a block. Each finished trial is
    kept in the folder; called again with it, the search goes on. tell: is told what is done, a line
    at a time.
    """
    trials = Trials(scene, folder)
    for name in [rock.name for rock in scene.rocks] or ["scene"]:
        one = (alone(scene, name) if scene.rocks else scene).excavated
        tell(f"{name}: looking for blocks that cannot be held")
        loose = trials.ask(f"{name}: loose", partial(_loose, one))
        free = sum(not b.fixed and i not in one.removed for i, b in enumerate(one.blocks))
        tell(f"{name}: {len(loose)} of {free} blocks cannot be held: {told(loose)}")
        row: dict = {"rock": name, "loose": loose, "without": loose}
        if len(loose) == free:
            row["without"] = trials.ask(
                f"{name}: loose with strength * {TWICE:g}",
                partial(_loose, weakened(one, 1 / TWICE)),
            )
            tell(f"{name}: {len(row['without'])} of them with {TWICE:g} times the strength "
                 f"neither: {told(row['without'])}")  # fmt: skip
        apart = np.isin([block.name for block in one.blocks], [b["block"] for b in row["without"]])
        tell(f"{name}: factor of safety of all blocks")
        factor = row["factor_of_safety"] = factor_of_safety(one, trials, name)
        if 0 < len(row["without"]) < free:
            tell(f"{name}: factor of safety without those {len(row['without'])}")
            factor = row["factor_without"] = factor_of_safety(
                one, trials, f"{name} without loose blocks", apart
            )
        tell(f"{name}: critical tilt")
        row |= {"critical_tilt": critical_tilt(one, trials, name), "picture": None}
        if factor:
            row["picture"] = f"failing-{quote(name, safe=' ')}.{picture_format}"
            path, weak = folder / row["picture"], weakened(one, SHOWN * factor)
            title = f"{name}: factor of safety {factor:.3g}\nwith strength / {weak.reduction:.3g}"
            tell(f"{name}: running it with strength / {weak.reduction:.3g}")
            row["first"] = trials.ask(
                row["picture"],
                partial(_show, weak, until, title, path, apart & (apart.sum() < free)),
            )
            tell(f"{name}: first to move: {told(row['first'])}")
        yield row


def seated(scene: Scene) -> Scene:
    """A scene that starts from its equilibrium, with the time step that follows: it is halved where
    joints close too far for it."""
    return replace(scene, run=replace(scene.run, step=None, fraction=None, settle=True))


def _loose(scene: Scene) -> list[dict]:
    return named(scene, Simulation(seated(scene)).unstable)


def _show(scene: Scene, until: float, title: str, path: Path, apart: np.ndarray) -> list[dict]:
    """Run and draw a scene that fails; returns the blocks that move first, but for those of a mask
    `apart` (n,)."""
    record, _ = to_failure(seated(scene), until)
    size = median_size(block for block in scene.blocks if not block.fixed)
    moved = [
        np.where(apart, 0.0, np.hypot(*record.displaced(i).T)) for i in range(len(record.times))
    ]
    away = next((frame for frame in moved if np.nanmax(frame) > FIRST * size), moved[-1])
    ahead = away > 0.5 * np.nanmax(away)
    Pictures(record, title, ahead, "moves first").final(path)
    return named(scene, ahead)


def factor_of_safety(
    scene: Scene, trials: Trials | None = None, name: str = "scene", loose: np.ndarray | None = None
) -> float | None:
    """Factor by which the strength of all joints is divided at limit equilibrium, to 0.6 %.

    loose (n,): blocks that need not be in equilibrium.

    Strength is the shear stress that a joint can bear at its own normal stress. Limit analysis
    bounds the factor from above, so the search begins just below its bound. None if the scene is in
    equilibrium with 1/64 of its strength, or has no equilibrium with 64 times of it.
    """
    trials = trials or Trials(scene)
    limit = trials.ask(f"{name}: limit analysis", partial(limit_factor, scene, loose))
    name = f"{name}: factor of safety"

    def at(log: float) -> Scene:
        return weakened(scene, float(np.exp(log)))

    if limit == 0.0:
        return None
    log = (
        _march(at, FACTOR, trials, name, loose)
        if limit is None
        else _search_below(at, float(np.log(limit)), FACTOR, trials, name, loose)
    )
    return None if log is None else float(np.exp(log))


def critical_tilt(scene: Scene, trials: Trials | None = None, name: str = "scene") -> float | None:
    """The turn of gravity (degrees, towards +x) at which a scene just holds; None beyond 60.

    Below zero where it does not hold as drawn.
    """

    def tilted(angle: float) -> Scene:
        gravity = rotation(np.radians(angle)) @ scene.gravity
        return replace(scene, gravity=tuple(gravity))

    return _march(tilted, TILT, trials or Trials(scene), f"{name}: critical tilt")


def weakened(scene: Scene, factor: float) -> Scene:
    """A scene with the strength of all joints divided by a factor, their elastic stiffness kept.

    `Scene.reduction` divides shear stress and stretches sliding, which divides strength and
    dilation but also divides shear stiffness by the factor squared. The laws inside are therefore
    stiffer in shear by the factor squared. Shear stiffness decides where normal forces depend on
    it, such as under in-situ stress or in a roof (docs/blocks.md).
    """
    laws = {name: law.strength_reduced(factor) for name, law in scene.laws.items()}
    return replace(scene, laws=laws, reduction=scene.reduction * factor)


def _march(
    at: Callable[[float], Scene], reach: tuple[float, float, float], trials: Trials, name: str,
    loose: np.ndarray | None = None,
) -> float | None:  # fmt: skip
    """Where the scenes `at` begin to fail, apart from loose blocks (n,); None if that is not
    between -most and most.

    reach: the first step, `most`, and to what it is found. It starts at 0, or below at the first
    multiple of a step that holds. From there on each equilibrium is looked for from the one before;
    where none is found the step is halved.
    """
    step, most, exact = reach
    with _Trial(at, trials, name, loose) as find:
        low, failed = 0.0, False
        while (moved := find(low)) is None:
            if low == -most:
                return None
            low, failed = max(low - step, -most), True
        while not failed or step > exact:
            high = min(low + step, most)
            further = find(high, low, moved)
            if further is None:
                failed, step = True, 0.5 * step
            elif high == most:
                return None
            else:
                low, moved = high, further
    return low + step


def _search_below(
    at: Callable[[float], Scene], bound: float, reach: tuple[float, float, float], trials: Trials,
    name: str, loose: np.ndarray | None = None,
) -> float | None:  # fmt: skip
    """Where the scenes `at` lose their equilibrium, known to be below a bound; None below -most."""
    _, most, exact = reach
    high, step = bound, BELOW_BOUND
    low = bound - step
    with _Trial(at, trials, name, loose) as find:
        while (moved := find(low)) is None:
            if low <= -most:
                return None
            high, step = low, STEP_GROWTH * step
            low -= step
        while high - low > exact:
            middle = 0.5 * (low + high)
            further = find(middle, low, moved)
            if further is None:
                high = middle
            else:
                low, moved = middle, further
    return 0.5 * (low + high)


class _Trial:
    """Finds the displacements of a trial, from those of another one, and shows progress."""

    def __init__(
        self, at: Callable[[float], Scene], trials: Trials, name: str, loose: np.ndarray | None
    ) -> None:
        self.at, self.trials, self.name, self.loose = at, trials, name, loose
        self.bar = tqdm(desc=name, unit="trial", delay=2.0, disable=None, leave=False)

    def __enter__(self) -> "_Trial":
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.close()

    def __call__(
        self, x: float, last: float | None = None, guess: np.ndarray | None = None
    ) -> np.ndarray | None:
        moved = self.trials.ask(
            f"{self.name} {x} from {last}",
            lambda: equilibrium_displacements(self.at(x), guess, self.loose),
        )
        self.bar.update()
        return None if moved is None else np.array(moved)


def alone(scene: Scene, name: str, seed: int | None = None) -> Scene:
    """One rock of a scene, cut with a seed (default its own), with nothing watched.

    Of the [[joint]] tables those of this rock stay; those that name its blocks only with its own
    seed, for with another there are other blocks.
    """
    data = read_tables(scene.text)
    rock = next(table for table in data["rock"] if table["name"] == name)
    own = {"seed": 0, **rock} | ({} if seed is None else {"seed": seed})
    same = own["seed"] == rock.get("seed", 0)
    blocks = {block["name"] for block in data.get("block", [])}
    outline = Polygon(np.add(rock["outline"], rock.get("at", [0, 0])))

    def belongs(joint: Tables) -> bool:
        if around := joint.get("around"):
            return bool(outline.contains(Point(around)))
        others = set(joint["between"]) - blocks
        return all(other.rpartition(" ")[0] == name for other in others) and (same or not others)

    digs = [dig for dig in data.get("excavate", [])
            if outline.intersection(Polygon(dig["corners"])).area > 0]  # fmt: skip
    kept = {"joint": [*filter(belongs, data.get("joint", []))], "excavate": digs}
    return build({**data, **kept, "rock": [own], "monitor": {}}, files=scene.files)
