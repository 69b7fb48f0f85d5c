"""For records and pictures: which segment of joint a law point stands for, and whose it is."""

from __future__ import annotations

import numpy as np

from ..contact.geometry import Contacts, Points
from ..contact.smoothing import raised


def segments(contacts: Contacts, points: Points, motion: np.ndarray) -> np.ndarray:
    """Ends (n, 2, 2) of the segment of joint that each law point stands for: [point, end, x y]."""
    c, k = contacts, len(contacts.corner)
    lies = 1 - raised(points.rise, np.ones_like(points.rise))[0]
    part = c.share * lies * np.maximum(points.overlap, 0.0)
    part += 0.5 * (points.length[:k] - part.sum(axis=0))
    way = c.outlines.place(motion)[1][c.edge]
    ahead = np.full(len(c), 0.5)
    ahead[:k] = part[0] / np.maximum(part.sum(axis=0), 1e-300)
    if c.along is not None:
        way = np.concatenate([way, 1j * points.normal[k:]])
    ends = points.at + np.stack([ahead, ahead - 1], axis=0) * points.length * way
    return np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)


def names(contacts: Contacts, points: Points, numbers: list[int]) -> np.ndarray:
    """Who meets at every law point: (n, 5) block, edge, block, edge and the point's number.

    Of the two edges at a corner the flatter one counts. Points along an edge have numbers below 0.
    """
    c, o = contacts, contacts.outlines
    side = np.where(points.rise[0] < points.rise[1], *c.sides)
    one, other = np.minimum(side, c.edge), np.maximum(side, c.edge)
    if c.along is not None:
        u = c.along
        one = np.concatenate([one, u.first[u.of]])
        other = np.concatenate([other, u.second[u.of]])
    first, second = o.block[one], o.block[other]
    return np.stack([first, one - o.start[first], second, other - o.start[second], numbers], axis=1)
