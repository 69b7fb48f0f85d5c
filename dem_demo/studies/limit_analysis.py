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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, diags, hstack

import jointlaw as jl
from jointlaw.joints.normal_control import NormalCondition, closing_increments

from ..contact import ContactManager, Contacts
from ..dynamics.blocks import Blocks, apply_loads
from ..dynamics.timestep import closure_and_shear_rates
from ..output.monitors import slip_distance
from ..scene import Scene
from .interior_point import Lines, minimise_imbalance

SMALLEST_FACTOR = 1 / 64
LARGEST_FACTOR = 64.0
TOLERANCE = 1e-3  # of the factor
STRESSES = 7  # at which the strength of a rough law gets a tangent
CHECKED_STRESSES = 61  # at which lines of a strength that is not concave must lie above it
SHEAR_STEPS = 120  # of a test up to the peak of a bond, and to the end of the test
STRESS_RANGE = 1e-3, 3.0  # of the largest overburden stress: where they lie
SLOPE_STEP = 1.05  # ratio of the two stresses that give a tangent
BALANCED = 1e-6  # unbalanced forces over the largest load that are rounding of the solver
OPTIMALITY_GAP = 1e-3  # of the least unbalanced forces: how far the lower bound lies below them
UNLIMITED_SHEAR = 1e6  # largest loads: shear strength of joints that never slide
MIN_SHEAR_STRENGTH = 1e-9  # largest loads: of joints without friction and cohesion
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
        if slip != step[0, 1]:  # else the last dilation is the first guess
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


def least_imbalance(balance: ForceBalance, factor: float) -> Imbalance:
    """Least unbalanced forces of all blocks with the strength divided by factor.

    They are zero (`BALANCED`) if there are contact forces that balance all blocks; else they are a
    lower bound, at most a share `OPTIMALITY_GAP` too low. The derivative follows from the
    multipliers of the linear program, which do not change to first order. Raises RuntimeError where
    the solver finds no solution.
    """
    scale = np.abs(balance.load).max(initial=0.0)
    if not scale:
        return Imbalance(0.0, 0.0)
    lines = _lines(balance, factor, scale)
    slope = _base_slope(balance, factor)
    no_shear = csr_array(balance.bolts.shape)
    normal = hstack([balance.normal, balance.bolts]).tocsr()
    shear = hstack([balance.shear, no_shear]).tocsr()
    # N = p + q and S = slope (p - q); N = p and S = q without a slope
    has_slope = slope > 0.0
    first = normal + shear @ diags(slope)
    second = normal @ diags(has_slope * 1.0) + shear @ diags(np.where(has_slope, -slope, 1.0))
    rows = Lines(
        lines.contact,
        lines.normal + lines.shear * slope[lines.contact],
        np.where(
            has_slope[lines.contact],
            lines.normal - lines.shear * slope[lines.contact],
            lines.shear,
        ),
        lines.limit,
    )
    load = -balance.load / scale
    solution = minimise_imbalance(first, second, load, rows, BALANCED, OPTIMALITY_GAP)
    if solution is None:
        raise RuntimeError(f"limit analysis at a factor of {factor:.4g}: no solution found")
    if solution.imbalance <= BALANCED:
        return Imbalance(0.0, 0.0)
    n = len(slope)
    p = solution.force[:n]
    q = solution.force[n:]
    normal_force = np.where(has_slope, p + q, p)[lines.contact]
    strength = lines.strength_at_zero + lines.strength_by_normal * normal_force
    return Imbalance(solution.lower_bound, -float(solution.multiplier @ strength))


class StrengthLines(NamedTuple):
    """Lines `normal` N + `shear` S <= limit of the strength divided by a factor, of contacts and,
    after them, of bolts; N and S relative to the largest load.

    The limit less `normal` N contains the strength `strength_at_zero` + `strength_by_normal` N
    times the inverse of the factor.
    """

    contact: np.ndarray
    normal: np.ndarray
    shear: np.ndarray
    limit: np.ndarray
    strength_at_zero: np.ndarray
    strength_by_normal: np.ndarray


def _lines(balance: ForceBalance, factor: float, scale: float) -> StrengthLines:
    """The lines of all contacts: |S| <= (c + mu N)/F and -N <= T/F. The tension of a bolt is
    between zero and its capacity, which is not divided."""
    parts: list[StrengthLines] = []

    def add(
        contact: np.ndarray, normal: float, shear: float, limit: Any, at_zero: Any, by_normal: float
    ) -> None:
        one = np.ones(len(contact))
        values = (normal, shear, limit, at_zero, by_normal)
        parts.append(StrengthLines(contact, *(one * value for value in values)))

    for number, strength in enumerate(balance.strengths):
        contact = np.flatnonzero(balance.law == number)
        area = balance.area[contact] / scale
        for cohesion, friction in zip(strength.cohesion, strength.friction, strict=True):
            for sign in (1.0, -1.0):
                if np.isinf(friction):  # such a joint never slides
                    add(contact, 0.0, sign, UNLIMITED_SHEAR, 0.0, 0.0)
                    continue
                at_zero = cohesion * area
                limit = at_zero / factor
                if friction == 0.0:
                    limit = np.maximum(limit, MIN_SHEAR_STRENGTH)
                add(contact, -friction / factor, sign, limit, at_zero, friction)
        is_sloped = (strength.friction > 0.0) & np.isfinite(strength.friction)
        bounds_tension = is_sloped & (strength.cohesion <= strength.friction * strength.tension)
        if not bounds_tension.any():
            at_zero = strength.tension * area
            add(contact, -1.0, 0.0, at_zero / factor, at_zero, 0.0)
    bolt = len(balance.area) + np.arange(len(balance.capacity))
    capacity = balance.capacity / scale
    is_limited = np.isfinite(capacity)
    add(bolt, -1.0, 0.0, 0.0, 0.0, 0.0)
    add(bolt[is_limited], 1.0, 0.0, capacity[is_limited], 0.0, 0.0)
    for sign in (1.0, -1.0):
        add(bolt, 0.0, sign, 1.0, 0.0, 0.0)  # a bolt has no shear force: any bound will do
    return StrengthLines(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _base_slope(balance: ForceBalance, factor: float) -> np.ndarray:
    """Slope of the steepest line of each contact with the strength divided by factor, zero of
    bolts and of joints that never slide.

    Forces along both lines of this slope leave no difference of large numbers to the solver.
    """
    steepest = np.array([strength.friction.max() for strength in balance.strengths])
    steepest[np.isinf(steepest)] = 0.0
    return np.append(steepest[balance.law] / factor, np.zeros(len(balance.capacity)))


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
