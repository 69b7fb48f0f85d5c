"""Static equilibrium of blocks in space on virgin joints.

The contacts are found once, at the places as drawn. Displacements of an equilibrium are of the
order of the closures, so contacts keep their places and normals. The search is the one of the plane
(`dynamics/search.py`): it reads rows, with six motions of a block and three components of a
displacement of the law.
"""

from collections.abc import Iterable
from functools import cached_property
from typing import NamedTuple

import numpy as np

import jointlaw as jl

from ..contact import tabulate_first_loading
from ..contact.joints import stick_response
from ..dynamics.equilibrium import MIN_FORCE_SCALE, STANDARD_GRAVITY, start_under_stress
from ..dynamics.relaxation import Verdict
from ..dynamics.search import EquilibriumSearch, StaticSystem
from .contacts import Surfaces, contact_axes, contact_rows, find_contacts, require_apart
from .face_laws import FaceLaws
from .in_situ import in_situ_traction
from .loads import applied_loads
from .scene import SpaceScene


class LawCurve(NamedTuple):
    """A law and its first-loading curve, by columns (`contact.tabulate_first_loading`)."""

    law: jl.Law
    curve: dict[str, np.ndarray]


class VirginJoints:
    """Joints of k contact points without history, as the search for an equilibrium reads them.

    law (k,): number of the law of each point. reduction (3,): 1 for the normal stress, and the
    factor by which shear stresses are divided (see `contact.Joints`). tensile_stiffness (laws,) in
    Pa/m: of intact bonds.
    """

    def __init__(self, laws: Iterable[jl.Law], law: np.ndarray, reduction: float) -> None:
        self.n = len(law)
        self.law = law
        self.reduction = np.array([1.0, reduction, reduction])
        self.by_law = []
        for one in laws:
            curve = {**tabulate_first_loading(one)}
            curve["stiffness"] = one.first_loading_stiffness(curve["closure"], reduction)
            self.by_law.append(LawCurve(one, curve))
        self.rows_by_law = [np.flatnonzero(law == i) for i in range(len(self.by_law))]
        self.tensile_stiffness = np.array([one.law.tensile_stiffness for one in self.by_law])
        self._batches = [
            one.law.joints(len(rows), track_dissipation=False)
            for one, rows in zip(self.by_law, self.rows_by_law, strict=True)
        ]

    def trial(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray, None]:
        """Tractions (k, 3) in Pa and tangents (k, 3, 3) in Pa/m at displacements d (k, 3) in m."""
        F = np.zeros((self.n, 3))
        C = np.zeros((self.n, 3, 3))
        for batch, rows in zip(self._batches, self.rows_by_law, strict=True):
            if len(rows):
                F[rows], C[rows] = batch.trial(d[rows] / self.reduction)
        return F / self.reduction, C / np.outer(self.reduction, self.reduction), None

    def stick_predictor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions (k, 3) and tangents (k, 3, 3) of joints that stick, at d (k, 3) in m."""

        def stress_and_stiffness(closure: np.ndarray) -> np.ndarray:
            columns = ("stress", "stiffness")
            return np.array([self.interpolate(name, "closure", closure) for name in columns])

        return stick_response(d, stress_and_stiffness, self.tensile_stiffness[self.law])

    def interpolate(self, column: str, by: str, x: np.ndarray) -> np.ndarray:
        """A column of the first-loading curves, such as "stress", where column `by` is x (k,)."""
        out = np.empty(self.n)
        for one, rows in zip(self.by_law, self.rows_by_law, strict=True):
            out[rows] = np.interp(x[rows], one.curve[by], one.curve[column])
        return out


class Equilibrium(NamedTuple):
    """Result of a search.

    verdict; unstable (n,): blocks without static equilibrium. displacement (n, 3) in m, rotation
    (n, 3): rotation vectors in rad. closure and shears d (k, 3) in m and tractions (k, 3) in Pa of
    the contact points: normal stress, and shear stresses along axes 2 and 3; effective stresses
    where there is water. unbalanced_ratio: the largest unbalanced force of the other blocks over
    their weight, which counts as on Earth without gravity, and as at least a millionth of the
    largest load.
    """

    verdict: Verdict
    unstable: np.ndarray
    displacement: np.ndarray
    rotation: np.ndarray
    d: np.ndarray
    traction: np.ndarray
    unbalanced_ratio: float


class Statics:
    """The blocks of a scene as drawn, their contacts and the law of each contact point.

    surfaces, points, axes, rows: geometry of the contacts (`contacts.py`); law (k,): numbers of the
    laws. mass (n,) in kg; gravity (n, 6) in N: with the pseudo-static seismic forces; loads (n, 6):
    all other forces and moments (`applied_loads`). is_free_motion (n, 6): motions that forces move;
    is_free (n,): blocks with such motions; is_removed (n,): blocks that are absent. start (k, 3) in
    m: closure and shears with which the joints start; the closure is the drawn one, or with in-situ
    stress the one at which they bear it.

    Raises ValueError for blocks that overlap as drawn.
    """

    def __init__(self, scene: SpaceScene) -> None:
        self.scene = scene
        blocks = scene.blocks
        self.is_removed = scene.is_removed
        self.is_free_motion = np.array([block.free_motions for block in blocks])
        self.is_free_motion[self.is_removed] = False
        self.is_free = self.is_free_motion.any(axis=1)
        self.surfaces = Surfaces([block.solid for block in blocks], self.is_free)
        require_apart(self.surfaces, [block.name for block in blocks], scene.skins, self.is_removed)
        pairs = self.surfaces.near_pairs(scene.skins)
        pairs = pairs[~self.is_removed[pairs].any(axis=1)]
        self.points = find_contacts(
            self.surfaces, scene.skins, scene.max_overlap, pairs, scene.strip_width
        )
        self.law, axis_2 = FaceLaws(scene, self.surfaces).law_and_axis(self.points)
        self.axes = contact_axes(self.surfaces, self.points, axis_2)
        self.rows = contact_rows(self.surfaces, self.points, self.axes)
        density = np.array([block.density for block in blocks])
        self.mass = density * self.surfaces.volume
        self.inertia = density[:, None] * self.surfaces.moments
        self.gravity = np.zeros((len(blocks), 6))
        self.gravity[:, :3] = self.mass[:, None] * scene.acceleration
        self.loads = applied_loads(scene, self.surfaces, self.rows, self.law)

        self.start = np.zeros((len(self.rows.area), 3))
        self.start[:, 0] = self.rows.closure
        if scene.in_situ is not None:
            joints = VirginJoints(scene.laws.values(), self.law, scene.reduction)
            stress = in_situ_traction(scene, self.points, self.axes)
            skin = float(scene.skins.min())
            offset, shears = start_under_stress(joints, stress, self.rows.closure, skin)
            self.start[:, 0] -= offset
            self.start[:, 1:] = shears

    @property
    def untouched(self) -> np.ndarray:
        """Free blocks (n,) that touch no other block."""
        touched = np.zeros(len(self.is_free), bool)
        touched[self.rows.block_a] = True
        touched[self.rows.block_b] = True
        return self.is_free & ~touched

    @cached_property
    def scale(self) -> np.ndarray:
        """Motion (n, 6) of a block per unit of a scaled motion; zero for fixed motions."""
        inertia = np.concatenate([np.repeat(self.mass[:, None], 3, axis=1), self.inertia], axis=1)
        return self.is_free_motion / np.sqrt(inertia)

    def search(
        self, scene: SpaceScene | None = None, excluded: np.ndarray | None = None
    ) -> EquilibriumSearch:
        """The search for an equilibrium with the laws and the reduction of a scene.

        scene: with other laws than the own scene, such as weakened ones. excluded (n,): blocks that
        have moved away, so their contacts bear nothing.
        """
        scene = scene or self.scene
        rows = self.rows
        joints = VirginJoints(scene.laws.values(), self.law, scene.reduction)
        of_blocks = np.concatenate([self.scale[rows.block_a], self.scale[rows.block_b]], axis=1)
        area = rows.area
        if excluded is not None:
            area = np.where(excluded[rows.block_a] | excluded[rows.block_b], 0.0, area)
        return EquilibriumSearch(
            StaticSystem(
                self.mass,
                self.surfaces.radius,
                self.is_free_motion,
                self.scale,
                (self.gravity + self.loads) * self.is_free_motion,
                rows.block_a,
                rows.block_b,
                rows.kinematics * of_blocks[:, None],
                area,
                self.start,
                joints,
            )
        )

    def solve(self, scene: SpaceScene | None = None) -> Equilibrium:
        """Find the equilibrium with the laws and the reduction of a scene, and the blocks that have
        none."""
        search = self.search(scene)
        none = np.zeros(len(self.mass), bool)
        guess = search.stick_predictor() if self.scene.in_situ is None else search.zero
        solution = search.solve(guess, none)
        verdict = solution.verdict
        if verdict is Verdict.EQUILIBRIUM and solution.unstable.any():
            verdict = Verdict.NO_EQUILIBRIUM
        y = solution.displacement
        motion = search.expand(y) * self.scale
        d = (search.start + search.kinematics @ y).reshape(3, -1).T
        unbalanced = search.unbalanced_force(y)
        size = self._size(unbalanced)
        is_stable = self.is_free & ~solution.unstable
        weight = self.mass * (np.linalg.norm(self.scene.acceleration) or STANDARD_GRAVITY)
        weight = np.maximum(weight, MIN_FORCE_SCALE * self._size(self.gravity + self.loads).max())
        return Equilibrium(
            verdict,
            solution.unstable,
            motion[:, :3],
            np.einsum("nij,nj->ni", self.surfaces.rotation, motion[:, 3:]),
            d,
            search.joints.trial(d)[0],
            float((size / weight)[is_stable].max(initial=0.0)),
        )

    def _size(self, force: np.ndarray) -> np.ndarray:
        """Sizes (n,) in N of forces and moments (n, 6); moments over the radius of the block."""
        moment = np.linalg.norm(force[:, 3:], axis=1) / self.surfaces.radius
        return np.hypot(np.linalg.norm(force[:, :3], axis=1), moment)

    def displacements(
        self,
        scene: SpaceScene,
        guess: np.ndarray | None = None,
        excluded: np.ndarray | None = None,
    ) -> np.ndarray | None:
        """Displacements (m,) of the free motions in equilibrium, None where none is found.

        guess: displacements of a similar scene from which the search starts, by default the stick
        predictor; excluded (n,): blocks that need no equilibrium.
        """
        search = self.search(scene, excluded)
        known = np.zeros(len(self.mass), bool) if excluded is None else excluded
        start = search.stick_predictor() if guess is None else guess
        solution = search.solve(start, known, name_unstable=False)
        return solution.displacement if solution.verdict is Verdict.EQUILIBRIUM else None
