"""Factor of safety and critical tilt of a scene, and how it fails.

Both are searched on the initial equilibrium, without running the blocks: a scene fails where no
displacements are found with which the joints carry the loads. A search starts at a parameter for
which the scene is stable, and takes every equilibrium as the initial guess of the next one, with
shorter steps where none is found.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from shapely import MultiPoint, Point, Polygon, unary_union
from tqdm import tqdm

from jointlaw.support.files import write_json

from ..dynamics.equilibrium import drawn_blocks, equilibrium_displacements, stick_displacements
from ..dynamics.simulation import Simulation
from ..output.folder import TRIALS
from ..output.pictures import Pictures
from ..output.record import format_blocks, list_blocks
from ..output.run import run_to_failure
from ..scene import Scene, Tables, build, median_size, read_tables, rotation
from ..scene.blocks import LENGTH_TOLERANCE
from ..scene.point_files import fill_in_points
from .limit_analysis import limit_factor

TRIALS_VERSION = 4
STRENGTHENED = 2.0  # times the strength, to find blocks that strength does not stabilise
INITIATION_DISPLACEMENT = 0.01  # of the median size of a block: initiating blocks are found then
INITIATING_FRACTION = 0.5  # of the largest displacement: initiating blocks have moved more
SHOWN_REDUCTION = 1.02  # times the factor of safety: strength reduction of the failing run


class SearchRange(NamedTuple):
    """Range of a search: its first step, the largest absolute value, and the tolerance."""

    step: float
    largest: float
    tolerance: float


TILT = SearchRange(8.0, 60.0, 0.05)  # degrees
LOG_FACTOR = SearchRange(np.log(2.0), np.log(64.0), 0.006)
STEP_BELOW_BOUND = 0.06  # first step of a search below an upper bound of the logarithm
STEP_GROWTH = 1.5  # of its further steps


class Trials:
    """Finished trials of a scene by name, kept in the file trials.json of a folder, if given.

    Raises ValueError for a folder with trials of another scene.
    """

    def __init__(self, scene: Any, folder: Path | None = None) -> None:
        """Read the finished trials of a scene with a `text` and `files`."""
        self.path = folder and folder / TRIALS
        self.header = {
            "version": TRIALS_VERSION,
            "scene": scene.text,
            "files": dict(scene.files),
        }
        self.results: dict[str, Any] = {}
        if self.path and self.path.exists():
            header = json.loads(self.path.read_text(encoding="utf-8"))
            self.results = header.pop("trials")
            if header != self.header:
                raise ValueError(
                    f"{self.path} holds trials of another scene: give another --out, or --force to "
                    "replace them"
                )

    def result(self, name: str, compute: Callable[[], Any]) -> Any:
        """Return the result of a trial, computed unless it is finished already.

        Arrays that come from the file are lists.
        """
        if name not in self.results:
            self.results[name] = compute()
            if self.path:
                write_json(self.path, {**self.header, "trials": self.results})
        return self.results[name]


def strength_reduction(
    scene: Scene, until: float, folder: Path, picture_format: str, tell: Callable[[str], None]
) -> Iterator[dict]:
    """Compute factor of safety and critical tilt of every rock alone, or of a scene without rocks.

    until: model time (s) at which the run to failure ends, if no block has moved by the size of a
    block before. folder: for pictures and finished trials; called again with it, the search
    continues. tell: called with each line of progress.

    Yields rows. `rock`: its name. `unstable`: names and centroids (m) of blocks without static
    equilibrium. `excluded`: the same blocks, or if all blocks are unstable, only blocks that are
    unstable with twice the strength too. `factor_of_safety`: of all blocks.
    `limit_analysis`: its upper bound, 0.0 if the scene has no equilibrium with 64 times its
    strength either, None if it has no bound. `factor_without_excluded`, `limit_without_excluded`:
    of all other blocks, while the excluded ones move away, if some are excluded. `critical_tilt`
    (degrees). A number is None where none is found. `picture`: name of
    the picture of the run to failure, None without a factor; the strength of that run is divided by
    1.02 times the factor. `initiating_blocks`: blocks that move first in it, names and centroids
    (m).
    """
    trials = Trials(scene, folder)
    for name in [rock.name for rock in scene.rocks] or ["scene"]:
        rock = (alone(scene, name) if scene.rocks else scene).excavated
        yield _reduce_rock(rock, name, trials, until, folder, picture_format, tell)


def _reduce_rock(
    scene: Scene, name: str, trials: Trials, until: float, folder: Path, picture_format: str,
    tell: Callable[[str], None],
) -> dict:  # fmt: skip
    """Return the row of `strength_reduction` of a rock alone, without excavation stages."""
    tell(f"{name}: searching unstable blocks")
    unstable = trials.result(f"{name}: unstable", partial(_unstable_blocks, scene))
    count = sum(not b.fixed and i not in scene.removed for i, b in enumerate(scene.blocks))
    blocks = f": {format_blocks(unstable)}" if unstable else ""
    tell(f"{name}: {len(unstable)} of {count} blocks are unstable{blocks}")
    excluded = unstable
    if len(unstable) == count:
        stronger = weakened(scene, 1 / STRENGTHENED)
        excluded = trials.result(
            f"{name}: unstable at strength * {STRENGTHENED:g}", partial(_unstable_blocks, stronger)
        )
        blocks = f": {format_blocks(excluded)}" if excluded else ""
        tell(f"{name}: {len(excluded)} blocks stay unstable at strength x {STRENGTHENED:g}{blocks}")
    row: dict = {"rock": name, "unstable": unstable, "excluded": excluded}
    names = [block["block"] for block in excluded]
    is_excluded = np.isin([block.name for block in scene.blocks], names)
    tell(f"{name}: factor of safety of all blocks")
    factor = row["factor_of_safety"] = factor_of_safety(scene, trials, name)
    row["limit_analysis"] = limit_bound(scene, trials, name)
    if 0 < len(excluded) < count:
        tell(f"{name}: factor of safety without {len(excluded)} unstable blocks")
        factor = row["factor_without_excluded"] = factor_of_safety(
            scene, trials, f"{name} without unstable blocks", is_excluded
        )
        row["limit_without_excluded"] = limit_bound(
            scene, trials, f"{name} without unstable blocks", is_excluded
        )
    else:
        is_excluded[:] = False
    tell(f"{name}: critical tilt")
    row["critical_tilt"] = critical_tilt(scene, trials, name)
    row["picture"] = None
    if factor:
        row["picture"] = f"failing-{quote(name, safe=' ')}.{picture_format}"
        weak = weakened(scene, SHOWN_REDUCTION * factor)
        title = f"{name}: factor of safety {factor:.3g}\nwith strength / {weak.reduction:.3g}"
        tell(f"{name}: running it with strength / {weak.reduction:.3g}")
        show = partial(_show_failure, weak, until, title, folder / row["picture"], is_excluded)
        initiating = row["initiating_blocks"] = trials.result(row["picture"], show)
        tell(f"{name}: initiating blocks: {format_blocks(initiating)}")
    return row


def settled(scene: Scene) -> Scene:
    """Return a scene that starts in static equilibrium, with the default time step, which is halved
    where joints stiffen."""
    return replace(scene, run=replace(scene.run, step=None, fraction=None, settle=True))


def _unstable_blocks(scene: Scene) -> list[dict]:
    """List the blocks without static equilibrium."""
    return list_blocks(scene, Simulation(settled(scene)).unstable)


def _show_failure(
    scene: Scene, until: float, title: str, path: Path, is_excluded: np.ndarray
) -> list[dict]:
    """Run and draw a scene that fails; returns the initiating blocks, none of them excluded."""
    record, _ = run_to_failure(settled(scene), until)
    size = median_size(block for block in scene.blocks if not block.fixed)
    distances = [
        np.where(is_excluded, 0.0, np.hypot(*record.displacements(i).T))
        for i in range(len(record.times))
    ]
    initiation = next(
        (frame for frame in distances if np.nanmax(frame) > INITIATION_DISPLACEMENT * size),
        distances[-1],
    )
    is_initiating = initiation > INITIATING_FRACTION * np.nanmax(initiation)
    Pictures(record, title, is_initiating, "initiating block").final(path)
    return list_blocks(scene, is_initiating)


def factor_of_safety(
    scene: Scene,
    trials: Trials | None = None,
    name: str = "scene",
    is_excluded: np.ndarray | None = None,
) -> float | None:
    """Compute the factor by which the strength of all joints is divided at limit equilibrium.

    Strength is the shear stress that a joint can carry at its own normal stress. Limit analysis
    bounds the factor from above, so the search begins just below its bound; the tolerance is 0.6 %.
    trials: finished trials, under `name`. is_excluded (n,): blocks that need no equilibrium.

    Returns None if the scene is in equilibrium with 1/64 of its strength, or has no equilibrium
    with 64 times of it.
    """
    trials = trials or Trials(scene)
    bound = limit_bound(scene, trials, name, is_excluded)
    if bound == 0.0:
        return None

    find_blocks = cache(partial(drawn_blocks, scene))

    @cache
    def sticking() -> np.ndarray:
        """Guess of trials that have no other: joints that cannot slide have the same stiffness
        with every strength."""
        return stick_displacements(scene, is_excluded, find_blocks())

    def solve(log_factor: float, guess: np.ndarray | None) -> np.ndarray | None:
        reduced = weakened(scene, float(np.exp(log_factor)))
        start = sticking() if guess is None else guess
        return equilibrium_displacements(reduced, start, is_excluded, find_blocks())

    with LimitSearch(solve, trials, f"{name}: factor of safety") as search:
        if bound is None:
            log_factor = search.upwards(LOG_FACTOR)
        else:
            log_factor = search.below(float(np.log(bound)), LOG_FACTOR)
    return None if log_factor is None else float(np.exp(log_factor))


def limit_bound(
    scene: Scene, trials: Trials, name: str, is_excluded: np.ndarray | None = None
) -> float | None:
    """Upper bound of the factor of safety by limit analysis (`limit_factor`), computed once.

    trials: finished trials, under `name`. is_excluded (n,): blocks that need no equilibrium.
    """
    return trials.result(f"{name}: limit analysis", partial(limit_factor, scene, is_excluded))


def critical_tilt(scene: Scene, trials: Trials | None = None, name: str = "scene") -> float | None:
    """Compute the rotation of gravity (degrees, towards +x) at limit equilibrium.

    It is negative if the scene fails as drawn. trials: finished trials, under `name`. Returns None
    for a tilt beyond 60 degrees.
    """

    def solve(angle: float, guess: np.ndarray | None) -> np.ndarray | None:
        gravity = rotation(np.radians(angle)) @ scene.gravity
        return equilibrium_displacements(replace(scene, gravity=tuple(gravity)), guess)

    with LimitSearch(solve, trials or Trials(scene), f"{name}: critical tilt") as search:
        return search.upwards(TILT)


def weakened(scene: Scene, factor: float) -> Scene:
    """A scene with the strength of all joints divided by a factor, their elastic stiffness kept.

    `Scene.reduction` divides shear stress and stretches sliding, which divides strength and
    dilation but also divides shear stiffness by the factor squared. The laws inside are therefore
    stiffer in shear by the factor squared. Shear stiffness decides where normal forces depend on
    it, such as under in-situ stress or in a roof (docs/blocks.md).
    """
    laws = {name: law.strength_reduced(factor) for name, law in scene.laws.items()}
    return replace(scene, laws=laws, reduction=scene.reduction * factor)


class LimitSearch:
    """Search for the parameter x beyond which a scene has no equilibrium.

    solve: function of x and of the displacements of the equilibrium at an earlier x, from which its
    search starts (None: from the drawing); returns the displacements of the equilibrium at x, None
    if there is none. trials: finished trials, under `name`. As a context manager it shows progress.
    """

    def __init__(
        self,
        solve: Callable[[float, np.ndarray | None], np.ndarray | None],
        trials: Trials,
        name: str,
    ) -> None:
        self.solve = solve
        self.trials = trials
        self.name = name
        self.bar = tqdm(desc=name, unit="trial", delay=2.0, disable=None, leave=False)

    def __enter__(self) -> "LimitSearch":
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.close()

    def upwards(self, within: SearchRange) -> float | None:
        """Search from x = 0 upwards, or if the scene fails there, from the first multiple of a
        negative step at which it is stable.

        The step is halved where no equilibrium is found. Returns None if x is not between
        -`within.largest` and `within.largest`.
        """
        step = within.step
        low = 0.0
        has_failed = False
        while (displacements := self._equilibrium(low)) is None:
            if low == -within.largest:
                return None
            low = max(low - step, -within.largest)
            has_failed = True
        while not has_failed or step > within.tolerance:
            high = min(low + step, within.largest)
            further = self._equilibrium(high, low, displacements)
            if further is None:
                has_failed = True
                step *= 0.5
            elif high == within.largest:
                return None
            else:
                low, displacements = high, further
        return low + step

    def below(self, bound: float, within: SearchRange) -> float | None:
        """Search below an upper bound of x, with growing steps until an equilibrium is found, then
        by bisection. Returns None if x is below -`within.largest`."""
        step = STEP_BELOW_BOUND
        high = bound
        low = bound - step
        while (displacements := self._equilibrium(low)) is None:
            if low <= -within.largest:
                return None
            high = low
            step *= STEP_GROWTH
            low -= step
        while high - low > within.tolerance:
            middle = 0.5 * (low + high)
            further = self._equilibrium(middle, low, displacements)
            if further is None:
                high = middle
            else:
                low, displacements = middle, further
        return 0.5 * (low + high)

    def _equilibrium(
        self, x: float, previous: float | None = None, guess: np.ndarray | None = None
    ) -> np.ndarray | None:
        """Return the displacements of the equilibrium at x, None if none is found.

        guess: displacements of the equilibrium at `previous`.
        """
        displacements = self.trials.result(
            f"{self.name} {x} from {previous}",
            lambda: self.solve(x, guess),
        )
        self.bar.update()
        return None if displacements is None else np.array(displacements)


def alone(scene: Scene, name: str, seed: int | None = None) -> Scene:
    """Build the scene of one of its rocks alone, without monitors.

    seed: another seed than the rock's own. `[[joint]]` tables of this rock are kept; tables
    that name its blocks are kept only with its own seed, because another seed gives other blocks.
    """
    data = fill_in_points(read_tables(scene.text), scene.files, scene.title)
    rock = next(table for table in data["rock"] if table["name"] == name)
    table = {"seed": 0, **rock} | ({} if seed is None else {"seed": seed})
    has_own_seed = table["seed"] == rock.get("seed", 0)
    other_blocks = {block["name"] for block in data.get("block", [])}
    outline = Polygon(np.add(rock["outline"], rock.get("at", [0, 0])))

    def belongs(joint: Tables) -> bool:
        """Whether a `[[joint]]` table is one of this rock."""
        if around := joint.get("around"):
            return bool(outline.contains(Point(around)))
        rock_blocks = set(joint["between"]) - other_blocks
        is_own = all(block.rpartition(" ")[0] == name for block in rock_blocks)
        return is_own and (has_own_seed or not rock_blocks)

    joints = [*filter(belongs, data.get("joint", []))]
    stages = [
        stage
        for stage in data.get("excavate", [])
        if outline.intersection(Polygon(stage["corners"])).area > 0
    ]
    other_shapes = [Polygon(block.corners) for block in scene.blocks if block.name in other_blocks]
    region = unary_union([outline, *other_shapes]).buffer(LENGTH_TOLERANCE * outline.length)

    def is_inside(support: Tables) -> bool:
        """Whether both ends of a bolt, or of a line of pressure, lie in this rock or in blocks that
        are defined one by one."""
        return region.covers(MultiPoint([support["from"], support["to"]]))

    parts = {"joint": joints, "excavate": stages, "rock": [table], "monitor": {}}
    for key in ("bolt", "pressure"):
        parts[key] = [*filter(is_inside, data.get(key, []))]
    return build({**data, **parts}, files=scene.files)
