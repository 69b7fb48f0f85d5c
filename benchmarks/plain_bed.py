"""The law the obvious way, in numpy: many fixed linear springs, each with its slider.

This is how the tests judge the package (tests/verification/slow_bed.py), with an axis of joints
added and motion in one plane: a bed of springs that touch at fixed depths for every orientation,
all of them stepped whether they touch or not, as array operations over all joints. No lumping and
no shortcut but one: the traction across the plane of motion is not summed.

Where the springs are is one of two choices:

- `even`: what one writes first, midpoint sums of the integrals over inclination, azimuth and touch
  depth.
- `tuned`: as in the tests, a Gauss rule in u = cos(a theta), springs at the centroid of what their
  cell holds, cells crowded towards touch.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

import jointlaw as jl
from jointlaw.accuracy.suite import Suite, errors

Rule = tuple[int, int, int]  # inclinations, azimuths on the whole circle, springs of an orientation


class Springs(NamedTuple):
    """Where the springs are: M orientations, D springs of each."""

    theta: np.ndarray  # (M,)
    phi: np.ndarray  # (M,)
    weight: np.ndarray  # (M,)
    z: np.ndarray  # (M, D), touch depths
    k: np.ndarray  # (M, D), of the virgin curve


def even(law: jl.JointLaw, rule: Rule) -> Springs:
    """Midpoints in theta, phi and touch depth."""
    (u, phi, depth), o = rule, law.orientation
    steepest = np.pi / (2 * o.a)
    theta = np.repeat((np.arange(u) + 0.5) / u * steepest, phi)
    azimuth = _around(u, phi)
    weight = o.a * np.sin(o.a * theta) * steepest / (u * phi)
    weight *= _density(law, np.cos(o.a * theta), azimuth)
    edges = _reach(law, theta) * np.arange(depth + 1) / depth
    slope = law.curve.force(edges)[1]
    k = np.diff(slope, axis=1)
    k[:, 0] += slope[:, 0]
    return Springs(theta, azimuth, weight, (edges[:, 1:] + edges[:, :-1]) / 2, k)


def tuned(law: jl.JointLaw, rule: Rule) -> Springs:
    """Gauss nodes in cos(a theta), centroids of crowded cells; one spring touches at once."""
    u, phi, depth = rule
    x, w = np.polynomial.legendre.leggauss(u)
    cosine = np.repeat(0.5 * (x + 1), phi)
    theta, azimuth = np.arccos(cosine) / law.orientation.a, _around(u, phi)
    weight = np.repeat(0.5 * w, phi) / phi * _density(law, cosine, azimuth)
    edges = _reach(law, theta) * (np.arange(depth) / (depth - 1)) ** 2
    force, slope = law.curve.force(edges)
    k = np.diff(slope, axis=1)
    moment = np.diff(force, axis=1) - slope[:, :-1] * np.diff(edges, axis=1)
    z = edges[:, 1:] - np.divide(moment, k, out=np.zeros_like(k), where=k > 0)
    at_once = slope[:, :1]
    z, k = np.concatenate([0 * at_once, z], axis=1), np.concatenate([at_once, k], axis=1)
    return Springs(theta, azimuth, weight, z, k)


def _around(u: int, phi: int) -> np.ndarray:
    return np.tile(np.arange(phi) * 2 * np.pi / phi, u)


def _density(law: jl.JointLaw, u: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Of orientations, over that of a = 1, b = c = 0 (Eq. 14)."""
    o = law.orientation
    value: np.ndarray = 1 + o.b / 2 * (3 * u**2 - 1) + 3 * o.c * (1 - u**2) * np.cos(2 * phi)
    return value


def _reach(law: jl.JointLaw, theta: np.ndarray) -> np.ndarray:
    """Deepest closure (M, 1) of each orientation on the standard paths, "far" among them."""
    slope = np.tan(theta)
    deepest: np.ndarray = law.closure_range * np.maximum(1.2 * (1 + slope), 0.5 + 3.0 * slope)
    return deepest[:, None]


class PlainBed:
    """n joints of one law on these springs."""

    def __init__(self, law: jl.JointLaw, springs: Springs, n: int) -> None:
        theta, phi, weight, z, k = springs
        p = law.asperity
        c1, st = np.cos(theta), np.sin(theta)
        self.n = np.stack([c1, st * np.cos(phi)])  # (2, M): closure and shear in the plane
        self.s, self.t = np.stack([-st, c1 * np.cos(phi)]), np.stack([0 * c1, -np.sin(phi)])
        self.c1, self.lam, self.mu = c1[:, None, None], p.lam, p.mu
        scale = law.asperity_density * weight * p.lam * p.K * c1 ** (1 + p.eta)
        self.k, self.z = (scale[:, None] * k)[:, :, None], z[:, :, None]
        self.delta = np.zeros((2, n))
        self.e = np.zeros((2, *k.shape, n))
        self.y = np.zeros((len(theta), 1, n))

    def update(self, d: np.ndarray) -> np.ndarray:
        """Advance by d (2, n); traction (2, n)."""
        self.delta += d
        y0, y1 = self.y, np.einsum("im,in->mn", self.n, self.delta)[:, None] / self.c1
        squeeze = np.maximum(y1 - self.z, 0.0)
        rise = np.where(y1 > y0, y1 - y0, 1.0)
        part = np.where(y0 < self.z, np.minimum(squeeze / rise, 1.0), 1.0) * (squeeze > 0)
        self.e *= squeeze > 0
        for e, direction in zip(self.e, (self.s, self.t), strict=True):
            e += part * np.einsum("im,in->mn", direction, d)[:, None]
        limit = self.mu * self.lam * self.c1 * squeeze
        size = np.hypot(*self.e)
        self.e *= limit / np.maximum(np.maximum(size, limit), 1e-300)
        self.y = y1
        normal = np.sum(self.k * squeeze, axis=1)
        shear = np.sum(self.k * self.e, axis=2) / (self.c1[:, :, 0] * self.lam)
        F: np.ndarray = self.n @ normal + self.s @ shear[0] + self.t @ shear[1]
        return F


def smallest(
    law: jl.JointLaw, suite: Suite, tolerance: float, place: Callable[..., Springs]
) -> tuple[Rule, float]:
    """The fewest springs, of `even` or `tuned`, that meet the tolerance on the standard paths."""
    known: dict[Rule, float] = {}

    def error(rule: Rule) -> float:
        if rule not in known:
            bed = PlainBed(law, place(law, rule), suite.d.shape[1])
            F = np.stack([bed.update(step.T).T for step in suite.d])
            known[rule] = float(errors(F, suite.F)[0].max())
        return known[rule]

    spread = ((1, 2, 3, 4, 6, 8, 12, 16, 24), (6, 8, 12, 16),
              (8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384))  # fmt: skip
    fine = [choices[-1] for choices in spread]
    enough = []  # what each direction needs while the others are fine, and more
    for i, choices in enumerate(spread):
        alone = (error((*fine[:i], n, *fine[i + 1 :])) for n in choices)  # type: ignore[arg-type]
        least = next((k for k, found in enumerate(alone) if found <= tolerance), -1)
        enough.append(choices[least:])
    for rule in sorted(product(*enough), key=lambda rule: int(np.prod(rule))):
        if error(rule) <= tolerance:
            return rule, error(rule)
    best = min(known.values())
    raise SystemExit(f"no plain bed of the spread meets {tolerance:.2g}; the best has {best:.2g}")
