"""critical_slip: the end of the in-plane offset follows the exact tractrix."""

import numpy as np
import pytest
from builders import law
from exact_work import step_work
from scipy.integrate import solve_ivp

import jointlaw as jl
from jointlaw.kernels import reference as kernel

D = 0.3
CORNERS = np.array([[0.1, 0.05], [0.9, 0.4], [0.5, 1.2], [-0.8, 0.9], [-0.7, 0.9], [0.4, -0.6]])


def tractrix(corners, length):
    """Offset after an in-plane path: below the limit it moves along, at the limit it turns."""
    o = np.zeros(2)
    for leg in np.diff(corners, axis=0, prepend=0.0):
        e, way = leg / np.linalg.norm(leg), np.linalg.norm(leg)
        # from inside, straight on until |o| = length
        along = o @ e
        free = min(way, -along + np.sqrt(max(along**2 + length**2 - o @ o, 0.0)))
        o, rest = o + free * e, way - free
        if rest > 1e-14:
            solved = solve_ivp(
                lambda s, x, e=e: e - (x @ e) * x / length**2, (0.0, rest), o, rtol=1e-12,
                atol=1e-14, method="DOP853",
            )  # fmt: skip
            o = solved.y[:, -1]
    return o


@pytest.mark.parametrize("division", [1, 3, 50])
@pytest.mark.parametrize("formation", [None, "population"])
def test_the_offset_follows_the_tractrix_in_steps_of_any_size(formation, division):
    """Without friction the traction tells the offset: compare with an unlimited joint put there."""
    limited = law(mu=0.0, formation=formation, critical_slip=D).joint()
    limited.update([0.8, 0.0, 0.0])
    for k, leg in enumerate(np.diff(CORNERS, axis=0, prepend=0.0)):
        for _ in range(division):
            F = limited.update([0.0, *(leg / division)])[0]
        free = law(mu=0.0, formation=formation).joint()
        exact = free.update([0.8, *tractrix(CORNERS[: k + 1], D)])[0]
        # the turning is solved in closed form: the integration's 1e-12 and rounding are left
        assert np.allclose(F, exact, rtol=0.0, atol=1e-10)


def test_steady_friction_under_constant_stress_tends_to_the_steepest_contacts():
    """atan(mu) + 90 deg/a for a critical slip far above the closure: the joint rides up its rim."""
    gaps = []
    for length in (100.0, 1000.0):
        one = law(b=0.0, c=0.0, mu=0.3, plane=0.0, critical_slip=length,
                  resolution=jl.Resolution(60, 60, 1))  # fmt: skip
        stress = float(one.normal_stress(1.0))
        record = jl.direct_shear(one.joint(), 6.0 * length, normal=stress, steps=60)
        friction = np.degrees(np.arctan2(record.F2[-1], record.F1[-1]))
        gaps.append(np.degrees(np.arctan(0.3)) + 30.0 - friction)
    # the loaded rim narrows as the root of closure over length: sqrt(10) = 3.2 times a decade
    assert gaps[0] > 2.0 * gaps[1] > 0.0
    assert gaps[1] < 1.0


@pytest.mark.parametrize(("mu", "work"), [(4.0, -8.864), (0.6, None)])
def test_a_known_fault_a_closed_cycle_creates_energy_if_mu_is_large(mu, work):
    """docs/theory-incremental.md, "Large shear": the offset bends y within a step."""
    R = 1e-6
    asperity = jl.Asperity(K=1e5, lam=1.2, eta=0.0, mu=mu)
    one = jl.JointLaw(
        orientation=jl.Orientation(1.0), asperity=asperity, asperity_density=1e10,
        closure_range=R, resolution=jl.Resolution(1, 3, 1), plane=0.0, critical_slip=0.3 * R,
    )  # fmt: skip
    cycle = [(1, 0.484), (-1.428, -0.503), (-3, 0), (0, -0.281), (0, 0.3), (3.428, 0)]
    state, found, k = np.zeros((one.tables.rows, 1)), 0.0, one.tables
    for d in R * np.array(cycle):
        found += step_work(k, state, d)
        state = kernel.step(k, state, d[:, None], False)[0]
    assert kernel.measures(k, state).stored[0] == 0.0  # nothing is left to give back
    if work is None:
        assert found > 0.0
    else:
        assert found == pytest.approx(work, abs=5e-4)  # the digits that are given
