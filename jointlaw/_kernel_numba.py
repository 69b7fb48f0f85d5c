"""The fast kernel: the numbers of `_kernel_numpy`, compiled, with the inner loops over joints.

States live in blocks of LANES joints, (blocks, rows, lanes), so that within a block every quantity
is one contiguous row. All that a block needs while it is advanced lies on a desk: one array of rows
of LANES numbers at constant offsets. Only so does the compiler see that no two rows overlap, and
turns each loop over l, the joint, into vector instructions. Branches in such loops are selections.

Symbols are those of law.md sections 6 to 8 and of the numpy kernel.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from ._checks import Array
from ._kernel_numpy import GRAZING, NEAR, NOTHING, TINY
from .law import Tables

# Strict arithmetic: no fused or reordered operations, so results are the same on every machine
_jit = numba.njit(error_model="numpy", nogil=True, cache=True)

LANES = 64  # joints per block


def _rows(first: int, count: int) -> tuple[int, ...]:
    return tuple(LANES * row for row in range(first, first + count))


# The desk. Pairs "0, 1" are before and after the step.
_Y0, _Y1, _F0, _F1, _S0, _S1, _X, _C0, _C1, _C2, _C3 = _rows(0, 11)  # a facet: y, Phi, Phi', curve
_DES, _DET, _QS, _QT, _SUMS, _SUMT, _CURVING = _rows(11, 7)  # its sliders
_BSS, _BST, _BTT, _VS, _VT = _rows(18, 5)  # its tangent
_P, _OLD, _NEW, _J, _SLIP = 23 * LANES, 26 * LANES, 29 * LANES, 32 * LANES, 36 * LANES  # a joint
_F, _PULL, _C, _LOST = 37 * LANES, 40 * LANES, 42 * LANES, 51 * LANES
_DESK = 52 * LANES

_M, _S, _T, _N, _REST = 0, 3, 6, 9, 12  # rows of the facet table; then A, a, compliance


class Packed(NamedTuple):
    """The tables of a law as few plain arrays: fewer arguments make a cheaper call."""

    facet: Array  # (M, 15): m, s, t, n (3 each, 0 where the plane drops one), A, a, compliance
    depth: Array  # (M, D + 1, 3): zeta, force and slope there, infinity as the largest float
    curve: Array  # (4 cells,): coefficients of S
    scalars: Array  # lam, mu, critical slip, eta, scale of the curve


def pack(k: Tables, compliance: Array) -> Packed:
    """Arrange the tables of a law for the compiled kernel."""
    facet = np.zeros((len(k.c1), 15))
    for first, rows in ((_M, k.m), (_S, k.s), (_T, k.t), (_N, k.n)):
        facet[:, first : first + k.dim] = rows.T
    facet[:, _REST:] = np.stack([k.area, k.area / k.c1, compliance], axis=-1)
    largest = np.finfo(float).max
    depth = np.minimum(np.stack([k.depth, k.depth_force, k.depth_slope], axis=-1), largest)
    scalars = np.array([k.lam, k.mu, k.critical_slip, k.curve.eta, k.curve.scale])
    return Packed(facet, depth, k.curve.S.ravel().copy(), scalars)


class Work(NamedTuple):
    """Working space of one thread, so that no step allocates any."""

    block: Array  # (rows, LANES): copy of a block of states
    desk: Array
    place: NDArray[np.int32]


def work(rows: int) -> Work:
    """Working space for states of this many rows."""
    return Work(np.zeros((rows, LANES)), np.zeros(_DESK), np.zeros(LANES, np.int32))


@_jit
def _virgin(desk, place, which, L, curve, eta, scale):
    """Phi and Phi' of the row of y: three loops, so that only the look-up itself is not vector."""
    y, force, slope = _Y0 + which, _F0 + which, _S0 + which
    cells = curve.size // 4
    top = np.float64(cells - 1)
    for l in range(L):
        v = np.sqrt(desk[y + l] if desk[y + l] > 0.0 else 0.0)
        r = 1.0 / (v + scale)
        at = v * r * cells
        i = np.int32(at if at < top else top)
        place[l] = i
        desk[_X + l] = at - np.float64(i)
        desk[force + l] = v
        desk[slope + l] = v * r * r
    for l in range(L):
        i = np.uint64(place[l]) * np.uint64(4)
        desk[_C0 + l] = curve[i]
        desk[_C1 + l] = curve[i + np.uint64(1)]
        desk[_C2 + l] = curve[i + np.uint64(2)]
        desk[_C3 + l] = curve[i + np.uint64(3)]
    weight = 0.5 * cells * scale
    for l in range(L):
        x, c1, c2, c3 = desk[_X + l], desk[_C1 + l], desk[_C2 + l], desk[_C3 + l]
        S = desk[_C0 + l] + x * (c1 + x * (c2 + x * c3))
        D = weight * desk[slope + l] * (c1 + x * (2.0 * c2 + x * (3.0 * c3)))
        v = desk[force + l]
        power = v if eta == 0.5 else 1.0  # y^eta where it is at hand
        desk[force + l] = power * v * v * S
        desk[slope + l] = power * ((1.0 + eta) * S + D)
    if eta != 0.5:
        for l in range(L):
            power = desk[y + l] ** eta if desk[y + l] > 0.0 else 0.0
            desk[force + l] *= power
            desk[slope + l] *= power


@_jit
def _curvature(desk, L, curve, eta, scale):
    """Phi'' of the row of y after the step."""
    cells = curve.size // 4
    for l in range(L):
        y = desk[_Y1 + l]
        v = np.sqrt(y if y > 0.0 else 1.0)
        t, s = v / (v + scale), scale / (v + scale)
        i = min(np.int32(t * cells), np.int32(cells - 1))
        x, i4 = t * cells - np.float64(i), np.uint64(i) * np.uint64(4)
        c1, c2, c3 = curve[i4 + np.uint64(1)], curve[i4 + np.uint64(2)], curve[i4 + np.uint64(3)]
        S = curve[i4] + x * (c1 + x * (c2 + x * c3))
        S1 = cells * (c1 + x * (2.0 * c2 + x * (3.0 * c3)))
        S2 = cells * cells * (2.0 * c2 + x * (6.0 * c3))
        ts = t * s
        D = 0.5 * ts * S1
        DD = 0.25 * (ts * ts) * S2 + 0.25 * ts * (s - t) * S1
        value = eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * D + DD
        power = 1.0 / v if eta == 0.5 else (v * v) ** (eta - 1.0)
        desk[_CURVING + l] = power * value if y > 0.0 else 0.0


@_jit
def _drag(desk, L, limit, dim):
    """The leash: new offsets, their derivative and the slip; see `_kernel_numpy.drag`."""
    for l in range(L):
        a0, a1 = desk[_OLD + LANES + l], desk[_OLD + 2 * LANES + l]
        p0, p1 = desk[_P + LANES + l], desk[_P + 2 * LANES + l]
        f0, f1 = a0 + p0, a1 + p1
        desk[_NEW + LANES + l], desk[_NEW + 2 * LANES + l] = f0, f1
        desk[_SLIP + l] = 0.0
        desk[_J + l] = desk[_J + 3 * LANES + l] = 1.0
        desk[_J + LANES + l] = desk[_J + 2 * LANES + l] = 0.0
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
        desk[_NEW + LANES + l], desk[_NEW + 2 * LANES + l] = b0, b1
        desk[_SLIP + l] = limit * (x + np.log(bottom / 2.0))
        turn = (rest * rest + cos * rest * (1.0 + decay)) / bottom
        turn += inside / (limit * max(cos, GRAZING)) * (2.0 * decay / bottom - sin1 * sin)
        turn /= length
        row0, row1 = -turn * e1 - sin1 / limit * e0, turn * e0 - sin1 / limit * e1
        if dim == 2:
            row0 = row1 = 0.0  # along one line the end of the leash does not turn
        desk[_J + l], desk[_J + LANES + l] = -b1 * row0, -b1 * row1
        desk[_J + 2 * LANES + l], desk[_J + 3 * LANES + l] = b0 * row0, b0 * row1


@_jit
def _slide(desk, L, lower, upper, ended, A, a, compliance, lam_mu, ledger, tangent):
    """One depth cell of one facet: steps 2 and 3 of law.md section 6."""
    zl, fl, sl = lower[0], lower[1], lower[2]
    zh, fh, sh = upper[0], upper[1], upper[2]
    strength = lam_mu * A
    for l in range(L):
        # the bed beyond the lower limit of the cell less that beyond the upper
        y0, y1, f0, f1 = desk[_Y0 + l], desk[_Y1 + l], desk[_F0 + l], desk[_F1 + l]
        from0, from1 = y0 - zl, y1 - zl
        G0, G1 = f0 - fl - sl * from0, f1 - fl - sl * from1
        k0, k1 = desk[_S0 + l] - sl, desk[_S1 + l] - sl
        if ended:
            G0 -= f0 - fh - sh * (y0 - zh) if y0 > zh else 0.0
            G1 -= f1 - fh - sh * (y1 - zh) if y1 > zh else 0.0
            k0 = sh - sl if y0 > zh else k0
            k1 = sh - sl if y1 > zh else k1
        k0 = k0 if (from0 > 0.0) & (k0 > 0.0) else 0.0
        k1 = k1 if (from1 > 0.0) & (k1 > 0.0) else 0.0
        h0, h1 = k0 * from0, k1 * from1
        G0, G1 = G0 if h0 > G0 else h0, G1 if h1 > G1 else h1
        G0, G1 = G0 if G0 > 0.0 else 0.0, G1 if G1 > 0.0 else 0.0
        # trial force: by the chord where stiffness grows, scaled down where it falls
        grows = k1 > k0
        dy = y1 - y0
        near = abs(dy) <= NEAR * abs(y1)
        top = G1 - G0 if grows else k1
        bottom = dy if grows else k0
        ratio = top / (bottom if bottom != 0.0 else 1.0)
        chord = 0.5 * (k0 + k1) if near else ratio
        chord = chord if chord > k0 else k0
        chord = chord if chord < k1 else k1
        kept = 1.0 if grows else ratio
        add = a * (chord if grows else k1)
        olds, oldt, des, det = desk[_QS + l], desk[_QT + l], desk[_DES + l], desk[_DET + l]
        ts, tt = olds * kept + add * des, oldt * kept + add * det
        new2 = ts * ts + tt * tt
        size = np.sqrt(new2)
        cap = strength * G1
        slips = size > cap
        share = cap / (size if slips else 1.0)
        share = share if slips else 1.0
        qs, qt = share * ts, share * tt
        desk[_QS + l], desk[_QT + l] = qs, qt
        desk[_SUMS + l] += qs
        desk[_SUMT + l] += qt
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
            desk[_LOST + l] += compliance * ((hard if grows else soft) + rub)
        if tangent is not None:  # J_q = beta (I - s s^T) E + v g^T, law.md section 7
            curves = (from1 > 0.0) & ((y1 < zh) | (not ended))
            c = desk[_CURVING + l] if curves else 0.0
            bend = (k1 - chord) / (1.0 if near else dy)
            bend = a * (0.5 * c if near else bend)
            fade = c / (k1 if k1 > TINY else 1.0)
            fade = fade if k1 > TINY else 0.0
            ws = bend * des if grows else fade * ts
            wt = bend * det if grows else fade * tt
            unit = 1.0 / (size if size > 0.0 else 1.0)
            us, ut = ts * unit, tt * unit
            dot = us * ws + ut * wt
            push = strength * k1
            desk[_VS + l] += share * (ws - us * dot) + push * us if slips else ws
            desk[_VT + l] += share * (wt - ut * dot) + push * ut if slips else wt
            beta = share * add
            sliding = beta if slips else 0.0
            desk[_BSS + l] += beta - sliding * us * us
            desk[_BST + l] -= sliding * us * ut
            desk[_BTT + l] += beta - sliding * ut * ut


@_jit
def _add_tangent(desk, L, facet, lam, leash, dim):
    """C += along g^T + (1/lam) E^T B E of one facet, law.md section 7."""
    A = facet[_REST]
    for i in range(dim):
        ni, si, ti = facet[_N + i] * A, facet[_S + i], facet[_T + i]
        for j in range(dim):
            sj, tj, mj = facet[_S + j], facet[_T + j], facet[_M + j]
            ss, st, tt = si * sj / lam, (si * tj + ti * sj) / lam, ti * tj / lam
            here = _C + (dim * i + j) * LANES
            for l in range(L):
                along = ni * desk[_S1 + l] + (si * desk[_VS + l] + ti * desk[_VT + l]) / lam
                bed = ss * desk[_BSS + l] + st * desk[_BST + l] + tt * desk[_BTT + l]
                desk[here + l] += along * mj + bed
            if leash and j > 0:  # g follows the offset, not the joint
                m1, m2 = facet[_M + 1], facet[_M + 2]
                J1, J2 = _J + (j - 1) * LANES, _J + (j + 1) * LANES
                for l in range(L):
                    along = ni * desk[_S1 + l] + (si * desk[_VS + l] + ti * desk[_VT + l]) / lam
                    desk[here + l] += along * (m1 * desk[J1 + l] + m2 * desk[J2 + l] - mj)


@_jit
def _facet(desk, place, s, L, facet, depth, f, curve, scalars, dim, ledger, tangent):
    """One facet of a block: closures, virgin curve, sliders, and its part of F and C."""
    lam, mu, limit, eta, scale = scalars[0], scalars[1], scalars[2], scalars[3], scalars[4]
    M, D = depth.shape[0], depth.shape[1] - 1
    m0, m1, m2 = facet[f, _M], facet[f, _M + 1], facet[f, _M + 2]
    s0, s1, s2 = facet[f, _S], facet[f, _S + 1], facet[f, _S + 2]
    t1, t2 = facet[f, _T + 1], facet[f, _T + 2]
    n0, n1, n2 = facet[f, _N], facet[f, _N + 1], facet[f, _N + 2]
    A, a, compliance = facet[f, _REST], facet[f, _REST + 1], facet[f, _REST + 2]
    for l in range(L):
        desk[_Y0 + l] = m0 * desk[_OLD + l] + m1 * desk[_OLD + LANES + l]
        desk[_Y1 + l] = m0 * desk[_NEW + l] + m1 * desk[_NEW + LANES + l]
        desk[_DES + l] = s0 * desk[_P + l] + s1 * desk[_P + LANES + l]
        desk[_DET + l] = t1 * desk[_P + LANES + l]
        desk[_SUMS + l] = desk[_SUMT + l] = 0.0
    if dim == 3:
        for l in range(L):
            desk[_Y0 + l] += m2 * desk[_OLD + 2 * LANES + l]
            desk[_Y1 + l] += m2 * desk[_NEW + 2 * LANES + l]
            desk[_DES + l] += s2 * desk[_P + 2 * LANES + l]
            desk[_DET + l] += t2 * desk[_P + 2 * LANES + l]
    for l in range(L):
        desk[_Y0 + l] = desk[_Y0 + l] if abs(desk[_Y0 + l]) >= NOTHING else 0.0
        desk[_Y1 + l] = desk[_Y1 + l] if abs(desk[_Y1 + l]) >= NOTHING else 0.0
    _virgin(desk, place, 0, L, curve, eta, scale)
    _virgin(desk, place, LANES, L, curve, eta, scale)
    if tangent is not None:
        _curvature(desk, L, curve, eta, scale)
        for l in range(L):
            desk[_BSS + l] = desk[_BST + l] = desk[_BTT + l] = 0.0
            desk[_VS + l] = desk[_VT + l] = 0.0
    for i in range(D):
        rs, rt = 2 * dim + f * D + i, 2 * dim + (M + f) * D + i
        for l in range(L):
            desk[_QS + l] = s[rs, l]
        for l in range(L):
            desk[_QT + l] = s[rt, l]
        _slide(desk, L, depth[f, i], depth[f, i + 1], i < D - 1, A, a, compliance, lam * mu,
               ledger, tangent)  # fmt: skip
        for l in range(L):
            s[rs, l] = desk[_QS + l]
        for l in range(L):
            s[rt, l] = desk[_QT + l]
    for l in range(L):
        normal = A * desk[_F1 + l]
        q0, q1 = desk[_SUMS + l] / lam, desk[_SUMT + l] / lam
        desk[_F + l] += n0 * normal + s0 * q0
        desk[_F + LANES + l] += n1 * normal + s1 * q0 + t1 * q1
        desk[_F + 2 * LANES + l] += n2 * normal + s2 * q0 + t2 * q1
    if limit < np.inf and ledger is not None:
        for l in range(L):
            desk[_PULL + l] += n1 * A * desk[_F1 + l]
            desk[_PULL + LANES + l] += n2 * A * desk[_F1 + l]
    if tangent is not None:
        _add_tangent(desk, L, facet[f], lam, limit < np.inf, dim)


@_jit
def advance(
    state, d, F, C, index, keep, first, last, block, desk, place, facet, depth, curve, scalars,
    dim, ledger, tangent,
):  # fmt: skip
    """Advance numbers first..last of the list `index` (of all joints if it is empty).

    d (m, dim) are the increments; F (m, dim) and C (m, dim, dim) are written. first is a multiple
    of the lanes in a block. Without `keep` the states stay as they were. `ledger` adds up the
    dissipated energy, `tangent` works out C; both are True or None, for which the compiler leaves
    the code out.
    """
    rows, W, limit = state.shape[1], state.shape[2], scalars[2]
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
            block[:, :W] = state[start // W]
            s = block
        desk[_P:_J] = 0.0
        desk[_F:_DESK] = 0.0
        for i in range(dim):
            for l in range(L):
                desk[_P + i * LANES + l] = d[start + l, i]
        for l in range(L):
            desk[_OLD + l] = s[0, l]
            desk[_NEW + l] = s[0, l] + desk[_P + l]
        for i in range(1, dim):
            row = i * LANES
            for l in range(L):
                desk[_OLD + row + l] = s[dim + i - 1, l]
                desk[_NEW + row + l] = s[dim + i - 1, l] + desk[_P + row + l]
        if limit < np.inf:
            _drag(desk, L, limit, dim)
        for i in range(dim):
            for l in range(L):
                s[i, l] += desk[_P + i * LANES + l]
        for i in range(1, dim):
            for l in range(L):
                s[dim + i - 1, l] = desk[_NEW + i * LANES + l]
        for f in range(facet.shape[0]):
            _facet(desk, place, s, L, facet, depth, f, curve, scalars, dim, ledger, tangent)
        for i in range(dim):
            for l in range(L):
                F[start + l, i] = desk[_F + i * LANES + l]
        if tangent is not None:
            for i in range(dim):
                for j in range(dim):
                    for l in range(L):
                        C[start + l, i, j] = desk[_C + (dim * i + j) * LANES + l]
        if ledger is not None:
            if limit < np.inf:
                for l in range(L):
                    pull = desk[_PULL + l] * desk[_NEW + LANES + l]
                    pull += desk[_PULL + LANES + l] * desk[_NEW + 2 * LANES + l]
                    desk[_LOST + l] += desk[_SLIP + l] * pull / limit
            for l in range(L):
                s[2 * dim - 1, l] += desk[_LOST + l]
        if listed and keep:
            for l in range(L):
                home, at = index[start + l] // W, index[start + l] % W
                for r in range(rows):
                    state[home, r, at] = block[r, l]
