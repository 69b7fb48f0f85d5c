"""One mass on one joint under explicit integration at 0.95 of the critical time step."""

import numpy as np
import pytest
from extremes.laws import COMPILED, SCALE, build

import jointlaw as jl

pytestmark = pytest.mark.slow

COARSE = jl.Resolution(2, 3, 1)
MASS, AREA = 1e3, 1.0  # kg, m2
EVERY = 5  # steps between looks at the energy: no divisor of a period
CASES = {  # law, normal stress of the load (Pa), speed of impact as a share of that at rest closure
    "Hertz at 1 Pa": ({}, 1.0, 0.3),
    "Hertz at 10 GPa": ({}, 1e10, 0.3),
    "Hertz, no friction": ({"mu": 0.0}, 1e7, 0.3),
    "impact from opening": ({}, 1e6, 3.0),
    "impact, little friction": ({"mu": 0.01}, 1e6, 3.0),
    "steep faces, impact": ({"a": 1.0, "mu": 0.6}, 1e6, 3.0),
    "linear, soft in shear": ({"eta": 0.0, "lam": 10.0}, 1e7, 0.3),
    "linear, no friction": ({"eta": 0.0, "mu": 0.0}, 1e7, 0.3),
    "stiff in shear": ({"lam": 0.1}, 1e7, 0.3),
    "many heights": ({"heights": "printed, population"}, 1e7, 1.0),
    "slopes that fade": ({"mating_length": 0.3 * SCALE, "mu": 0.3}, 1e7, 1.0),
}
LOSSLESS = ("Hertz, no friction", "linear, no friction", "linear, soft in shear")
PROBE, STEPS = (6000, 4000) if COMPILED else (1200, 500)


class Mass:
    """n masses, each on its joint under a constant normal load, hit in n directions; leapfrog."""

    def __init__(self, case, n=4):
        changes, stress, share = CASES[case]
        self.law = build(resolution=COARSE, **changes)
        self.load = np.array([stress * AREA, 0.0, 0.0])
        self.joints = self.law.joints(n)
        rest = float(self.law.closure(stress))
        self.joints.update(np.tile([-rest if share > 1.0 else rest, 0.0, 0.0], (n, 1)))
        speed = share * np.sqrt(stress * AREA * rest / MASS)
        toward = np.random.default_rng(4).normal(size=(n, 3))
        toward[:, 0] = np.abs(toward[:, 0])
        self.start = toward / np.linalg.norm(toward, axis=1, keepdims=True) * speed
        self.rest = rest

    def run(self, steps, dt):
        """Energies (every fifth step, n), and the largest effective closure.

        The energy counts the kinetic part as the product of the speeds before and after: that is
        what leapfrog keeps, to the last digit on a linear spring.
        """
        joints, load, seen = self.joints, self.load, []
        v, F = self.start, joints.F
        for k in range(steps):
            faster = v + (load - F * AREA) * (dt / MASS)
            if k % EVERY == 0:
                measures = joints.measures()
                kinetic = 0.5 * MASS * np.sum(v * faster, axis=1)
                energy = kinetic + AREA * measures.stored - joints.delta @ load
                seen.append((energy, measures.reach))
            v = faster
            F = joints.update(v * dt, tangent=False)[0]
        energies, reach = np.array(seen).swapaxes(0, 1)
        return energies, reach.max()


def swing(case):
    """Runs at 0.95 of the critical step of the largest closure reached.

    Returns, as shares of the kinetic energy at the start and the work of the load up to rest, how
    far the energy ever rises above the first, and how far after the first tenth above the largest
    in it; and the largest reach over that which the time step was made for.
    """
    probe, mass = Mass(case), Mass(case)
    short = 0.1 * probe.law.critical_time_step(MASS, AREA, 10.0 * probe.rest)
    bound = 1.1 * probe.run(PROBE, short)[1]  # the closure reached, on a fine step
    energies, reach = mass.run(STEPS, 0.95 * mass.law.critical_time_step(MASS, AREA, bound))
    early = len(energies) // 10
    scale = mass.rest * mass.load[0] + 0.5 * MASS * np.sum(mass.start**2, axis=1)
    above = (energies.max(axis=0) - energies[0]) / scale
    growth = (energies[early:].max(axis=0) - energies[:early].max(axis=0)) / scale
    return float(np.max(above)), float(np.max(growth)), reach / bound


@pytest.mark.parametrize("case", [case for case in CASES if case not in LOSSLESS])
def test_with_friction_energy_never_rises_above_the_first(case):
    """At 0.95 of the critical step, impacts from opening and a friction of 0.01 included: no more
    than the rounding of the sums that energy is."""
    above, growth, reached = swing(case)
    assert reached <= 1.0
    assert max(above, growth) <= 1e-12


@pytest.mark.parametrize("case", LOSSLESS)
def test_lossless_lasting_contact_keeps_its_energy(case):
    """Leapfrog keeps that of a linear spring to rounding; that of a Hertz contact at 0.95 of its
    critical step comes and goes by 1 %, and after a tenth of the run no farther than before."""
    above, growth, reached = swing(case)
    assert reached <= 1.0 or "linear" in case  # which is as stiff at any closure
    assert above <= (0.02 if case == "Hertz, no friction" else 1e-12)
    assert growth <= (1e-3 if case == "Hertz, no friction" else 1e-12)


def test_beyond_the_critical_step_a_linear_joint_breaks_loose():
    """The bound is no idle one: the sum of A/c1 in it is the stiffness to the mean of cos^2, so
    1.2 times its step is too long. Opening ends the growth: a factor, not an overflow."""
    mass = Mass("linear, no friction")
    critical = mass.law.critical_time_step(MASS, AREA, mass.rest)
    calm, _ = Mass("linear, no friction").run(300, 0.95 * critical)
    wild, _ = mass.run(300, 1.2 * critical)
    assert np.abs(wild[-1]).max() > 1e3 * np.abs(calm).max()


def test_an_undamped_hertz_impact_gains_less_in_smaller_steps(record):
    """The figures of docs/limits.md, at 4000 phases of the step, with a third in hand.

    A unit mass touches flat facets, F = y^1.5, at speed 1. The impact lasts 4.03/omega of its
    stiffest moment, 2/share steps of this share of the critical step 2/omega.
    """
    most = {0.95: np.inf, 0.8: 0.4, 0.5: 0.1, 0.2: 6e-3, 0.1: 6e-4, 0.05: 1e-4}
    law = build(
        a=1e8, b=0.0, c=0.0, K=1.0, lam=1.0, mu=0.4, density=1.0, range=1.0,
        resolution=jl.Resolution(1, 3, 1),
    )  # fmt: skip
    for share, promised in most.items():
        dt = share * 2.0 / np.sqrt(1.5 * 1.25**0.2)  # the deepest closure is 1.25^0.4
        contact, closing = law.joints(4000), np.eye(3)[0]
        x, v = -(np.arange(4000) + 0.5) / 4000 * dt, np.ones(4000)
        contact.update(np.outer(x, closing))
        for _ in range(int(8.0 / share) + 8):
            v = v - contact.update(np.outer(v * dt, closing), tangent=False)[0][:, 0] * dt
        assert (contact.delta[:, 0] < 0).all()
        gained = v**2 - 1.0
        record("impact", share, gained.min(), gained.max())
        assert gained.max() < promised
