"""The readable kernel: one step of a batch of joints. Every other kernel is tested against it.

Symbols and order are those of docs/theory-incremental.md. Arrays carry physical axes first and
joints last: facets (M, B), cells (M, D, B), sliders (2, M, D, B). State (rows, B) holds

    delta (dim) | in-plane offset (dim - 1) | dissipated energy (1) | q (2 M D)

where q is the shear force of a slider times lam, in the (s, t) basis of Eq. 25. With asperities
that yield follow flattened depth (M) | plastic work (1); with wear, slip of the asperities (1) and
by how much mu had fallen in the last step (1); with a bond its damage (1).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..discretisation.tables import Tables
from ..support.checks import Array
from ..support.thresholds import GRAZING, LIMIT, NEAR, ROUNDED, TINY, UNDERFLOW
from .bond import hold
from .cells import Cells, cells, compliance, reciprocal
from .wear import friction, slipped, within_limit
from .yielding import flatten, flattened, plastic_work, softening

Flags = NDArray[np.bool_]


class State(NamedTuple):
    """The parts of a state array (rows, B), as views."""

    delta: Array
    offset: Array
    dissipated: Array
    q: Array
    depth: Array  # flattened depth of every facet (M, B), no rows where asperities do not yield
    plastic: Array  # (B,) or no rows
    slip: Array  # of the asperities (B,), or no rows
    fallen: Array  # by how much mu had fallen in the last step (B,), or no rows
    damage: Array  # of the bond (B,), or no rows


class Sliders(NamedTuple):
    """The sliders of a step: trial forces (2, M, D, B), the rest (M, D, B)."""

    trial: Array  # q before the friction limit
    size: Array  # |trial|
    strength: Array  # mu lam A: the friction limit of q over G
    cap: Array  # mu lam A G: the friction limit of q
    share: Array  # cap over size where the slider slips, 1 elsewhere
    chord: Array  # of G over the step: stiffness of springs that were added on the way
    grows: Flags  # whether the stiffness of the cell has grown
    near: Flags  # whether y has hardly changed
    slips: Flags  # whether the slider is at its friction limit, but for rounding

    @property
    def unit(self) -> Array:
        """Direction of the trial force (2, M, D, B)."""
        size = self.size
        return np.divide(self.trial, size, out=np.zeros_like(self.trial), where=size > 0)

    @property
    def push(self) -> Array:
        """Derivative (2, M, D, B) of q by G: mu lam A along a slider that slips, 0 elsewhere."""
        return np.where(self.slips, self.strength * self.unit, 0.0)


def step(k: Tables, state: Array, d: Array, tangent: bool) -> tuple[Array, Array, Array | None]:
    """Advance joints by the increments d (dim, B): new state, F (dim, B), C (dim, dim, B).

    1. The joint moves: delta += d, and the in-plane offset with it, up to critical_slip ("Large
       shear"). Every facet then has y = n . (closure, offset)/c1, before and after.
    2. Virgin curve at y: Phi, Phi', and the share G, kappa = dG/dy of every depth cell ("Few
       cells, exact virgin curve").
    3. Sliders are loaded by the facet-plane increment de = (I - n n^T) d. Where kappa grew,
       q += A/c1 chord de; where it fell, the springs that part take their force along,
       q = q kappa1/kappa0 + A/c1 kappa1 de.
    4. Coulomb friction: |q| <= mu lam A G (Eq. 5, 6).
       Where asperities yield, Phi, G and kappa are less their values at the flattened depth
       ("Yielding"). With wear mu has fallen, and q is reduced to its new limit ("Wear").
    5. Traction: F = sum of A Phi n + (1/lam) sum of q (Eq. 21).
    6. Dissipated energy, every term >= 0 ("No step creates energy").
    7. Tangent C = dF/dd ("The tangent"), not without `tangent`.
    8. The bond, if there is one, adds its own F, dissipated energy and C ("The bond").
    """
    old = parts(k, state)
    new_state = np.empty_like(state)
    new = parts(k, new_state)
    new.delta[:] = old.delta + d
    offset, J_offset, slip = limited_offset(k, old.offset, d[1:])
    new.offset[:] = offset

    before = cells(k, effective_closure(k, old.delta[0], old.offset))
    after = cells(k, effective_closure(k, new.delta[0], offset))
    gained, flat0, flat1 = after.G - before.G, None, None
    if k.yields:
        new.depth[:] = flatten(k, old.depth, after.y)
        flat0, flat1 = cells(k, old.depth), cells(k, new.depth)
        new.plastic[:] = old.plastic + plastic_work(k, before.y, after.y, flat0, flat1)
        gained = after.G - np.maximum(before.G, flat0.G)
        before, after = flattened(before, flat0), flattened(after, flat1)
    q, lost, mu = old.q, np.zeros(d.shape[1]), np.asarray(k.mu)
    if k.wears:
        mu = friction(k, old.slip)
        q, lost = within_limit(k, before, q, strength(k, mu), old.fallen, mu)
        new.fallen[:] = k.mu - mu

    basis = np.stack([k.s, k.t])  # (2, dim, M)
    de = np.einsum("edm,db->emb", basis, d)[:, :, None]  # facet-plane increment (2, M, 1, B)
    sliders = load(k, before, gained, after, strength(k, mu), q, de)
    resolved = sliders.size**2 > TINY  # squares of smaller forces underflow: they count as zero
    new.q[:] = np.where(resolved, sliders.share, 0.0) * sliders.trial

    F = k.n @ (k.area[:, None] * after.force)
    F = F + np.einsum("edm,emb->db", basis, new.q.sum(axis=2)) / k.lam

    lost = lost + friction_loss(k, before, after, q, sliders)
    new.dissipated[:] = old.dissipated + lost
    if slip.any():
        pull = k.n[1:] @ (k.area[:, None] * after.force)  # in-plane part of the normal forces
        # >= 0 by symmetry of the facets, but for rounding
        pulled = np.maximum(np.sum(pull * offset, axis=0), 0.0)
        new.dissipated[:] += slip * pulled / k.critical_slip
    if k.wears:
        rubbed = new.dissipated - old.dissipated
        new.slip[:] = old.slip + slipped(k, before, after, mu, rubbed)
    if k.yields:
        new.dissipated[:] += new.plastic - old.plastic
    held = None
    if k.bond is not None:
        held = hold(k.bond, new.delta, old.damage)
        new.damage[:] = held.damage
        new.dissipated[:] += held.lost
        F = F + held.F
    if not tangent:
        return new_state, F, None
    g = gradient(k, J_offset)
    C = stiffness(k, before, after, sliders, de, g)
    if flat0 is not None and flat1 is not None:
        C = C - softening(k, after, flat0, flat1, sliders.push, g)
    if held is not None:
        C = C + held.C
    return new_state, F, C


def parts(k: Tables, state: Array) -> State:
    """Views of the parts of a state array, q as (2, M, D, B)."""
    dim, M = k.dim, len(k.c1)
    damage = state[-1] if k.bond is not None else state[:0]
    state = state[:-1] if k.bond is not None else state
    q, rest = np.split(state[2 * dim :], [2 * M * k.cells])
    depth, plastic = (rest[:M], rest[M]) if k.yields else (rest[:0], rest[:0])
    slip, fallen = rest[-2:] if k.wears else (rest[:0], rest[:0])
    place = state[:dim], state[dim : 2 * dim - 1], state[2 * dim - 1]
    return State(*place, q.reshape(2, M, k.cells, -1), depth, plastic, slip, fallen, damage)


def effective_closure(k: Tables, closure: Array, offset: Array) -> Array:
    """Effective closure y = n . (closure, offset)/c1 of every facet (M, B)."""
    y: Array = k.m[0][:, None] * closure
    for row, o in zip(k.m[1:], offset, strict=True):
        y = y + row[:, None] * o
    return np.where(np.abs(y) < UNDERFLOW, 0.0, y)


def load(
    k: Tables, before: Cells, gained: Array, after: Cells, strength: Array, q: Array, de: Array
) -> Sliders:
    """Trial forces of all sliders and their friction limits: steps 3 and 4 of `step`.

    gained: what G of every cell grows by, before springs yield at the new y, which they do at once.
    """
    kappa0, kappa1 = before.kappa, after.kappa
    dy = (after.y - before.y)[:, None]
    near = np.abs(dy) <= NEAR * np.abs(after.y)[:, None]
    if k.yields:  # all flattened springs touch at one closure: the mean is wrong in that step
        near = near & ((kappa0 > 0) | (kappa1 == 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = np.where(near, 0.5 * (kappa0 + kappa1), gained / dy)
    chord = np.clip(chord, np.minimum(kappa0, kappa1), np.maximum(kappa0, kappa1))
    a = (k.area / k.c1)[:, None, None]
    grows = kappa1 > kappa0
    kept = np.divide(kappa1, kappa0, out=np.zeros_like(kappa0), where=kappa0 > 0)
    trial = np.where(grows, q + a * chord * de, q * kept + a * kappa1 * de)
    cap = strength * after.G
    size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
    share = np.divide(cap, size, out=np.ones_like(size), where=size > cap)
    force = k.curve.force(after.y)[0] if k.yields else after.force
    slips = at_limit(size, strength, after.G, force)
    return Sliders(trial, size, strength, cap, share, chord, grows, near, slips)


def strength(k: Tables, mu: Array) -> Array:
    """mu lam A per facet (M, 1, 1 or B): the friction limit of q over G."""
    return mu * k.lam * k.area[:, None, None]


def at_limit(size: Array, strength: Array, G: Array, force: Array) -> Flags:
    """Whether sliders whose |q| is `size` are at their friction limit, but for rounding.

    force: Phi (M, B) of the virgin curve, whose rounding G has.
    """
    return size >= strength * (G * (1 - LIMIT) - ROUNDED * force[:, None])


def friction_loss(k: Tables, before: Cells, after: Cells, q: Array, sliders: Sliders) -> Array:
    """Energy (B,) in J/m2 that sliders, and springs that part under shear, lose in a step.

    Each term is >= 0 as written, for kappa0 <= chord <= kappa1 where the stiffness grows.
    """
    kappa0, chord, share = before.kappa, sliders.chord, sliders.share
    q2, trial2 = q[0] ** 2 + q[1] ** 2, sliders.size**2
    r0, r1, rc = reciprocal(kappa0), reciprocal(after.kappa), reciprocal(chord)
    hardening = trial2 * (rc - r1) + np.where(kappa0 > TINY, q2 * (r0 - rc), 0.0)
    softening = (kappa0 - after.kappa) * r0 * (q2 * r0)
    lost = np.where(sliders.grows, np.where(chord > TINY, hardening, 0.0), softening)
    lost = lost + 2 * share * (1 - share) * (trial2 * r1)
    return np.sum(compliance(k) * lost, axis=(0, 1))


def limited_offset(k: Tables, offset: Array, p: Array) -> tuple[Array, Array, Array]:
    """The offset after the in-plane step p, dragged along where it is at its limit D_c.

    Returns offset (dim-1, B), d offset/d p (dim-1, dim-1, B) and int cos(alpha) ds (B), the part of
    the drag along the offset, which times the resultant T . o/|o| is the energy it dissipates.
    docs/theory-incremental.md, "Large shear".
    """
    size, free = len(offset), offset + p
    J = np.broadcast_to(np.eye(size)[:, :, None], (size, *free.shape)).copy()
    slip = np.zeros(free.shape[1])
    D = k.critical_slip
    # an offset that is outside by rounding and moves inwards is not at the limit
    held = np.flatnonzero((np.sum(free**2, axis=0) > D * D) & (np.sum(free * p, axis=0) > 0))
    if held.size == 0:
        return free, J, slip
    o, step = offset[:, held], p[:, held]
    length = np.hypot(step[0], step[-1] if size == 2 else 0.0)
    e = step / length
    along = np.sum(o * e, axis=0)
    inside = -along + np.sqrt(np.maximum(D * D - np.sum(o**2, axis=0) + along**2, 0.0))
    inside = np.clip(inside, 0.0, length)  # way until the offset is at its limit
    o = o + inside * e
    x = (length - inside) / D
    across = np.array([-e[1], e[0]]) if size == 2 else np.zeros_like(e)
    cos, sin = np.clip(np.sum(o * e, axis=0) / D, 0.0, 1.0), np.sum(o * across, axis=0) / D
    decay, rest = np.exp(-x), -np.expm1(-x)
    bottom = (1 + cos) + (1 - cos) * decay**2
    cos1, sin1 = ((1 + cos) - (1 - cos) * decay**2) / bottom, 2 * sin * decay / bottom
    free[:, held] = D * (cos1 * e + sin1 * across)
    slip[held] = D * (x + np.log(bottom / 2))
    # d(angle of the offset) = turn d(angle of e) - sin1/D d(length), and e turns with step
    grazing = np.maximum(cos, GRAZING)
    turn = (rest**2 + cos * rest * (1 + decay)) / bottom
    turn = turn + inside / (D * grazing) * (2 * decay / bottom - sin1 * sin)
    new_across = np.array([-free[1, held], free[0, held]]) if size == 2 else np.zeros_like(e)
    row = turn / length * across - sin1 / D * e
    J[:, :, held] = new_across[:, None] * row[None]
    return free, J, slip


def gradient(k: Tables, J_offset: Array) -> Array:
    """g = dy/dd of every facet (dim, M, B)."""
    g = np.broadcast_to(k.m[:, :, None], (*k.m.shape, J_offset.shape[2])).copy()
    g[1:] = np.einsum("om,opb->pmb", k.m[1:], J_offset)
    return g


def stiffness(
    k: Tables, before: Cells, after: Cells, sliders: Sliders, de: Array, g: Array
) -> Array:
    """Tangent C = dF/dd (dim, dim, B): J_q = beta (I - s s^T) E + v g^T per cell, summed."""
    trial, share, chord, grows = sliders.trial, sliders.share, sliders.chord, sliders.grows
    y, kappa = after.y, after.kappa
    a = (k.area / k.c1)[:, None, None]
    depth = k.depth[:, :, None]
    inside = (y[:, None] > depth[:, :-1]) & (y[:, None] < depth[:, 1:])
    p = np.where(inside, k.curve.curvature(y)[:, None], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        chord_slope = np.where(sliders.near, p / 2, (kappa - chord) / (y - before.y)[:, None])
    # rounding must not decide: a facet that did not close has not grown; q at its limit slips
    stiffer = grows & ((y - before.y) > ROUNDED * np.abs(y))[:, None]
    v = np.where(stiffer, a * chord_slope * de, p * reciprocal(kappa) * trial)
    beta = np.where(sliders.cap > 0, a * np.where(grows, chord, kappa), 0.0)
    slips, unit = sliders.slips, sliders.unit
    v = np.where(slips, share * (v - unit * np.sum(unit * v, axis=0)), v)
    v = v + np.where(slips, sliders.strength * kappa * unit, 0.0)
    beta = np.where(slips, share * beta, beta)
    outer = np.where(slips, unit[:, None] * unit[None], 0.0)
    inner = np.sum(beta * (np.eye(2)[:, :, None, None, None] - outer), axis=3)  # (2, 2, M, B)
    basis = np.stack([k.s, k.t])
    along = k.n[:, :, None] * (k.area[:, None] * after.slope)
    along = along + np.einsum("edm,emb->dmb", basis, np.sum(v, axis=2)) / k.lam
    C: Array = np.einsum("imb,jmb->ijb", along, g)
    C = C + np.einsum("eim,efmb,fjm->ijb", basis, inner, basis) / k.lam
    return C


def traction(k: Tables, state: Array) -> Array:
    """Traction F (dim, B) in Pa that a state carries."""
    now = parts(k, state)
    y = effective_closure(k, now.delta[0], now.offset)
    force, _ = k.curve.force(y)
    if k.yields:
        force = np.where(y > now.depth, force - k.curve.force(now.depth)[0], 0.0)
    shear = np.einsum("edm,emb->db", np.stack([k.s, k.t]), now.q.sum(axis=2))
    F: Array = k.n @ (k.area[:, None] * force) + shear / k.lam
    return F if k.bond is None else F + hold(k.bond, now.delta, now.damage).F


class Measures(NamedTuple):
    """What the states of joints amount to, arrays (n,): docs/theory-incremental.md."""

    sliding: Array  # share of all facet orientations: in touch, every cell at its limit
    slipping: Array  # share of the friction capacity that is at its limit
    separated: Array  # share of all facet orientations: out of touch
    stored: Array  # elastic energy, J/m2
    reach: Array  # largest effective closure of any facet, m


def measures(k: Tables, state: Array) -> Measures:
    """Shares, stored energy and reach of a batch of states (rows, B)."""
    state_now = parts(k, state)
    virgin = cells(k, effective_closure(k, state_now.delta[0], state_now.offset))
    now = flattened(virgin, cells(k, state_now.depth) if k.yields else None)
    y, force, G = now.y, now.force, now.G
    mu = friction(k, state_now.slip) if k.wears else np.asarray(k.mu)
    q2 = state_now.q[0] ** 2 + state_now.q[1] ** 2
    capped = at_limit(np.sqrt(q2), strength(k, mu), G, virgin.force)
    weight = (k.weight / k.weight.sum())[:, None]
    touches = y > (state_now.depth if k.yields else 0.0)
    sliding = np.sum(weight * (touches & np.all(capped, axis=1)), axis=0)
    total = np.where(force > 0, force, 1.0)
    slipping = np.sum(weight * np.sum(np.where(capped, G, 0.0), axis=1) / total, axis=0)
    separated = np.sum(weight * ~touches, axis=0)
    normal = k.curve.energy(y)
    if k.yields:
        depth = state_now.depth
        normal = normal - k.curve.energy(depth) - k.curve.force(depth)[0] * (y - depth)
        normal = np.where(touches, np.maximum(normal, 0.0), 0.0)
    stored = np.sum((k.area * k.c1)[:, None] * normal, axis=0)
    stored = stored + np.sum(compliance(k) * q2 * reciprocal(now.kappa), axis=(0, 1))
    if k.bond is not None:
        stored = stored + hold(k.bond, state_now.delta, state_now.damage).stored
    return Measures(sliding, slipping, separated, stored, np.max(y, axis=0))
