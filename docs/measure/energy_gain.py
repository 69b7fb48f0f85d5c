"""The largest energy that steps and closed cycles with a mating length gain: a search.

    python docs/measure/energy_gain.py [--laws 60] [--first 0] [--generations 100] [--population 12]

In the limit of small steps no step gains energy by the work of the joint's own traction, nor does a
closed cycle. Differential evolution looks for the opposite on random laws: for the step, the step
forward and back (four times, the mean of a round), and the triangle of eight steps a side, that
gain most. Traction is integrated along each step by a Gauss rule. A gain is the energy stored at
the end, less the work and the energy stored at the start, over the largest energy stored on the way
(paths that store almost nothing do not count). Printed are the largest of all laws, by steps of at
most so many mating lengths; of the cycles also in steps of a tenth, and of the triangle the largest
error of the work if it is taken as the trapezoid of the tractions at the ends of steps. More
generations and a larger population (of candidates for each parameter) find larger gains.
"""

from typing import NamedTuple

import numpy as np
from common import print_table, run_command
from scipy.optimize import differential_evolution

import jointlaw as jl
from jointlaw.joints.state import JointState

STEP_SIZES = (1.0, 0.25, 0.1, 0.01)  # mating lengths
# smallest energy that a gain is compared with: near first touch, where almost no energy is stored,
# the search would find the error of the Gauss rule; joints at the closure range store about 1
MIN_ENERGY = 1e-3


class Path(NamedTuple):
    """A kind of path, which starts where two legs from the virgin state end."""

    free_corners: int
    steps_per_leg: int
    rounds: int  # 0: it does not return to its start


SINGLE_STEP = Path(free_corners=1, steps_per_leg=1, rounds=0)
FORWARD_AND_BACK = Path(free_corners=1, steps_per_leg=1, rounds=4)
TRIANGLE = Path(free_corners=2, steps_per_leg=8, rounds=1)


def largest_gains(laws=60, first=0, generations=100, population=12):
    """Search the random laws of so many seeds from the first on, and print the table."""
    effort = {"maxiter": generations, "popsize": population}
    rows = []
    for step_size in STEP_SIZES:
        gains = [gains_of_law(step_size, first + i, effort) for i in range(laws)]
        rows.append([f"{step_size:g}", *(f"{gain:.1e}" for gain in np.max(gains, axis=0))])
    print_table(["step (mating lengths)", "one step", "there and back", "in tenths", "triangle",
                 "in tenths", "trapezoid", "in tenths"], rows)  # fmt: skip


def gains_of_law(step_size, seed, effort):
    """The figures (7,) of one law: gains, and errors of the trapezoid.

    effort: options of the differential evolution.
    """
    law = random_law(np.random.default_rng(seed))
    step, round_trip, triangle = (
        search(law, step_size, path, seed, effort)
        for path in (SINGLE_STEP, FORWARD_AND_BACK, TRIANGLE)
    )
    step_gain = energy_gains(law, step, steps=1, panels=2048)[0, 0]
    round_gains = [
        energy_gains(law, round_trip, steps, panels=256)[0, 0] / FORWARD_AND_BACK.rounds
        for steps in (1, 10)
    ]
    by_gauss = []
    trapezoid_errors = []
    for refinement in (1, 10):
        steps = TRIANGLE.steps_per_leg * refinement
        gauss, trapezoid = energy_gains(law, triangle, steps, panels=64)[0]
        by_gauss.append(gauss)
        trapezoid_errors.append(abs(gauss - trapezoid))
    return [step_gain, *round_gains, *by_gauss, *trapezoid_errors]


def random_law(rng):
    """Any law whose dilation decays with slip, of few facets, in units of its closure range."""
    b = rng.uniform(-1.0, 2.0)
    degrades = rng.random() < 0.3
    return jl.JointLaw(
        orientation=jl.Orientation(rng.choice([1.0, rng.uniform(1.0, 5.0)]), b,
                                   rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6)),
        asperity=jl.Asperity(1.0, rng.uniform(0.3, 2.0), rng.choice([0.0, 0.5, 1.0]),
                             rng.choice([rng.uniform(0.0, 1.2), rng.uniform(1.2, 4.0)]),
                             rng.choice([np.inf, 10.0 ** rng.uniform(-2.5, 0.5)])),
        asperity_density=1.0, closure_range=1.0, mating_length=10.0 ** rng.uniform(-1.0, 1.0),
        slope_wear=10.0 ** rng.uniform(-2.0, 1.0) if degrades else np.inf,
        plane=[None, 0.7][rng.integers(2)], resolution=jl.Resolution(rng.integers(1, 3), 3, 2),
    )  # fmt: skip


def search(law, step_size, path, seed, effort):
    """Corners (1, legs, dim) of the path of the largest gain that differential evolution finds."""
    panels = 2 if path == TRIANGLE else 32
    parameters = 1 + (2 + path.free_corners) * law.dim

    def loss(x):
        corners = path_corners(law, x, step_size, path)
        return -energy_gains(law, corners, path.steps_per_leg, panels)[:, 0]

    result = differential_evolution(
        loss, [(-1.0, 1.0)] * parameters, polish=False, vectorized=True, updating="deferred",
        rng=np.random.default_rng(seed), **effort,
    )  # fmt: skip
    return path_corners(law, result.x[:, None], step_size, path)


def path_corners(law, x, step_size, path):
    """Corners (n, legs, dim) of candidates x (parameters, n): two, then the path.

    The first parameter is the logarithm of the size of the path.
    """
    positions = x[1:].T.reshape(x.shape[1], -1, law.dim)
    largest_leg = max(0.5 * path.steps_per_leg, 1.0) * step_size * law.mating_length
    length = largest_leg * 10.0 ** (x[0] - 1.0)
    shear = [1.0] * (law.dim - 1)
    start = positions[:, :2] * np.array([1.0, *(2.0 * law.mating_length * s for s in shear)])
    start[..., 0] += 0.5  # most are in touch
    directions = positions[:, 2:]
    directions = directions / np.maximum(1.0, np.linalg.norm(directions, axis=2)[..., None])
    unit = np.stack([np.minimum(length, 1.0), *(length * s for s in shear)], axis=-1)
    corners = start[:, -1:] + directions * unit[:, None]
    if not path.rounds:
        return np.concatenate([start, corners], axis=1)
    cycle = np.concatenate([corners, start[:, -1:]], axis=1)
    return np.concatenate([start, np.tile(cycle, (1, path.rounds, 1))], axis=1)


def energy_gains(law, corners, steps, panels):
    """Gains (n, 2) of n paths, by the Gauss rule and by the trapezoid.

    corners (n, legs, dim) in m; the first two legs lead to the start of the path, every other leg
    is taken in so many steps.
    """
    times, weights = integration_rules(panels)
    legs = np.diff(corners, axis=1, prepend=0.0)
    joints = law.joints(len(legs))
    points = law.joints(len(legs) * times.size)  # all times of a step, of all paths
    largest_energy = np.zeros(len(legs))
    for leg in (legs[:, 0], legs[:, 1]):
        joints.update(leg, tangent=False)
        largest_energy = np.maximum(largest_energy, joints.stored_energy)
    start_energy = joints.stored_energy
    work = np.zeros((len(legs), 2))
    for leg in np.moveaxis(legs[:, 2:], 1, 0):
        increment = leg / steps
        for _ in range(steps):
            values = np.repeat(joints.snapshot().values, times.size, axis=0)
            points.restore(JointState(law.fingerprint, values))
            repeated = np.repeat(increment, times.size, axis=0)
            partial = repeated * np.tile(times, len(legs))[:, None]
            F = points.update(partial, tangent=False)[0]
            power = np.sum(F * repeated, axis=1).reshape(len(legs), -1)
            work += power @ weights.T
            energy = points.stored_energy.reshape(len(legs), -1)
            largest_energy = np.maximum(largest_energy, energy.max(axis=1))
            joints.update(increment, tangent=False)
    gains = (joints.stored_energy - start_energy)[:, None] - work
    return gains / np.maximum(largest_energy, MIN_ENERGY)[:, None]


def integration_rules(panels):
    """Times (n,) in a step and weights (2, n): Gauss's two points in each panel, and trapezoid."""
    x, w = np.polynomial.legendre.leggauss(2)
    inside = (np.arange(panels)[:, None] + 0.5 * (x + 1.0)) / panels
    gauss = np.tile(0.5 * w / panels, panels)
    trapezoid = [0.5, *np.zeros(gauss.size), 0.5]
    return np.array([0.0, *inside.ravel(), 1.0]), np.array([[0.0, *gauss, 0.0], trapezoid])


if __name__ == "__main__":
    run_command(__doc__, largest_gains)
