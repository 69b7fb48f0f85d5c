"""Loads on blocks but for their weight; of a stress in the ground exact integrals along edges."""

import numpy as np

from ..contact import Outlines, Tracker
from ..scene import Scene, Stress
from .blocks import Blocks


def press(scene: Scene, blocks: Blocks, tracker: Tracker) -> np.ndarray:
    """Bring the loads of the blocks to what they are with their edges where these are now; returns
    how much more they are (n, 3).

    Water presses on all edges, so the joints carry what is left, the effective stress. The pressure
    that is given for the joints of a law presses on both faces where edges lie on each other:
    uniform, it is the same as half of it at either end.
    """
    given = [stress for stress in (scene.water, scene.in_situ) if stress]
    if not (given or scene.wet or scene.stages):
        return 0.0 * blocks.loads
    contacts, loads, before = tracker.contacts, blocks.steady + blocks.support, blocks.loads.copy()
    for stress in given:
        loads += scene.thickness * _on_edges(stress, contacts.outlines, blocks.motion)
    pressure = np.array([scene.pressure.get(name, 0.0) for name in scene.laws])[tracker.law]
    push = pressure * contacts.carried.sum(axis=0) * scene.thickness
    loads += contacts.assemble(blocks.motion, push, 0.0 * push)
    blocks.loads[:] = loads * blocks.mobile
    return blocks.loads - before


def _on_edges(stress: Stress, outlines: Outlines, motion: np.ndarray) -> np.ndarray:
    """Forces and torques (n, 3) per m of thickness of a stress on edges of the blocks.

    An edge is split where the line bends and where it crosses the line. Along each part a to b of
    length L the stress goes straight from u_a to u_b: the force is -S.n L (u_a + u_b)/2, at
    a + (b - a)(u_a + 2 u_b)/(3 (u_a + u_b)).
    """
    p, block = outlines.placed, outlines.block
    centre, along = (motion[0] + 1j * motion[1])[block, None], (p[outlines.after] - p)[:, None]
    bends = (stress.line[:, 0] - p.real[:, None]) / np.where(along.real, along.real, np.inf)
    ends = 0.0 * along.real, np.sort(np.clip(bends, 0.0, 1.0)), 0.0 * along.real + 1.0
    at = p[:, None] + np.concatenate(ends, axis=1) * along
    a, b = at[:, :-1], at[:, 1:]
    da, db = stress.signed(a), stress.signed(b)
    crossing = a + (b - a) * da / np.where(da == db, 1.0, da - db)
    crosses = (da > 0) != (db > 0)
    a, b = np.where(crosses & (da <= 0), crossing, a), np.where(crosses & (db <= 0), crossing, b)
    ua, ub = np.maximum(da, 0.0), np.maximum(db, 0.0)
    push = stress.on(1j * (b - a)) * stress.edges[:, None]  # minus the outward normal, times L
    arms = ((a - centre) * (2 * ua + ub) + (b - centre) * (ua + 2 * ub)) / 6
    force, couple = push * (ua + ub) / 2, (arms.conj() * push).imag
    parts = (part.sum(axis=1) for part in (force.real, force.imag, couple))
    return np.stack([np.bincount(block, part, motion.shape[1]) for part in parts], axis=1)
