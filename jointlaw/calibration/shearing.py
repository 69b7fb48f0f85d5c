"""Shear tests by a law: all joints together, along their own displacements and normal stresses."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..joints.normal_control import NormalCondition, closing_increments
from ..laws.joint_law import JointLaw
from ..support.checks import Array

TOLERANCE = 1e-9  # of the normal stress
Path = tuple[Array, Array, NDArray[np.intp]]


class Sheared(NamedTuple):
    """A shear test by a law: displacement (m), shear stress (Pa), opening (m), (rows,) each; and
    the rows of the measured points (n,).
    """

    way: Array
    stress: Array
    opening: Array
    points: NDArray[np.intp]

    @property
    def dilation(self) -> float:
        """Largest opening over shear of a step: the tangent of the dilation angle."""
        moves = np.abs(np.diff(self.way))
        return float(np.max(np.diff(self.opening)[moves > 0] / moves[moves > 0]))


def shear_all(law: JointLaw, paths: Sequence[Path]) -> list[Sheared]:
    """Tests by a law of one plane, each along its `ShearCurve.path`, one joint each.

    Raises ValueError where a law cannot follow, with the remedy.
    """
    longest = max(way.size for way, _, _ in paths)
    padded = ((np.pad(x, (0, longest - x.size), mode="edge") for x in path[:2]) for path in paths)
    way, normal = (np.stack(columns, -1) for columns in zip(*padded, strict=True))
    joints, scale = law.joints(len(paths), ledger=False), normal.max(axis=0)
    moves, step = np.diff(way, axis=0, prepend=0.0), np.zeros((len(paths), 2))
    stress, closure = np.empty(way.shape), np.empty(way.shape)
    for k, move in enumerate(moves):
        with np.errstate(divide="ignore", invalid="ignore"):  # the last dilation goes on
            guess = np.nan_to_num(step[:, 0] * move / step[:, 1], posinf=0.0, neginf=0.0)
        step[:, 0], step[:, 1] = guess, move
        try:
            step[:, 0] = closing_increments(
                joints, step, NormalCondition(normal[k], scale), TOLERANCE
            )
            F, _ = joints.update(step, tangent=False)
        except ArithmeticError as error:
            raise ValueError(
                f"no joint of mu = {law.asperity.mu:.3g} and a = {law.orientation.a:.3g} follows "
                f"this shear test ({error}); hold one of them, or check the units of the test"
            ) from error
        stress[k], closure[k] = F[:, 1], joints.delta[:, 0]
    return [
        Sheared(way[:n, k], stress[:n, k], closure[0, k] - closure[:n, k], points)
        for k, (n, points) in enumerate((path[0].size, path[2]) for path in paths)
    ]
