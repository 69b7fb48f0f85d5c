"""Against the step of the theory written out with 50 digits, on one orientation and on few; and the
virgin curve against Kummer's function.

Source: docs/theory-incremental.md, "Few cells, exact virgin curve".
"""

import mpmath as mp
import numpy as np
import pytest
from extremes import FULL
from extremes.laws import SCALE, build, name

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
        self.m, self.n, self.depth = exact(k.m.T), exact(k.n.T), exact(k.depth)
        self.basis = exact(np.stack([k.s.T, k.t.T], axis=1))
        self.area, self.c1 = exact(k.area), exact(k.c1)
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
        low, high = self.depth[facet][i], self.depth[facet][i + 1]
        if y <= low:
            return mp.mpf(0), mp.mpf(0)
        r = min(y, high)
        (base, base_slope), (top, top_slope) = self.force(low), self.force(r)
        kappa = top_slope - (base_slope if i else 0)
        return kappa * (y - r) + top - base - (top_slope - kappa) * (r - low), kappa

    def update(self, d):
        """Traction after the step d."""
        d, F = exact(d), exact(np.zeros(3))
        before, self.delta = self.delta, self.delta + d
        for f, q in enumerate(self.q):
            y0, y1 = self.m[f] @ before, self.m[f] @ self.delta
            de, a = self.basis[f] @ d, self.area[f] / self.c1[f]
            for i in range(len(q)):
                (G0, k0), (G1, k1) = self.cell(f, i, y0), self.cell(f, i, y1)
                if k1 > k0:
                    q[i] = q[i] + a * (G1 - G0) / (y1 - y0) * de
                else:
                    q[i] = q[i] * (k1 / k0 if k0 > 0 else 0) + a * k1 * de
                cap, size = self.mu * self.lam * self.area[f] * G1, mp.hypot(*q[i])
                q[i] = q[i] * (cap / size if size > cap else 1)
            F = F + self.n[f] * self.area[f] * self.force(y1)[0]
            F = F + q.sum(axis=0) @ self.basis[f] / self.lam
        return F


def gap(changes, seed, steps=24):
    """Largest |F - exact|, as a share of |F|."""
    changes = dict(changes)
    law = build(resolution=jl.Resolution(1, 3, changes.pop("depth")), **changes)
    joint, rng, worst = law.joint(), np.random.default_rng(seed), 0.0
    with mp.workdps(DIGITS):
        slow = Exact(law)
        for k in range(steps):
            # a grid of 2^-70 m: sums of steps are then exact, and no rounding of delta is measured
            d = rng.normal(size=3) * SCALE * 10.0 ** rng.uniform(-8.0, 0.0)
            if k % 5 == 0:
                d = np.array([0.7 * SCALE, 0.0, 0.0])
            if k % 7 == 6:
                d[1:] *= 30.0
            d = np.round(d * 2.0**70) / 2.0**70
            F, G = joint.update(d, tangent=False)[0], slow.update(d)
            size = max(abs(G))
            worst = max(worst, float(max(abs(exact(F) - G)) / (size if size > 0 else 1)))
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("changes", CASES, ids=name)
def test_force_agrees_with_50_digits(changes, record):
    """1e-12 is asked. Chords of steps near 1e-5 of y lose five digits of sixteen, and their share
    of F is as small."""
    worst = max(gap(changes, seed) for seed in (range(6) if FULL else [6]))
    record("exact", *(changes[key] for key in ("a", "mu", "lam", "depth")), worst)
    assert worst < 1e-12


@pytest.mark.parametrize("eta", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("alpha", [-1.0 + 1e-9, -0.99, -0.5, -0.1])
def test_a_density_infinite_at_the_point_of_contact(alpha, eta):
    """Phi of "individual" gamma heights without overlap is Kummer's function, and rises as
    y^(2 + alpha + eta): over thirty decades, from a table good to 1e-10 of the largest S / w^p."""
    heights = jl.GammaHeights(alpha, 1.15, 0.0, "individual")
    curve = virgin_curve(eta, heights)
    p, q = mp.mpf(alpha) + 1, mp.mpf(eta) + 1
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
