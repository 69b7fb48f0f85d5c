"""Work along steps: an adaptive quadrature that finds the places where anything changes branch."""

import numpy as np

from jointlaw.kernels import asperities
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.mating import planes
from jointlaw.kernels.wear import worn_share
from jointlaw.kernels.yielding import flatten

# Lobatto's rule of four points on 0 to 1, which looks at both ends of each part
_X, _W = [0.0, 0.5 - 0.05**0.5, 0.5 + 0.05**0.5, 1.0], np.array([1, 5, 5, 1]) / 12
# a step may change branch at once
_EDGES = np.array([0.0, *np.geomspace(1e-5, 1.0, 20)])


def work(power, exact):
    """int_0^1 power(j, t) dt (n,) of n steps, to about exact (n,).

    power: of the steps j (m,) at their times t (m,), what they do per time (m,).
    """

    def rule(j, a, b):
        return (b - a) * sum(w * power(j, a + x * (b - a)) for x, w in zip(_X, _W, strict=True))

    n, total = len(exact), np.zeros(len(exact))
    j, a, b = np.tile(np.arange(n), 20), np.repeat(_EDGES[:-1], n), np.repeat(_EDGES[1:], n)
    whole = rule(j, a, b)
    while len(j):
        middle = 0.5 * (a + b)
        left, right = rule(j, a, middle), rule(j, middle, b)
        good = (np.abs(left + right - whole) <= exact[j]) | (b - a < 1e-14)
        np.add.at(total, j[good], (left + right)[good])
        j, whole = np.tile(j[~good], 2), np.concatenate([left[~good], right[~good]])
        a, b = np.concatenate([[a, middle], [middle, b]], axis=1)[:, np.tile(~good, 2)]
    return total


def work_of_step(element, delta, d, state, exact):
    """Work (n,) of the tractions of an element that the steps t d (dim, n) lead to, t from 0 to 1,
    from places delta (dim, n) and states (rows, n)."""

    def power(j, t):
        new = state[:, j].copy()
        F = element.step(delta[:, j], t * d[:, j], state[:, j], new, False).F
        return np.sum(F * d[:, j], axis=0)

    return work(power, exact)


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


def step_work(k, states, d, exact):
    """Work (n,) along steps d (dim, n) from states as they begin (rows, n), to about exact (n,).

    The planes are those of the whole step, and y runs straight: docs/theory-incremental.md, "No
    step creates energy".
    """
    old, k = kernel.parts(k, states), k.asperities
    p0, p1, slopes = old.delta[1:], old.delta[1:] + d[1:], old.slopes
    middle = planes(k, 0.5 * (p0 + p1), slopes)
    gamma = np.maximum(planes(k, p0, slopes).gamma, planes(k, p1, slopes).gamma)
    y0, y1 = (asperities.effective_closure(k, x, slopes) for x in (old.delta, old.delta + d))
    limit = asperities.strength(k, np.broadcast_to(gamma, y0.shape))
    part = np.einsum("edmb,db->emb", middle.basis, d)

    def power(j, t):
        y, before = y0[:, j] + t * (y1 - y0)[:, j], asperities.cells(k, y0[:, j])
        after = asperities.cells(k, y)
        gained = after.G - before.G
        if k.yields:
            flat0 = asperities.cells(k, old.depth[:, j])
            gained = after.G - np.maximum(before.G, flat0.G)
            now = asperities.cells(k, flatten(k, old.depth[:, j], y))
            before, after = asperities.flattened(before, flat0), asperities.flattened(after, now)
        moved = (t * part[..., j])[:, :, None]
        sliders = asperities.load(k, before, gained, after, limit[..., j], old.q[..., j], moved)
        q = sliders.share * sliders.trial
        pressed = np.sum((k.area * k.c1)[:, None] * after.force * (y1 - y0)[:, j], axis=0)
        return pressed + np.einsum("emb,emdb->b", part[..., j], q) / k.lam

    return work(power, exact)
