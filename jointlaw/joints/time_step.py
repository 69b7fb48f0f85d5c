"""Stable explicit time steps: of one mass on one joint, and of bodies connected by many joints.

The step of leapfrog and of the other explicit schemes of block codes is stable below `2/omega`,
with the largest angular frequency omega of the bodies on their joints. Several joints at one body
add their stiffness, and two bodies that move against each other load the joint between them by the
sum of their motions, so that a step for one joint with its reduced mass is too long: by a factor
of 1.14 for two equal masses in series on a base, 1.41 for many, and 2 for four joints under one
mass.

`stable_time_step` bounds omega. Joint j with stiffness at most k_j = K_j A_j, between bodies a and
b, resists the relative velocity of its contact point. In coordinates scaled by the square root of
the mass, the velocity of the point of body a is at most sqrt(g) times the velocity of the body,
with g = 1/m + r^2/I, r the distance from the centre of mass. So omega^2 is at most the largest
eigenvalue of the matrix N of numbers >= 0 with, for each joint, k_j g_a and k_j g_b on the diagonal
and k_j sqrt(g_a g_b) beside it. For every vector w > 0 this eigenvalue is at most the largest
(N w)/w (Collatz), which power iteration lowers to the eigenvalue from above: the step is safe after
any number of iterations.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..support.checks import Array, finite, numbers

_ITERATIONS = 200
_CONVERGENCE = 1e-3  # relative, between upper and lower bound of the eigenvalue


def single_mass_time_step(mass: ArrayLike, area: ArrayLike, stiffness: Array) -> Array:
    """Critical time step 2 sqrt(m/(K area)) in s, infinite where the stiffness is zero.

    mass: reduced mass in kg, > 0; area: in m2, > 0; stiffness: K in Pa/m.
    Raises ValueError for a mass or an area that is not > 0 and finite.
    """
    m = finite("mass", mass, "kg")
    a = finite("area", area, "m2")
    if not ((m > 0).all() and (a > 0).all()):
        raise ValueError(f"mass = {m} kg, area = {a} m2 are out of bounds: both must be > 0")
    with np.errstate(divide="ignore"):
        return 2 * np.sqrt(m / (stiffness * a))


def stable_time_step(
    first: ArrayLike,
    second: ArrayLike,
    mass: ArrayLike,
    area: ArrayLike,
    stiffness: ArrayLike,
    inertia: ArrayLike | None = None,
    arm: ArrayLike | None = None,
) -> float:
    """Stable explicit time step (s) of bodies that are connected by joints, rotation included.

    first, second: indices (joints,) of the two bodies of each joint. mass: (bodies,) in kg, > 0;
    infinite for a fixed body. area: of the joints in m2, > 0, a number or (joints,). stiffness:
    upper bound of `|C|` of each joint in Pa/m, >= 0, a number or (joints,): `max_stiffness()` of a
    batch for joints in their present state, or `law.max_stiffness(closure, shear)` for the largest
    displacements of the run.
    inertia: smallest principal moment of inertia (bodies,) in kg m2, > 0, in a plane the moment
    about its normal; infinite for a body that does not rotate; None: no body rotates. arm:
    distances (joints, 2) in m from the contact point to the centres of mass of the first and second
    body; needed with `inertia`.

    The result is exact for bodies in a row that move along it, and shorter than necessary where
    joints act in different directions (by sqrt(2) for two joints without shear stiffness at right
    angles) or on rotation and translation at once. A fraction of 0.95 of it is stable in lasting
    contact; impacts have the limits of `JointLaw.critical_time_step`. Returns infinity where
    nothing resists. Raises ValueError for indices that name no body, and for other shapes or
    numbers out of bounds.

    >>> dt = jl.stable_time_step([0, 1], [2, 0], [1.0, 1.0, np.inf], 0.01, 1e9)
    """
    m = _positive("mass", mass, "kg")
    if m.ndim != 1:
        raise ValueError(f"mass has shape {m.shape}: give one number for each body, (bodies,)")
    a = _bodies("first", first, len(m))
    b = _bodies("second", second, len(m))
    if a.shape != b.shape or (a == b).any():
        raise ValueError(
            f"first has shape {a.shape} and second {b.shape}: give two different bodies for each "
            "joint"
        )
    joints = len(a)
    k = _per_joint("area", _positive("area", area, "m2"), joints)
    K = finite("stiffness", stiffness, "Pa/m")
    if not (K >= 0.0).all():
        raise ValueError(f"stiffness = {stiffness!r} Pa/m is out of bounds: it must be >= 0")
    k = k * _per_joint("stiffness", K, joints)
    mobility = np.stack([1.0 / m[a], 1.0 / m[b]])  # g of both bodies of each joint
    if inertia is not None:
        moment = _positive("inertia", inertia, "kg m2")
        r = finite("arm", np.zeros(0) if arm is None else arm, "m")
        if moment.shape != m.shape or r.shape != (joints, 2):
            raise ValueError(
                f"inertia has shape {moment.shape} and arm {r.shape}: give ({len(m)},) and "
                f"({joints}, 2)"
            )
        mobility = mobility + r.T**2 / np.stack([moment[a], moment[b]])
    elif arm is not None:
        raise ValueError("arm is given without inertia: give the moments of inertia of the bodies")
    largest = _largest_eigenvalue(np.concatenate([a, b]), k, mobility, len(m))
    return float(2.0 / np.sqrt(largest)) if largest > 0.0 else np.inf


def _largest_eigenvalue(bodies: NDArray[np.intp], k: Array, mobility: Array, count: int) -> float:
    """Upper bound of the largest eigenvalue of N, within _CONVERGENCE of it, in 1/s2.

    bodies: first, then second bodies of all joints; k: stiffness in N/m; mobility: g (2, joints).
    """
    roots = np.sqrt(k * mobility)  # of both bodies of each joint
    if not roots.any():
        return 0.0
    n = len(k)

    def multiply(w: Array) -> Array:
        of_joints = roots[0] * w[bodies[:n]] + roots[1] * w[bodies[n:]]
        products = np.concatenate(roots * of_joints)
        return np.asarray(np.bincount(bodies, products, count), float)

    moves = multiply(np.ones(count)) > 0.0  # bodies that are neither fixed nor without joints
    w = moves.astype(float)
    upper = np.inf
    for _ in range(_ITERATIONS):
        product = multiply(w)
        ratio = product[moves] / w[moves]
        upper = min(upper, float(ratio.max()))
        if upper - ratio.min() <= _CONVERGENCE * upper:
            break
        w = product / product.max()
        w = np.where(moves, np.maximum(w, np.finfo(float).tiny), 0.0)
    return upper


def _bodies(name: str, value: ArrayLike, count: int) -> NDArray[np.intp]:
    """Indices of bodies, one for each joint. Raises ValueError for other numbers."""
    index: Any = np.asarray(value)
    is_index = index.ndim == 1 and (index.size == 0 or np.issubdtype(index.dtype, np.integer))
    if not is_index or (index.size and not 0 <= index.min() <= index.max() < count):
        raise ValueError(f"{name} = {value!r}: give indices of bodies, from 0 to {count - 1}")
    return np.asarray(index, np.intp)


def _positive(name: str, value: ArrayLike, unit: str) -> Array:
    """Numbers > 0, infinity included. Raises ValueError for others."""
    array = numbers(name, value, unit)
    if not (array > 0.0).all():
        raise ValueError(f"{name} = {value!r} {unit} is out of bounds: it must be > 0")
    return array


def _per_joint(name: str, array: Array, joints: int) -> Array:
    """One number for each joint. Raises ValueError for another shape."""
    if array.shape not in ((), (joints,)):
        raise ValueError(f"{name} has shape {array.shape}: give a number or ({joints},)")
    return np.broadcast_to(array, (joints,))
