"""Stress before an excavation: what each contact point in space bears of it.

A contact point stands for a part of the polygon of its contact. Its traction is such that all
points of a contact have the force and the moment of a stress that varies linearly over the polygon:
each triangle between a side and the centroid gives its corners their shares, and the share of the
centroid goes to all points as their areas.
"""

import numpy as np

from .contacts import ContactPoints
from .loads import SpaceStress
from .scene import SpaceScene


def mean_of_points(points: ContactPoints, stress: SpaceStress) -> np.ndarray:
    """Values (k,) of the profile of a stress for contact points.

    Times their areas, they have the integral and the first moments over each polygon of the profile
    between its corners and its centroid.
    """
    k = len(points.area)
    contact = points.contact
    first = np.searchsorted(contact, contact)
    count = np.bincount(contact)[contact] if k else contact
    following = first + (np.arange(k) - first + 1) % np.maximum(count, 1)
    weight = points.area / np.maximum(np.bincount(contact, points.area)[contact], 1e-300)
    n = int(contact.max(initial=-1)) + 1
    center = np.stack([np.bincount(contact, weight * x, n) for x in points.point.T], axis=1)
    value = np.maximum(stress.signed(points.point), 0.0)
    value_center = np.maximum(stress.signed(center), 0.0)[contact]
    at_center = center[contact]
    side = np.cross(points.point - at_center, points.point[following] - at_center)
    triangle = 0.5 * np.linalg.norm(side, axis=1)
    force = triangle * (2 * value + value[following] + value_center) / 12
    after = triangle * (value + 2 * value[following] + value_center) / 12
    np.add.at(force, following, after)
    rest = triangle * (value + value[following] + 2 * value_center) / 12
    force += weight * np.bincount(contact, rest, n)[contact]
    return force / np.maximum(points.area, 1e-300)


def in_situ_traction(scene: SpaceScene, points: ContactPoints, axes: np.ndarray) -> np.ndarray:
    """Effective normal stress and shear stresses (k, 3) in Pa of contact points under the in-situ
    stress of a scene, less the water pressure.

    axes (k, 3, 3): normal of block b, axis 2, axis 3. Block a is pressed along the normal, and
    sheared against its own displacement.
    """
    stress = scene.in_situ
    assert stress is not None
    on_a = axes[:, 0] @ stress.tensor * mean_of_points(points, stress)[:, None]
    traction = np.einsum("ki,kci->kc", on_a, axes) * [1.0, -1.0, -1.0]
    if scene.water:
        traction[:, 0] -= mean_of_points(points, scene.water)
    return traction
