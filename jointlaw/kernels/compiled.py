"""The fast kernel: the numbers of `reference`, compiled, with the inner loops over joints.

States live in blocks of LANES joints, (blocks, rows, lanes), so that within a block every quantity
is one contiguous row. All that a block needs while it is advanced lies on one scratch pad: rows
of LANES numbers at constant offsets. Only so does the compiler see that no two rows overlap, and
turns each loop over l, the joint, into vector instructions. Branches in such loops are selections.

Symbols are those of docs/theory-incremental.md and of the reference kernel.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from ..discretisation.nodes import UNUSED
from ..discretisation.tables import UNDERFLOW, Tables
from ..support.checks import Array
from .cells import TINY, compliance
from .reference import GRAZING, LIMIT, NEAR, ROUNDED

# Strict arithmetic: no fused or reordered operations, so results are the same on every machine
_jit = numba.njit(error_model="numpy", nogil=True, cache=True)

LANES = 128  # joints per block, as in blocks.py


def _rows(first: int, count: int) -> tuple[int, ...]:
    return tuple(LANES * row for row in range(first, first + count))


# Rows of the scratch pad. Pairs "0, 1" are before and after the step.
_Y0, _Y1, _F0, _F1, _S0, _S1, _X = _rows(0, 7)  # a facet: y, Phi, Phi', place in the curve
_DES, _DET, _SUMS, _SUMT = _rows(7, 4)  # its sliders
_CURVING, _BSS, _BST, _BTT, _VS, _VT, _G0, _G1, _G2 = _rows(11, 9)  # its tangent
_P, _P1, _P2, _OLD, _OLD1, _OLD2, _NEW, _NEW1, _NEW2 = _rows(20, 9)  # a joint: step, y's origin
_J00, _J01, _J10, _J11, _SLIP, _PULL1, _PULL2, _LOST, _F, _FS, _FT = _rows(29, 11)
_NORMAL, _PLASTIC = _rows(40, 2)  # a joint whose asperities wear or yield
_C00, _C01, _C02, _C10, _C11, _C12, _C20, _C21, _C22, _MU = _rows(42, 10)
_Z0, _Z1, _FZ0, _FZ1, _SZ1, _AT0, _FAT0, _WS, _WT = _rows(52, 9)  # its flattened facets
(_SINCE,) = _rows(61, 1)  # friction over that of the last step
_PAD = 62 * LANES

# The same rows while joints are measured
_ALL_SLIP, _LIMIT, _SLIDING, _SLIPPING, _APART, _STORED, _REACH = _rows(20, 7)

_M, _S, _T, _N, _REST = 0, 3, 6, 9, 12  # columns of the facet table; then A, a, compliance,
_POTENTIAL, _SHARE = 15, 16  # A c1 and the share of the facet orientation
_YIELD, _OPPOSITE = 17, 18


class Packed(NamedTuple):
    """The tables of a law as few plain arrays: fewer arguments make a cheaper call."""

    facet: Array  # (M, 19): m, s, t, n (3 each, 0 where the plane drops one), then the above
    depth: Array  # (M, D + 1, 3): zeta, force and slope there, infinity as the largest float
    curve: Array  # (4 cells,): coefficients of S
    scalars: Array  # lam, mu, critical slip, eta, scale and rise of the curve, mu residual, slip
    dim: int


def pack(k: Tables) -> Packed:
    """Arrange the tables of a law for the compiled kernel."""
    facet = np.zeros((len(k.c1), 19))
    for first, rows in ((_M, k.m), (_S, k.s), (_T, k.t), (_N, k.n)):
        facet[:, first : first + k.dim] = rows.T
    share = k.weight / k.weight.sum()
    rest = (k.area, k.area / k.c1, compliance(k).ravel(), k.area * k.c1, share)
    facet[:, _REST:_YIELD] = np.stack(rest, axis=-1)
    facet[:, _YIELD] = np.inf if k.yield_depth is None else k.yield_depth
    facet[:, _OPPOSITE] = k.opposite
    largest = np.finfo(float).max
    depth = np.minimum(np.stack([k.depth, k.depth_force, k.depth_slope], axis=-1), largest)
    virgin = (k.curve.eta, k.curve.scale, k.curve.rise)
    residual = k.mu if k.mu_residual is None else k.mu_residual
    scalars = np.array([k.lam, k.mu, k.critical_slip, *virgin, residual, k.wear_slip])
    curve = k.curve.S.ravel().copy()
    return Packed(facet, depth, curve, scalars, k.dim)


def block_rows(k: Tables) -> int:
    """Rows of a block: the state, then Phi and Phi' of all facets, which save half the look-ups.

    With flattened facets, Phi there too.
    """
    return k.rows + (2 + k.yields) * len(k.c1)


class Work(NamedTuple):
    """Working space of one thread, so that no step allocates any."""

    block: Array  # (rows, LANES): copy of a block of states
    pad: Array
    place: NDArray[np.int32]  # cell of the curve, per lane; then lanes whose flattened depth moves
    piece: Array  # its four coefficients, per lane


def new_work(rows: int) -> Work:
    """Working space for blocks of this many rows."""
    place, piece = np.zeros(2 * LANES, np.int32), np.zeros(4 * LANES)
    return Work(np.zeros((rows, LANES)), np.zeros(_PAD), place, piece)


@_jit
def _fetch(place, piece, L, table):
    """The four coefficients of each lane's cell, moved as a whole: one wide load and store."""
    four, one, two, three = np.uint64(4), np.uint64(1), np.uint64(2), np.uint64(3)
    for l in range(L):
        i, o = four * np.uint64(place[l]), four * np.uint64(l)
        c0, c1, c2, c3 = table[i], table[i + one], table[i + two], table[i + three]
        piece[o], piece[o + one], piece[o + two], piece[o + three] = c0, c1, c2, c3


@_jit
def _virgin(work, law, after, L):
    """Phi and Phi' of the row of y: three loops, so that only the look-up itself is not vector."""
    pad, place, piece, curve = work.pad, work.place, work.piece, law.curve
    eta, scale, rise = law.scalars[3], law.scalars[4], law.scalars[5]
    if after is None:  # a constant for the compiler
        y, force, slope = _Y0, _F0, _S0
    else:
        y, force, slope = _Y1, _F1, _S1
    cells = curve.size // 4
    top = np.float64(cells - 1)
    looked = 0 if cells == 1 else L  # without heights S is 1, and there is nothing to look up
    for l in range(L - looked):
        here = pad[y + l] if abs(pad[y + l]) >= UNDERFLOW else 0.0
        v = np.sqrt(here if here > 0.0 else 0.0)
        one = 1.0 if v > 0.0 else 0.0
        power = v if eta == 0.5 else one
        place[l] = 0
        pad[y + l] = here
        pad[_X + l] = 0.0
        pad[force + l] = power * v * v
        pad[slope + l] = power * (1.0 + eta)
    for l in range(looked):
        here = pad[y + l] if abs(pad[y + l]) >= UNDERFLOW else 0.0
        v = np.sqrt(here if here > 0.0 else 0.0)
        r = 1.0 / (v + scale)
        at = v * r * cells
        i = np.int32(at if at < top else top)
        place[l] = i
        pad[y + l] = here
        pad[_X + l] = at - np.float64(i)
        pad[force + l] = v
        pad[slope + l] = v * r * r
    _fetch(place, piece, looked, curve)
    weight = 0.5 * cells * scale
    for l in range(looked):
        x, o = pad[_X + l], 4 * l
        c0, c1, c2, c3 = piece[o], piece[o + 1], piece[o + 2], piece[o + 3]
        S = c0 + x * (c1 + x * (c2 + x * c3))
        D = weight * pad[slope + l] * (c1 + x * (2.0 * c2 + x * (3.0 * c3)))
        v = pad[force + l]
        one = 1.0 if v > 0.0 else 0.0
        power = v if eta == 0.5 else one  # y^eta where it is at hand
        pad[force + l] = power * v * v * S
        pad[slope + l] = power * ((1.0 + eta) * S + D)
    if rise > 0.0:  # S over w^rise: D S gains rise (1 - w) S
        W = scale * scale
        for l in range(L):
            here = pad[y + l] if pad[y + l] > 0.0 else 0.0
            w, rest = here / (here + W), W / (here + W)
            lift = w**rise
            by_y = pad[force + l] / (here if here > 0.0 else 1.0)
            pad[slope + l] = lift * (pad[slope + l] + rise * rest * by_y)
            pad[force + l] *= lift
    if (eta != 0.5) & (eta != 0.0):
        for l in range(L):
            power = pad[y + l] ** eta if pad[y + l] > 0.0 else 0.0
            pad[force + l] *= power
            pad[slope + l] *= power


@_jit
def _bend(piece, o, x, v, cells, scale):
    """S, D S and D D S of one lane, v its sqrt(y)."""
    c0, c1, c2, c3 = piece[o], piece[o + 1], piece[o + 2], piece[o + 3]
    r = 1.0 / (v + scale)
    t, s = v * r, scale * r
    S = c0 + x * (c1 + x * (c2 + x * c3))
    S1 = cells * (c1 + x * (2.0 * c2 + x * (3.0 * c3)))
    S2 = cells * cells * (2.0 * c2 + x * (6.0 * c3))
    ts = t * s
    return S, 0.5 * ts * S1, 0.25 * (ts * ts) * S2 + 0.25 * ts * (s - t) * S1


@_jit
def _curvature(work, law, L):
    """Phi'' of the row of y after the step, from the pieces that `_virgin` just fetched for it."""
    pad, piece, cells = work.pad, work.piece, np.float64(law.curve.size // 4)
    eta, scale, rise = law.scalars[3], law.scalars[4], law.scalars[5]
    for l in range(L):
        y = pad[_Y1 + l]
        v = np.sqrt(y if y > 0.0 else 1.0)
        S, D, DD = _bend(piece, 4 * l, pad[_X + l], v, cells, scale)
        value = eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * D + DD
        value = value / (v if eta == 0.5 else v * v)
        pad[_CURVING + l] = value if y > 0.0 else 0.0
    if rise > 0.0:
        W = scale * scale
        for l in range(L):
            y = pad[_Y1 + l]
            v = np.sqrt(y if y > 0.0 else 1.0)
            S, D, DD = _bend(piece, 4 * l, pad[_X + l], v, cells, scale)
            w, more = v * v / (v * v + W), rise * W / (v * v + W)
            DD = DD + 2.0 * more * D + (more * more - more * w) * S
            value = eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * (D + more * S) + DD
            value = w**rise * value / (v if eta == 0.5 else v * v)
            pad[_CURVING + l] = value if y > 0.0 else 0.0
    if (eta != 0.5) & (eta != 0.0):
        for l in range(L):
            pad[_CURVING + l] *= pad[_Y1 + l] ** eta if pad[_Y1 + l] > 0.0 else 0.0


@_jit
def _limit_offset(pad, L, limit, dim):
    """New offsets, their derivative and the slip; see `reference.limited_offset`."""
    for l in range(L):
        a0, a1 = pad[_OLD1 + l], pad[_OLD2 + l]
        p0, p1 = pad[_P1 + l], pad[_P2 + l]
        f0, f1 = a0 + p0, a1 + p1
        pad[_NEW1 + l], pad[_NEW2 + l] = f0, f1
        pad[_SLIP + l] = 0.0
        pad[_J00 + l] = pad[_J11 + l] = 1.0
        pad[_J01 + l] = pad[_J10 + l] = 0.0
        length = np.hypot(p0, p1)
        if f0 * f0 + f1 * f1 <= limit * limit or f0 * p0 + f1 * p1 <= 0.0:
            continue
        e0, e1 = p0 / length, p1 / length
        along = a0 * e0 + a1 * e1
        inside = -along + np.sqrt(max(limit * limit - (a0 * a0 + a1 * a1) + along * along, 0.0))
        inside = min(max(inside, 0.0), length)
        a0 += inside * e0
        a1 += inside * e1
        x = (length - inside) / limit
        cos = min(max((a0 * e0 + a1 * e1) / limit, 0.0), 1.0)
        sin = (a1 * e0 - a0 * e1) / limit
        decay, rest = np.exp(-x), -np.expm1(-x)
        bottom = (1.0 + cos) + (1.0 - cos) * decay * decay
        cos1 = ((1.0 + cos) - (1.0 - cos) * decay * decay) / bottom
        sin1 = 2.0 * sin * decay / bottom
        b0, b1 = limit * (cos1 * e0 - sin1 * e1), limit * (cos1 * e1 + sin1 * e0)
        pad[_NEW1 + l], pad[_NEW2 + l] = b0, b1
        pad[_SLIP + l] = limit * (x + np.log(bottom / 2.0))
        turn = (rest * rest + cos * rest * (1.0 + decay)) / bottom
        turn += inside / (limit * max(cos, GRAZING)) * (2.0 * decay / bottom - sin1 * sin)
        turn /= length
        row0, row1 = -turn * e1 - sin1 / limit * e0, turn * e0 - sin1 / limit * e1
        if dim == 2:
            row0 = row1 = 0.0  # along one line the offset does not turn
        pad[_J00 + l], pad[_J01 + l] = -b1 * row0, -b1 * row1
        pad[_J10 + l], pad[_J11 + l] = b0 * row0, b0 * row1


@_jit
def _places(law, yields, wears):
    """First rows of flattened depths, of the slip, and of Phi beside the state."""
    M = law.depth.shape[0]
    first = 2 * law.dim + 2 * M * (law.depth.shape[1] - 1)
    slip = beside = first
    if yields is not None:
        slip = beside = first + M + 1
    if wears is not None:
        beside = slip + 2
    return first, slip, beside


@_jit
def _worn_friction(pad, s, L, law, yields, wears):
    """Friction of the asperities of each joint after their slip, and over that of the last step."""
    slip, first, last = _places(law, yields, wears)[1], law.scalars[1], law.scalars[6]
    for l in range(L):
        pad[_MU + l] = last + (first - last) * np.exp(-s[slip, l] / law.scalars[7])
    for l in range(L):
        before = first - s[slip + 1, l]
        since = pad[_MU + l] / (before if before > 0.0 else 1.0)
        pad[_SINCE + l] = since if (since < 1.0) & (before > 0.0) else 1.0


@_jit
def _flatten(work, s, L, law, f, yields, wears):
    """Flattened depths of a facet before and after the step, and Phi there; see `yielding`."""
    pad, facet = work.pad, law.facet
    first, _, beside = _places(law, yields, wears)
    at, kept = first + f, beside + 2 * law.depth.shape[0] + f
    deep, o = facet[f, _YIELD], np.int64(facet[f, _OPPOSITE])
    m0, m1, m2 = facet[f, _M], facet[f, _M + 1], facet[f, _M + 2]
    for l in range(L):
        pad[_Z1 + l] = m0 * pad[_NEW + l] + m1 * pad[_NEW1 + l]
    if law.dim == 3:
        for l in range(L):
            pad[_Z1 + l] += m2 * pad[_NEW2 + l]
    if o != f:
        m0, m1, m2 = facet[o, _M], facet[o, _M + 1], facet[o, _M + 2]
        for l in range(L):
            other = m0 * pad[_NEW + l] + m1 * pad[_NEW1 + l] + m2 * pad[_NEW2 + l]
            pad[_Z1 + l] = other if other > pad[_Z1 + l] else pad[_Z1 + l]
    for l in range(L):
        z0, fz0, z1 = s[at, l], s[kept, l], pad[_Z1 + l] - deep
        pad[_Z0 + l], pad[_FZ0 + l], pad[_FZ1 + l] = z0, fz0, fz0
        pad[_Z1 + l] = z1 if z1 > z0 else z0
    count = (
        0  # Phi is looked up only in lanes where it moves, packed into the rows of before the step
    )
    for l in range(L):
        work.place[LANES + count] = l
        pad[_Y0 + count] = pad[_Z1 + l]
        count += 1 if pad[_Z1 + l] > pad[_Z0 + l] else 0
    if count > 0:
        _virgin(work, law, None, count)
    for i in range(count):
        l = work.place[LANES + i]
        pad[_FZ1 + l], pad[_SZ1 + l] = pad[_F0 + i], pad[_S0 + i]
        s[at, l], s[kept, l] = pad[_Z1 + l], pad[_F0 + i]


@_jit
def _subtract_flattened(pad, L, law, f, ledger):
    """Phi and Phi' less their values at the flattened depth, and what flattened springs lost."""
    deep, potential = law.facet[f, _YIELD], law.facet[f, _POTENTIAL]
    for l in range(L):
        y1, z1, f1 = pad[_Y1 + l], pad[_Z1 + l], pad[_F1 + l] - pad[_FZ1 + l]
        pad[_F1 + l] = f1 if (y1 > z1) & (f1 > 0.0) else 0.0
        pad[_S1 + l] = pad[_S1 + l] if y1 > z1 else 0.0
    if ledger is not None:
        for l in range(L):
            c0, c1 = pad[_Y0 + l] - pad[_Z0 + l], pad[_Y1 + l] - pad[_Z1 + l]
            own = pad[_Y1 + l] - deep >= pad[_Z1 + l]
            c0, c1 = c0 if c0 > 0.0 else 0.0, c1 if c1 > 0.0 else 0.0
            mean = 0.5 * ((c0 if c0 < deep else deep) + (c1 if c1 < deep else deep))
            lost = pad[_FZ1 + l] - pad[_FZ0 + l]
            pad[_PLASTIC + l] += potential * (deep if own else mean) * lost


@_jit
def _gain(z, fz, y, fy, zl, fl, sl, zh, fh, sh, ended):
    """What a cell gains from z to y, where the virgin force is known; right for y >= z, zl."""
    gain = fy - (fz if z > zl else fl) - sl * (y - (z if z > zl else zl))
    if ended:
        beyond = fy - (fz if z > zh else fh) - sh * (y - (z if z > zh else zh))
        gain -= beyond if y > zh else 0.0
    return gain


@_jit
def _slide(pad, qs, qt, L, law, f, i, ledger, tangent, yields, wears):
    """One depth cell of one facet: steps 3 and 4 of `reference.step`."""
    facet, depth = law.facet, law.depth
    A, a, compliance = facet[f, _REST], facet[f, _REST + 1], facet[f, _REST + 2]
    strength = law.scalars[0] * law.scalars[1] * A
    by_mu = law.scalars[0] * A
    zl, fl, sl = depth[f, i, 0], depth[f, i, 1], depth[f, i, 2]
    zh, fh, sh = depth[f, i + 1, 0], depth[f, i + 1, 1], depth[f, i + 1, 2]
    ended = i + 2 < depth.shape[1]
    for l in range(L):
        y0, y1, f0, f1 = pad[_Y0 + l], pad[_Y1 + l], pad[_F0 + l], pad[_F1 + l]
        from0, from1 = y0 - zl, y1 - zl
        k0, k1 = pad[_S0 + l] - sl, pad[_S1 + l] - sl
        if ended:
            k0 = sh - sl if y0 > zh else k0
            k1 = sh - sl if y1 > zh else k1
        k0 = k0 if (from0 > 0.0) & (k0 > 0.0) else 0.0
        k1 = k1 if (from1 > 0.0) & (k1 > 0.0) else 0.0
        if yields is None:
            # the bed beyond the lower limit of the cell less that beyond the upper
            G0, G1 = f0 - fl - sl * from0, f1 - fl - sl * from1
            if ended:
                G0 -= f0 - fh - sh * (y0 - zh) if y0 > zh else 0.0
                G1 -= f1 - fh - sh * (y1 - zh) if y1 > zh else 0.0
            h0, h1 = k0 * from0, k1 * from1
            G0, G1 = G0 if h0 > G0 else h0, G1 if h1 > G1 else h1
            G0, G1 = G0 if G0 > 0.0 else 0.0, G1 if G1 > 0.0 else 0.0
            gained = G1 - G0
        else:  # the bed less what it holds at the flattened depth
            z0, z1, at0, fat0 = pad[_Z0 + l], pad[_Z1 + l], pad[_AT0 + l], pad[_FAT0 + l]
            k0, k1 = k0 if y0 > z0 else 0.0, k1 if y1 > z1 else 0.0
            gained = _gain(at0, fat0, y1, f1, zl, fl, sl, zh, fh, sh, ended)
            G1 = _gain(z1, pad[_FZ1 + l], y1, f1, zl, fl, sl, zh, fh, sh, ended)
            h1 = k1 * (y1 - (z1 if z1 > zl else zl))
            G1 = G1 if h1 > G1 else h1
            G1 = G1 if G1 > 0.0 else 0.0
        # trial force: by the chord where stiffness grows, scaled down where it falls
        grows = k1 > k0
        dy = y1 - y0
        near = abs(dy) <= NEAR * abs(y1)
        if yields is not None:  # as in `reference.load`
            near = near & ((k0 > 0.0) | (k1 == 0.0))
        top = gained if grows else k1
        bottom = dy if grows else k0
        ratio = top / (bottom if bottom != 0.0 else 1.0)
        chord = 0.5 * (k0 + k1) if near else ratio
        chord = chord if chord > k0 else k0
        chord = chord if chord < k1 else k1
        kept = 1.0 if grows else ratio
        add = a * (chord if grows else k1)
        olds, oldt, des, det = qs[l], qt[l], pad[_DES + l], pad[_DET + l]
        if wears is not None:  # reduced to the new limit, as in `wear.within_limit`
            strength = by_mu * pad[_MU + l]
            if yields is not None:
                G0 = _gain(z0, pad[_FZ0 + l], y0, f0, zl, fl, sl, zh, fh, sh, ended)
                h0 = k0 * (y0 - (z0 if z0 > zl else zl))
                G0 = G0 if h0 > G0 else h0
                G0 = G0 if G0 > 0.0 else 0.0
            cap0, before2 = strength * G0, olds * olds + oldt * oldt
            back = pad[_SINCE + l] if before2 > cap0 * cap0 else 1.0
            soft0 = 1.0 / (k0 if k0 > TINY else 1.0)
            worn = (1.0 - back) * (1.0 + back) * before2 * soft0
            pad[_LOST + l] += compliance * (worn if k0 > TINY else 0.0)
            olds, oldt = back * olds, back * oldt
        ts, tt = olds * kept + add * des, oldt * kept + add * det
        new2 = ts * ts + tt * tt
        size = np.sqrt(new2)
        cap = strength * G1
        slips = size > cap
        share = cap / (size if slips else 1.0)
        share = share if slips else 1.0
        part = share if new2 > TINY else 0.0  # squares of smaller forces underflow
        qs[l], qt[l] = part * ts, part * tt
        pad[_SUMS + l] += part * ts
        pad[_SUMT + l] += part * tt
        if ledger is not None:  # each term is >= 0 as written
            r0 = 1.0 / (k0 if k0 > TINY else 1.0)
            r1 = 1.0 / (k1 if k1 > TINY else 1.0)
            rc = 1.0 / (chord if chord > TINY else 1.0)
            old2 = olds * olds + oldt * oldt
            hard = new2 * (rc - r1) + (old2 * (r0 - rc) if k0 > TINY else 0.0)
            hard = hard if chord > TINY else 0.0
            soft = (k0 - k1) * r0 * (old2 * r0)
            soft = soft if k0 > TINY else 0.0
            rub = 2.0 * share * (1.0 - share) * (new2 * r1)
            rub = rub if k1 > TINY else 0.0
            pad[_LOST + l] += compliance * ((hard if grows else soft) + rub)
        if tangent is not None:  # J_q = beta (I - s s^T) E + v g^T, "The tangent"
            curves = (from1 > 0.0) & ((y1 < zh) | (not ended))
            c = pad[_CURVING + l] if curves else 0.0
            bend = (k1 - chord) / (1.0 if near else dy)
            bend = a * (0.5 * c if near else bend)
            fade = c / (k1 if k1 > TINY else 1.0)
            fade = fade if k1 > TINY else 0.0
            # exactly as in the reference where rounding would decide
            stiffer = grows & (dy > ROUNDED * abs(y1))
            limited = size >= strength * (G1 * (1.0 - LIMIT) - ROUNDED * f1)
            ws = bend * des if stiffer else fade * ts
            wt = bend * det if stiffer else fade * tt
            unit = 1.0 / (size if size > 0.0 else 1.0)
            us, ut = ts * unit, tt * unit
            dot = us * ws + ut * wt
            push = strength * k1
            pad[_VS + l] += share * (ws - us * dot) + push * us if limited else ws
            pad[_VT + l] += share * (wt - ut * dot) + push * ut if limited else wt
            if yields is not None:
                kz = pad[_SZ1 + l] - sl
                kz = sh - sl if ended & (z1 > zh) else kz
                kz = kz if (z1 > zl) & (kz > 0.0) & (k1 > 0.0) & limited else 0.0
                pad[_WS + l] += strength * kz * us
                pad[_WT + l] += strength * kz * ut
            beta = share * add if cap > 0.0 else 0.0
            sliding = beta if limited else 0.0
            pad[_BSS + l] += beta - sliding * us * us
            pad[_BST + l] -= sliding * us * ut
            pad[_BTT + l] += beta - sliding * ut * ut


@_jit
def _gradient(pad, L, m0, m1, m2, limited):
    """g = dy/dd of one facet, a row per component; an offset at its limit turns with the step."""
    if limited:
        for l in range(L):
            pad[_G0 + l] = m0
            pad[_G1 + l] = m1 * pad[_J00 + l] + m2 * pad[_J10 + l]
            pad[_G2 + l] = m1 * pad[_J01 + l] + m2 * pad[_J11 + l]
    else:
        for l in range(L):
            pad[_G0 + l], pad[_G1 + l], pad[_G2 + l] = m0, m1, m2


@_jit
def _add_tangent(pad, L, law, f):
    """C += along g^T + E^T B E of one facet, "The tangent"; B and v count in units of lam."""
    facet, dim = law.facet, law.dim
    s0, s1, s2 = facet[f, _S], facet[f, _S + 1], facet[f, _S + 2]
    t1, t2, A, soft = facet[f, _T + 1], facet[f, _T + 2], facet[f, _REST], 1.0 / law.scalars[0]
    n0, n1, n2 = A * facet[f, _N], A * facet[f, _N + 1], A * facet[f, _N + 2]
    for l in range(L):
        slope, vs, vt = pad[_S1 + l], soft * pad[_VS + l], soft * pad[_VT + l]
        bss, bst, btt = soft * pad[_BSS + l], soft * pad[_BST + l], soft * pad[_BTT + l]
        g0, g1 = pad[_G0 + l], pad[_G1 + l]
        along = n0 * slope + s0 * vs
        left, right = s0 * bss, s0 * bst
        pad[_C00 + l] += along * g0 + left * s0
        pad[_C01 + l] += along * g1 + left * s1 + right * t1
        along = n1 * slope + s1 * vs + t1 * vt
        left, right = s1 * bss + t1 * bst, s1 * bst + t1 * btt
        pad[_C10 + l] += along * g0 + left * s0
        pad[_C11 + l] += along * g1 + left * s1 + right * t1
    if dim == 2:
        return
    for l in range(L):
        slope, vs, vt = pad[_S1 + l], soft * pad[_VS + l], soft * pad[_VT + l]
        bss, bst, btt = soft * pad[_BSS + l], soft * pad[_BST + l], soft * pad[_BTT + l]
        g0, g1, g2 = pad[_G0 + l], pad[_G1 + l], pad[_G2 + l]
        left, right = s2 * bss + t2 * bst, s2 * bst + t2 * btt
        pad[_C02 + l] += (n0 * slope + s0 * vs) * g2 + s0 * left
        pad[_C12 + l] += (n1 * slope + s1 * vs + t1 * vt) * g2 + s1 * left + t1 * right
        along = n2 * slope + s2 * vs + t2 * vt
        pad[_C20 + l] += along * g0 + left * s0
        pad[_C21 + l] += along * g1 + left * s1 + right * t1
        pad[_C22 + l] += along * g2 + left * s2 + right * t2


@_jit
def _yield_tangent(pad, L, law, f):
    """C -= along g^T of a facet whose flattened depth moves, with the y that presses it."""
    facet, dim, o = law.facet, law.dim, np.int64(law.facet[f, _OPPOSITE])
    A, soft, limited = facet[f, _REST], 1.0 / law.scalars[0], law.scalars[2] < np.inf
    m0, m1, m2, deep = facet[o, _M], facet[o, _M + 1], facet[o, _M + 2], facet[f, _YIELD]
    for l in range(L):
        y1, z1 = pad[_Y1 + l], pad[_Z1 + l]
        if z1 <= pad[_Z0 + l] or y1 <= z1:
            continue
        g0, g1, g2 = pad[_G0 + l], pad[_G1 + l], pad[_G2 + l]
        if z1 > y1 - deep and limited:
            g0 = m0
            g1 = m1 * pad[_J00 + l] + m2 * pad[_J10 + l]
            g2 = m1 * pad[_J01 + l] + m2 * pad[_J11 + l]
        slope, ws, wt = A * pad[_SZ1 + l], soft * pad[_WS + l], soft * pad[_WT + l]
        for i in range(dim):
            along = facet[f, _N + i] * slope + facet[f, _S + i] * ws + facet[f, _T + i] * wt
            row = _C00 + 3 * i * LANES + l
            pad[row] -= along * g0
            pad[row + LANES] -= along * g1
            pad[row + 2 * LANES] -= along * g2


@_jit
def _facet(work, s, L, law, f, ledger, tangent, yields, wears):
    """One facet of a block: closures, virgin curve, sliders, and its part of F and C."""
    pad, facet, dim = work.pad, law.facet, law.dim
    lam, limit = law.scalars[0], law.scalars[2]
    M, D = law.depth.shape[0], law.depth.shape[1] - 1
    m0, m1, m2 = facet[f, _M], facet[f, _M + 1], facet[f, _M + 2]
    s0, s1, s2 = facet[f, _S], facet[f, _S + 1], facet[f, _S + 2]
    t1, t2 = facet[f, _T + 1], facet[f, _T + 2]
    n0, n1, n2 = facet[f, _N], facet[f, _N + 1], facet[f, _N + 2]
    A = facet[f, _REST]
    if yields is not None:
        _flatten(work, s, L, law, f, yields, wears)
    for l in range(L):
        pad[_Y0 + l] = m0 * pad[_OLD + l] + m1 * pad[_OLD1 + l]
        pad[_Y1 + l] = m0 * pad[_NEW + l] + m1 * pad[_NEW1 + l]
        pad[_DES + l] = s0 * pad[_P + l] + s1 * pad[_P1 + l]
        pad[_DET + l] = t1 * pad[_P1 + l]
        pad[_SUMS + l] = pad[_SUMT + l] = 0.0
    if dim == 3:
        for l in range(L):
            pad[_Y0 + l] += m2 * pad[_OLD2 + l]
            pad[_Y1 + l] += m2 * pad[_NEW2 + l]
            pad[_DES + l] += s2 * pad[_P2 + l]
            pad[_DET + l] += t2 * pad[_P2 + l]
    beside = _places(law, yields, wears)[2]
    rf, rs = beside + f, beside + M + f
    for l in range(L):
        pad[_Y0 + l] = pad[_Y0 + l] if abs(pad[_Y0 + l]) >= UNDERFLOW else 0.0
        pad[_F0 + l], pad[_S0 + l] = s[rf, l], s[rs, l]
    if yields is not None:
        for l in range(L):
            touches = pad[_Y0 + l] > pad[_Z0 + l]
            pad[_AT0 + l] = pad[_Y0 + l] if touches else pad[_Z0 + l]
            pad[_FAT0 + l] = pad[_F0 + l] if touches else pad[_FZ0 + l]
    _virgin(work, law, True, L)
    for l in range(L):
        s[rf, l], s[rs, l] = pad[_F1 + l], pad[_S1 + l]
    if tangent is not None:
        if law.curve.size == 4:  # not fetched yet
            _fetch(work.place, work.piece, L, law.curve)
        _curvature(work, law, L)
        _gradient(pad, L, m0, m1, m2, limit < np.inf)
        for l in range(L):
            pad[_BSS + l] = pad[_BST + l] = pad[_BTT + l] = 0.0
            pad[_VS + l] = pad[_VT + l] = 0.0
        if yields is not None:
            for l in range(L):
                pad[_WS + l] = pad[_WT + l] = 0.0
    for i in range(D):
        if law.depth[f, i, 0] >= UNUSED:
            break
        rs, rt = 2 * dim + f * D + i, 2 * dim + (M + f) * D + i
        _slide(pad, s[rs], s[rt], L, law, f, i, ledger, tangent, yields, wears)
    if yields is not None:
        _subtract_flattened(pad, L, law, f, ledger)
    if wears is not None:
        for l in range(L):
            before = pad[_F0 + l] if yields is None else pad[_FAT0 + l] - pad[_FZ0 + l]
            pad[_NORMAL + l] += A * (before + pad[_F1 + l])
    soft = 1.0 / lam
    for l in range(L):
        normal, q0, q1 = A * pad[_F1 + l], soft * pad[_SUMS + l], soft * pad[_SUMT + l]
        pad[_F + l] += n0 * normal + s0 * q0
        pad[_FS + l] += n1 * normal + s1 * q0 + t1 * q1
    if dim == 3:
        for l in range(L):
            normal, q0, q1 = A * pad[_F1 + l], soft * pad[_SUMS + l], soft * pad[_SUMT + l]
            pad[_FT + l] += n2 * normal + s2 * q0 + t2 * q1
    if limit < np.inf and ledger is not None:
        for l in range(L):
            pad[_PULL1 + l] += n1 * A * pad[_F1 + l]
            pad[_PULL2 + l] += n2 * A * pad[_F1 + l]
    if tangent is not None:
        _add_tangent(pad, L, law, f)
        if yields is not None:
            _yield_tangent(pad, L, law, f)


@_jit
def _clear(pad, first, last):
    for l in range(first, last):
        pad[l] = 0.0


@_jit
def _begin(pad, s, d, start, L, law, yields, wears):
    """Lay out the old and new place of each joint of a block, and move it."""
    limit, dim = law.scalars[2], law.dim
    if limit < np.inf or dim == 1:
        _clear(pad, _P, _J00)  # the offset has one component in a plane, none on closure
    _clear(pad, _PULL1, _C00)
    if wears is not None:
        _worn_friction(pad, s, L, law, yields, wears)
    for i in range(dim):
        row, origin = i * LANES, 0 if i == 0 else dim + i - 1
        for l in range(L):
            pad[_P + row + l] = d[start + l, i]
        for l in range(L):
            pad[_OLD + row + l] = s[origin, l]
        for l in range(L):
            pad[_NEW + row + l] = pad[_OLD + row + l] + pad[_P + row + l]
    if limit < np.inf:
        _limit_offset(pad, L, limit, dim)
    for i in range(dim):
        row = i * LANES
        for l in range(L):
            s[i, l] += pad[_P + row + l]
        if i > 0:
            for l in range(L):
                s[dim + i - 1, l] = pad[_NEW + row + l]


@_jit
def _finish(pad, s, F, C, start, L, law, ledger, tangent, yields, wears):
    """Hand out F and C, and add up the ledger."""
    limit, dim = law.scalars[2], law.dim
    for i in range(dim):
        for l in range(L):
            F[start + l, i] = pad[_F + i * LANES + l]
    if tangent is not None:
        for i in range(dim):
            for j in range(dim):
                for l in range(L):
                    C[start + l, i, j] = pad[_C00 + (3 * i + j) * LANES + l]
    if ledger is not None:
        if limit < np.inf:
            for l in range(L):
                pull = pad[_PULL1 + l] * pad[_NEW1 + l] + pad[_PULL2 + l] * pad[_NEW2 + l]
                pad[_LOST + l] += pad[_SLIP + l] * (pull if pull > 0.0 else 0.0) / limit
        for l in range(L):
            s[2 * dim - 1, l] += pad[_LOST + l]
        slip = _places(law, yields, wears)[1]
        if yields is not None:
            for l in range(L):
                s[slip - 1, l] += pad[_PLASTIC + l]
                s[2 * dim - 1, l] += pad[_PLASTIC + l]
        if wears is not None:
            for l in range(L):
                capacity = 0.5 * pad[_MU + l] * pad[_NORMAL + l]
                rubbed = pad[_LOST + l] / (capacity if capacity > 0.0 else 1.0)
                s[slip, l] += rubbed if capacity > 0.0 else 0.0
                s[slip + 1, l] = law.scalars[1] - pad[_MU + l]


@_jit
def advance(
    state, d, F, C, index, keep, first, last, block, pad, place, piece, facet, depth, curve,
    scalars, dim, yields, wears, ledger, tangent,
):  # fmt: skip
    """Advance numbers first..last of the list `index` (of all joints if it is empty).

    The arguments are the fields of the engine's `Step`, of `Work` and of `Packed`, one by one:
    numba takes 5 us more to be called with a tuple of arrays than with the arrays themselves.

    d (m, dim) are the increments; F (m, dim) and C (m, dim, dim) are written. first is a multiple
    of the lanes in a block. Without `keep` the states stay as they were. `ledger` adds up the
    dissipated energy, `tangent` works out C; both are True or None, for which the compiler leaves
    the code out.
    """
    work = Work(block, pad, place, piece)
    law = Packed(facet, depth, curve, scalars, dim)
    rows, W = state.shape[1], state.shape[2]
    listed = index.size > 0
    for start in range(first, last, W):
        L = min(W, last - start)
        if listed:
            for l in range(L):
                home, at = index[start + l] // W, index[start + l] % W
                for r in range(rows):
                    block[r, l] = state[home, r, at]
            s = block
        elif keep:
            s = state[start // W]
        else:
            for r in range(rows):
                for l in range(L):
                    block[r, l] = state[start // W, r, l]
            s = block
        _begin(pad, s, d, start, L, law, yields, wears)
        if tangent is not None:
            _clear(pad, _C00, _MU)
        for f in range(facet.shape[0]):
            _facet(work, s, L, law, f, ledger, tangent, yields, wears)
        _finish(pad, s, F, C, start, L, law, ledger, tangent, yields, wears)
        if listed and keep:
            for l in range(L):
                home, at = index[start + l] // W, index[start + l] % W
                for r in range(rows):
                    state[home, r, at] = block[r, l]


@_jit
def _count(pad, qs, qt, L, law, f, i, yields, wears):
    """One depth cell of one facet: is it at its friction limit, and what does it store."""
    facet, depth = law.facet, law.depth
    strength = law.scalars[1] * law.scalars[0] * facet[f, _REST]
    compliance = facet[f, _REST + 2]
    zl, fl, sl = depth[f, i, 0], depth[f, i, 1], depth[f, i, 2]
    zh, fh, sh = depth[f, i + 1, 0], depth[f, i + 1, 1], depth[f, i + 1, 2]
    ended = i + 2 < depth.shape[1]
    for l in range(L):
        y, force, slope = pad[_Y0 + l], pad[_F0 + l], pad[_S0 + l]
        reach = min(max(y, zl), zh)
        k = min(max(slope, sl), sh) - sl
        G = k * (y - reach) + (min(max(force, fl), fh) - fl - sl * (reach - zl))
        z = zl
        if yields is not None:
            z = pad[_Z0 + l]
            k = k if y > z else 0.0
            G = _gain(z, pad[_FZ0 + l], y, force, zl, fl, sl, zh, fh, sh, ended)
            z = z if z > zl else zl
        most = k * (y - z if y > z else 0.0)
        G = min(max(G, 0.0), most)
        if wears is not None:
            strength = pad[_MU + l] * law.scalars[0] * facet[f, _REST]
        q2 = qs[l] * qs[l] + qt[l] * qt[l]
        limit = np.sqrt(q2) >= strength * (G * (1.0 - LIMIT) - ROUNDED * force)
        pad[_ALL_SLIP + l] = pad[_ALL_SLIP + l] if limit else 0.0
        pad[_LIMIT + l] += G if limit else 0.0
        soft = 1.0 / (k if k > TINY else 1.0)
        pad[_STORED + l] += compliance * q2 * (soft if k > TINY else 0.0)


@_jit
def _effective(pad, s, L, law, f):
    """Effective closure y of one facet in the states s."""
    facet, dim = law.facet, law.dim
    m0, m1, m2 = facet[f, _M], facet[f, _M + 1], facet[f, _M + 2]
    closure, offset, other = s[0], s[dim], s[2 * dim - 2]
    for l in range(L):
        pad[_Y0 + l] = m0 * closure[l] + m1 * offset[l]
    if dim == 3:
        for l in range(L):
            pad[_Y0 + l] += m2 * other[l]


@_jit
def _normal_energy(work, law, L, energy, potential):
    """Energy of the normal springs at the row of y, from the table of T; Phi and Phi' beside."""
    pad, piece = work.pad, work.piece
    eta, scale, rise = law.scalars[3], law.scalars[4], law.scalars[5]
    _virgin(work, law, None, L)
    _fetch(work.place, piece, L, energy)
    for l in range(L):
        y, x, o = pad[_Y0 + l], pad[_X + l], 4 * l
        T = piece[o] + x * (piece[o + 1] + x * (piece[o + 2] + x * piece[o + 3]))
        y = y if y > 0.0 else 0.0
        power = np.sqrt(y) if eta == 0.5 else 1.0
        pad[_CURVING + l] = potential * T * y * y * power
    if rise > 0.0:
        for l in range(L):
            y = pad[_Y0 + l] if pad[_Y0 + l] > 0.0 else 0.0
            pad[_CURVING + l] *= (y / (y + scale * scale)) ** rise
    if (eta != 0.5) & (eta != 0.0):
        for l in range(L):
            pad[_CURVING + l] *= pad[_Y0 + l] ** eta if pad[_Y0 + l] > 0.0 else 0.0


@_jit
def _measure_facet(work, s, L, law, f, energy, yields, wears):
    """What one facet of a block adds to the measures."""
    pad, dim = work.pad, law.dim
    M, D = law.depth.shape[0], law.depth.shape[1] - 1
    potential, share = law.facet[f, _POTENTIAL], law.facet[f, _SHARE]
    for l in range(L):
        pad[_ALL_SLIP + l], pad[_LIMIT + l], pad[_Z0 + l] = 1.0, 0.0, 0.0
    if yields is not None:
        at = _places(law, yields, wears)[0] + f
        for l in range(L):
            pad[_Z0 + l] = pad[_Y0 + l] = s[at, l]
        _normal_energy(work, law, L, energy, potential)
        for l in range(L):
            pad[_FZ0 + l], pad[_FZ1 + l] = pad[_F0 + l], pad[_CURVING + l]
    _effective(pad, s, L, law, f)
    _normal_energy(work, law, L, energy, potential)
    if yields is not None:
        for l in range(L):
            y, z = pad[_Y0 + l], pad[_Z0 + l]
            normal = pad[_CURVING + l] - pad[_FZ1 + l]
            normal -= potential * pad[_FZ0 + l] * (y - z)
            pad[_CURVING + l] = normal if (y > z) & (normal > 0.0) else 0.0
    for i in range(D):
        if law.depth[f, i, 0] >= UNUSED:
            break
        rs, rt = 2 * dim + f * D + i, 2 * dim + (M + f) * D + i
        _count(pad, s[rs], s[rt], L, law, f, i, yields, wears)
    for l in range(L):
        y, force, z = pad[_Y0 + l], pad[_F0 + l], pad[_Z0 + l]
        if yields is not None:
            force = force - pad[_FZ0 + l] if y > z else 0.0
        pad[_STORED + l] += pad[_CURVING + l]
        pad[_SLIDING + l] += share * pad[_ALL_SLIP + l] if y > z else 0.0
        pad[_SLIPPING + l] += share * pad[_LIMIT + l] / (force if force > 0.0 else 1.0)
        pad[_APART + l] += 0.0 if y > z else share
        pad[_REACH + l] = y if y > pad[_REACH + l] else pad[_REACH + l]


@_jit
def measures(
    state, out, first, last, block, pad, place, piece, facet, depth, curve, scalars, dim,
    yields, wears, energy,
):  # fmt: skip
    """Measures (5, n) of joints first..last, as `reference.measures`; arguments as above."""
    work = Work(block, pad, place, piece)
    law = Packed(facet, depth, curve, scalars, dim)
    W = state.shape[2]
    for start in range(first, last, W):
        L = min(W, last - start)
        s = state[start // W]
        _clear(pad, _SLIDING, _REACH)
        if wears is not None:
            _worn_friction(pad, s, L, law, yields, wears)
        pad[_REACH : _REACH + LANES] = -np.inf
        for f in range(facet.shape[0]):
            _measure_facet(work, s, L, law, f, energy, yields, wears)
        for i in range(5):
            for l in range(L):
                out[i, start + l] = pad[_SLIDING + i * LANES + l]


@_jit
def refresh(
    state, first, last, block, pad, place, piece, facet, depth, curve, scalars, dim, yields,
    wears,
):  # fmt: skip
    """Phi and Phi' in the blocks of joints first..last, after their states were written."""
    work = Work(block, pad, place, piece)
    law = Packed(facet, depth, curve, scalars, dim)
    M, W = depth.shape[0], state.shape[2]
    for start in range(first, last, W):
        L = min(W, last - start)
        s = state[start // W]
        for f in range(M):
            first_depth, _, beside = _places(law, yields, wears)
            _effective(pad, s, L, law, f)
            _virgin(work, law, None, L)
            for l in range(L):
                s[beside + f, l], s[beside + M + f, l] = pad[_F0 + l], pad[_S0 + l]
            if yields is not None:
                for l in range(L):
                    pad[_Y0 + l] = s[first_depth + f, l]
                _virgin(work, law, None, L)
                for l in range(L):
                    s[beside + 2 * M + f, l] = pad[_F0 + l]
