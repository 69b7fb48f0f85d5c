"""Exact references: the step with 50 digits, Kummer's function, energy of a mass on a joint.

The step of the theory is evaluated with 50 digits on one orientation and on few; the first-loading
curve is compared with Kummer's function; the energy of one mass on one joint is balanced under
explicit integration at 0.95 of the critical time step. Source: docs/theory-incremental.md.
"""

import mpmath as mp
import numpy as np
import pytest
from extremes.laws import COMPILED, FULL, SCALE, build, name

import jointlaw as jl
from jointlaw.discretisation.first_loading_curve import exact_force, first_loading_curve

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


exact = np.frompyfunc(lambda x: mp.mpf(float(x)), 1, 1)  # converts to arrays of mpmath numbers


class ExactJoint:
    """One joint without heights: the same facets and nodes, Phi = y^(1 + eta), exact chords."""

    def __init__(self, law):
        k = law.tables.asperities
        self.m = exact(k.m.T)
        self.n = exact(k.n.T)
        self.depth = exact(k.cell_depth)
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
                    q[i] = q[i] + de * (a * (G1 - G0) / (y1 - y0))
                else:
                    q[i] = q[i] * (k1 / k0 if k0 > 0 else 0) + de * (a * k1)
                cap = self.mu * self.lam * self.area[f] * G1
                size = mp.hypot(*q[i])
                q[i] = q[i] * (cap / size if size > cap else 1)
            F = F + self.n[f] * self.area[f] * self.force(y1)[0]
            F = F + q.sum(axis=0) @ self.basis[f] / self.lam
        return F


@pytest.mark.parametrize("changes", CASES, ids=name)
def test_force_agrees_with_50_digits(changes, record):
    """The largest difference is 1e-12 of |F|.

    Chords of steps near 1e-5 of y lose five digits of sixteen, but contribute as little to F.
    """
    parameters = {key: value for key, value in changes.items() if key != "depth"}
    law = build(resolution=jl.Resolution(1, 3, changes["depth"]), **parameters)
    worst = 0.0
    for seed in range(6) if FULL else [6]:
        joint = law.joint()
        rng = np.random.default_rng(seed)
        with mp.workdps(DIGITS):
            exact_joint = ExactJoint(law)
            for k in range(24):
                d = rng.normal(size=3) * SCALE * 10.0 ** rng.uniform(-8.0, 0.0)
                if k % 5 == 0:
                    d = np.array([0.7 * SCALE, 0.0, 0.0])
                if k % 7 == 6:
                    d[1:] *= 30.0
                # on a grid of 2^-70 m sums of steps are exact, so that delta has no rounding
                d = np.round(d * 2.0**70) / 2.0**70
                F = joint.update(d, tangent=False)[0]
                G = exact_joint.update(d)
                size = max(abs(G))
                worst = max(worst, float(max(abs(exact(F) - G)) / (size if size > 0 else 1)))
    record("exact", *(changes[key] for key in ("a", "mu", "lam", "depth")), worst)
    assert worst < 1e-12


@pytest.mark.parametrize("eta", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("alpha", [-1.0 + 1e-9, -0.99, -0.5, -0.1])
def test_a_density_infinite_at_the_point_of_contact(alpha, eta):
    """Phi of "individual" gamma heights without overlap is Kummer's function.

    It is proportional to y^(2 + alpha + eta) at small y. Over thirty decades the table is accurate
    to 1e-10 of the largest S / w^p.
    """
    heights = jl.GammaHeights(alpha, 1.15, 0.0, "individual")
    curve = first_loading_curve(eta, heights)
    p = mp.mpf(alpha) + 1
    q = mp.mpf(eta) + 1
    rise = mp.gamma(q + 1) / mp.gamma(p + q + 1)
    y = np.geomspace(1e-30, 1e4, 35)
    force, slope = curve.force(y)
    # at first contact the force is a power of y, and so is its integral
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
MASS = 1e3  # kg
AREA = 1.0  # m2
ENERGY_INTERVAL = 5  # steps between energies: no divisor of a period
# law, normal stress of the load (Pa), impact speed over sqrt(load * rest closure / mass)
CASES = {
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
PROBE_STEPS, STEPS = (6000, 4000) if COMPILED else (1200, 500)


class Masses:
    """n masses on joints under a constant normal load, with n initial velocities; leapfrog."""

    def __init__(self, case, n=4):
        changes, stress, speed_ratio = CASES[case]
        self.law = build(resolution=COARSE, **changes)
        self.load = np.array([stress * AREA, 0.0, 0.0])
        self.joints = self.law.joints(n)
        rest = float(self.law.closure(stress))
        self.joints.update(np.tile([-rest if speed_ratio > 1.0 else rest, 0.0, 0.0], (n, 1)))
        speed = speed_ratio * np.sqrt(stress * AREA * rest / MASS)
        direction = np.random.default_rng(4).normal(size=(n, 3))
        direction[:, 0] = np.abs(direction[:, 0])
        self.start = direction / np.linalg.norm(direction, axis=1, keepdims=True) * speed
        self.rest = rest

    def run(self, steps, dt):
        """Energies (every fifth step, n), and the largest effective closure.

        The kinetic energy is the product of the velocities before and after the step: leapfrog
        conserves this energy on a linear spring to rounding.
        """
        joints = self.joints
        load = self.load
        samples = []
        v = self.start
        F = joints.F
        for k in range(steps):
            v_next = v + (load - F * AREA) * (dt / MASS)
            if k % ENERGY_INTERVAL == 0:
                measures = joints.measures()
                kinetic = 0.5 * MASS * np.sum(v * v_next, axis=1)
                energy = kinetic + AREA * measures.stored_energy - joints.delta @ load
                samples.append((energy, measures.max_effective_closure))
            v = v_next
            F = joints.update(v * dt, tangent=False)[0]
        energies, closure = np.array(samples).swapaxes(0, 1)
        return energies, closure.max()


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_energy_never_rises_above_the_first(case):
    """At 0.95 of the critical step the energy does not grow, impacts and friction of 0.01 included.

    The tolerance is the rounding of the sums, relative to the initial kinetic energy and the work
    of the load. Leapfrog conserves the energy of a linear spring to rounding. The energy of a Hertz
    contact without friction oscillates by 1 %, after a tenth of the run not more than before.
    """
    probe = Masses(case)
    masses = Masses(case)
    short = 0.1 * probe.law.critical_time_step(MASS, AREA, 10.0 * probe.rest)
    bound = 1.1 * probe.run(PROBE_STEPS, short)[1]  # of the closure, in m
    dt = 0.95 * masses.law.critical_time_step(MASS, AREA, bound)
    energies, closure = masses.run(STEPS, dt)
    assert closure <= bound or "linear" in case  # its stiffness does not depend on closure
    early = len(energies) // 10
    scale = masses.rest * masses.load[0] + 0.5 * MASS * np.sum(masses.start**2, axis=1)
    above = (energies.max(axis=0) - energies[0]) / scale
    growth = (energies[early:].max(axis=0) - energies[:early].max(axis=0)) / scale
    max_above, max_growth = (0.02, 1e-3) if case == "Hertz, no friction" else (1e-12, 1e-12)
    assert above.max() <= max_above
    assert growth.max() <= max_growth


@pytest.mark.slow
def test_beyond_the_critical_step_a_linear_joint_is_unstable():
    """The bound is close: its sum of A/c1 is the stiffness except for the mean of cos^2.

    1.2 times the critical step is too long. Opening limits the growth to a factor.
    """
    masses = Masses("linear, no friction")
    critical = masses.law.critical_time_step(MASS, AREA, masses.rest)
    stable, _ = Masses("linear, no friction").run(300, 0.95 * critical)
    unstable, _ = masses.run(300, 1.2 * critical)
    assert np.abs(unstable[-1]).max() > 1e3 * np.abs(stable).max()


@pytest.mark.slow
def test_an_undamped_hertz_impact_gains_less_in_smaller_steps(record):
    """The figures of docs/limits.md, at 4000 phases of the step; the tolerances are a third larger.

    A unit mass hits flat facets, F = y^1.5, at speed 1. The impact lasts 4.03/omega with the
    largest omega, or 2/ratio steps, where `ratio` is the step over the critical step 2/omega.
    """
    max_gain = {0.95: np.inf, 0.8: 0.4, 0.5: 0.1, 0.2: 6e-3, 0.1: 6e-4, 0.05: 1e-4}
    law = build(
        a=1e8, b=0.0, c=0.0, K=1.0, lam=1.0, mu=0.4, density=1.0, range=1.0,
        resolution=jl.Resolution(1, 3, 1),
    )  # fmt: skip
    for ratio, tolerance in max_gain.items():
        dt = ratio * 2.0 / np.sqrt(1.5 * 1.25**0.2)  # the deepest closure is 1.25^0.4
        contact = law.joints(4000)
        closing = np.eye(3)[0]
        x = -(np.arange(4000) + 0.5) / 4000 * dt
        v = np.ones(4000)
        contact.update(np.outer(x, closing))
        for _ in range(int(8.0 / ratio) + 8):
            v = v - contact.update(np.outer(v * dt, closing), tangent=False)[0][:, 0] * dt
        assert (contact.delta[:, 0] < 0).all()
        gain = v**2 - 1.0
        record("impact", ratio, gain.min(), gain.max())
        assert gain.max() < tolerance
