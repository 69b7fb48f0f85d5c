"""How far a scene is from failing: its strength reduction factor and its critical tilt.

Both are found by bisection on the initial equilibrium, without running the blocks: a scene fails
where no displacements are found with which the joints carry the loads.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jointlaw.parameters.rock import RANGES
from jointlaw.support.pyplot import FORMATS

from ..dynamics.simulation import Simulation
from ..output.pictures import Pictures
from ..output.record import Record, far
from ..output.run import play
from ..scene import STICKS, Scene, Tables, build, read_tables, turn

EXACT = 0.01  # share of the tilt and of the factor to which they are found
STEP, STEEPEST, LEAST = 8.0, 60.0, 0.01  # degrees: first step, largest, closest told apart
LARGEST = 64.0  # factor
SHOWN = 1.02  # times the factor: what the friction of the failing run is divided by


def strength_reduction(
    scene: Scene, until: float, folder: Path, picture_format: str = FORMATS[0]
) -> Iterator[dict]:
    """Factor and critical tilt of every rock alone, or of a scene without rocks; and a picture.

    The picture is of a run with friction divided by 1.02 times the factor, which ends at `until`
    (s) or once a block has moved by the size of a block. Yields `rock`, `factor`, `critical_tilt`
    (degrees), each None where none is found, and the `picture` in `folder`, None without a factor.
    """
    for name in [rock.name for rock in scene.rocks] or ["scene"]:
        one = alone(scene, name) if scene.rocks else scene
        row = {"rock": name, "factor": strength_factor(one)}
        row |= {"critical_tilt": critical_tilt(one), "picture": None}
        if row["factor"]:
            row["picture"], factor = f"failing-{name}.{picture_format}", SHOWN * row["factor"]
            title = f"{scene.title}; {name}, friction divided by {factor:.3g}"
            sim = Simulation(replace(reduced(one, factor), title=title))
            record = Record(sim)
            play(sim, record, until, far)
            Pictures(record).final(folder / row["picture"])
        yield row


def critical_tilt(scene: Scene) -> float | None:
    """The turn of gravity (degrees, towards +x) at which a scene just holds; None beyond 60.

    Below zero where it does not hold as drawn.
    """

    return _bisect(
        lambda tilt: replace(scene, gravity=tuple(turn(np.radians(tilt)) @ scene.gravity)),
        STEP, STEEPEST, lambda tilt: max(EXACT * abs(tilt), LEAST),
    )  # fmt: skip


def strength_factor(scene: Scene) -> float | None:
    """What all friction is to be divided by for a scene to just hold.

    None if it holds with 1/64 of it, or fails with 64 times of it. No friction is made larger than
    a scene may have, 5.
    """

    log = _bisect(
        lambda log: reduced(scene, float(np.exp(log))), np.log(2), np.log(LARGEST), lambda _: EXACT
    )
    return None if log is None else float(np.exp(log))


def reduced(scene: Scene, factor: float) -> Scene:
    """A scene with the friction of asperities and of plain Coulomb divided by a factor."""
    highest, laws = RANGES["mu"][1], {}  # that a scene may have; what fails with it has no factor
    for name, law in scene.laws.items():
        given = {key: getattr(law.asperity, key) for key in ("mu", "mu_residual")}
        weak = {key: min(mu / factor, highest) for key, mu in given.items()
                if mu is not None and mu < STICKS}  # fmt: skip
        laws[name] = replace(law, asperity=replace(law.asperity, **weak))
    return replace(scene, laws=laws)


def _bisect(
    at: Callable[[float], Scene], step: float, most: float, exact: Callable[[float], float]
) -> float | None:
    """Where the scenes `at` begin to fail: looked for from 0 up if that one holds, else down."""
    with tqdm(desc="equilibria", delay=2.0, disable=None, leave=False) as bar:

        def holds(x: float) -> bool:
            bar.update()
            scene = at(x)
            return Simulation(replace(scene, run=replace(scene.run, seat=True))).balanced

        sense = 1.0 if holds(0.0) else -1.0
        low, high = 0.0, sense * step
        while holds(high) == (sense > 0):
            if abs(high) == most:
                return None
            low, high = high, sense * min(abs(high) + step, most)
        while abs(high - low) > exact(high):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if holds(middle) == (sense > 0) else (low, middle)
    return 0.5 * (low + high)


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
    low, high = np.quantile(np.add(rock["outline"], rock.get("at", [0, 0])), [0, 1], axis=0)

    def belongs(joint: Tables) -> bool:
        if around := joint.get("around"):
            return bool((low < around).all() and (around < high).all())
        others = set(joint["between"]) - blocks
        return all(other.rpartition(" ")[0] == name for other in others) and (same or not others)

    joints = [joint for joint in data.get("joint", []) if belongs(joint)]
    return build({**data, "rock": [own], "watch": {}, "joint": joints}, files=scene.files)
