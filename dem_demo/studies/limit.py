"""How far a scene is from failing: its critical tilt and its strength reduction factor.

Both are found by bisection on the initial equilibrium, without running the blocks: a scene fails
where no displacements are found with which the joints carry the loads.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from tqdm import tqdm

from jointlaw.parameters.rock import RANGES

from ..dynamics.simulation import Simulation
from ..scene import GRAVITY, Files, build, law_table, turn

Tables = dict[str, Any]
EXACT = 0.01  # share of the tilt and of the factor to which they are found
STEP, STEEPEST, LEAST = 8.0, 60.0, 0.01  # degrees: first step, largest, closest told apart
LARGEST = 64.0  # factor


def critical_tilt(data: Tables, files: Files) -> float | None:
    """The turn of gravity (degrees, towards +x) at which a scene just holds; None beyond 60.

    Below zero where it does not hold as drawn.
    """
    return _bisect(
        lambda tilt: tilted(data, tilt), files, STEP, STEEPEST, lambda t: max(EXACT * abs(t), LEAST)
    )


def strength_factor(data: Tables, files: Files) -> float | None:
    """What all friction is to be divided by for a scene to just hold.

    None if it holds with 1/64 of it, or fails with 64 times of it. No friction is made larger than
    a scene may have, 5.
    """
    log = _bisect(
        lambda log: reduced(data, np.exp(log), files),
        files,
        np.log(2),
        np.log(LARGEST),
        lambda _: EXACT,
    )
    return None if log is None else float(np.exp(log))


def tilted(data: Tables, tilt: float) -> Tables:
    """A scene's tables with gravity turned by a tilt (degrees) towards +x."""
    gravity = turn(np.radians(tilt)) @ data.get("gravity", GRAVITY)
    return {**data, "gravity": gravity.tolist()}


def reduced(data: Tables, factor: float, files: Files) -> Tables:
    """A scene's tables with the friction of asperities and of plain Coulomb divided by a factor."""
    laws = {name: dict(law_table(law, f"laws.{name}", files)) for name, law in data["laws"].items()}
    for law in laws.values():
        if "asperity" in law:
            law["asperity"] = _divided(law["asperity"], factor)
    return {**data, "laws": {name: _divided(law, factor) for name, law in laws.items()}}


def _divided(table: Tables, factor: float) -> Tables:
    highest = RANGES["mu"][1]  # that a scene may have; what fails with it has no factor
    return {
        key: min(value / factor, highest)
        if key in ("mu", "mu_residual", "friction") and math.isfinite(value)
        else value
        for key, value in table.items()
    }


def _bisect(
    at: Callable[[float], Tables],
    files: Files,
    step: float,
    most: float,
    exact: Callable[[float], float],
) -> float | None:
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
