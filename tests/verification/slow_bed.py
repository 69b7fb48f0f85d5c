"""The law as a brute-force bed: fixed linear springs with sliders, no lumping, no shortcuts.

Every orientation carries many linear unilateral springs that touch at closures z_j. Each has its
own Coulomb slider, and yields on its own: squeezed beyond the yield interference it keeps a set,
and touches that much later. Slow and obvious: it exists to judge the package and shares no code
with it.
"""

import numpy as np
from builders import directions
from slow_virgin import SlowGamma, virgin


def depth_bins(y_max, n_depth, eta, heights):
    """Touch depths z (n,) and stiffnesses k (n,): sum k = Phi', sum k (y - z) = Phi at every edge.

    k is Phi'' integrated over its bin; z is the centroid of Phi'' in the bin. A finite Phi'(0)
    is one more spring at z = 0. Edges crowd towards touch, where Phi'' may be singular.
    """
    edges = y_max * (np.arange(n_depth) / (n_depth - 1.0)) ** 2
    phi, slope = np.array([virgin(e, eta, heights) for e in edges]).T
    k = np.diff(slope)
    moment = np.diff(phi) - slope[:-1] * np.diff(edges)  # int Phi''(t) (right edge - t) dt
    z = edges[1:] - np.divide(moment, k, out=np.diff(edges) / 2.0, where=k > 0.0)
    return np.append(0.0, z), np.append(slope[0], k)


class SlowBed:
    """One joint with the parameters of a law, from zero along a path of displacements (steps, 3).

    n_theta, n_phi: inclinations and azimuths; n_depth: springs of each.
    """

    def __init__(self, law, path, n_theta, n_phi, n_depth):
        o, p, h = law.orientation, law.asperity, law.heights
        n, weights = directions(o.a, o.b, o.c, order=n_theta, azimuths=n_phi)
        normals, weights = n.reshape(3, -1).T, weights.ravel()
        self.n, self.c1, self.path = normals, normals[:, 0], path
        self.lam, self.mu = p.lam, p.mu
        self.scale = law.asperity_density * weights * p.lam * p.K * self.c1 ** (1.0 + p.eta)
        heights = h and SlowGamma(h.alpha, h.beta, h.overlap, h.formation)
        # rows of equal tilt share their depths
        reach = [float(f"{r:.12g}") for r in reach_of(path, normals)]
        bins = {r: depth_bins(r, n_depth, p.eta, heights) for r in set(reach)}
        self.z, self.k = np.moveaxis([bins[r] for r in reach], 1, 0)
        self.mating_length, self.steep = law.mating_length, normals[:, 1:] / self.c1[:, None]
        self.yields_at = (p.yield_interference / self.c1)[:, None]  # largest y - z of a spring
        self.crushed = 0.0  # plastic work
        # where slopes fade the asperities of opposite orientations are flattened together
        turned = normals * [1.0, -1.0, -1.0]
        mirror = np.argmin(np.sum((normals[:, None] - turned) ** 2, axis=2), axis=0)
        self.mirror = mirror if np.isfinite(law.mating_length) else np.arange(len(normals))
        azimuth = np.arctan2(normals[:, 2], normals[:, 1])
        self.e0 = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
        self._turn(np.zeros(2))
        self.delta = np.zeros(3)
        self.y = np.zeros(len(normals))
        self.e = np.zeros((2, *self.z.shape))  # in-plane stretch of every spring

    def update(self, d):
        """Advance by the small increment d (3,); return the traction (3,)."""
        d = np.asarray(d, dtype=float)
        self.delta = self.delta + d
        self._turn(self.delta[1:] - 0.5 * d[1:])  # planes at mid-step, of sliders that move
        y0, self.y = self.y, self.delta[0] + self._rise(self.delta[1:])
        y1, z0 = self.y, self.z
        top = y1[:, None] - self.yields_at
        self.z = np.maximum(z0, np.maximum(top, top[self.mirror]))
        held = np.clip(0.5 * (y0 + y1)[:, None] - 0.5 * (z0 + self.z), 0.0, self.yields_at)
        self.crushed += np.sum((self.scale * self.c1)[:, None] * self.k * held * (self.z - z0))
        touching = y1[:, None] > self.z
        # a spring that touches inside the step has moved along the facet only since its touch
        rise = np.where(y1 > y0, y1 - y0, 1.0)[:, None]
        part = np.where(y0[:, None] < z0, (y1[:, None] - z0) / rise, 1.0) * touching
        de = self.basis @ d  # (m, 2)
        free = self.e * touching + part * de.T[:, :, None]
        self._turn(self.delta[1:])
        limit = self.mu * self.lam * self.lean[:, None] * self.c1[:, None]
        limit = limit * np.clip(y1[:, None] - self.z, 0.0, None)
        size = np.sqrt(free[0] ** 2 + free[1] ** 2)
        self.e = free * (limit / np.maximum(size, np.maximum(limit, 1e-300)))
        return self.traction()

    def _turn(self, p):
        """Planes of the asperities at the in-plane displacement p (2,), by differences of y."""
        h = 1e-6 * min(self.mating_length, 1.0)
        ways = [(self._rise(p + h * e) - self._rise(p - h * e)) / (2 * h) for e in np.eye(2)]
        a = np.stack(ways, axis=1)
        self.slope = np.column_stack([np.ones(len(a)), a])
        length = np.linalg.norm(self.slope, axis=1)
        self.lean = self.c1 * length
        s = np.column_stack([-np.sum(a * self.e0, axis=1), self.e0])
        s /= np.linalg.norm(s, axis=1)[:, None]
        self.basis = np.stack([s, np.cross(self.slope / length[:, None], s)], axis=1)

    def _rise(self, p):
        return self.steep @ p / np.hypot(1.0, np.hypot(*p) / self.mating_length)

    def traction(self):
        """Sum of the forces of all facets, axis 1 the joint normal."""
        normal = self.scale * np.sum(self.k * np.clip(self.y[:, None] - self.z, 0.0, None), axis=1)
        shear = self.scale / (self.c1 * self.lam) * np.sum(self.k * self.e, axis=2)
        return normal @ (self.c1[:, None] * self.slope) + np.einsum("io,oij->j", shear, self.basis)

    def follow(self):
        """Tractions (steps, 3) along the path, and stored energies (steps,)."""
        rows = [(self.update(d), self.stored()) for d in np.diff(self.path, axis=0, prepend=0.0)]
        return tuple(np.array(part) for part in zip(*rows, strict=True))

    def stored(self):
        """Energy in all springs, per area."""
        squeeze = np.clip(self.y[:, None] - self.z, 0.0, None)
        normal = self.scale * self.c1 * np.sum(self.k * squeeze**2, axis=1)
        shear = self.scale / (self.c1 * self.lam) * np.sum(self.k * np.sum(self.e**2, axis=0), 1)
        return 0.5 * float(np.sum(normal + shear))


def reach_of(path, normals, margin=1.0 + 1e-9):
    """Largest closure y of every orientation along a path of displacements (steps, 3)."""
    tilt = np.hypot(normals[:, 1], normals[:, 2]) / normals[:, 0]
    shear = np.max(np.hypot(path[:, 1], path[:, 2]))
    return margin * (np.max(np.clip(path[:, 0], 0.0, None)) + tilt * shear)
