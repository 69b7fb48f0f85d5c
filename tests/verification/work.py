"""Work along steps: an adaptive quadrature that locates the changes of branch."""

import numpy as np

from jointlaw.kernels import asperities
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.cells import evaluate_cells
from jointlaw.kernels.degradation import degrade_slopes
from jointlaw.kernels.interlock import planes
from jointlaw.kernels.plasticity import subtract_plastic, update_indentation

# Lobatto's rule of four points on 0 to 1, which has points at both ends of each part
_NODES = [0.0, 0.5 - 0.05**0.5, 0.5 + 0.05**0.5, 1.0]
_WEIGHTS = np.array([1, 5, 5, 1]) / 12
# a step may change branch at its very start
_EDGES = np.array([0.0, *np.geomspace(1e-5, 1.0, 20)])
_SMALLEST_PART = 1e-14


def integrate_power(power, exact):
    """int_0^1 power(j, t) dt (n,) of n steps, to about exact (n,).

    power: work per time (m,) of the steps j (m,) at their times t (m,).
    """

    def lobatto(j, a, b):
        values = [w * power(j, a + x * (b - a)) for x, w in zip(_NODES, _WEIGHTS, strict=True)]
        return (b - a) * sum(values)

    n = len(exact)
    total = np.zeros(n)
    j = np.tile(np.arange(n), 20)
    a = np.repeat(_EDGES[:-1], n)
    b = np.repeat(_EDGES[1:], n)
    whole = lobatto(j, a, b)
    while len(j):
        middle = 0.5 * (a + b)
        first_half = lobatto(j, a, middle)
        second_half = lobatto(j, middle, b)
        halves = first_half + second_half
        is_exact = (np.abs(halves - whole) <= exact[j]) | (b - a < _SMALLEST_PART)
        np.add.at(total, j[is_exact], halves[is_exact])
        refined = ~is_exact
        j = np.tile(j[refined], 2)
        whole = np.concatenate([first_half[refined], second_half[refined]])
        a, b = np.concatenate([[a, middle], [middle, b]], axis=1)[:, np.tile(refined, 2)]
    return total


def work_of_step(element, delta, d, state, exact):
    """Work (n,) of the tractions of an element along steps t d (dim, n), t from 0 to 1.

    From displacements delta (dim, n) and states (rows, n), to about exact (n,).
    """

    def power(j, t):
        new_state = state[:, j].copy()
        F = element.step(delta[:, j], t * d[:, j], state[:, j], new_state, False).F
        return np.sum(F * d[:, j], axis=0)

    return integrate_power(power, exact)


def degraded(k, state):
    """States (rows, B) at the start of a step: after degradation by the work of friction so far."""
    new_state = state.copy()
    facets = k.asperities
    if facets.degrades:
        old = kernel.state_parts(k, state)
        new = kernel.state_parts(k, new_state)
        new.lost_slopes[:] = degrade_slopes(facets, old)
        new.q[:], dissipation = asperities.degrade(facets, old.delta, old, 1 - new.lost_slopes)
        new.dissipated_energy[:] += dissipation
    return new_state


def states_along(k, state, d):
    """States (rows, n + 1) of one joint, from (rows, 1) along n steps d (n, dim)."""
    states = [state]
    for step in d:
        states.append(kernel.step(k, states[-1], step[:, None], False)[0])
    return np.hstack(states)


def work_on_step_geometry(k, states, d, end_slopes, exact):
    """Work (n,) along steps d (dim, n) from degraded states (rows, n), to about exact (n,).

    The planes are constant in a step, and y varies linearly: docs/theory-incremental.md,
    "Dissipation is non-negative along the geometry of the step". Where slopes decrease by stress,
    to the retention end_slopes (n,), this is the external work less the energy that normal springs
    dissipate as slopes decrease.
    """
    old = kernel.state_parts(k, states)
    facets = k.asperities
    slopes = old.slope_retention
    p0 = old.delta[1:]
    p1 = p0 + d[1:]
    middle = planes(facets, 0.5 * (p0 + p1), 0.5 * (slopes + end_slopes))
    gamma = np.maximum(planes(facets, p0, slopes).gamma, planes(facets, p1, end_slopes).gamma)
    y0 = asperities.effective_closure(facets, old.delta, slopes)
    y1 = asperities.effective_closure(facets, old.delta + d, end_slopes)
    limit = asperities.friction_limit(facets, np.broadcast_to(gamma, y0.shape))
    in_plane = np.einsum("edmb,db->emb", middle.basis, d)

    def power(j, t):
        y = y0[:, j] + t * (y1 - y0)[:, j]
        before = evaluate_cells(facets, y0[:, j])
        after = evaluate_cells(facets, y)
        gained = after.G - before.G
        if facets.yields:
            old_indentation = evaluate_cells(facets, old.indentation[:, j])
            gained = after.G - np.maximum(before.G, old_indentation.G)
            indentation = evaluate_cells(
                facets, update_indentation(facets, old.indentation[:, j], y)
            )
            before = subtract_plastic(before, old_indentation)
            after = subtract_plastic(after, indentation)
        slip = (t * in_plane[..., j])[:, :, None]
        sliders = asperities.load_sliders(
            facets, before, gained, after, limit[..., j], old.q[..., j], slip
        )
        q = sliders.scale * sliders.trial
        normal_force = (facets.area * facets.c1)[:, None] * after.force
        normal_power = np.sum(normal_force * (y1 - y0)[:, j], axis=0)
        return normal_power + np.einsum("emb,emdb->b", in_plane[..., j], q) / facets.lam

    return integrate_power(power, exact)
