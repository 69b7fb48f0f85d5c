"""Static equilibrium by dynamic relaxation.

The blocks move through a fictitious time with masses that make every iteration stable, and with a
damping near the critical one of the slowest motion, until they are at rest. Joints have no history:
in every iteration the law takes the total displacement in one step from its virgin state. A path of
iterations would leave joints sheared by displacements several times the static ones, and a slope
then falls at 0.97 of its strength.

Near the limit of the strength, iterations are slow: friction makes the stiffness unsymmetric, and
blocks oscillate with growing amplitude (flutter) unless the damping is far above the critical one
of the slowest motion. Implicit steps of an overdamped motion continue therefore, as in
pseudo-transient continuation (Kelley and Keyes 1998), with time steps that grow while the linear
model of a step predicts the unbalanced force. They are stable for every time step, and pass into
Newton's method. After each step a few overdamped iterations smooth what contacts that opened,
closed or slid have disturbed.

Where Newton's method stops at a maximum of the unbalanced force, relaxation goes on, because it
follows the forces. Where there is no equilibrium, the unbalanced force no longer falls while
displacements grow at a steady rate: both together are the verdict "no equilibrium". A stall of the
unbalanced force alone is none: blocks that rearrange stall for thousands of iterations. A search
without a decision within the limits of steps and iterations is reported as such.
"""

import ctypes
from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

import jointlaw as jl
from jointlaw.native.library import load as load_law_library

from ..compiled import RelaxationArrays, RelaxedLaw, address
from .bolts import StaticBolts

MASS_FACTOR = 0.28  # masses over row sums of the stiffness: 0.25 is the limit of stability
CLOSURE_GROWTH = 1.6  # closures during the iterations over the first ones: bounds the stiffness
OPEN_JOINT_STIFFNESS = 0.3  # of joints that are open at first, over the median of closed ones
MIN_MASS_RATIO = 0.01  # over the median mass
RAMP_ITERATIONS = 1000  # iterations over which loads come on
CHECK_INTERVAL = 500  # iterations between two checks
MAX_ITERATIONS = 60_000
COMPARED_INTERVALS = 4  # intervals that are compared with as many before
STALL_RATIO = 0.93  # fall of the smallest unbalanced force above which it no longer falls
STEADY_RATIO = 0.8  # growth of displacements over that of before above which it is steady
MIN_GROWTH = 0.01  # of the largest displacement from the places as drawn: growth that counts
DIVERGENCE_RATIO = 10.0  # unbalanced force over the smallest so far at which masses are raised
MASS_INCREASE = 4.0
FIRST_NEWTON_FORCE = 0.03  # unbalanced force (over the loads) at which Newton's method first tries
ROUNDING_FORCE = 1e-12  # unbalanced force (over the loads) that is rounding
NEXT_NEWTON_RATIO = 0.4  # of the unbalanced force of the last trial
MAX_NEWTON_CHANGE = 0.5  # of the largest displacement: how far Newton's method may go
EXPLICIT_ITERATIONS = 3500  # before implicit steps
SMALL_FORCE = 0.03  # unbalanced force (over the loads) from which implicit steps begin at once
FIRST_TIME_STEP = 2.0  # of implicit steps, over the unbalanced force relative to the loads
MAX_STEPS = 500  # implicit ones; slopes of hundreds of blocks near failure need up to 300
MAX_STEPS_OF_DOUBLING = 150  # implicit ones that do not double the pseudo-time
MAX_MODEL_ERROR = 20.0  # of the unbalanced force after a step, over the one before it
TIME_STEP_DECREASE = 4.0  # after a larger error
TIME_STEP_GROWTH = ((1.0, 3.0), (3.0, 1.5), (10.0, 1.0), (np.inf, 0.5))  # up to a model error
SMOOTHING_ITERATIONS = 100
SMOOTHING_DAMPING = 1.0  # critical for a frequency of half the highest: prevents flutter
NEWTON_FORCE = 1e-6  # unbalanced force (over the loads) from which Newton's method ends the search
DOUBLING = 2.0  # of the pseudo-time, after which unbalanced force and growth are compared
MIN_DOUBLING_GROWTH = 0.2  # the same in a doubling of the pseudo-time
STEADY_DOUBLING_RATIO = 1.5  # of the growth over that in the doubling before: 2 at constant speed
DOUBLING_STALL_RATIO = 0.7  # of smallest unbalanced forces; an exponential decay stays below both
UNSTABLE_FRACTION = 0.01  # of the fastest block: slower ones are not unstable
ADVANCE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)  # as in layout.h

INPUT_ARRAYS = (
    "laws", "block_a", "block_b", "kinematics", "area", "start", "reduction", "load", "is_free",
)  # fmt: skip
WORK_ARRAYS = (
    "mass", "first_force", "y", "v", "force", "previous_y", "previous_force",
)  # fmt: skip


class Verdict(Enum):
    """Whether an equilibrium was found."""

    EQUILIBRIUM = "in equilibrium"
    NO_EQUILIBRIUM = "without equilibrium"
    NOT_DECIDED = "not decided"


class Relaxed(NamedTuple):
    """Result of a relaxation: displacements y (motions,), the growth of each motion (motions,) in
    the last intervals, the verdict, iterations, and unbalanced force over the loads."""

    y: np.ndarray
    growth: np.ndarray
    verdict: Verdict
    iterations: int
    residual: float


def is_plain_friction(law: jl.Law) -> bool:
    """Whether a law is Coulomb's, without tension and without softening after the peak."""
    if type(law) is not jl.CoulombLaw:  # a subclass may have more elements
        return False
    keeps_friction = law.residual_friction in (None, law.friction)
    keeps_cohesion = law.residual_cohesion in (None, law.cohesion)
    return law.tension == 0.0 and keeps_friction and keeps_cohesion


class Relaxation:
    """Blocks on virgin joints, ready to relax.

    laws: of the joints; law (k,): number of the law of each contact point. block_a, block_b (k,):
    blocks that meet there. kinematics (k, dim, 2 dof): how closure and shears follow the motions of
    both. area (k,) in m2. start (k, dim) in m: displacements at y = 0. load (n, dof): forces on the
    blocks. is_free (n, dof). Motions may have any units if forces are the ones that do work on
    them. reduction: factor of a strength reduction. stiffness_at: upper bound (k,) in Pa/m of the
    stiffness at closures (k,) in m; stiffness_closed (k,): the same where nothing touches at first.
    bolts: rock bolts between the same blocks.
    """

    def __init__(
        self,
        laws: Sequence[jl.Law],
        law: np.ndarray,
        block_a: np.ndarray,
        block_b: np.ndarray,
        kinematics: np.ndarray,
        area: np.ndarray,
        start: np.ndarray,
        load: np.ndarray,
        is_free: np.ndarray,
        stiffness_at: Callable[[np.ndarray], np.ndarray],
        stiffness_closed: np.ndarray,
        reduction: float = 1.0,
        bolts: StaticBolts | None = None,
    ) -> None:
        dim, both = kinematics.shape[1:]
        shape = (len(load), both // 2)
        bolts = bolts or StaticBolts.none(both)
        self.n_joints = len(area)
        self.bolt_stiffness = bolts.stiffness
        # A bolt is a contact point of area 1 that opens as the bolt gets longer
        shortening = np.zeros((len(bolts.elongation), dim, both))
        shortening[:, 0] = -bolts.kinematics
        length_left = np.zeros((len(bolts.elongation), dim))
        length_left[:, 0] = -bolts.elongation
        self.stiffness_at = stiffness_at
        self.stiffness_closed = stiffness_closed
        self.block_a = np.append(block_a, bolts.block_a).astype(np.int64)
        self.block_b = np.append(block_b, bolts.block_b).astype(np.int64)
        self.kinematics = np.ascontiguousarray(np.concatenate([kinematics, shortening]))
        self.area = np.append(area, np.ones(len(shortening)))
        self.start = np.ascontiguousarray(np.concatenate([start, length_left]))
        self.reduction = np.append(1.0, np.full(dim - 1, reduction))
        self.load = np.ascontiguousarray(load * is_free, float)
        self.is_free = np.array(is_free, float, order="C")
        for name in WORK_ARRAYS:
            setattr(self, name, np.zeros(shape))
        self.settlement = np.zeros(shape)  # see `relax`
        self.error: Exception | None = None  # of a step of the law in Python
        self.callbacks: list[Any] = []  # which C holds
        self.zero = np.zeros(1, np.int64)
        bears = area > 0.0  # overlaps without length exert no force
        self.steps = [
            self._law_step(one, np.flatnonzero((law == i) & bears)) for i, one in enumerate(laws)
        ]
        relaxed_laws = [
            self._law_arrays(one, *step) for one, step in zip(laws, self.steps, strict=True)
        ]
        self.bolt_points = np.arange(self.n_joints, len(self.area))
        if len(self.bolt_points):
            relaxed_laws.append(bolts.relaxed_law(self.bolt_points, dim))
        self.relaxed_laws = relaxed_laws  # which keep their arrays alive
        self.laws = (RelaxedLaw * len(relaxed_laws))(*relaxed_laws)
        self.arrays = RelaxationArrays(
            n_blocks=len(load),
            n_laws=len(relaxed_laws),
            dim=dim,
            dof=shape[1],
            ramp=RAMP_ITERATIONS,
        )
        self.arrays.bind(self, *INPUT_ARRAYS, *WORK_ARRAYS)
        self.scale = float(np.linalg.norm(self.load)) or 1.0

    def _law_step(self, law: jl.Law, contact: np.ndarray) -> tuple[Any, jl.Step, np.ndarray]:
        """A batch of virgin joints for these contact points (m,), and a step that leaves it so."""
        m, dim = len(contact), self.start.shape[1]
        batch = law.joints(m, track_dissipation=False)
        step = jl.Step(np.zeros((m, dim)), np.zeros((m, dim)), None, commit=False)
        if m:
            batch.advance(step)  # prepares the call of the library
        return batch, step, contact

    def _law_arrays(
        self, law: jl.Law, batch: Any, step: jl.Step, contact: np.ndarray
    ) -> RelaxedLaw:
        """Addresses of a step for the compiled relaxation."""
        if not len(contact):
            return RelaxedLaw()
        if is_plain_friction(law):
            return RelaxedLaw(
                contact=contact.ctypes.data,
                n_joints=len(contact),
                is_friction=1,
                normal_stiffness=law.normal_stiffness,
                shear_stiffness=law.shear_stiffness,
                friction=law.friction,
                cohesion=law.cohesion,
            )
        call = step.call[1]
        if call is None:  # the numpy kernel, such as of a user's own law
            advance: Any = self._advance_in_python(batch, step)
            argument = None
            next_joint = address(self.zero)
        else:
            call.commit = call.track_dissipation = False
            call.chunk = len(contact)
            advance = load_law_library().jlaw_run
            argument = ctypes.addressof(call)
            next_joint = argument + type(call).next.offset
        return RelaxedLaw(
            advance=ctypes.cast(advance, ctypes.c_void_p).value,
            batch=argument,
            next_joint=next_joint,
            contact=contact.ctypes.data,
            n_joints=len(contact),
            d=address(step.d),
            F=address(step.F),
        )

    def _advance_in_python(self, batch: jl.JointBatch, step: jl.Step) -> Any:
        """A function that C calls for a step of the law; displacements and tractions are in `step`.

        Where displacements are too large for the law, tractions are not finite, as in the compiled
        law, and the iterations count as diverged.
        """

        def advance(_batch: int, _operation: int) -> int:
            try:
                batch.advance(step)
            except jl.NonFiniteError:
                step.F[:] = np.nan
            except Exception as error:  # C cannot pass it on: `_call` raises it
                self.error = error
                return -1
            return 0

        self.callbacks.append(ADVANCE(advance))
        return self.callbacks[-1]

    def unbalanced(self, y: np.ndarray) -> np.ndarray:
        """Unbalanced forces (n, dof) of the free motions at displacements y (n, dof)."""
        self.y[:] = y
        self._call("compute_unbalanced")
        return self.force * self.is_free

    def _call(self, name: str, *arguments: int) -> bool:
        """Call a compiled function; returns whether the iterations diverged."""
        status = self.arrays.call(name, *arguments)
        if self.error is not None:
            raise self.error
        if status < 0:
            raise MemoryError("no memory for a copy of a block of states")
        return bool(status)

    def masses(self, y: np.ndarray) -> np.ndarray:
        """Masses (n, dof) with which iterations are stable while joints close by no more than 1.6
        times their closure at y (n, dof)."""
        a, b, dof = self.block_a, self.block_b, y.shape[1]
        both = np.concatenate([y[a], y[b]], axis=1)
        closure = self.start[:, 0] + np.einsum("km,km->k", self.kinematics[:, 0], both)
        closure = closure[: self.n_joints]
        is_closed = closure > 0
        if is_closed.any():
            stiffness = self.stiffness_at(CLOSURE_GROWTH * closure)
            typical = np.median(stiffness[is_closed])
            stiffness = np.maximum(stiffness, OPEN_JOINT_STIFFNESS * typical)
        else:
            stiffness = self.stiffness_closed
        stiffness = np.append(stiffness, self.bolt_stiffness)
        size = np.abs(self.kinematics)
        row_sum = size.sum(axis=2)  # (k, dim): over the motions of both blocks
        mass = np.zeros_like(y)
        row_stiffness = (stiffness * self.area)[:, None] * row_sum
        for block, part in ((a, size[:, :, :dof]), (b, size[:, :, dof:])):
            for motion in range(dof):
                of_point = (row_stiffness * part[:, :, motion]).sum(axis=1)
                mass[:, motion] += np.bincount(block, of_point, len(mass))
        is_heavy = (self.is_free > 0) & (mass > 0)
        if is_heavy.any():
            mass = np.maximum(mass, MIN_MASS_RATIO * np.median(mass[is_heavy]))
        return MASS_FACTOR * np.where(mass > 0, mass, 1.0)

    def fix(self, blocks: np.ndarray) -> None:
        """Let blocks (mask or indices) stay where they are."""
        self.is_free[blocks] = 0.0
        self.load *= self.is_free

    def relax(
        self,
        y: np.ndarray,
        finish: Callable[[np.ndarray], np.ndarray | None],
        implicit_step: Callable[[np.ndarray, np.ndarray], np.ndarray | None] | None = None,
        settlement: np.ndarray | None = None,
    ) -> Relaxed:
        """Search for the equilibrium by dynamic relaxation from displacements y (n, dof).

        Iterations of the compiled relaxation bring the loads on, implicit steps continue. Where
        these do not decide, iterations go on until Newton's method converges nearby, the unbalanced
        force is rounding, the blocks move steadily, or MAX_ITERATIONS is reached; masses grow where
        the iteration diverges.

        finish: Newton's method; returns the equilibrium that it finds near displacements, or None.
        implicit_step: solves (K + drag) step = unbalanced force at displacements (n, dof) for a
        drag (n, dof), None without a solution; without this function there are iterations alone.
        settlement (n, dof): displacements from the places as drawn to the places where y is zero,
        zero by default. Growth is relative to the displacements from the places as drawn: near
        equilibrium y is small, and a slow decay would double it.

        Returns the displacements, the growth of those that move, the verdict, the number of
        iterations and the smallest unbalanced force.
        """
        self.settlement = np.zeros_like(y) if settlement is None else settlement
        self.first_force[:] = self.unbalanced(y)
        first_size = float(np.linalg.norm(self.first_force)) / self.scale
        self.arrays.smallest_damping = 0.0
        self.arrays.largest_force = DIVERGENCE_RATIO * self.scale * max(1.0, first_size)
        if first_size < SMALL_FORCE:
            if (solution := finish(y)) is not None:
                none = np.zeros_like(y)
                return Relaxed(solution, none, Verdict.EQUILIBRIUM, 0, first_size)
            self.mass[:] = self.masses(y)
            self.arrays.done = RAMP_ITERATIONS  # all loads act
            if implicit_step and (relaxed := self._continue(y, finish, implicit_step)):
                return relaxed
            implicit_step = None
        self.mass[:] = self.masses(y)
        self.arrays.done = 0
        return self._iterate(y, finish, implicit_step)

    def _iterate(self, y: np.ndarray, finish: Any, implicit_step: Any) -> Relaxed:
        """Iterations and, after EXPLICIT_ITERATIONS, implicit steps: see `relax`."""
        none = np.zeros_like(y)
        self._restart(y)
        best, smallest, newton_at = y.copy(), np.inf, FIRST_NEWTON_FORCE
        sizes: list[float] = []
        places: list[np.ndarray] = []
        while self.arrays.done < MAX_ITERATIONS:
            if self._call("relax", CHECK_INTERVAL):
                self.mass *= MASS_INCREASE
                self._restart(best)
                sizes.clear()
                places.clear()
                continue
            now = self.y.copy()
            self.mass[:] = np.maximum(self.mass, self.masses(now))
            if self.arrays.done <= RAMP_ITERATIONS:
                continue
            size = self.arrays.smallest_force / self.scale
            if size < smallest:
                best, smallest = now, size
            if size < newton_at and (not implicit_step or size < NEWTON_FORCE):
                solution = finish(now)
                if solution is not None and self._is_near(solution, now):
                    return Relaxed(solution, none, Verdict.EQUILIBRIUM, self.arrays.done, size)
                newton_at = NEXT_NEWTON_RATIO * size
            if size < ROUNDING_FORCE:
                return Relaxed(now, none, Verdict.EQUILIBRIUM, self.arrays.done, size)
            if implicit_step and self.arrays.done >= EXPLICIT_ITERATIONS:
                if relaxed := self._continue(now, finish, implicit_step):
                    return relaxed
                implicit_step = None
                self._restart(now)
            sizes.append(size)
            places.append(now)
            growth = _steady_growth(sizes, places, self._largest_displacement(now))
            if growth is not None:
                return Relaxed(now, growth, Verdict.NO_EQUILIBRIUM, self.arrays.done, size)
        growth = places[-1] - places[max(-1 - COMPARED_INTERVALS, -len(places))] if places else none
        return Relaxed(self.y.copy(), growth, Verdict.NOT_DECIDED, self.arrays.done, smallest)

    def _continue(self, y: np.ndarray, finish: Any, implicit_step: Any) -> Relaxed | None:
        """Implicit steps of an overdamped motion from displacements y (n, dof), each followed by
        smoothing iterations; None where they decide nothing. See `relax`."""
        force = self.unbalanced(y)
        size = float(np.linalg.norm(force)) / self.scale
        time_step = FIRST_TIME_STEP / max(size, ROUNDING_FORCE)
        history = _History(y, size)
        newton_at = NEWTON_FORCE
        for _ in range(MAX_STEPS):
            if history.steps > MAX_STEPS_OF_DOUBLING:
                return None
            history.steps += 1
            drag = self.mass / time_step
            step = implicit_step(y, drag)
            error = np.inf
            if step is not None:
                force_after = self.unbalanced(y + step)
                missed = float(np.linalg.norm(force_after - drag * step))
                error = missed / (self.scale * max(size, ROUNDING_FORCE))
            if not error <= MAX_MODEL_ERROR:  # also no number
                time_step /= TIME_STEP_DECREASE
                continue
            y = y + step
            size = float(np.linalg.norm(force_after)) / self.scale
            if size < newton_at:
                if (solution := finish(y)) is not None:
                    none = np.zeros_like(y)
                    return Relaxed(solution, none, Verdict.EQUILIBRIUM, self.arrays.done, size)
                newton_at = NEXT_NEWTON_RATIO * size
            if size > NEWTON_FORCE:
                y, size = self._smooth(y)
            largest = self._largest_displacement(y)
            growth = history.steady_growth(time_step, y, size, largest)
            if growth is not None:
                return Relaxed(y, growth, Verdict.NO_EQUILIBRIUM, self.arrays.done, size)
            time_step *= next(factor for limit, factor in TIME_STEP_GROWTH if error <= limit)
        return None

    def _smooth(self, y: np.ndarray) -> tuple[np.ndarray, float]:
        """Displacements after overdamped iterations from y (n, dof), and the unbalanced force over
        the loads there. Masses grow where the iterations diverge, and y stays as it is."""
        self.arrays.smallest_damping = SMOOTHING_DAMPING
        self._restart(y)
        has_diverged = self._call("relax", SMOOTHING_ITERATIONS)
        self.arrays.smallest_damping = 0.0
        if has_diverged:
            self.mass *= MASS_INCREASE
        smoothed = y if has_diverged else self.y.copy()
        self.mass[:] = np.maximum(self.mass, self.masses(smoothed))
        return smoothed, float(np.linalg.norm(self.unbalanced(smoothed))) / self.scale

    def _largest_displacement(self, y: np.ndarray) -> float:
        """Largest displacement from the places as drawn at displacements y (n, dof)."""
        return float(np.abs(self.settlement + y).max(initial=0.0))

    def _is_near(self, solution: np.ndarray, y: np.ndarray) -> bool:
        """Whether Newton's method ended near the displacements that it started from."""
        limit = MAX_NEWTON_CHANGE * np.abs(y * self.is_free).max(initial=0.0)
        return bool(np.abs((solution - y) * self.is_free).max(initial=0.0) <= limit)

    def _restart(self, y: np.ndarray) -> None:
        """Continue at rest from displacements y (n, dof).

        Velocities become zero. The unbalanced force is computed at y, less the fraction of the
        initial unbalanced force that the ramp of this iteration still withholds.
        """
        self.v[:] = 0.0
        fading = max(0.0, 1.0 - self.arrays.done / RAMP_ITERATIONS)
        self.force[:] = self.unbalanced(y) - fading * self.first_force * self.is_free
        self.previous_force[:] = self.force
        self.previous_y[:] = y
        self.arrays.damping = 0.0


class _History:
    """Pseudo-time, displacements y (n, dof) and smallest unbalanced force of implicit steps, at
    each doubling of the pseudo-time; steps since the last one."""

    def __init__(self, y: np.ndarray, size: float) -> None:
        self.steps = 0
        self.time = 0.0
        self.compared_at = 0.0
        self.y = y
        self.smallest = np.inf
        self.previous_smallest = size
        self.previous_growth = np.inf

    def steady_growth(
        self, time_step: float, y: np.ndarray, size: float, largest: float
    ) -> np.ndarray | None:
        """Growth (n, dof) of the displacements in the last doubling of the pseudo-time, if blocks
        move steadily; None unless the smallest unbalanced force has hardly fallen, and the
        displacements grow by a large share of the largest one and at an almost constant speed."""
        self.time += time_step
        self.smallest = min(self.smallest, size)
        if self.time < DOUBLING * self.compared_at:
            return None
        growth = y - self.y
        fastest = float(np.abs(growth).max())
        stalls = self.smallest > DOUBLING_STALL_RATIO * self.previous_smallest
        grows = fastest > MIN_DOUBLING_GROWTH * largest
        is_steady = fastest > STEADY_DOUBLING_RATIO * self.previous_growth
        self.steps = 0
        self.compared_at = self.time
        self.y = y
        self.previous_smallest = self.smallest
        self.smallest = np.inf
        self.previous_growth = fastest
        return growth if stalls and grows and is_steady else None


def _steady_growth(
    sizes: list[float], places: list[np.ndarray], largest: float
) -> np.ndarray | None:
    """Growth (n, dof) of the displacements over the last intervals, if blocks move steadily.

    sizes, places: unbalanced force and displacements at each check. None unless the smallest
    unbalanced force no longer falls, and the displacements grow by a noticeable share of the
    largest one and at least about as fast as in the intervals before.
    """
    n = COMPARED_INTERVALS
    if len(sizes) <= 2 * n:
        return None
    growth = places[-1] - places[-1 - n]
    previous_growth = places[-1 - n] - places[-1 - 2 * n]
    fastest = np.abs(growth).max()
    stalls = min(sizes[-n:]) > STALL_RATIO * min(sizes[-2 * n : -n])
    grows = fastest > MIN_GROWTH * largest
    is_steady = fastest > STEADY_RATIO * np.abs(previous_growth).max()
    return growth if stalls and grows and is_steady else None
