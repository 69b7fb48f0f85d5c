"""Simulated direct shear tests of a law, all tests of a fit in one batch of joints."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..joints.normal_control import NormalCondition, closing_increments
from ..laws.joint_law import JointLaw
from ..support.checks import Array

TOLERANCE = 1e-9  # of the normal stress
# displacements of the loading to an initial shear stress over the displacement of the test
INITIAL_LOADING = np.geomspace(1e-3, 10.0, 60)


class ShearPath(NamedTuple):
    """Prescribed path of a shear test.

    shear: displacement in m, (rows,).
    normal: normal stress in Pa, (rows,).
    points: rows of the measured points, (n,).
    initial_stress: shear stress in Pa that the joint is sheared to before the path, under the first
        normal stress.
    """

    shear: Array
    normal: Array
    points: NDArray[np.intp]
    initial_stress: float = 0.0


class SimulatedTest(NamedTuple):
    """A shear test simulated with a law.

    shear: displacement in m, (rows,).
    stress: shear stress in Pa, (rows,).
    opening: in m, (rows,), from the start of shear.
    points: rows of the measured points, (n,).
    """

    shear: Array
    stress: Array
    opening: Array
    points: NDArray[np.intp]

    @property
    def dilation(self) -> float:
        """Tangent of the largest dilation angle: largest opening over slip of a step."""
        slip = np.abs(np.diff(self.shear))
        return float(np.max(np.diff(self.opening)[slip > 0] / slip[slip > 0]))


def simulate_shear(law: JointLaw, paths: Sequence[ShearPath]) -> list[SimulatedTest]:
    """Simulate shear tests, one joint each.

    A path with an initial stress is preceded by shear up to this stress; if the law cannot carry
    it, up to its peak. Displacement and opening count from there.

    Parameters
    ----------
    law: a law with a plane.
    paths: path of each test.

    Raises ValueError, with the remedy, if the law cannot follow a path.
    """
    loaded = [k for k, path in enumerate(paths) if path.initial_stress]
    tests = dict[int, SimulatedTest]()
    if loaded:
        loadings = [_initial_loading(paths[k]) for k in loaded]
        for k, loading in zip(loaded, _simulate(law, loadings), strict=True):
            tests[k] = loading
    extended = [_preceded(path, tests[k]) if k in tests else path for k, path in enumerate(paths)]
    simulated = _simulate(law, extended)
    return [_without_start(test, path) for test, path in zip(simulated, paths, strict=True)]


def _initial_loading(path: ShearPath) -> ShearPath:
    """Monotonic shear under the first normal stress, to find the initial displacement."""
    whole = float(np.sum(np.abs(np.diff(path.shear))))
    shear = np.sign(path.initial_stress) * whole * np.append(0.0, INITIAL_LOADING)
    return ShearPath(shear, np.full(shear.size, path.normal[0]), np.arange(shear.size))


def _preceded(path: ShearPath, loading: SimulatedTest) -> ShearPath:
    """The path after the part of `loading` up to its initial stress."""
    stress = np.abs(loading.stress)
    target = abs(path.initial_stress)
    peak = int(np.argmax(stress))
    row = int(np.argmax(stress >= target)) if stress[peak] >= target else peak
    start = float(loading.shear[row])
    if stress[row] > target:
        start = float(
            np.interp(target, stress[row - 1 : row + 1], loading.shear[row - 1 : row + 1])
        )
    before = loading.shear[:row]
    shear = np.concatenate([before, start + path.shear])
    normal = np.concatenate([np.full(row, path.normal[0]), path.normal])
    return ShearPath(shear, normal, path.points + row)


def _without_start(test: SimulatedTest, path: ShearPath) -> SimulatedTest:
    """The test from the first row of its path on."""
    start = test.shear.size - path.shear.size
    opening = test.opening[start:] - test.opening[start]
    return SimulatedTest(path.shear, test.stress[start:], opening, path.points)


def _simulate(law: JointLaw, paths: Sequence[ShearPath]) -> list[SimulatedTest]:
    """Simulate paths from the unloaded joint. Raises ValueError as `simulate_shear`."""
    rows = max(path.shear.size for path in paths)
    shear = np.stack([_padded(path.shear, rows) for path in paths], -1)
    normal = np.stack([_padded(path.normal, rows) for path in paths], -1)
    joints = law.joints(len(paths), track_dissipation=False)
    scale = normal.max(axis=0)
    increments = np.diff(shear, axis=0, prepend=0.0)
    step = np.zeros((len(paths), 2))
    stress = np.empty(shear.shape)
    closure = np.empty(shear.shape)
    for row, increment in enumerate(increments):
        # first guess of the closure increment: the dilation of the previous step
        with np.errstate(divide="ignore", invalid="ignore"):
            guess = np.nan_to_num(step[:, 0] * increment / step[:, 1], posinf=0.0, neginf=0.0)
        step[:, 0] = guess
        step[:, 1] = increment
        condition = NormalCondition(normal[row], scale)
        try:
            step[:, 0] = closing_increments(joints, step, condition, TOLERANCE)
            F, _ = joints.update(step, tangent=False)
        except ArithmeticError as error:
            raise ValueError(
                f"no joint with mu = {law.asperity.mu:.3g} and a = {law.orientation.a:.3g} can "
                f"follow this shear test ({error}); fix one of them, or check the units of the test"
            ) from error
        stress[row] = F[:, 1]
        closure[row] = joints.delta[:, 0]
    return [_unpadded(path, stress[:, k], closure[:, k]) for k, path in enumerate(paths)]


def _padded(values: Array, rows: int) -> Array:
    """Values extended to this number of rows by the last one."""
    return np.pad(values, (0, rows - values.size), mode="edge")


def _unpadded(path: ShearPath, stress: Array, closure: Array) -> SimulatedTest:
    """The test of one path from the padded columns of its joint."""
    rows = path.shear.size
    return SimulatedTest(path.shear, stress[:rows], closure[0] - closure[:rows], path.points)
