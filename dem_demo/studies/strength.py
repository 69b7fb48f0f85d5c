"""How far a scene is from failing: its strength reduction factor and its critical tilt.

Both are found by bisection on the initial equilibrium, without running the blocks: a scene fails
where no displacements are found with which the joints carry the loads.
"""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jointlaw.parameters.rock import RANGES
from jointlaw.support.pyplot import FORMATS

from ..dynamics.simulation import Simulation
from ..output.pictures import Pictures
from ..output.record import Record, far
from ..output.run import play
from ..scene import GRAVITY, Files, Scene, Tables, build, law_table, read_tables, turn

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
    data, files = read_tables(scene.text), scene.files
    for table in data["rock"] or [None]:
        name, one = "scene", data
        if table is not None:
            name, one = table["name"], alone(data, table["name"])
        row = {"rock": name, "factor": strength_factor(one, files)}
        row |= {"critical_tilt": critical_tilt(one, files), "picture": None}
        if row["factor"]:
            row["picture"], factor = f"failing-{name}.{picture_format}", SHOWN * row["factor"]
            title = f"{scene.title}; {name}, friction divided by {factor:.3g}"
            sim = Simulation(build({**reduced(one, factor, files), "title": title}, files=files))
            record = Record(sim)
            play(sim, record, until, far)
            Pictures(record).final(folder / row["picture"])
        yield row


def critical_tilt(data: Tables, files: Files) -> float | None:
    """The turn of gravity (degrees, towards +x) at which a scene just holds; None beyond 60.

    Below zero where it does not hold as drawn.
    """

    def tilted(tilt: float) -> Tables:
        gravity = turn(np.radians(tilt)) @ data.get("gravity", GRAVITY)
        return {**data, "gravity": gravity.tolist()}

    return _bisect(tilted, files, STEP, STEEPEST, lambda t: max(EXACT * abs(t), LEAST))


def strength_factor(data: Tables, files: Files) -> float | None:
    """What all friction is to be divided by for a scene to just hold.

    None if it holds with 1/64 of it, or fails with 64 times of it. No friction is made larger than
    a scene may have, 5.
    """

    def weakened(log: float) -> Tables:
        return reduced(data, np.exp(log), files)

    log = _bisect(weakened, files, np.log(2), np.log(LARGEST), lambda _: EXACT)
    return None if log is None else float(np.exp(log))


def reduced(data: Tables, factor: float, files: Files) -> Tables:
    """A scene's tables with the friction of asperities and of plain Coulomb divided by a factor."""
    highest = RANGES["mu"][1]  # that a scene may have; what fails with it has no factor

    def divided(table: Tables) -> Tables:
        given = {key: table[key] for key in ("mu", "mu_residual", "friction") if key in table}
        finite = {key: value for key, value in given.items() if math.isfinite(value)}
        return table | {key: min(value / factor, highest) for key, value in finite.items()}

    laws = {}
    for name, table in data["laws"].items():
        law = law_table(table, files)
        laws[name] = divided(law) | {k: divided(law[k]) for k in ("asperity",) if k in law}
    return {**data, "laws": laws}


def _bisect(
    at: Callable[[float], Tables], files: Files, step: float, most: float,
    exact: Callable[[float], float],
) -> float | None:  # fmt: skip
    """Where the scenes `at` begin to fail: looked for from 0 up if that one holds, else down."""
    with tqdm(desc="equilibria", delay=2.0, disable=None, leave=False) as bar:

        def holds(x: float) -> bool:
            bar.update()
            data = at(x)
            scene = build({**data, "run": {**data["run"], "seat": True}}, files=files)
            return Simulation(scene).balanced

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


def alone(data: Tables, name: str, seed: int | None = None) -> Tables:
    """A scene's tables with one of its rocks, cut with a seed (default its own), nothing watched.

    Of the [[joint]] tables those of this rock stay; those that name its blocks only with its own
    seed, for with another there are other blocks.
    """
    rock = next(table for table in data["rock"] if table["name"] == name)
    same = seed is None or seed == rock.get("seed", 0)
    blocks = {block["name"] for block in data.get("block", [])}
    low, high = np.quantile(np.add(rock["outline"], rock.get("at", [0, 0])), [0, 1], axis=0)

    def belongs(joint: Tables) -> bool:
        if around := joint.get("around"):
            return bool((low < around).all() and (around < high).all())
        others = set(joint["between"]) - blocks
        return all(other.rpartition(" ")[0] == name for other in others) and (same or not others)

    joints = [joint for joint in data.get("joint", []) if belongs(joint)]
    rock = rock if same else {**rock, "seed": seed}
    return {**data, "rock": [rock], "watch": {}, "joint": joints}
