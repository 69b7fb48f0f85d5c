"""The law as a brute-force spring-slider model: every spring explicit, no code of the package.

Every orientation carries many linear unilateral springs that touch at closures z_j. Each has its
own Coulomb slider, and yields on its own: squeezed beyond the yield interference it is indented
plastically, and touches at a larger closure from then on. Slow and obvious: an independent
reference for the package.
"""

import numpy as np
from builders import directions
from first_loading import ReferenceGamma, first_loading

DIFFERENCE_STEP = 1e-6  # of the mating length, or of one


def springs(y_max, count, eta, heights):
    """Touch depths z (n,) and stiffnesses k (n,): sum k = Phi', sum k (y - z) = Phi at every edge.

    k is Phi'' integrated over its bin; z is the centroid of Phi'' in the bin. A finite Phi'(0)
    is one more spring at z = 0. Edges crowd towards first touch, where Phi'' may be singular.
    """
    edges = y_max * (np.arange(count) / (count - 1.0)) ** 2
    phi, slope = np.array([first_loading(edge, eta, heights) for edge in edges]).T
    k = np.diff(slope)
    moment = np.diff(phi) - slope[:-1] * np.diff(edges)  # int Phi''(t) (right edge - t) dt
    z = edges[1:] - np.divide(moment, k, out=np.diff(edges) / 2.0, where=k > 0.0)
    return np.append(0.0, z), np.append(slope[0], k)


def largest_closures(path, normals, margin=1.0 + 1e-9):
    """Largest closure y of every orientation along a path of displacements (steps, 3)."""
    tilt = np.hypot(normals[:, 1], normals[:, 2]) / normals[:, 0]
    shear = np.max(np.hypot(path[:, 1], path[:, 2]))
    return margin * (np.max(np.clip(path[:, 0], 0.0, None)) + tilt * shear)


class SpringSliderModel:
    """One joint with the parameters of a law, from zero along a path of displacements (steps, 3).

    n_theta, n_phi: inclinations and azimuths; n_depth: springs of each orientation.
    """

    def __init__(self, law, path, n_theta, n_phi, n_depth):
        orientation = law.orientation
        asperity = law.asperity
        h = law.heights
        n, weights = directions(
            orientation.a, orientation.b, orientation.c, order=n_theta, azimuths=n_phi
        )
        normals = n.reshape(3, -1).T
        weights = weights.ravel()
        self.path = path
        self.c1 = normals[:, 0]
        self.lam = asperity.lam
        self.mu = asperity.mu
        self.scale = law.asperity_density * weights * asperity.lam * asperity.K
        self.scale *= self.c1 ** (1.0 + asperity.eta)
        heights = h and ReferenceGamma(h.alpha, h.beta, h.overlap, h.formation)
        # orientations of equal inclination have the same springs
        closures = [float(f"{y:.12g}") for y in largest_closures(path, normals)]
        sets = {y: springs(y, n_depth, asperity.eta, heights) for y in set(closures)}
        self.z, self.k = np.moveaxis([sets[y] for y in closures], 1, 0)
        self.mating_length = law.mating_length
        self.slopes = normals[:, 1:] / self.c1[:, None]
        # largest y - z of a spring
        self.yield_squeeze = (asperity.yield_interference / self.c1)[:, None]
        self.plastic_work = 0.0
        # with a mating length the asperities of opposite orientations are indented together
        opposite = normals * [1.0, -1.0, -1.0]
        mirror = np.argmin(np.sum((normals[:, None] - opposite) ** 2, axis=2), axis=0)
        self.mirror = mirror if np.isfinite(law.mating_length) else np.arange(len(normals))
        azimuth = np.arctan2(normals[:, 2], normals[:, 1])
        self.e0 = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
        self._rotate_planes(np.zeros(2))
        self.delta = np.zeros(3)
        self.y = np.zeros(len(normals))
        self.e = np.zeros((2, *self.z.shape))  # in-plane stretch of every spring

    def update(self, d):
        """Advance by the small increment d (3,); return the traction (3,)."""
        d = np.asarray(d, dtype=float)
        self.delta = self.delta + d
        self._rotate_planes(self.delta[1:] - 0.5 * d[1:])  # at mid-step, for the sliders
        y0 = self.y
        y1 = self.delta[0] + self._climb(self.delta[1:])
        self.y = y1
        z0 = self.z
        self._indent(y0, y1)
        touches = y1[:, None] > self.z
        # a spring that touches inside the step has moved along the facet only since its touch
        closing = np.where(y1 > y0, y1 - y0, 1.0)[:, None]
        fraction = np.where(y0[:, None] < z0, (y1[:, None] - z0) / closing, 1.0) * touches
        in_plane = self.basis @ d  # (m, 2)
        trial = self.e * touches + fraction * in_plane.T[:, :, None]
        self._rotate_planes(self.delta[1:])
        limit = self.mu * self.lam * self.lean[:, None] * self.c1[:, None]
        limit = limit * np.clip(y1[:, None] - self.z, 0.0, None)
        size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
        self.e = trial * (limit / np.maximum(size, np.maximum(limit, 1e-300)))
        return self.traction()

    def _indent(self, y0, y1):
        """Indent the springs that yield between the closures y0 and y1 (m,); add plastic work."""
        z0 = self.z
        yielding = y1[:, None] - self.yield_squeeze
        self.z = np.maximum(z0, np.maximum(yielding, yielding[self.mirror]))
        mean_squeeze = 0.5 * (y0 + y1)[:, None] - 0.5 * (z0 + self.z)
        force = self.k * np.clip(mean_squeeze, 0.0, self.yield_squeeze)
        self.plastic_work += np.sum((self.scale * self.c1)[:, None] * force * (self.z - z0))

    def _rotate_planes(self, p):
        """Planes of the asperities at the in-plane displacement p (2,), by differences of y."""
        h = DIFFERENCE_STEP * min(self.mating_length, 1.0)
        gradient = [(self._climb(p + h * e) - self._climb(p - h * e)) / (2 * h) for e in np.eye(2)]
        a = np.stack(gradient, axis=1)
        self.slope = np.column_stack([np.ones(len(a)), a])
        length = np.linalg.norm(self.slope, axis=1)
        self.lean = self.c1 * length
        s = np.column_stack([-np.sum(a * self.e0, axis=1), self.e0])
        s /= np.linalg.norm(s, axis=1)[:, None]
        self.basis = np.stack([s, np.cross(self.slope / length[:, None], s)], axis=1)

    def _climb(self, p):
        """Closure (m,) of every orientation by the in-plane displacement p (2,)."""
        return self.slopes @ p / np.hypot(1.0, np.hypot(*p) / self.mating_length)

    def traction(self):
        """Sum (3,) of the forces of all facets, axis 1 the joint normal."""
        normal = self.scale * np.sum(self.k * np.clip(self.y[:, None] - self.z, 0.0, None), axis=1)
        shear = self.scale / (self.c1 * self.lam) * np.sum(self.k * self.e, axis=2)
        return normal @ (self.c1[:, None] * self.slope) + np.einsum("io,oij->j", shear, self.basis)

    def stored_energy(self):
        """Energy in all springs, per area."""
        squeeze = np.clip(self.y[:, None] - self.z, 0.0, None)
        normal = self.scale * self.c1 * np.sum(self.k * squeeze**2, axis=1)
        shear = self.scale / (self.c1 * self.lam) * np.sum(self.k * np.sum(self.e**2, axis=0), 1)
        return 0.5 * float(np.sum(normal + shear))

    def follow(self):
        """Tractions (steps, 3) along the path, and stored energies (steps,)."""
        tractions = []
        energies = []
        for d in np.diff(self.path, axis=0, prepend=0.0):
            tractions.append(self.update(d))
            energies.append(self.stored_energy())
        return np.array(tractions), np.array(energies)
