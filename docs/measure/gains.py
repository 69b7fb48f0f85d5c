"""The largest energy that steps and closed cycles with a mating length gain: searched for.

    python docs/measure/gains.py [--laws 60] [--first 0]

No step gains by the work of the joint's own traction in the limit of small steps, nor does a closed
cycle. Differential evolution looks for the opposite on random laws: for the step, the step there
and back (four times, the mean of a round), and the triangle of eight steps a side, that gain most.
Traction is integrated along each step by a Gauss rule. A
gain is what is stored at the end, less the work and what was stored at the beginning, as a share of
the largest energy stored on the way. Printed are the largest of all laws, by steps of at most so
many mating lengths; of the cycles also in steps of a tenth, and of the triangle the largest error
of the work if it is taken as the trapezoid of the tractions at the ends of steps.
"""

import numpy as np
from scipy.optimize import differential_evolution
from tables import asked, table

import jointlaw as jl
from jointlaw.joints.state import JointState

HEAD = ["step (mating lengths)", "one step", "there and back", "in tenths", "triangle", "in tenths",
        "trapezoid", "in tenths"]  # fmt: skip
SIDE, ROUNDS = 8, 4
# corners that are free beside the first two, steps from one to the next, rounds
STEP, BACK, TRIANGLE = (1, 1, 0), (1, 1, ROUNDS), (2, SIDE, 1)


def rules(panels):
    """Times (n,) in a step and weights (2, n): of Gauss's two points in each of so many parts, and
    of the trapezoid."""
    x, w = np.polynomial.legendre.leggauss(2)
    inside = (np.arange(panels)[:, None] + 0.5 * (x + 1.0)) / panels
    gauss = np.tile(0.5 * w / panels, panels)
    trapezoid = [0.5, *np.zeros(gauss.size), 0.5]
    return np.array([0.0, *inside.ravel(), 1.0]), np.array([[0.0, *gauss, 0.0], trapezoid])


def random_law(rng):
    """Any law whose slopes fade, of few facets, in units of its closure range."""
    b, wears = rng.uniform(-1.0, 2.0), rng.random() < 0.3
    return jl.JointLaw(
        orientation=jl.Orientation(rng.choice([1.0, rng.uniform(1.0, 5.0)]), b,
                                   rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6)),
        asperity=jl.Asperity(1.0, rng.uniform(0.3, 2.0), rng.choice([0.0, 0.5, 1.0]),
                             rng.choice([rng.uniform(0.0, 1.2), rng.uniform(1.2, 4.0)]),
                             rng.choice([np.inf, 10.0 ** rng.uniform(-2.5, 0.5)])),
        asperity_density=1.0, closure_range=1.0, mating_length=10.0 ** rng.uniform(-1.0, 1.0),
        slope_wear=10.0 ** rng.uniform(-2.0, 1.0) if wears else np.inf,
        plane=[None, 0.7][rng.integers(2)], resolution=jl.Resolution(rng.integers(1, 3), 3, 2),
    )  # fmt: skip


def gains(law, corners, steps, panels):
    """Gains (n, 2) of n paths by both rules: two legs to where they begin, and on.

    corners (n, legs, dim) in m; each leg from the third on is taken in so many steps.
    """
    t, w = rules(panels)
    legs = np.diff(corners, axis=1, prepend=0.0)
    joints, points = law.joints(len(legs)), law.joints(len(legs) * t.size)
    peak = np.zeros(len(legs))
    for leg in (legs[:, 0], legs[:, 1]):
        joints.update(leg, tangent=False)
        peak = np.maximum(peak, joints.stored_energy)
    start = joints.stored_energy
    work = np.zeros((len(legs), 2))
    for leg in np.moveaxis(legs[:, 2:], 1, 0):
        for _ in range(steps):
            d = leg / steps
            values = np.repeat(joints.snapshot().values, t.size, axis=0)
            points.restore(JointState(law.fingerprint, values))
            spread = np.repeat(d, t.size, axis=0)
            F = points.update(spread * np.tile(t, len(legs))[:, None], tangent=False)[0]
            work += np.sum(F * spread, axis=1).reshape(len(legs), -1) @ w.T
            peak = np.maximum(peak, points.stored_energy.reshape(len(legs), -1).max(axis=1))
            joints.update(d, tangent=False)
    made = (joints.stored_energy - start)[:, None] - work
    return made / np.where(peak > 0, peak, np.inf)[:, None]


def paths(law, x, size, kind):
    """Corners (n, legs, dim) of candidates x (parameters, n): two, then a step or a cycle.

    The first parameter is the logarithm of how large either is.
    """
    _, steps, rounds = kind
    places = x[1:].T.reshape(x.shape[1], -1, law.dim)
    reach = max(0.5 * steps, 1.0) * size * law.mating_length * 10.0 ** (x[0] - 1.0)
    shear = [1.0] * (law.dim - 1)
    begin = places[:, :2] * np.array([1.0, *(2.0 * law.mating_length * s for s in shear)])
    begin[..., 0] += 0.5  # most are in touch
    way = places[:, 2:] / np.maximum(1.0, np.linalg.norm(places[:, 2:], axis=2)[..., None])
    unit = np.stack([np.minimum(reach, 1.0), *(reach * s for s in shear)], axis=-1)
    way = begin[:, -1:] + way * unit[:, None]
    cycle = np.concatenate([way, begin[:, -1:]], axis=1)
    return np.concatenate([begin, np.tile(cycle, (1, rounds, 1)) if rounds else way], axis=1)


def search(law, size, kind, seed):
    """Corners (1, legs, dim) of the step or cycle of the largest gain that was found."""
    free, steps, _ = kind
    panels = 2 if kind == TRIANGLE else 32

    def loss(x):
        return -gains(law, paths(law, x, size, kind), steps, panels)[:, 0]

    found = differential_evolution(
        loss, [(-1.0, 1.0)] * (1 + (2 + free) * law.dim), maxiter=25, popsize=4,
        polish=False, vectorized=True, updating="deferred", rng=np.random.default_rng(seed),
    )  # fmt: skip
    return paths(law, found.x[:, None], size, kind)


def largest(size, seed):
    """The figures (7,) of one law: gains, and errors of the trapezoid."""
    law = random_law(np.random.default_rng(seed))
    step, back, triangle = (search(law, size, kind, seed) for kind in (STEP, BACK, TRIANGLE))
    (made,) = gains(law, step, 1, 2048)
    there = [gains(law, back, steps, 256)[0, 0] / ROUNDS for steps in (1, 10)]
    whole, tenths = (gains(law, triangle, SIDE * more, 64)[0] for more in (1, 10))
    return [made[0], *there, whole[0], tenths[0], *(abs(x[0] - x[1]) for x in (whole, tenths))]


if __name__ == "__main__":
    given, rows = asked(__doc__, laws=60, first=0), []
    for size in (1.0, 0.25, 0.1, 0.01):
        found = [largest(size, given.first + i) for i in range(given.laws)]
        rows.append([f"{size:g}", *(f"{most:.1e}" for most in np.max(found, axis=0))])
    print(table(HEAD, rows))
