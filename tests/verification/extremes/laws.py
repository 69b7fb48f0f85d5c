"""Laws with parameters at the bounds of their ranges: one at a time, in pairs, at random.

The tests record their figures as properties of their report (`pytest --junitxml`), from which
docs/measure/test_figures.py makes tables; docs/validation.md has the figures. With JOINTLAW_FULL=1
in the environment they run at the full length of these tables.
"""

import os
from itertools import combinations

import numpy as np

import jointlaw as jl
from jointlaw.kernels.engine import NativeEngine, engine

FULL = os.environ.get("JOINTLAW_FULL") == "1"
SCALE = 2e-6  # m: closure range and asperity height of the reference law
REFERENCE = {
    "a": 3.0, "b": 0.5, "c": 0.1, "K": 2e8, "lam": 1.2, "eta": 0.5, "mu": 0.4, "density": 1e10,
    "heights": None, "range": SCALE, "mating_length": np.inf, "resolution": jl.Resolution(2, 4, 3),
    "yields at": np.inf, "wears over": np.inf,
}  # fmt: skip

_ROUGH = (3.82, 1.15e-6, 2e-6)  # alpha, beta, overlap: Westerly granite
HEIGHTS = {
    "printed, population": (*_ROUGH, "population"),
    "printed, individual": (*_ROUGH, "individual"),
    "1e6 times as wide": (3.82, 1.15, 2e-6, "individual"),
    "1e-6 times as wide": (3.82, 1.15e-12, 2e-12, "individual"),
    "alpha = -0.99": (-0.99, 1.15e-6, 2e-6, "individual"),
    "alpha = -0.99, overlap 0": (-0.99, 1.15e-6, 0.0, "individual"),
    "alpha = -0.5, overlap 0": (-0.5, 1.15e-6, 0.0, "population"),
    "overlap 0": (3.82, 1.15e-6, 0.0, "individual"),
    "overlap in the lower tail": (3.82, 1.15e-6, 1e-9, "individual"),
    "overlap in the upper tail": (3.82, 1.15e-6, 1e-4, "population"),
}
EXTREMES = {
    "a": [1.0, 1.0 + 1e-12, 1e3, 1e8],
    "b, c": [(-1.0, 0.5), (-1.0, -0.5), (2.0, 0.0), (0.0, 1 / 3)],
    "mu": [0.0, 1e-8, 10.0, 1e6],
    "lam": [0.1, 10.0],
    "eta": [0.0, 1e-6, 1.0, 2.0],
    "K": [1e-20, 1e20],
    "density": [1e-20, 1e20],
    "range": [SCALE * 1e-6, SCALE * 1e6],
    "heights": list(HEIGHTS),
    "mating_length": [SCALE * 0.1, SCALE * 3.0],
    "yields at": [SCALE * 1e-12, SCALE * 1e-3, SCALE * 0.1, SCALE * 1e3],
    "wears over": [1e2, 1e5],  # J/m2; some 1e4 are stored
}


def build(**changes):
    """The reference law with changed parameters; "b, c" are a pair, heights a name or values."""
    p = REFERENCE | changes
    b, c = p.get("b, c", (p["b"], p["c"]))
    heights = HEIGHTS.get(p["heights"], p["heights"])
    length = p["mating_length"]
    if p["wears over"] < np.inf:  # asperity degradation needs a mating length
        length = min(length, 3.0 * p["range"])
    return jl.JointLaw(
        orientation=jl.Orientation(p["a"], b, c),
        asperity=jl.Asperity(
            K=p["K"], lam=p["lam"], eta=p["eta"], mu=p["mu"], yield_interference=p["yields at"]
        ),
        heights=heights and jl.GammaHeights(*heights),
        asperity_density=p["density"],
        closure_range=p["range"],
        mating_length=max(length, 0.1 * p["range"]) if p["range"] and length < np.inf else length,
        slope_wear=p["wears over"],
        slope_residual=0.3,
        resolution=p["resolution"],
    )


# the numpy kernel is 20 times slower for small batches: long runs are shorter with it
COMPILED = isinstance(engine(build().tables), NativeEngine)


def name(changes):
    """The changed parameters of a law, as the name of a test."""
    return ", ".join(f"{key} = {value}" for key, value in changes.items()) or "reference"


def alone():
    """Changes for the reference law and for each extreme value alone."""
    return [{}, *({key: value} for key, values in EXTREMES.items() for value in values)]


def pairs():
    """Changes for every two extreme values together."""
    return [
        {k1: v1, k2: v2}
        for k1, k2 in combinations(EXTREMES, 2)
        for v1 in EXTREMES[k1]
        for v2 in EXTREMES[k2]
    ]


def random_changes(rng):
    """Random admissible parameters over many decades, a third of them at an extreme value.

    Returns the changes and a length (m) for the size of steps.
    """

    def pick(key, value):
        chance = rng.random()
        return EXTREMES[key][rng.integers(len(EXTREMES[key]))] if chance < 0.3 else value

    b = rng.uniform(-1.0, 2.0)
    unit = 10.0 ** rng.uniform(-8.0, 8.0)  # of length, times the reference length
    changes = {
        "a": pick("a", 1.0 + 10.0 ** rng.uniform(-8.0, 4.0)),
        "b, c": pick("b, c", (b, rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6))),
        "mu": pick("mu", 10.0 ** rng.uniform(-3.0, 1.0)),
        "lam": pick("lam", 10.0 ** rng.uniform(-1.0, 1.0)),
        "eta": pick("eta", rng.uniform(0.0, 2.0)),
        "K": 10.0 ** rng.uniform(-20.0, 20.0),
        "density": 10.0 ** rng.uniform(-20.0, 20.0),
        "range": SCALE * unit * 10.0 ** rng.choice([0.0, 0.0, rng.uniform(-6.0, 6.0)]),
        "resolution": jl.Resolution(*(int(rng.integers(*r)) for r in ((1, 4), (3, 6), (1, 5)))),
        "mating_length": SCALE * unit * 10.0 ** rng.uniform(-3, 1)
        if rng.random() < 0.3
        else np.inf,
    }
    if rng.random() < 0.5:
        alpha = float(rng.choice([-0.9, -0.5, 0.0, 3.82, 20.0, rng.uniform(-0.9, 30.0)]))
        beta = SCALE * unit * 10.0 ** rng.choice([0.0, rng.uniform(-1.0, 3.0)]) / (alpha + 1.0)
        overlap = float(rng.choice([0.0, beta, 10.0 * beta, beta * 10.0 ** rng.uniform(-6, 2)]))
        formation = "population" if rng.random() < 0.3 else "individual"
        changes["heights"] = (alpha, float(beta), overlap, formation)
    for key, low, high in (("yields at", -12.0, 3.0), ("wears over", -6.0, 3.0)):
        if rng.random() < 0.3:
            changes[key] = SCALE * unit * 10.0 ** rng.uniform(low, high)
    return changes, SCALE * unit
