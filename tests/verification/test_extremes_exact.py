"""Against the step of the theory written out with 50 digits, on one orientation and on few.

Source: docs/theory-incremental.md, "Few cells, exact virgin curve".
"""

import mpmath as mp
import numpy as np
import pytest
from extremes import FULL
from extremes.laws import SCALE, build, name

import jointlaw as jl

pytestmark = pytest.mark.slow

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


class Exact:
    """One joint without heights: the same facets and nodes, Phi = y^(1 + eta), exact chords."""

    def __init__(self, law):
        k = law.tables.asperities

        def exact(array):
            return [[mp.mpf(float(x)) for x in row] for row in np.atleast_2d(array).T]

        self.m, self.n, self.s, self.t = map(exact, (k.m, k.n, k.s, k.t))
        self.area, self.c1 = ([mp.mpf(float(x)) for x in v] for v in (k.area, k.c1))
        self.depth = [[mp.mpf(float(x)) for x in row] for row in k.depth]
        self.eta, self.lam, self.mu = (mp.mpf(x) for x in (law.asperity.eta, k.lam, k.mu))
        self.delta = [mp.mpf(0)] * 3
        self.q = [[[mp.mpf(0), mp.mpf(0)] for _ in row[1:]] for row in self.depth]

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
        base, base_slope = self.force(low)
        top, top_slope = self.force(r)
        if i == 0:
            base_slope = mp.mpf(0)
        return (top_slope - base_slope) * (y - r) + top - base - base_slope * (r - low), (
            top_slope - base_slope
        )

    def update(self, d):
        """Traction after the step d."""
        d = [mp.mpf(float(x)) for x in d]
        new = [x + dx for x, dx in zip(self.delta, d, strict=True)]
        F = [mp.mpf(0)] * 3
        for f, (m, n, s, t) in enumerate(zip(self.m, self.n, self.s, self.t, strict=True)):
            y0, y1 = mp.fdot(m, self.delta), mp.fdot(m, new)
            de, a = (mp.fdot(s, d), mp.fdot(t, d)), self.area[f] / self.c1[f]
            normal = self.area[f] * self.force(y1)[0]
            F = [Fi + ni * normal for Fi, ni in zip(F, n, strict=True)]
            for i, q in enumerate(self.q[f]):
                (G0, k0), (G1, k1) = self.cell(f, i, y0), self.cell(f, i, y1)
                if k1 > k0:
                    q = [qe + a * (G1 - G0) / (y1 - y0) * x for qe, x in zip(q, de, strict=True)]
                else:
                    kept = k1 / k0 if k0 > 0 else mp.mpf(0)
                    q = [qe * kept + a * k1 * x for qe, x in zip(q, de, strict=True)]
                cap, size = self.mu * self.lam * self.area[f] * G1, mp.hypot(*q)
                if size > cap:
                    q = [qe * cap / size for qe in q]
                self.q[f][i] = q
                F = [
                    Fi + (si * q[0] + ti * q[1]) / self.lam
                    for Fi, si, ti in zip(F, s, t, strict=True)
                ]
        self.delta = new
        return F


def gap(changes, seed, steps=24):
    """Largest |F - exact|, as a share of |F|."""
    changes = dict(changes)
    depth = changes.pop("depth")
    law = build(resolution=jl.Resolution(1, 3, depth), **changes)
    joint, exact, rng = law.joint(), Exact(law), np.random.default_rng(seed)
    worst = 0.0
    with mp.workdps(DIGITS):
        for k in range(steps):
            # a grid of 2^-70 m: sums of steps are then exact, and no rounding of delta is measured
            d = rng.normal(size=3) * SCALE * 10.0 ** rng.uniform(-8.0, 0.0)
            if k % 5 == 0:
                d = np.array([0.7 * SCALE, 0.0, 0.0])
            if k % 7 == 6:
                d[1:] *= 30.0
            d = np.round(d * 2.0**70) / 2.0**70
            F, G = joint.update(d, tangent=False)[0], exact.update(d)
            away = max(abs(mp.mpf(float(a)) - b) for a, b in zip(F, G, strict=True))
            size = float(max(abs(b) for b in G))
            worst = max(worst, float(away) / size if size > 0 else float(away))
    return worst


@pytest.mark.parametrize("changes", CASES, ids=name)
def test_force_agrees_with_50_digits(changes, record):
    """1e-12 is asked. Chords of steps near 1e-5 of y lose five digits of sixteen, and their share
    of F is as small."""
    worst = max(gap(changes, seed) for seed in (range(6) if FULL else [6]))
    record("exact", *(changes[key] for key in ("a", "mu", "lam", "depth")), worst)
    assert worst < 1e-12
