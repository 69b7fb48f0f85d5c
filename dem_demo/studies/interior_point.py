"""Interior-point method for the linear programs of limit analysis.

The program asks for contact forces x that balance the loads r as well as they can:

    minimise sum(u + w)  with  A x + u - w = r,  C x <= h,  u >= 0,  w >= 0.

Each contact has two unknown forces, and each row of C (a line of its strength) reads the forces of
one contact only. The forces of a contact can therefore be eliminated by themselves, and the
equations of a step have the structure of a stiffness matrix: motions of blocks that touch. A
general solver does not see that, and moves on to a vertex of the feasible set, which takes it
longer than all iterations where many mechanisms are near the limit.

The method is Mehrotra's predictor-corrector method (Mehrotra 1992, SIAM J. Optim. 2, 575) from an
infeasible start. The multipliers y of the equations are the velocities of the blocks in a
mechanism, with |y| <= 1, and r.y - h.l with the multipliers l of the lines is a lower bound of the
minimum: the power that the loads have in excess of the dissipation.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array, diags, hstack

from ..dynamics.search import factorise

MAX_ITERATIONS = 100
FIRST_SLACK = 100.0  # of the largest load: slacks of lines and unbalanced forces at the start
FIRST_MULTIPLIER = 0.3  # of lines at the start
BALANCE_TOLERANCE = 1e-5  # of the largest load: violation of the balance of a motion, and of lines
VELOCITY_TOLERANCE = 1e-6  # of the largest velocity: violation of the equations of a mechanism
STEP_SHARE = 0.99, 0.9995  # of the step to the nearest bound, at first and near the end
LATE_COMPLEMENTARITY = 1e-4  # mean product of slack and multiplier below which the end is near
ROUNDING = 1e-16  # of velocities


class Lines(NamedTuple):
    """Rows of C x <= h: `first` x[contact] + `second` x[n + contact] <= limit, for n contacts."""

    contact: np.ndarray
    first: np.ndarray
    second: np.ndarray
    limit: np.ndarray


class LeastImbalance(NamedTuple):
    """Solution of a program: forces x (2 n,), multipliers of its lines, the sum of unbalanced
    forces of x, a lower bound of the least sum, and the number of iterations."""

    force: np.ndarray
    multiplier: np.ndarray
    imbalance: float
    lower_bound: float
    iterations: int


class _Point(NamedTuple):
    """A point of the method, or a step: forces, slacks of lines, unbalanced forces u and w;
    multipliers of equations and of lines."""

    x: np.ndarray
    slack: np.ndarray
    u: np.ndarray
    w: np.ndarray
    y: np.ndarray
    multiplier: np.ndarray

    def primal_bounds(self) -> tuple[np.ndarray, ...]:
        """What must not be negative, of forces."""
        return self.slack, self.u, self.w

    def moved(self, step: "_Point", primal: float, dual: float) -> "_Point":
        """This point after shares of a step."""
        shares = (primal, primal, primal, primal, dual, dual)
        parts = zip(self, step, shares, strict=True)
        return _Point(*(value + share * change for value, change, share in parts))


def minimise_imbalance(
    first: csr_array, second: csr_array, load: np.ndarray, lines: Lines, zero: float, gap: float
) -> LeastImbalance | None:
    """Minimise the sum of unbalanced forces.

    first, second (m, n): forces on m motions by unit forces of n contacts, so A = [first, second].
    load (m,): the right side r, whose largest entry is of the order of one. The search ends where
    the sum is below `zero`, or where its lower bound is above, and differs from it by less than a
    share `gap`. Returns None without convergence.
    """
    return _Method(first, second, load, lines).minimise(zero, gap)


class _Contacts(NamedTuple):
    """Matrices C' W C of n contacts in triangular form.

    With the forces p + mixed q and q of each contact instead of p and q, its matrix is diagonal:
    first and second (n,). `rest` is what lines read of the second force then. All are sums of
    squares, without a difference of large numbers.
    """

    mixed: np.ndarray
    first: np.ndarray
    second: np.ndarray
    rest: np.ndarray

    def solve(self, v: np.ndarray, lines: Lines) -> tuple[np.ndarray, np.ndarray]:
        """x = (C' W C)^-1 v (2 n,), and C x."""
        first, second = np.split(v, 2)
        q = (second - self.mixed * first) / self.second
        p = first / self.first
        line_values = lines.first * p[lines.contact] + self.rest * q[lines.contact]
        return np.concatenate([p - self.mixed * q, q]), line_values


class _Method:
    """The arrays of a program, see `minimise_imbalance`."""

    def __init__(self, first: csr_array, second: csr_array, load: np.ndarray, lines: Lines) -> None:
        self.m, self.n = first.shape
        self.first = first
        self.second = second
        self.A = hstack([first, second]).tocsr()
        self.transpose = self.A.T.tocsr()
        self.load = load
        self.lines = lines

    def minimise(self, zero: float, gap: float) -> LeastImbalance | None:
        """Iterate from the standard start; see `minimise_imbalance`."""
        lines = self.lines
        ones = np.ones(self.m)
        point = _Point(
            np.zeros(2 * self.n),
            np.maximum(lines.limit, FIRST_SLACK),
            FIRST_SLACK * ones,
            FIRST_SLACK * ones,
            0.0 * ones,
            np.full(len(lines.limit), FIRST_MULTIPLIER),
        )
        for iteration in range(MAX_ITERATIONS):
            residuals = self._residuals(point)
            imbalance = float(point.u.sum() + point.w.sum())
            lower_bound = float(self.load @ point.y - lines.limit @ point.multiplier)
            violation = [np.abs(part).max(initial=0.0) for part in residuals]
            is_feasible = max(violation[:2]) <= BALANCE_TOLERANCE
            if is_feasible and violation[2] <= VELOCITY_TOLERANCE:
                is_close = lower_bound > zero and imbalance - lower_bound <= gap * lower_bound
                if imbalance <= zero or is_close:
                    return LeastImbalance(
                        point.x, point.multiplier, imbalance, lower_bound, iteration
                    )
            next_point = self._iterate(point, residuals)
            if next_point is None:
                return None
            point = next_point
        return None

    def _line_values(self, x: np.ndarray) -> np.ndarray:
        """C x."""
        contact, first, second, _ = self.lines
        return first * x[contact] + second * x[self.n + contact]

    def _line_sums(self, values: np.ndarray) -> np.ndarray:
        """C' times values of the lines."""
        contact, first, second, _ = self.lines
        return np.concatenate(
            [
                np.bincount(contact, first * values, self.n),
                np.bincount(contact, second * values, self.n),
            ]
        )

    def _residuals(self, point: _Point) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What balance, lines and multipliers lack at a point."""
        return (
            self.load - self.A @ point.x - point.u + point.w,
            self.lines.limit - self._line_values(point.x) - point.slack,
            self.transpose @ point.y - self._line_sums(point.multiplier),
        )

    def _iterate(self, point: _Point, residuals: tuple) -> _Point | None:
        """The point after a predictor and a corrector; None if the matrix is singular."""
        lines = self.lines
        _, slack, u, w, y, multiplier = point
        above = np.maximum(1.0 - y, ROUNDING)
        below = np.maximum(1.0 + y, ROUNDING)
        weight = multiplier / slack
        contacts = self._eliminate_contacts(weight)
        diagonal = u / above + w / below
        factors = factorise(self._matrix(contacts, diagonal))
        if factors is None:
            return None
        balance, line_gap, dual = residuals

        def direction(of_lines: np.ndarray, of_u: np.ndarray, of_w: np.ndarray) -> _Point:
            """Newton's step that changes the products of complementary values by these amounts."""
            g = dual - self._line_sums((of_lines - multiplier * line_gap) / slack)
            response, _ = contacts.solve(g, lines)
            unbalanced = balance - self.A @ response - of_u / above + of_w / below
            dy = factors.solve(unbalanced)
            response, _ = contacts.solve(self.transpose @ dy, lines)
            dy += factors.solve(unbalanced - self.A @ response - diagonal * dy)  # refinement
            dx, line_change = contacts.solve(g + self.transpose @ dy, lines)
            slack_step = line_gap - line_change
            return _Point(
                dx,
                slack_step,
                (of_u + u * dy) / above,
                (of_w - w * dy) / below,
                dy,
                (of_lines - multiplier * slack_step) / slack,
            )

        def shares(step: _Point) -> tuple[float, float]:
            """Largest shares of a step of forces and of multipliers that keep the bounds."""
            primal = zip(point.primal_bounds(), step.primal_bounds(), strict=True)
            dual_bounds = ((multiplier, step.multiplier), (above, -step.y), (below, step.y))
            return (
                min(_share(value, change) for value, change in primal),
                min(_share(value, change) for value, change in dual_bounds),
            )

        def complementarity(point: _Point) -> float:
            """Mean product of complementary values."""
            products = (
                point.multiplier @ point.slack
                + point.u @ (1.0 - point.y)
                + point.w @ (1.0 + point.y)
            )
            return float(products) / (len(lines.limit) + 2 * self.m)

        now = complementarity(point)
        predictor = direction(-multiplier * slack, -u * above, -w * below)
        centre = now * (complementarity(point.moved(predictor, *shares(predictor))) / now) ** 3
        corrector = direction(
            centre - multiplier * slack - predictor.multiplier * predictor.slack,
            centre - u * above + predictor.u * predictor.y,
            centre - w * below - predictor.w * predictor.y,
        )
        step_share = STEP_SHARE[now < LATE_COMPLEMENTARITY]
        primal_step, dual_step = (step_share * size for size in shares(corrector))
        return point.moved(corrector, primal_step, dual_step)

    def _eliminate_contacts(self, weight: np.ndarray) -> "_Contacts":
        """The matrices C' diag(weight) C of the contacts, in triangular form."""
        contact, first, second, _ = self.lines
        a = np.bincount(contact, first * first * weight, self.n)
        mixed = np.bincount(contact, first * second * weight, self.n) / a
        rest = second - mixed[contact] * first
        return _Contacts(mixed, a, np.bincount(contact, rest * rest * weight, self.n), rest)

    def _matrix(self, contacts: "_Contacts", diagonal: np.ndarray) -> csc_array:
        """A (C' W C)^-1 A' + diagonal."""
        second = self.second - self.first @ diags(contacts.mixed)
        half = hstack(
            [
                self.first @ diags(1.0 / np.sqrt(contacts.first)),
                second @ diags(1.0 / np.sqrt(contacts.second)),
            ]
        ).tocsr()
        return (half @ half.T + diags(diagonal)).tocsc()


def _share(value: np.ndarray, change: np.ndarray) -> float:
    """Largest share of a change, at most 1, that leaves values positive."""
    falls = change < 0.0
    return min(1.0, float((value[falls] / -change[falls]).min(initial=np.inf)))
