"""Laboratory tests on one joint: closure and direct shear under normal control."""

import math
from collections.abc import Sequence

import numpy as np

from ..joints.crushed import warn_if_crushed
from ..joints.joint import Joint
from ..joints.normal_control import NormalCondition, closing_increments
from ..joints.state import NonFiniteError
from ..support.checks import Array, at_least, integer, more_than, number, numbers
from ..support.progress import track
from .record import UNITS, Record


class PathError(RuntimeError):
    """A test could not go on, as `message` says; `record` holds all rows measured so far."""

    def __init__(self, message: str, record: Record) -> None:
        super().__init__(message, record)  # both, so that it can be pickled
        self.record = record

    def __str__(self) -> str:
        return str(self.args[0])


def closure_test(joint: Joint, stress: float | Sequence[float], steps: int = 100) -> Record:
    """Close a joint to a normal stress, from the one it carries, and open it again.

    Parameters
    ----------
    joint: the joint; it is left in the state at the end of the test.
    stress: largest normal stress in Pa, > 0, or one for each cycle.
    steps: steps per branch; rows crowd towards small stress as the stiffness does.

    Returns the Record, its first row the joint as it was given. Raises ValueError for a bad
    argument and PathError, with the record so far, when a stress cannot be reached.

    >>> record = jl.closure_test(law.joint(), 5e6)
    >>> closed = record.closure.max()
    """
    peaks = [more_than("stress", s, 0.0) for s in _series("stress", stress, "Pa")]
    steps = integer("steps", steps, 1)
    asperities = joint.law.tables.asperities
    # stress grows with this power of closure where all asperities touch
    power = 1.0 if asperities is None else 1.0 + asperities.curve.eta
    grading = (np.arange(1, steps + 1) / steps) ** power
    levels: list[float] = []
    start = max(float(joint.F[0]), 0.0)
    for peak in peaks:
        levels += [*(start + (peak - start) * grading), *(peak * grading[-2::-1]), 0.0]
        start = 0.0
    log = _Log(joint, 0.0, "closure test")
    log.measure(joint.F)
    for level in track(levels, "closure test", len(levels)):
        log.advance(np.zeros(joint.law.dim - 1), NormalCondition(level, max(peaks)))
    return log.record()


def direct_shear(
    joint: Joint,
    to: float | Sequence[float],
    normal: float = 10e6,
    stiffness: float = 0.0,
    azimuth: float = 0.0,
    steps: int = 200,
) -> Record:
    """Seat a joint at a normal stress and shear it to one or more turning points.

    Parameters
    ----------
    joint: the joint; it is left in the state at the end of the test.
    to: turning points of the shear displacement in m, along the azimuth from where the joint
        stands: one number, or several for reversals. No motion across the azimuth.
    normal: normal stress in Pa at which the joint is seated, > 0.
    stiffness: normal stiffness of the surroundings in Pa/m: the normal stress grows by it times
        the dilation. Zero keeps the normal stress, infinity keeps the closure.
    azimuth: direction of shear in rad, from axis 2 towards axis 3; a law with a plane shears
        along that plane.
    steps: steps per leg.

    Returns the Record, its first row the seated joint. Raises ValueError for a bad argument and
    PathError, with the record so far, when the normal condition cannot be met.

    >>> record = jl.direct_shear(law.joint(), to=[1e-6, -1e-6], normal=5e6)
    >>> angle = record.peak_friction_angle
    """
    normal = more_than("normal", normal, 0.0)
    stiffness = at_least("stiffness", stiffness, 0.0, infinite=True)
    steps = integer("steps", steps, 1)
    points = [number("to", p) for p in _series("to", to, "m")]
    azimuth = number("azimuth", azimuth)
    if joint.law.dim == 1:
        raise ValueError("joint: its law has closure_only; direct shear needs a law without")
    plane = joint.law.plane
    if plane is not None and azimuth not in (0.0, plane):
        raise ValueError(
            f"azimuth = {azimuth:g} rad: this law moves in its plane at {plane:g} rad only; "
            "use a law with plane=None"
        )
    log = _Log(joint, azimuth if plane is None else plane, "direct shear")
    along = np.array([math.cos(azimuth), math.sin(azimuth)]) if plane is None else np.ones(1)
    log.advance(np.zeros_like(along), NormalCondition(normal, normal))  # seated without shear
    condition = NormalCondition(normal, normal, stiffness, float(joint.delta[0]))
    legs = np.repeat(np.diff(points, prepend=0.0) / steps, steps)
    for length in track(legs, "direct shear", len(legs)):
        log.advance(length * along, None if math.isinf(stiffness) else condition)
    return log.record()


def _series(name: str, value: float | Sequence[float], unit: str) -> Array:
    """One number or several as a one-dimensional array."""
    series = np.atleast_1d(numbers(name, value, unit))
    if series.ndim != 1 or series.size == 0:
        raise ValueError(f"{name} = {value!r} must be one number ({unit}) or a sequence of them")
    return series


class _Log:
    """Rows of a test in progress, and the steps that add them."""

    def __init__(self, joint: Joint, azimuth: float, name: str) -> None:
        self.joint, self.azimuth, self.name = joint, azimuth, name
        self.rows: list[Array] = []
        dim, shear = joint.law.dim, [0.0, math.cos(azimuth), math.sin(azimuth)]
        # the axes of the joint in space (dim, 3)
        self.axes = np.eye(3) if dim == 3 else np.array([[1.0, 0.0, 0.0], shear])[:dim]

    def advance(self, shear: Array, condition: NormalCondition | None) -> None:
        """One step with the in-plane increment `shear` that meets the normal condition."""
        try:
            step = np.concatenate([[0.0], shear])
            if condition is not None:
                (step[0],) = closing_increments(self.joint._batch, step[None], condition)
            F, _ = self.joint.update(step, tangent=False)
        except (NonFiniteError, ArithmeticError) as error:
            raise PathError(
                f"{self.name} stopped after {len(self.rows)} rows: {error}", self.record()
            ) from error
        self.measure(F)

    def measure(self, F: Array) -> None:
        """Add a row from the joint's state and its traction F."""
        joint, now = self.joint, self.joint.measures()
        numbers = (now.sliding, now.separated, now.stored, joint.dissipated_energy)
        self.rows.append(np.hstack([joint.delta @ self.axes, F @ self.axes, *numbers]))

    def record(self) -> Record:
        """The rows so far."""
        table = np.array(self.rows).reshape(-1, len(UNITS))
        warn_if_crushed(self.joint.law, table[:, 0])
        return Record(dict(zip(UNITS, table.T, strict=True)), self.azimuth, self.name)
