"""The package against the slow bed on random paths in 3-D."""

import numpy as np
import pytest
from builders import increments, law, random_corners
from slow_bed import SlowBed

pytestmark = pytest.mark.slow


# bed: its inclinations, azimuths and springs; bounds: what "fine" and "reference" promise, and the
# bed errs by 0.05 %; parts: whether joints part wholly and touch again
USUAL = {"paths": 5, "steps": 30, "bed": (8, 24, 200), "bounds": (1e-2, 3e-3), "parts": True}
LAW = {"a": 3.0, "b": 0.5, "c": 0.1, "mu": 0.4, "formation": "population"}
# facets that were pressed flat touch all at once: a coarser bed misses more than `reference`; on 20
# paths of 0.05, of 0.1 and of 0.3 ranges: 2.7, 1.4 and 1.3 %, 0.41, 0.27 and 0.18 %
YIELDS = USUAL | {"paths": 2, "bed": (24, 60, 60), "bounds": (3e-2, 5e-3)}
FADES = YIELDS | {"paths": 1, "steps": 200}
CASES = {
    "population": (USUAL, LAW | {"mu": 0.3}, 0),
    "individual": (
        USUAL, {"a": 1.4, "b": 0.0, "c": 0.2, "mu": 0.5, "formation": "individual"}, 1,
    ),
    "uniform": (USUAL, {"a": 2.0, "b": 1.0, "c": -0.1, "mu": 0.6, "lam": 1.0, "eta": 0.3}, 2),
    "smooth": (USUAL, {"a": 6.0, "b": -0.5, "c": 0.3, "mu": 0.7, "formation": "population"}, 3),
    # near 90 degrees the closure grows as the tangent: more inclinations; facets see closures far
    # beyond the depth nodes, and never all part
    "wild": (
        USUAL | {"bed": (20, 32, 200), "bounds": (3e-2, 9e-3), "parts": False},
        {"a": 1.0, "b": -0.5, "c": -0.2, "mu": 0.4, "lam": 0.8, "formation": "individual"}, 4,
    ),
    "yields late": (YIELDS, LAW | {"damage": {"yield_interference": 0.3}}, 30),
    "yields": (YIELDS, LAW | {"damage": {"yield_interference": 0.1}}, 10),
    "yields soon": (YIELDS, LAW | {"formation": None, "damage": {"yield_interference": 0.05}}, 5),
    "yields and fades": (
        FADES, LAW | {"damage": {"yield_interference": 0.1}, "mating_length": 0.6}, 10,
    ),
    "fades": (FADES | {"bounds": (1.5e-2, 3e-3)}, LAW | {"mating_length": 0.6}, 50),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_tractions_agree_with_the_slow_bed(name):
    case, parameters, seed = CASES[name]
    d = increments(random_corners(np.random.default_rng(seed), case["paths"]), case["steps"])
    beds = [SlowBed(law(**parameters), path, *case["bed"]) for path in np.cumsum(d, axis=1)]
    exact, energy = (np.array(part) for part in zip(*(bed.follow() for bed in beds), strict=True))
    peak = np.linalg.norm(exact, axis=2).max(axis=1)
    for resolution, bound in zip(("fine", "reference"), case["bounds"], strict=True):
        joints, rows = law(**parameters, resolution=resolution).joints(len(d)), []
        for step in np.moveaxis(d, 1, 0):
            F, _ = joints.update(step, tangent=False)
            rows.append((F, joints.stored_energy, joints.measures().separated > 1.0 - 1e-12))
        F, stored, apart = (np.stack(part, axis=1) for part in zip(*rows, strict=True))
        # the paths do what they claim
        assert (apart[:, :-1] & ~apart[:, 1:]).any() == case["parts"]
        error = np.linalg.norm(F - exact, axis=2).max(axis=1) / peak
        assert error.max() < bound, (resolution, error)
        # energy is quadratic in the force: twice its error
        gap = np.abs(stored - energy).max(axis=1) / energy.max(axis=1)
        assert gap.max() < 2.0 * bound
        # the bed takes the mean squeeze of a step: first order in the step
        np.testing.assert_allclose(joints.plastic_work, [bed.crushed for bed in beds], rtol=0.05)
