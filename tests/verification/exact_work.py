"""Work of a joint's own force along one step, split wherever a facet or a slider changes branch.

Where the virgin curve is tabulated its energy is a table of its own, which interpolates to 1e-10 of
itself: `stored` integrates the tabulated force instead.
"""

import dataclasses

import numpy as np

from jointlaw.discretisation.virgin_curve import VirginCurve
from jointlaw.kernels import reference as kernel

_X, _W = np.polynomial.legendre.leggauss(16)
_X = 0.5 * (_X + 1.0)  # Gauss rule of 16 points on 0 to 1, with weights _W / 2
# a cubic that is flat at both ends smooths the powers of y at touch
_T, _TW = 3 * _X**2 - 2 * _X**3, 0.5 * _W * 6 * _X * (1 - _X)
_STARTS = np.unique(
    np.concatenate([[1e-14], np.geomspace(1e-5, 0.05, 16), np.linspace(0.0, 1.0, 49)[1:]])
)


def _branches(k, state, d, t):
    """On which side of every kink (kinks, n) the trial steps t d (n,) of one state end."""
    spread = np.repeat(state, len(t), axis=1)
    old = kernel.parts(k, spread)
    new = kernel.parts(k, kernel.step(k, spread, d[:, None] * t, False)[0])
    virgin = kernel.cells(k, kernel.effective_closure(k, new.delta[0], new.offset))
    flat = kernel.cells(k, new.depth) if k.yields else None
    now = kernel.flattened(virgin, flat)
    mu = kernel.friction(k, old.slip) if k.wears else np.asarray(k.mu)
    cap = kernel.strength(k, mu) * now.G
    low = k.depth[:, :-1, None]
    sides = [
        np.hypot(new.q[0], new.q[1]) >= cap * (1 - 1e-13),
        virgin.y[:, None] > low,
        now.kappa > 0,
        np.sum((old.offset + d[1:, None] * t) ** 2, axis=0)[None, None] > k.critical_slip**2,
    ]
    if k.yields:
        own = virgin.y - k.yield_depth[:, None] >= new.depth
        sides += [new.depth[:, None] > low, (new.depth > old.depth)[None], own[None]]
    return np.concatenate([side.reshape(-1, len(t)) for side in sides])


def _kinks(k, state, d):
    """Times at which the branches change, by bisection between a few starts."""
    at = _branches(k, state, d, _STARTS)
    change = (at[:, 1:] != at[:, :-1]).any(axis=0)
    low, high, side, found = _STARTS[:-1][change], _STARTS[1:][change], at[:, :-1][:, change], []
    for _ in range(80):  # several changes between two starts: one after the other
        if low.size == 0:
            break
        a, b = low, high
        for _ in range(46):
            c = 0.5 * (a + b)
            same = (_branches(k, state, d, c) == side).all(axis=0)
            a, b = np.where(same, c, a), np.where(same, b, c)
        found.append(b)
        after, end = _branches(k, state, d, b), _branches(k, state, d, high)
        more = (after != end).any(axis=0) & (b < high)
        low, high, side = b[more], high[more], after[:, more]
    return np.unique(np.concatenate([[0.0, 1.0], *found]))


class _Integrated(VirginCurve):
    """A virgin curve whose energy is the integral of its own tabulated force."""

    def energy(self, y):
        if len(self.S) == 1:
            return super().energy(y)
        v = np.sqrt(np.maximum(y, 0.0)).ravel()
        ends = np.sqrt(_nodes(self))
        i = np.minimum(np.searchsorted(ends, v, "right") - 1, len(ends) - 1)
        whole = np.append(0.0, np.cumsum(self._between(ends[:-1], ends[1:])))
        return (whole[i] + self._between(ends[i], v)).reshape(np.shape(y))

    def _between(self, low, high):
        """int Phi dy with y = v^2, v from low to high (n,) within one piece of the table."""
        v = low[:, None] + (high - low)[:, None] * _X
        return (self.force(v**2)[0] * 2.0 * v) @ (0.5 * _W) * (high - low)


def _nodes(curve):
    """Closures (m) at which the pieces of the table meet, from 0 on."""
    t = np.arange(len(curve.S)) / len(curve.S)
    return (curve.scale * t / (1.0 - t)) ** 2


def stored(k, state):
    """Stored energy (B,) in J/m2 of a batch of states (rows, B), without the table of energies."""
    own = dataclasses.replace(k, curve=_Integrated(*k.curve))
    return kernel.measures(own, state).stored


def step_work(k, state, d):
    """int_0^1 F(trial(t d)) . d dt of one joint: state (rows, 1), d (dim,)."""
    edges = _kinks(k, state, d)
    # the pieces of a tabulated virgin curve meet smoothly enough for four rules between kinks
    edges = np.interp(np.arange(0, 4 * len(edges) - 3) / 4, np.arange(len(edges)), edges)
    span = np.diff(edges)[:, None]
    t, w = (edges[:-1, None] + span * _T).ravel(), (span * _TW).ravel()
    F = kernel.step(k, np.repeat(state, len(t), axis=1), d[:, None] * t, False)[1]
    return float(w @ (d @ F))
