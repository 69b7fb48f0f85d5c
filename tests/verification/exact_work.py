"""Work of a joint's own force along one step, split wherever a facet or a slider changes branch.

Where the virgin curve is tabulated its energy is a table of its own, which interpolates to 1e-10 of
itself: `stored` integrates the tabulated force instead.
"""

import dataclasses

import numpy as np

from jointlaw.discretisation.virgin_curve import VirginCurve
from jointlaw.kernels import asperities
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.mating import planes
from jointlaw.kernels.wear import worn_share
from jointlaw.kernels.yielding import flatten

_X, _W = np.polynomial.legendre.leggauss(16)
_X = 0.5 * (_X + 1.0)  # Gauss rule of 16 points on 0 to 1, with weights _W / 2
# a cubic that is flat at both ends smooths the powers of y at touch
_T, _TW = 3 * _X**2 - 2 * _X**3, 0.5 * _W * 6 * _X * (1 - _X)
_STARTS = np.unique(
    np.concatenate([[1e-14], np.geomspace(1e-5, 0.05, 16), np.linspace(0.0, 1.0, 49)[1:]])
)


def begun(k, state):
    """States (rows, B) as a step begins: slopes have worn by the work of friction so far."""
    new = state.copy()
    facets = k.asperities
    if facets.wears:
        old, now = kernel.parts(k, state), kernel.parts(k, new)
        now.worn[:] = worn_share(facets, old.worn, old.work)
        now.q[:], lost = asperities.wear(facets, old.delta, old, 1 - now.worn)
        now.dissipated[:] += lost
    return new


def walk(k, state, d):
    """States (rows, n + 1) of one joint, from (rows, 1) along n steps d (n, dim)."""
    states = [state]
    for step in d:
        states.append(kernel.step(k, states[-1], step[:, None], False)[0])
    return np.hstack(states)


def along(k, state, d, t):
    """Where steps d (dim, B) from states as they begin (rows, B) are at the time t (B,).

    The planes are those of the whole step, and y runs straight: docs/theory-incremental.md, "No
    step creates energy". Returns the power (B,), and on which side of every kink (kinks, B).
    """
    old, k = kernel.parts(k, state), k.asperities
    p0, p1, slopes = old.delta[1:], old.delta[1:] + d[1:], old.slopes
    middle = planes(k, 0.5 * (p0 + p1), slopes)
    gamma = np.maximum(planes(k, p0, slopes).gamma, planes(k, p1, slopes).gamma)
    y0, y1 = (asperities.effective_closure(k, x, slopes) for x in (old.delta, old.delta + d))
    before, after = asperities.cells(k, y0), asperities.cells(k, y0 + t * (y1 - y0))
    gained, depth, y, low = after.G - before.G, old.depth, after.y, k.depth[:, :-1, None]
    sides = [y[:, None] > low]
    if k.yields:
        depth, flat0 = flatten(k, old.depth, after.y), asperities.cells(k, old.depth)
        gained = after.G - np.maximum(before.G, flat0.G)
        now = asperities.cells(k, depth)
        before, after = asperities.flattened(before, flat0), asperities.flattened(after, now)
        sides += [depth[:, None] > low, depth > old.depth, y - k.yield_depth[:, None] >= depth]
    part = np.einsum("edmb,db->emb", middle.basis, d)
    limit = asperities.strength(k, gamma)
    sliders = asperities.load(k, before, gained, after, limit, old.q, (t * part)[:, :, None])
    q = sliders.share * sliders.trial
    power = np.sum((k.area * k.c1)[:, None] * after.force * (y1 - y0), axis=0)
    power = power + np.einsum("emb,emdb->b", part, q) / k.lam
    sides += [np.hypot(q[0], q[1]) >= sliders.cap * (1 - 1e-13), after.kappa > 0]
    return power, np.concatenate([side.reshape(-1, len(t)) for side in sides])


def _kinks(k, states, d):
    """Which step (n,), and when in it (n,), the branches change: bisection between a few starts."""

    def branches(which, t):
        return along(k, states[:, which], d[:, which], t)[1]

    steps = np.arange(d.shape[1])
    at = branches(np.repeat(steps, len(_STARTS)), np.tile(_STARTS, len(steps)))
    at = at.reshape(len(at), len(steps), -1)
    which, i = np.nonzero((at[..., 1:] != at[..., :-1]).any(axis=0))
    low, high, side = _STARTS[i], _STARTS[i + 1], at[:, which, i]
    found = [(np.repeat(steps, 2), np.tile([0.0, 1.0], len(steps)))]
    for _ in range(80):  # several changes between two starts: one after the other
        if low.size == 0:
            break
        a, b = low, high
        for _ in range(46):
            c = 0.5 * (a + b)
            same = (branches(which, c) == side).all(axis=0)
            a, b = np.where(same, c, a), np.where(same, b, c)
        found.append((which, b))
        after, end = branches(which, b), branches(which, high)
        more = (after != end).any(axis=0) & (b < high)
        which, low, high, side = which[more], b[more], high[more], after[:, more]
    return np.unique(np.concatenate(found, axis=1), axis=1)


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
    facets, *beside = k.elements
    own = dataclasses.replace(facets.k, curve=_Integrated(*facets.k.curve))
    whole = kernel.Tables(k.dim, (asperities.Asperities(own), *beside))
    return kernel.measures(whole, state).stored


def step_work(k, states, d):
    """Work (n,) along steps d (dim, n), by `along`, of states as they begin (rows, n)."""
    which, edges = _kinks(k, states, d)
    # the pieces of a tabulated virgin curve meet smoothly enough for four rules between kinks
    start = np.repeat(edges[:-1], 4) + np.outer(np.diff(edges) / 4, np.arange(4)).ravel()
    inside = np.repeat(which[1:] == which[:-1], 4)
    start, span = start[inside], np.repeat(np.diff(edges) / 4, 4)[inside]
    which = np.repeat(np.repeat(which[:-1], 4)[inside].astype(int), len(_T))
    t, w = start[:, None] + span[:, None] * _T, span[:, None] * _TW
    power = along(k, states[:, which], d[:, which], t.ravel())[0]
    return np.bincount(which, w.ravel() * power)
