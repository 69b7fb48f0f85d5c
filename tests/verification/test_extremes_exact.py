"""Against what is exact: the step of the theory written out with 50 digits, on one orientation and
on few; the virgin curve against Kummer's function; and the energy of one mass on one joint under
explicit integration at 0.95 of the critical time step.

Source: docs/theory-incremental.md, "Few cells, exact virgin curve".
"""

import mpmath as mp
import numpy as np
import pytest
from extremes.laws import COMPILED, FULL, SCALE, build, name

import jointlaw as jl
from jointlaw.discretisation.virgin_curve import exact_force, virgin_curve

DIGITS = 50
CASES = [
    {"a": a, "eta": eta, "mu": mu, "lam": lam, "depth": depth}
    for a, mu, lam, depth in [
        (1e8, 0.4, 1.2, 1), (1e8, 1e6, 0.1, 3), (1e8, 1e-8, 10.0, 3), (1e8, 0.0, 1.2, 1),
        (3e4, 10.0, 0.1, 3), (1.0, 0.4, 0.1, 3), (1.0, 10.0, 10.0, 2), (1.0, 1e6, 1.2, 1),
        (1e3, 10.0, 10.0, 4),
    ]
    for eta in (0.0, 1e-6, 0.5, 1.0, 2.0)
]  # fmt: skip


exact = np.frompyfunc(lambda x: mp.mpf(float(x)), 1, 1)  # to arrays of numbers of mpmath


class Exact:
    """One joint without heights: the same facets and nodes, Phi = y^(1 + eta), exact chords."""

    def __init__(self, law):
        k = law.tables.asperities
        self.m = exact(k.m.T)
        self.n = exact(k.n.T)
        self.depth = exact(k.depth)
        self.basis = exact(np.stack([k.s.T, k.t.T], axis=1))
        self.area = exact(k.area)
        self.c1 = exact(k.c1)
        self.eta, self.lam, self.mu = exact([law.asperity.eta, k.lam, k.mu])
        self.delta = exact(np.zeros(3))
        self.q = exact(np.zeros((*self.depth[:, 1:].shape, 2)))

    def force(self, y):
        """Phi and Phi'."""
        if y <= 0:
            return mp.mpf(0), mp.mpf(0)
        return y ** (1 + self.eta), (1 + self.eta) * y**self.eta

    def cell(self, facet, i, y):
        """G_i and kappa_i."""
        low = self.depth[facet][i]
        high = self.depth[facet][i + 1]
        if y <= low:
            return mp.mpf(0), mp.mpf(0)
        r = min(y, high)
        base, base_slope = self.force(low)
        top, top_slope = self.force(r)
        kappa = top_slope - (base_slope if i else 0)
        return kappa * (y - r) + top - base - (top_slope - kappa) * (r - low), kappa

    def update(self, d):
        """Traction after the step d."""
        d = exact(d)
        F = exact(np.zeros(3))
        before = self.delta
        self.delta = self.delta + d
        for f, q in enumerate(self.q):
            y0 = self.m[f] @ before
            y1 = self.m[f] @ self.delta
            de = self.basis[f] @ d
            a = self.area[f] / self.c1[f]
            for i in range(len(q)):
                G0, k0 = self.cell(f, i, y0)
                G1, k1 = self.cell(f, i, y1)
                if k1 > k0:
                    q[i] = q[i] + a * (G1 - G0) / (y1 - y0) * de
                else:
                    q[i] = q[i] * (k1 / k0 if k0 > 0 else 0) + a * k1 * de
                cap = self.mu * self.lam * self.area[f] * G1
                size = mp.hypot(*q[i])
                q[i] = q[i] * (cap / size if size > cap else 1)
            F = F + self.n[f] * self.area[f] * self.force(y1)[0]
            F = F + q.sum(axis=0) @ self.basis[f] / self.lam
        return F


@pytest.mark.parametrize("changes", CASES, ids=name)
def test_force_agrees_with_50_digits(changes, record):
    """1e-12 of |F| is asked. Chords of steps near 1e-5 of y lose five digits of sixteen, and their
    share of F is as small."""
    more = {key: value for key, value in changes.items() if key != "depth"}
    law = build(resolution=jl.Resolution(1, 3, changes["depth"]), **more)
    worst = 0.0
    for seed in range(6) if FULL else [6]:
        joint = law.joint()
        rng = np.random.default_rng(seed)
        with mp.workdps(DIGITS):
            slow = Exact(law)
            for k in range(24):
                d = rng.normal(size=3) * SCALE * 10.0 ** rng.uniform(-8.0, 0.0)
                if k % 5 == 0:
                    d = np.array([0.7 * SCALE, 0.0, 0.0])
                if k % 7 == 6:
                    d[1:] *= 30.0
                # a grid of 2^-70 m: sums of steps are then exact, and no rounding of delta counts
                d = np.round(d * 2.0**70) / 2.0**70
                F = joint.update(d, tangent=False)[0]
                G = slow.update(d)
                size = max(abs(G))
                worst = max(worst, float(max(abs(exact(F) - G)) / (size if size > 0 else 1)))
    record("exact", *(changes[key] for key in ("a", "mu", "lam", "depth")), worst)
    assert worst < 1e-12


@pytest.mark.parametrize("eta", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("alpha", [-1.0 + 1e-9, -0.99, -0.5, -0.1])
def test_a_density_infinite_at_the_point_of_contact(alpha, eta):
    """Phi of "individual" gamma heights without overlap is Kummer's function, and rises as
    y^(2 + alpha + eta): over thirty decades, from a table good to 1e-10 of the largest S / w^p."""
    heights = jl.GammaHeights(alpha, 1.15, 0.0, "individual")
    curve = virgin_curve(eta, heights)
    p = mp.mpf(alpha) + 1
    q = mp.mpf(eta) + 1
    rise = mp.gamma(q + 1) / mp.gamma(p + q + 1)
    y = np.geomspace(1e-30, 1e4, 35)
    force, slope = curve.force(y)
    # at touch the force is a power of y, and so is its integral
    assert curve.energy(y)[0] / (y[0] * force[0]) == pytest.approx(1 / float(p + q + 1), rel=1e-6)
    with mp.workdps(30):
        for k, z in enumerate(map(mp.mpf, y / 1.15)):
            S = rise * z**p * mp.hyp1f1(p, p + q + 1, -z)
            DS = p * (S - rise * z ** (p + 1) / (p + q + 1) * mp.hyp1f1(p + 1, p + q + 2, -z))
            assert force[k] / y[k] ** (1 + eta) == pytest.approx(float(S), rel=1e-9)
            # a derivative of the table is one order lower
            assert slope[k] / y[k] ** eta == pytest.approx(float((1 + eta) * S + DS), rel=1e-6)
            assert exact_force(y[k : k + 1], eta, heights)[0] == pytest.approx(force[k], rel=1e-9)


COARSE = jl.Resolution(2, 3, 1)
MASS = 1e3
AREA = 1.0  # kg, m2
EVERY = 5  # steps between looks at the energy: no divisor of a period
# law, normal stress of the load (Pa), speed of impact as a share of that at rest closure
MASSES = {
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
PROBE, STEPS = (6000, 4000) if COMPILED else (1200, 500)


class Mass:
    """n masses, each on its joint under a constant normal load, hit in n directions; leapfrog."""

    def __init__(self, case, n=4):
        changes, stress, share = MASSES[case]
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
        joints = self.joints
        load = self.load
        seen = []
        v = self.start
        F = joints.F
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


@pytest.mark.slow
@pytest.mark.parametrize("case", MASSES)
def test_energy_never_rises_above_the_first(case):
    """At 0.95 of the critical step, impacts from opening and a friction of 0.01 included: no more
    than the rounding of the sums that energy is, as shares of the kinetic energy at the start and
    the work of the load up to rest.

    Leapfrog keeps that of a linear spring to rounding; that of a Hertz contact without friction
    comes and goes by 1 %, and after a tenth of the run no farther than before.
    """
    probe = Mass(case)
    mass = Mass(case)
    short = 0.1 * probe.law.critical_time_step(MASS, AREA, 10.0 * probe.rest)
    bound = 1.1 * probe.run(PROBE, short)[1]  # the closure reached, on a fine step
    energies, reach = mass.run(STEPS, 0.95 * mass.law.critical_time_step(MASS, AREA, bound))
    assert reach <= bound or "linear" in case  # which is as stiff at any closure
    early = len(energies) // 10
    scale = mass.rest * mass.load[0] + 0.5 * MASS * np.sum(mass.start**2, axis=1)
    above = (energies.max(axis=0) - energies[0]) / scale
    growth = (energies[early:].max(axis=0) - energies[:early].max(axis=0)) / scale
    most = (0.02, 1e-3) if case == "Hertz, no friction" else (1e-12, 1e-12)
    assert above.max() <= most[0]
    assert growth.max() <= most[1]


@pytest.mark.slow
def test_beyond_the_critical_step_a_linear_joint_breaks_loose():
    """The bound is no idle one: the sum of A/c1 in it is the stiffness to the mean of cos^2, so
    1.2 times its step is too long. Opening ends the growth: a factor, not an overflow."""
    mass = Mass("linear, no friction")
    critical = mass.law.critical_time_step(MASS, AREA, mass.rest)
    calm, _ = Mass("linear, no friction").run(300, 0.95 * critical)
    wild, _ = mass.run(300, 1.2 * critical)
    assert np.abs(wild[-1]).max() > 1e3 * np.abs(calm).max()


@pytest.mark.slow
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
        contact = law.joints(4000)
        closing = np.eye(3)[0]
        x = -(np.arange(4000) + 0.5) / 4000 * dt
        v = np.ones(4000)
        contact.update(np.outer(x, closing))
        for _ in range(int(8.0 / share) + 8):
            v = v - contact.update(np.outer(v * dt, closing), tangent=False)[0][:, 0] * dt
        assert (contact.delta[:, 0] < 0).all()
        gained = v**2 - 1.0
        record("impact", share, gained.min(), gained.max())
        assert gained.max() < promised
