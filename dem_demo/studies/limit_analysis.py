"""Limit analysis: an upper bound of the factor of safety by linear programming.

A scene can only be in equilibrium with its strength divided by F if there are contact forces that
balance every block and respect the strength of every joint, whatever the stiffnesses. Whether there
are any is a linear program, which minimises the unbalanced forces. If they are not zero,
equilibrium is impossible: failure is proved. The least unbalanced forces are nearly a straight line
over the strength, and the multipliers of the program give its slope, so that Newton's method finds
the limit in a few programs.

If there are balanced contact forces, nothing is proved, because joints cannot choose their forces:
they follow from the displacements, and joints that dilate less than their friction angle may fail
before (non-associated flow). For friction alone the gap is 4 to 17 % on slopes of rock; an
equilibrium that was found is the proof on that side.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import OptimizeResult, linprog
from scipy.sparse import csr_array, diags, eye, hstack, vstack

import jointlaw as jl
from jointlaw.joints.normal_control import NormalCondition, closing_increments

from ..contact import ContactManager, Contacts
from ..dynamics.blocks import Blocks, apply_loads
from ..dynamics.timestep import closure_and_shear_rates
from ..output.monitors import slip_distance
from ..scene import Scene

SMALLEST_FACTOR = 1 / 64
LARGEST_FACTOR = 64.0
TOLERANCE = 1e-3  # of the factor
STRESSES = 7  # at which the strength of a rough law gets a tangent
CHECKED_STRESSES = 61  # at which lines of a strength that is not concave must lie above it
SHEAR_STEPS = 120  # of a test up to the peak of a bond, and to the end of the test
STRESS_RANGE = 1e-3, 3.0  # of the largest overburden stress: where they lie
SLOPE_STEP = 1.05  # ratio of the two stresses that give a tangent
BALANCED = 1e-6  # unbalanced forces over the largest load that are rounding of the solver
STRENGTH_CHANGE = 1e-3  # relative: change of strength whose effect on a program is computed
FIRST_RATIO = 2.0  # of factors that are tried until the blocks cannot balance
MAX_NEWTON_TRIALS = 12  # then the search bisects


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

    Of a rough law: tangents of its peak strength in direct shear, which lie above a concave
    function of the normal stress. The strength of slopes that degrade by stress is not concave
    everywhere; a line that it exceeds is raised, so that the bound stays a bound.
    """
    if type(law) is jl.CoulombLaw:  # a subclass may have more elements
        return Strength(np.array([law.cohesion]), np.array([law.friction]), law.tension)
    low, high = (fraction * stress for fraction in STRESS_RANGE)
    stresses = np.geomspace(low, high, STRESSES)
    peaks, strength_nearby = peak_strength(law, [stresses, SLOPE_STEP * stresses])
    friction = (strength_nearby - peaks) / ((SLOPE_STEP - 1.0) * stresses)
    cohesion = peaks - friction * stresses
    if (np.diff(friction) > 0.0).any():  # not concave
        stresses = np.geomspace(low, high, CHECKED_STRESSES)
        peaks = peak_strength(law, stresses)
        excess = peaks - (cohesion[:, None] + friction[:, None] * stresses)  # (lines, stresses)
        cohesion += np.maximum(excess.max(axis=1), 0.0)
    return Strength(cohesion, friction, law.tensile_strength)


def peak_strength(law: jl.Law, stress: ArrayLike) -> np.ndarray:
    """Largest shear stress (Pa) of direct shear at each normal stress (Pa), in its shape.

    The joints of all tests are one batch. Raises ArithmeticError where the law cannot bear one.
    """
    stresses = np.atleast_1d(np.asarray(stress, dtype=float))
    condition = NormalCondition(stresses.ravel(), stresses.ravel())
    joints = law.joints(stresses.size, track_dissipation=False)
    step = np.zeros((stresses.size, law.dim))
    peak = np.zeros(stresses.size)
    for slip in np.concatenate([[0.0], _slip_increments(law)]):
        step[:, 0] = 0.0
        step[:, 1] = slip
        step[:, 0] = closing_increments(joints, step, condition)
        F, _ = joints.update(step, tangent=False)
        peak = np.maximum(peak, np.abs(F[:, 1]))
    return peak.reshape(np.shape(stress))


def _slip_increments(law: jl.Law) -> np.ndarray:
    """Slip increments (m) of a shear test past the peak of a law."""
    slip = slip_distance(law)
    to = [1.2 * slip]
    bond = getattr(law, "bond", None)
    if bond is not None:  # a brittle bond peaks early
        to = sorted([min(1.01 / bond.limits[1][1], slip), 1.2 * slip])
    return np.repeat(np.diff(to, prepend=0.0) / SHEAR_STEPS, SHEAR_STEPS)


class Imbalance(NamedTuple):
    """Least sum of unbalanced forces at a factor of safety, relative to the largest load; its
    derivative by the inverse of the factor, which multiplies the strength."""

    force: float
    derivative: float


class Program(NamedTuple):
    """A linear program: minimise the sum of unbalanced forces.

    equations (m, n), right_side (m,): balance of the m free motions. rows, limits: inequalities of
    further lines of strengths, None without any. bounds (n, 2): of the unknowns. cost (n,).
    """

    equations: csr_array
    right_side: np.ndarray
    rows: csr_array | None
    limits: np.ndarray | None
    bounds: np.ndarray
    cost: np.ndarray


def least_imbalance(balance: ForceBalance, factor: float) -> Imbalance:
    """Least unbalanced forces of all blocks with the strength divided by factor.

    They are zero (`BALANCED`) if there are contact forces that balance all blocks. The derivative
    follows from the multipliers of the linear program, which do not change to first order. Raises
    RuntimeError where the solver finds no solution.
    """
    if not np.abs(balance.load).max(initial=0.0):
        return Imbalance(0.0, 0.0)
    program = _program(balance, factor)
    for method in ("highs-ipm", "highs-ds"):
        solution = linprog(
            program.cost, A_ub=program.rows, b_ub=program.limits, A_eq=program.equations,
            b_eq=program.right_side, bounds=program.bounds, method=method,
        )  # fmt: skip
        if solution.status == 0:
            break
    else:
        raise RuntimeError(f"limit analysis at a factor of {factor:.4g}: {solution.message}")
    stronger = _program(balance, factor / (1.0 + STRENGTH_CHANGE))
    change = _change_of_minimum(program, stronger, solution)
    return Imbalance(solution.fun, change * factor / STRENGTH_CHANGE)


def _change_of_minimum(program: Program, changed: Program, solution: OptimizeResult) -> float:
    """Change of the minimum of a linear program, to first order in the change of the program."""
    x = solution.x
    residual = (changed.right_side - program.right_side) - (
        changed.equations - program.equations
    ) @ x
    change = solution.eqlin.marginals @ residual
    if program.rows is not None:
        slack = (changed.limits - program.limits) - (changed.rows - program.rows) @ x
        change += solution.ineqlin.marginals @ slack
    for column, side in enumerate((solution.lower, solution.upper)):
        is_finite = np.isfinite(program.bounds[:, column])
        moved = changed.bounds[is_finite, column] - program.bounds[is_finite, column]
        change += side.marginals[is_finite] @ moved
    return float(change)


def _program(balance: ForceBalance, factor: float) -> Program:
    """The linear program for the strength divided by factor.

    Unknowns of each contact: the normal force above -tension, N + T = p + q with p, q >= 0, and the
    shear force (mu/F) (p - q) + s with |s| bounded by the rest of the cohesion. They respect the
    steepest line of its strength by themselves; further lines are inequalities. The tension of a
    bolt is between zero and its capacity, which is not divided. Unknowns of each motion: unbalanced
    force in either direction. Forces are relative to the largest load.
    """
    scale = np.abs(balance.load).max()
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
    motions = len(balance.load)
    cohesive = np.flatnonzero(rest > 0)
    sliding = balance.shear @ diags(slope)
    unbalanced = eye(motions, format="csr")
    equations = hstack(
        [
            balance.normal + sliding,
            balance.normal - sliding,
            balance.shear[:, cohesive],
            balance.bolts,
            unbalanced,
            -unbalanced,
        ]
    ).tocsr()
    right_side = -balance.load / scale + balance.normal @ tension
    unknowns = equations.shape[1]
    bounds = np.zeros((unknowns, 2))
    bounds[:, 1] = np.inf
    first_bolt = 2 * count + len(cohesive)
    first_unbalanced = unknowns - 2 * motions
    bounds[2 * count : first_bolt] = np.stack([-rest[cohesive], rest[cohesive]], axis=1)
    bounds[first_bolt:first_unbalanced, 1] = balance.capacity / scale
    cost = np.zeros(unknowns)
    cost[first_unbalanced:] = 1.0
    rows, limits = _further_lines(balance, first, factor, area, slope, tension, cohesive, unknowns)
    return Program(equations, right_side, rows, limits, bounds, cost)


def _further_lines(balance, first, factor, area, slope, tension, cohesive, unknowns):
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
                shape = (len(contacts), unknowns)
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
    low = 0.0  # largest factor so far with which the blocks can balance
    high = np.inf  # smallest factor so far with which they cannot
    estimate = np.nan
    factor = 1.0
    for trial in itertools.count(1):
        imbalance = least_imbalance(balance, factor)
        if imbalance.force > BALANCED:
            high = factor
            estimate = _newton_estimate(high, imbalance) if trial <= MAX_NEWTON_TRIALS else np.nan
        else:
            low = factor
        if low == LARGEST_FACTOR:
            return None
        if high == SMALLEST_FACTOR:
            return 0.0
        if high <= (1.0 + TOLERANCE) * low:
            return high
        factor = _next_factor(low, high, estimate)
    raise AssertionError("unreachable: the search ends by itself")


def _newton_estimate(factor: float, imbalance: Imbalance) -> float:
    """Factor of safety at which the imbalance is zero, by its tangent over the strength at a
    factor; nan where it does not fall with the strength."""
    if not imbalance.derivative < 0.0:
        return np.nan
    return 1.0 / (1.0 / factor - imbalance.force / imbalance.derivative)


def _next_factor(low: float, high: float, estimate: float) -> float:
    """Factor that a search tries next.

    The blocks can balance with the factor `low` (0.0: none known) and cannot with `high` (infinite:
    none known). The estimate comes from `high`; it is met exactly where one mechanism decides, so
    that a trial just below it and one just above it end the search.
    """
    if high == np.inf:
        return min(FIRST_RATIO * low, LARGEST_FACTOR)
    below = estimate / (1.0 + 0.5 * TOLERANCE)
    above = estimate * (1.0 + 0.25 * TOLERANCE)
    if low < below < high:
        return max(below, SMALLEST_FACTOR)
    if low < above < high:
        return above
    if low == 0.0:
        return SMALLEST_FACTOR
    return float(np.sqrt(low * high))
