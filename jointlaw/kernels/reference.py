"""The readable kernel: one step of a batch of joints, in the order of law.md sections 6 to 8.

Every other kernel is tested against this one. Arrays carry physical axes first and joints last:
facets (M, B), cells (M, D, B), sliders (2, M, D, B). State (rows, B) holds

    delta (dim) | in-plane offset (dim - 1) | dissipated energy (1) | q (2 M D)

where q is the shear force of a slider times lam, in the (s, t) basis of Eq. 25.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..law import NOTHING, Tables
from ..support.checks import Array

NEAR = 1e-5  # of y: below such a change of y the chord of G is lost in rounding, the mean is not
GRAZING = 1e-12  # cosine at which the leash grows taut: its derivative has a pole at 0
LIMIT = 1e-9  # of the friction limit: a slider this close is at it, less the rounding of q
ROUNDED = 1e-12  # of Phi: as much may be lost in a G next to a node
TINY = 1e-290  # a stiffness whose reciprocal might overflow, or a square that underflows: nothing


class State(NamedTuple):
    """The parts of a state array (rows, B), as views."""

    delta: Array
    offset: Array
    dissipated: Array
    q: Array


def parts(k: Tables, state: Array) -> State:
    """Views of delta, offset, dissipated energy and q (2, M, D, B) in a state array."""
    dim = k.dim
    q = state[2 * dim :].reshape(2, len(k.c1), k.cells, -1)
    return State(state[:dim], state[dim : 2 * dim - 1], state[2 * dim - 1], q)


def closures(k: Tables, closure: Array, offset: Array) -> Array:
    """Effective closure y = n . (closure, offset)/c1 of every facet (M, B)."""
    y: Array = k.m[0][:, None] * closure
    for row, o in zip(k.m[1:], offset, strict=True):
        y = y + row[:, None] * o
    return np.where(np.abs(y) < NOTHING, 0.0, y)


def cells(k: Tables, y: Array, force: Array, slope: Array) -> tuple[Array, Array]:
    """G_i and kappa_i of every depth cell (M, D, B), law.md section 6."""
    low, high = k.depth[:, :-1, None], k.depth[:, 1:, None]
    low_force, high_force = k.depth_force[:, :-1, None], k.depth_force[:, 1:, None]
    low_slope, high_slope = k.depth_slope[:, :-1, None], k.depth_slope[:, 1:, None]
    y, force, slope = y[:, None], force[:, None], slope[:, None]
    reach = np.clip(y, low, high)
    # by place, not by size: beyond its last height a tabulated slope wavers by its rounding
    kappa = np.where(y > high, high_slope, slope) - low_slope
    kappa = np.where(y > low, np.maximum(kappa, 0.0), 0.0)
    stored = np.clip(force, low_force, high_force) - low_force - low_slope * (reach - low)
    G = kappa * (y - reach) + stored
    return np.clip(G, 0.0, kappa * np.maximum(y - low, 0.0)), kappa


def reciprocal(kappa: Array) -> Array:
    """1/kappa, 0 where there is no stiffness."""
    return np.divide(1.0, kappa, out=np.zeros_like(kappa), where=kappa > TINY)


def compliance(k: Tables) -> Array:
    """c1/(2 A lam) per facet (M, 1, 1): turns |q|^2/kappa into energy; 0 for an empty facet."""
    scale = 2 * k.area * k.lam
    return np.divide(k.c1, scale, out=np.zeros_like(scale), where=scale > 0)[:, None, None]


def drag(k: Tables, offset: Array, p: Array) -> tuple[Array, Array, Array]:
    """The leash of law.md section 8: offset after the in-plane step p, its derivative, the slip.

    Returns offset (dim-1, B), d offset/d p (dim-1, dim-1, B) and int cos(alpha) ds (B), the part of
    the drag along the offset, which times the resultant T . o/|o| is the energy it dissipates.
    """
    size, free = len(offset), offset + p
    J = np.broadcast_to(np.eye(size)[:, :, None], (size, *free.shape)).copy()
    slip = np.zeros(free.shape[1])
    D = k.critical_slip
    # outside by rounding and on the way in is not taut
    taut = np.flatnonzero((np.sum(free**2, axis=0) > D * D) & (np.sum(free * p, axis=0) > 0))
    if taut.size == 0:
        return free, J, slip
    o, step = offset[:, taut], p[:, taut]
    length = np.hypot(step[0], step[-1] if size == 2 else 0.0)
    e = step / length
    along = np.sum(o * e, axis=0)
    inside = -along + np.sqrt(np.maximum(D * D - np.sum(o**2, axis=0) + along**2, 0.0))
    inside = np.clip(inside, 0.0, length)  # way until the leash is taut
    o = o + inside * e
    x = (length - inside) / D
    across = np.array([-e[1], e[0]]) if size == 2 else np.zeros_like(e)
    cos, sin = np.clip(np.sum(o * e, axis=0) / D, 0.0, 1.0), np.sum(o * across, axis=0) / D
    decay, rest = np.exp(-x), -np.expm1(-x)
    bottom = (1 + cos) + (1 - cos) * decay**2
    cos1, sin1 = ((1 + cos) - (1 - cos) * decay**2) / bottom, 2 * sin * decay / bottom
    free[:, taut] = D * (cos1 * e + sin1 * across)
    slip[taut] = D * (x + np.log(bottom / 2))
    # d(angle of the offset) = turn d(angle of e) - sin1/D d(length), and e turns with step
    grazing = np.maximum(cos, GRAZING)
    turn = (rest**2 + cos * rest * (1 + decay)) / bottom
    turn = turn + inside / (D * grazing) * (2 * decay / bottom - sin1 * sin)
    new_across = np.array([-free[1, taut], free[0, taut]]) if size == 2 else np.zeros_like(e)
    row = turn / length * across - sin1 / D * e
    J[:, :, taut] = new_across[:, None] * row[None]
    return free, J, slip


def step(k: Tables, state: Array, d: Array, tangent: bool) -> tuple[Array, Array, Array | None]:
    """Advance a batch by the increments d (dim, B): new state, F (dim, B), C (dim, dim, B)."""
    old = parts(k, state)
    new_state = np.empty_like(state)
    new = parts(k, new_state)
    new.delta[:] = old.delta + d
    offset, J_offset, slip = drag(k, old.offset, d[1:])
    new.offset[:] = offset

    y0 = closures(k, old.delta[0], old.offset)
    y1 = closures(k, new.delta[0], offset)
    force1, slope1 = k.curve.force(y1)
    G0, kappa0 = cells(k, y0, *k.curve.force(y0))
    G1, kappa1 = cells(k, y1, force1, slope1)
    dy = (y1 - y0)[:, None]
    near = np.abs(dy) <= NEAR * np.abs(y1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = np.where(near, 0.5 * (kappa0 + kappa1), (G1 - G0) / dy)
    chord = np.clip(chord, np.minimum(kappa0, kappa1), np.maximum(kappa0, kappa1))

    basis = np.stack([k.s, k.t])  # (2, dim, M)
    de = np.einsum("edm,db->emb", basis, d)[:, :, None]  # facet-plane increment (2, M, 1, B)
    a = (k.area / k.c1)[:, None, None]
    grows = kappa1 > kappa0
    kept = np.divide(kappa1, kappa0, out=np.zeros_like(kappa0), where=kappa0 > 0)
    trial = np.where(grows, old.q + a * chord * de, old.q * kept + a * kappa1 * de)
    cap = k.mu * k.lam * k.area[:, None, None] * G1
    size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
    share = np.divide(cap, size, out=np.ones_like(size), where=size > cap)
    trial2 = size**2
    new.q[:] = np.where(trial2 > TINY, share, 0.0) * trial  # a size that underflows has no cap
    F = k.n @ (k.area[:, None] * force1)
    F = F + np.einsum("edm,emb->db", basis, new.q.sum(axis=2)) / k.lam

    # Dissipation, each term >= 0 as written (law.md section 6, kappa0 <= chord <= kappa1)
    q2 = old.q[0] ** 2 + old.q[1] ** 2
    r0, r1, rc = reciprocal(kappa0), reciprocal(kappa1), reciprocal(chord)
    hardening = trial2 * (rc - r1) + np.where(kappa0 > TINY, q2 * (r0 - rc), 0.0)
    softening = (kappa0 - kappa1) * r0 * (q2 * r0)
    lost = np.where(grows, np.where(chord > TINY, hardening, 0.0), softening)
    lost = lost + 2 * share * (1 - share) * (trial2 * r1)
    new.dissipated[:] = old.dissipated + np.sum(compliance(k) * lost, axis=(0, 1))
    if slip.any():
        pull = k.n[1:] @ (k.area[:, None] * force1)  # in-plane resultant of the normal forces
        # >= 0 by symmetry of the facets, but for rounding
        pulled = np.maximum(np.sum(pull * offset, axis=0), 0.0)
        new.dissipated[:] += slip * pulled / k.critical_slip
    if not tangent:
        return new_state, F, None

    # Tangent, law.md section 7: J_q = beta (I - s s^T) E + v g^T per cell, summed over cells
    p = np.where((y1[:, None] > k.depth[:, :-1, None]) & (y1[:, None] < k.depth[:, 1:, None]),
                 k.curve.curvature(y1)[:, None], 0.0)  # fmt: skip
    with np.errstate(divide="ignore", invalid="ignore"):
        chord_slope = np.where(near, p / 2, (kappa1 - chord) / dy)
    v = np.where(grows, a * chord_slope * de, p * r1 * trial)
    beta = np.where(kappa1 > 0, a * np.where(grows, chord, kappa1), 0.0)
    unit = np.divide(trial, size, out=np.zeros_like(trial), where=size > 0)
    slips = size > cap
    v = np.where(slips, share * (v - unit * np.sum(unit * v, axis=0)), v)
    v = v + np.where(slips, k.mu * k.lam * k.area[:, None, None] * kappa1 * unit, 0.0)
    beta = np.where(slips, share * beta, beta)
    outer = np.where(slips, unit[:, None] * unit[None], 0.0)
    inner = np.sum(beta * (np.eye(2)[:, :, None, None, None] - outer), axis=3)  # (2, 2, M, B)
    g = np.broadcast_to(k.m[:, :, None], (k.dim, *y1.shape)).copy()
    g[1:] = np.einsum("om,opb->pmb", k.m[1:], J_offset)
    along = k.n[:, :, None] * (k.area[:, None] * slope1)
    along = along + np.einsum("edm,emb->dmb", basis, np.sum(v, axis=2)) / k.lam
    C = np.einsum("imb,jmb->ijb", along, g)
    C = C + np.einsum("eim,efmb,fjm->ijb", basis, inner, basis) / k.lam
    return new_state, F, C


def traction(k: Tables, state: Array) -> Array:
    """Traction F (dim, B) in Pa that a state carries."""
    now = parts(k, state)
    force, _ = k.curve.force(closures(k, now.delta[0], now.offset))
    shear = np.einsum("edm,emb->db", np.stack([k.s, k.t]), now.q.sum(axis=2))
    F: Array = k.n @ (k.area[:, None] * force) + shear / k.lam
    return F


class Measures(NamedTuple):
    """What the states of joints amount to, arrays (n,): law.md section 8b."""

    sliding: Array  # share of all facet orientations: in touch, every cell at its limit
    slipping: Array  # share of the friction capacity that is at its limit
    separated: Array  # share of all facet orientations: out of touch
    stored: Array  # elastic energy, J/m2
    reach: Array  # largest effective closure of any facet, m


def measures(k: Tables, state: Array) -> Measures:
    """Shares, stored energy and reach of a batch of states (rows, B)."""
    now = parts(k, state)
    y = closures(k, now.delta[0], now.offset)
    force, slope = k.curve.force(y)
    G, kappa = cells(k, y, force, slope)
    q2 = now.q[0] ** 2 + now.q[1] ** 2
    strength = k.mu * k.lam * k.area[:, None, None]
    capped = np.sqrt(q2) >= strength * (G * (1 - LIMIT) - ROUNDED * force[:, None])
    weight = (k.weight / k.weight.sum())[:, None]
    touches = y > 0
    sliding = np.sum(weight * (touches & np.all(capped, axis=1)), axis=0)
    total = np.where(force > 0, force, 1.0)
    slipping = np.sum(weight * np.sum(np.where(capped, G, 0.0), axis=1) / total, axis=0)
    separated = np.sum(weight * ~touches, axis=0)
    stored = np.sum((k.area * k.c1)[:, None] * k.curve.energy(y), axis=0)
    stored = stored + np.sum(compliance(k) * q2 * reciprocal(kappa), axis=(0, 1))
    return Measures(sliding, slipping, separated, stored, np.max(y, axis=0))
