"""Simulated laboratory tests on one joint: closure tests and direct shear tests.

The normal stress is controlled: in every step the closure increment is solved for at which the
normal traction has its prescribed value (`joints.normal_control`).
"""

import math
from collections.abc import Sequence

import numpy as np

from ..joints.joint import Joint
from ..joints.normal_control import NormalCondition, closing_increments
from ..joints.state import NonFiniteError
from ..joints.validity import warn_if_closed
from ..support.checks import Array, at_least, integer, more_than, number, numbers
from ..support.progress import track
from .record import UNITS, TestRecord


class PathError(RuntimeError):
    """A test stopped before its end, for the reason in the message.

    `record` is the `TestRecord` of all completed steps.
    """

    def __init__(self, message: str, record: TestRecord) -> None:
        super().__init__(message, record)  # both, so that it can be pickled
        self.record = record

    def __str__(self) -> str:
        return str(self.args[0])


def closure_test(joint: Joint, stress: float | Sequence[float], steps: int = 100) -> TestRecord:
    """Load a joint from its present normal stress to a larger one, and unload it to zero.

    Parameters
    ----------
    joint: the joint; after the test it is in the final state of the test.
    stress: largest normal stress in Pa, > 0; a sequence gives one for each load cycle.
    steps: steps per loading or unloading branch. They are shorter at small stress, where the joint
        is softer.

    Returns a `TestRecord`, whose first row is the initial state of the joint. Raises ValueError for
    an invalid argument, and PathError with the record so far if a stress cannot be reached.

    >>> record = jl.closure_test(law.joint(), 5e6)
    >>> max_closure = record.closure.max()
    """
    peaks = [more_than("stress", peak, 0.0) for peak in _as_series("stress", stress, "Pa")]
    steps = integer("steps", steps, 1)
    asperities = joint.law.tables.asperities
    # when all asperities are in contact, stress is proportional to closure^(1 + eta)
    power = 1.0 if asperities is None else 1.0 + asperities.curve.eta
    grading = (np.arange(1, steps + 1) / steps) ** power
    levels: list[float] = []
    start = max(float(joint.F[0]), 0.0)
    for peak in peaks:
        levels += [*(start + (peak - start) * grading), *(peak * grading[-2::-1]), 0.0]
        start = 0.0
    test = _Test(joint, 0.0, "closure test")
    test.append_row(joint.F)
    no_shear = np.zeros(joint.law.dim - 1)
    for level in track(levels, "closure test", len(levels)):
        test.apply_step(no_shear, NormalCondition(level, max(peaks)))
    return test.record()


def direct_shear(
    joint: Joint,
    to: float | Sequence[float],
    normal: float = 10e6,
    stiffness: float = 0.0,
    azimuth: float = 0.0,
    steps: int = 200,
) -> TestRecord:
    """Load a joint to a normal stress, then shear it to one or more reversal points.

    Parameters
    ----------
    joint: the joint; after the test it is in the final state of the test.
    to: reversal points of the shear displacement in m, along the azimuth and relative to the
        initial displacement of the joint: one number, or a sequence for shear reversals. There is
        no displacement across the azimuth.
    normal: normal stress in Pa at the start of shear, > 0.
    stiffness: normal stiffness of the surroundings in Pa/m. The normal stress increases by the
        stiffness times the dilation: zero keeps the normal stress constant (CNL), a positive value
        is constant normal stiffness (CNS), and infinity keeps the closure constant.
    azimuth: direction of shear in rad, from axis 2 towards axis 3. A law with a plane shears along
        this plane.
    steps: steps between two reversal points.

    Returns a `TestRecord`, whose first row is the joint under the normal stress before shear.
    Raises ValueError for an invalid argument, and PathError with the record so far if the normal
    condition cannot be met.

    >>> record = jl.direct_shear(law.joint(), to=[1e-6, -1e-6], normal=5e6)
    >>> angle = record.peak_friction_angle
    """
    normal = more_than("normal", normal, 0.0)
    stiffness = at_least("stiffness", stiffness, 0.0, infinite=True)
    steps = integer("steps", steps, 1)
    reversals = [number("to", point) for point in _as_series("to", to, "m")]
    azimuth = number("azimuth", azimuth)
    if joint.law.dim == 1:
        raise ValueError("joint: its law has closure_only; direct shear needs a law without")
    plane = joint.law.plane
    if plane is not None and azimuth not in (0.0, plane):
        raise ValueError(
            f"azimuth = {azimuth:g} rad: this law moves in its plane at {plane:g} rad only; "
            "use a law with plane=None"
        )
    if plane is None:
        direction = np.array([math.cos(azimuth), math.sin(azimuth)])
        test = _Test(joint, azimuth, "direct shear")
    else:
        direction = np.ones(1)
        test = _Test(joint, plane, "direct shear")
    test.apply_step(np.zeros_like(direction), NormalCondition(normal, normal))
    closure_before_shear = float(joint.delta[0])
    condition = NormalCondition(normal, normal, stiffness, closure_before_shear)
    increments = np.repeat(np.diff(reversals, prepend=0.0) / steps, steps)
    for increment in track(increments, "direct shear", len(increments)):
        test.apply_step(increment * direction, None if math.isinf(stiffness) else condition)
    return test.record()


def _as_series(name: str, value: float | Sequence[float], unit: str) -> Array:
    """One number or a sequence of numbers as an array of one dimension."""
    series = np.atleast_1d(numbers(name, value, unit))
    if series.ndim != 1 or series.size == 0:
        raise ValueError(f"{name} = {value!r} must be one number ({unit}) or a sequence of them")
    return series


class _Test:
    """A test in progress: applies steps to the joint and collects the rows of the record."""

    def __init__(self, joint: Joint, azimuth: float, name: str) -> None:
        self.joint = joint
        self.azimuth = azimuth
        self.name = name
        self.rows: list[Array] = []
        self.last_step = np.zeros(joint.law.dim)
        # unit vectors of the degrees of freedom of the joint in 3-D, (dim, 3)
        if joint.law.dim == 3:
            self.axes = np.eye(3)
        else:
            shear_axis = [0.0, math.cos(azimuth), math.sin(azimuth)]
            self.axes = np.array([[1.0, 0.0, 0.0], shear_axis])[: joint.law.dim]

    def apply_step(self, shear: Array, condition: NormalCondition | None) -> None:
        """Apply a shear increment (dim - 1,) in m, and the closure increment of the condition.

        Without a condition the closure stays constant. Appends a row. Raises PathError.
        """
        step = np.concatenate([[0.0], shear])
        try:
            if condition is not None:
                if shear.any() and np.array_equal(shear, self.last_step[1:]):
                    step[0] = self.last_step[0]  # first guess: the dilation of the last step
                (step[0],) = closing_increments(self.joint._batch, step[None], condition)
            F, _ = self.joint.update(step, tangent=False)
        except (NonFiniteError, ArithmeticError) as error:
            raise PathError(
                f"{self.name} stopped after {len(self.rows)} rows: {error}", self.record()
            ) from error
        self.last_step = step
        self.append_row(F)

    def append_row(self, F: Array) -> None:
        """Append a row: displacement, the traction F (dim,) and measures of the joint."""
        joint = self.joint
        measures = joint.measures()
        scalars = (
            measures.sliding,
            measures.separated,
            measures.stored_energy,
            joint.dissipated_energy,
        )
        self.rows.append(np.hstack([joint.delta @ self.axes, F @ self.axes, *scalars]))

    def record(self) -> TestRecord:
        """The record of all rows so far; warns where the law closed beyond its closure range."""
        table = np.array(self.rows).reshape(-1, len(UNITS))
        warn_if_closed(self.joint.law, table[:, 0])
        return TestRecord(dict(zip(UNITS, table.T, strict=True)), self.azimuth, self.name)
