"""Loads that a stress in the ground puts on the edges of blocks: exact integrals along them."""

import numpy as np

from ..contact import Outlines, Tracker
from ..scene import Scene, Stress
from .blocks import Blocks


def press(scene: Scene, blocks: Blocks, tracker: Tracker) -> None:
    """Bring the loads of the blocks to what they are with their edges where these are now.

    The in-situ stress acts on the sides of the scene that it loads, water on all other edges, so
    the joints carry what is left, the effective stress. The pressure that is given for a law
    presses on both faces where edges with a joint of it lie on each other: uniform, it is the same
    as half of it at either end.
    """
    water, in_situ = scene.water, scene.in_situ
    if water is None and in_situ is None and not scene.stages:
        return
    contacts, loads, wet = tracker.contacts, blocks.steady + blocks.share * blocks.support, np.True_
    if in_situ:
        wet = ~in_situ.loaded
        loads += scene.thickness * _on_edges(in_situ.stress, contacts.outlines, blocks.motion, ~wet)
    if water and water.table:
        loads += scene.thickness * _on_edges(water.table, contacts.outlines, blocks.motion, wet)
    if water and water.pressure:
        by_law = np.array([water.pressure.get(name, 0.0) for name in scene.laws])
        push = by_law[tracker.law] * contacts.carried.sum(axis=0) * scene.thickness
        loads += contacts.assemble(blocks.motion, push, 0.0 * push)
    blocks.loads[:] = loads * blocks.mobile


def _on_edges(stress: Stress, outlines: Outlines, motion: np.ndarray, which) -> np.ndarray:
    """Forces and torques (n, 3) per m of thickness of a stress on the edges of blocks where they
    are now; which: edges (c,) that it acts on."""
    p, block = outlines.placed, outlines.block
    force, couple = _integral(stress, p, p[outlines.after], (motion[0] + 1j * motion[1])[block])
    parts = np.stack([force.real, force.imag, couple]) * which
    return np.stack([np.bincount(block, part, motion.shape[1]) for part in parts], axis=1)


def _integral(stress: Stress, p: np.ndarray, q: np.ndarray, centre: np.ndarray):
    """Force x + iy (N/m) on edges p to q (c,), their blocks on the left, and its moment (N) about
    a centre.

    An edge is split where the line bends and where it crosses the line. Along each part a to b of
    length L the stress goes straight from u_a to u_b: the force is -S.n L (u_a + u_b)/2, at
    a + (b - a)(u_a + 2 u_b)/(3 (u_a + u_b)).
    """
    wide = (q - p).real[:, None]
    bends = (stress.line[:, 0] - p.real[:, None]) / np.where(wide, wide, np.inf)
    share = np.concatenate([0 * wide, np.sort(np.clip(bends, 0.0, 1.0)), 0 * wide + 1], axis=1)
    at = p[:, None] + share * (q - p)[:, None]
    a, b = at[:, :-1], at[:, 1:]
    da, db = stress.signed(a), stress.signed(b)
    crossing = a + (b - a) * da / np.where(da == db, 1.0, da - db)
    crosses = (da > 0) != (db > 0)
    a, b = np.where(crosses & (da <= 0), crossing, a), np.where(crosses & (db <= 0), crossing, b)
    ua, ub = np.maximum(da, 0.0), np.maximum(db, 0.0)
    push = stress.on(1j * (b - a))  # minus the outward normal, times the length
    a, b = a - centre[:, None], b - centre[:, None]
    arms = (a * (2 * ua + ub) + b * (ua + 2 * ub)) / 6
    return (push * (ua + ub) / 2).sum(axis=1), (arms.conj() * push).imag.sum(axis=1)
