"""Limit analysis: an upper bound of the factor of safety by linear programming.

A scene can only be in equilibrium with its strength divided by F if there are contact forces that
balance every block and respect the strength of every joint, whatever the stiffnesses. Whether there
are any is a linear program. If there are none, equilibrium is impossible: failure is proved. If
there are some, nothing is proved, because joints cannot choose their forces: they follow from the
displacements, and joints that dilate less than their friction angle may fail before (non-associated
flow). For friction alone the gap is 4 to 17 % on slopes of rock; an equilibrium that was found is
the proof on that side.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, diags, hstack, vstack

import jointlaw as jl

from ..contact import ContactManager, Contacts
from ..dynamics.blocks import Blocks, apply_loads
from ..dynamics.timestep import closure_and_shear_rates
from ..output.monitors import slip_distance
from ..scene import Scene

SMALLEST_FACTOR = 1 / 64
LARGEST_FACTOR = 64.0
TOLERANCE = 1e-3  # of the factor
STRESSES = 7  # at which the strength of a rough law gets a tangent
STRESS_RANGE = 1e-3, 3.0  # of the largest overburden stress: where they lie
SLOPE_STEP = 1.05  # ratio of the two stresses that give a tangent
INFEASIBLE = 2  # status of scipy.optimize.linprog


class Strength(NamedTuple):
    """Strength of a joint: |shear stress| <= cohesion + friction * normal stress, for every line,
    and normal stress >= -tension (Pa)."""

    cohesion: np.ndarray  # (lines,) in Pa
    friction: np.ndarray  # (lines,)
    tension: float


class ForceBalance(NamedTuple):
    """Equations and strengths of a scene's contacts that bear forces.

    normal, shear (m, n): generalised forces on the m free motions by unit forces of n contacts;
    load (m,): of weight, loads and water; area (n,) in m2; law (n,): number of each one's law.
    """

    normal: csr_array
    shear: csr_array
    load: np.ndarray
    area: np.ndarray
    law: np.ndarray
    strengths: Sequence[Strength]
    bolts: csr_array  # (m, b): generalised forces by unit tensions of the bolts
    capacity: np.ndarray  # (b,) in N


def force_balance(scene: Scene, excluded: np.ndarray | None = None) -> ForceBalance:
    """The balance of a scene as drawn, without the `excluded` blocks (blocks,) and their contacts:
    they move away."""
    blocks = Blocks(scene)
    manager = ContactManager(scene, blocks.motion)
    manager.rebuild(blocks.motion, blocks.neighbour_pairs())
    apply_loads(scene, blocks, manager)
    contacts: Contacts = manager.contacts
    bears = contacts.length > 1e-9 * contacts.length.max(initial=0.0)
    if excluded is not None:
        bears &= ~(excluded[contacts.block_a] | excluded[contacts.block_b])
    bearing = np.flatnonzero(bears)
    count = len(contacts.length)
    motions = -closure_and_shear_rates(blocks, contacts).T.tocsr()  # (free motions, 2 contacts)
    load = ((blocks.gravity + blocks.loads) * blocks.inverse_sqrt_inertia)[blocks.is_free]
    if excluded is not None:
        block_of_motion = np.nonzero(blocks.is_free)[0]
        is_included = ~excluded[block_of_motion]
        motions = motions[is_included]
        load = load[is_included]
    bolts = blocks.bolts
    bolt_motions = -bolts.rates(blocks.motion, blocks.inverse_sqrt_inertia, blocks.is_free).T
    bolt_motions = bolt_motions.tocsr()
    holds = np.ones(bolts.n, bool)
    if excluded is not None:
        bolt_motions = bolt_motions[is_included]
        holds = ~(excluded[bolts.block_a] | excluded[bolts.block_b])
    stress = overburden_stress(scene)
    strengths = [strength_of(law, stress) for law in scene.laws.values()]
    return ForceBalance(
        motions[:, bearing],
        motions[:, count + bearing],
        load,
        contacts.area[bearing],
        manager.law[bearing],
        strengths,
        bolt_motions[:, np.flatnonzero(holds)],
        bolts.capacity[holds],
    )


def overburden_stress(scene: Scene) -> float:
    """Scale (Pa) of the stresses in a scene: the weight of a column of its height, or its in-situ
    stress if that is larger."""
    corners = np.concatenate([block.corners for block in scene.blocks])
    height = float(np.ptp(corners, axis=0).max())
    density = max(block.section.mass / block.section.area for block in scene.blocks)
    weight = density * float(np.hypot(*scene.gravity)) * height
    if scene.in_situ is None:
        return weight
    deepest = float(scene.in_situ.signed(corners @ [1, 1j]).max())
    return max(weight, float(np.abs(scene.in_situ.tensor).max()) * deepest)


def strength_of(law: jl.Law, stress: float) -> Strength:
    """Strength of a law, for stresses of the order of `stress` (Pa).

    Of a rough law: tangents of its peak strength in direct shear. It is a concave function of the
    normal stress, so that tangents lie above it and the bound stays a bound.
    """
    if type(law) is jl.CoulombLaw:  # a subclass may have more elements
        return Strength(np.array([law.cohesion]), np.array([law.friction]), law.tension)
    low, high = (fraction * stress for fraction in STRESS_RANGE)
    stresses = np.geomspace(low, high, STRESSES)
    peaks = np.array([peak_strength(law, s) for s in stresses])
    strength_nearby = np.array([peak_strength(law, SLOPE_STEP * s) for s in stresses])
    friction = (strength_nearby - peaks) / ((SLOPE_STEP - 1.0) * stresses)
    return Strength(peaks - friction * stresses, friction, law.tensile_strength)


def peak_strength(law: jl.Law, stress: float) -> float:
    """Largest shear stress (Pa) of direct shear at a normal stress (Pa)."""
    slip = slip_distance(law)
    to = [1.2 * slip]
    bond = getattr(law, "bond", None)
    if bond is not None:  # a brittle bond peaks early
        to = sorted([min(1.01 / bond.limits[1][1], slip), 1.2 * slip])
    record = jl.direct_shear(law.joint(), to=to, normal=stress, steps=120)
    return float(np.abs(record.shear_stress).max())


def can_balance(balance: ForceBalance, factor: float) -> bool:
    """Whether there are contact forces that balance all blocks with the strength divided by factor.

    Unknowns of each contact: the normal force above -tension, N + T = p + q with p, q >= 0, and the
    shear force (mu/F) (p - q) + s with |s| bounded by the rest of the cohesion. They respect the
    steepest line of its strength by themselves; further lines are inequalities. The tension of a
    bolt is between zero and its capacity, which is not divided. Raises RuntimeError
    where the solver decides nothing.
    """
    scale = np.abs(balance.load).max()
    if not scale:
        return True
    area = balance.area / scale
    law = balance.law
    first = [strength.friction.argmax() for strength in balance.strengths]
    pairs = list(zip(balance.strengths, first, strict=True))
    slope = np.array([strength.friction[i] for strength, i in pairs])[law] / factor
    free = np.isinf(slope)  # such a joint never slides
    slope = np.where(free, 0.0, slope)
    cohesion = np.array([strength.cohesion[i] for strength, i in pairs])[law] * area / factor
    tension = np.array([strength.tension for strength in balance.strengths])[law] * area / factor
    rest = np.where(free, np.inf, np.maximum(cohesion - slope * tension, 0.0))
    count = len(area)
    cohesive = np.flatnonzero(rest > 0)
    sliding = balance.shear @ diags(slope)
    equations = hstack(
        [
            balance.normal + sliding,
            balance.normal - sliding,
            balance.shear[:, cohesive],
            balance.bolts,
        ]
    ).tocsr()
    right_side = -balance.load / scale + balance.normal @ tension
    bounds = np.zeros((equations.shape[1], 2))
    bounds[: 2 * count, 1] = np.inf
    first_bolt = 2 * count + len(cohesive)
    bounds[2 * count : first_bolt] = np.stack([-rest[cohesive], rest[cohesive]], axis=1)
    bounds[first_bolt:, 1] = balance.capacity / scale
    rows, limits = _further_lines(balance, first, factor, area, slope, tension, cohesive)
    for method in ("highs-ipm", "highs-ds"):
        solution = linprog(
            np.zeros(equations.shape[1]), A_ub=rows, b_ub=limits, A_eq=equations, b_eq=right_side,
            bounds=bounds, method=method,
        )  # fmt: skip
        if solution.status in (0, INFEASIBLE):
            return solution.status == 0
    raise RuntimeError(f"limit analysis at a factor of {factor:.4g}: {solution.message}")


def _further_lines(balance, first, factor, area, slope, tension, cohesive):
    """Rows and bounds of |S| <= (c + mu N)/F for all lines but the first of each contact."""
    count = len(area)
    place = np.full(count, -1)
    place[cohesive] = 2 * count + np.arange(len(cohesive))
    rows = []
    limits = []
    for number, strength in enumerate(balance.strengths):
        contacts = np.flatnonzero(balance.law == number)
        for line in range(len(strength.friction)):
            if line == first[number] or not len(contacts):
                continue
            k = np.arange(len(contacts))
            mu = strength.friction[line] / factor
            bound = strength.cohesion[line] * area[contacts] / factor - mu * tension[contacts]
            has_rest = place[contacts] >= 0
            for sign in (1.0, -1.0):
                entries = [
                    (k, contacts, sign * slope[contacts] - mu),
                    (k, count + contacts, -sign * slope[contacts] - mu),
                    (k[has_rest], place[contacts[has_rest]], np.full(has_rest.sum(), sign)),
                ]
                row, column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
                shape = (len(contacts), 2 * count + len(cohesive) + len(balance.capacity))
                rows.append(csr_array((value, (row, column)), shape=shape))
                limits.append(bound)
    if not rows:
        return None, None
    return vstack(rows).tocsr(), np.concatenate(limits)


def format_bound(bound: float | None) -> str:
    """Format an upper bound of the factor of safety for the terminal.

    At a bound of 1 or less the scene itself has no equilibrium.
    """
    if bound is None:
        return "limit analysis gives no bound"
    if bound > 1.0:
        return f"at most {bound:.3g} by limit analysis"
    if bound == 0.0:
        bound_text = f"also with {LARGEST_FACTOR:g} times the strength"
    else:
        bound_text = f"at most {bound:.3g} by limit analysis"
    return f"no equilibrium exists: proved ({bound_text})"


def limit_factor(scene: Scene, excluded: np.ndarray | None = None) -> float | None:
    """Upper bound of the factor of safety of a scene, to 0.1 %.

    With its strength divided by this factor no contact forces balance the blocks: failure is
    proved. `excluded` (blocks,) need no balance. None where forces are found even at 1/64 of the
    strength, 0.0 where none are found with 64 times the strength.
    """
    balance = force_balance(scene, excluded)
    low = SMALLEST_FACTOR
    high = LARGEST_FACTOR
    factor = 1.0
    step = 2.0
    if can_balance(balance, factor):
        low = factor
        while factor < LARGEST_FACTOR:
            factor = min(factor * step, LARGEST_FACTOR)
            if not can_balance(balance, factor):
                high = factor
                break
            low = factor
        else:
            return None
    else:
        high = factor
        while factor > SMALLEST_FACTOR:
            factor = max(factor / step, SMALLEST_FACTOR)
            if can_balance(balance, factor):
                low = factor
                break
            high = factor
        else:
            return 0.0
    while high > (1.0 + TOLERANCE) * low:
        factor = float(np.sqrt(low * high))
        if can_balance(balance, factor):
            low = factor
        else:
            high = factor
    return high
