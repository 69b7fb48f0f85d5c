"""The only file that talks to pymunk: it finds colliding pairs and integrates rigid bodies.

Shapes are sensors with a skin, so pymunk reports which blocks come near each other and never
pushes them. Forces go in from the `pre_solve` of a constraint that does nothing, which runs once
per step after the positions have moved and before the velocities do: symplectic Euler.
"""

from collections.abc import Callable, Sequence

import numpy as np
import pymunk
from pymunk import batch

from ..scene import Block

MOTION = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)
FORCES = batch.BodyFields.FORCE | batch.BodyFields.TORQUE


class World:
    """pymunk's view of the blocks; block numbers are those of the list given.

    inertia (n, 3): mass, mass and moment of every block.
    """

    def __init__(self, blocks: Sequence[Block], inertia: np.ndarray, skin: float) -> None:
        self.space = pymunk.Space()
        self.near: set[tuple[int, int]] = set()  # pairs of blocks within two skins
        self.bodies: list[pymunk.Body] = []
        self._number: dict[pymunk.Shape, int] = {}
        for i, block in enumerate(blocks):
            if block.fixed:
                body = pymunk.Body(body_type=pymunk.Body.STATIC)
            else:
                body = pymunk.Body(inertia[i, 0], inertia[i, 2])
            body.position = tuple(block.centroid)
            shape = pymunk.Poly(body, block.local.tolist(), radius=skin)
            shape.sensor = True
            shape.collision_type = 1
            self.space.add(body, shape)
            self.bodies.append(body)
            self._number[shape] = i
        self.space.on_collision(1, 1, begin=self._begin, separate=self._separate)
        mover = next(body for body in self.bodies if body.body_type == pymunk.Body.DYNAMIC)
        self._hook = pymunk.SimpleMotor(mover, self.space.static_body, 0.0)
        self._hook.max_force = 0.0
        self.space.add(self._hook)
        self._read, self._write = batch.Buffer(), batch.Buffer()
        batch.get_space_bodies(self.space, batch.BodyFields.BODY_ID, self._read)
        order = np.frombuffer(self._read.int_buf(), dtype=np.uintp).tolist()
        self._from_batch = np.array([order.index(body.id) for body in self.bodies])
        self._forces = np.zeros((len(order), 3))
        self._write.set_float_buf(self._forces)
        self._find_first_pairs()

    def step(self, dt: float, forces: Callable[[np.ndarray], np.ndarray]) -> None:
        """One step; `forces` maps the motion (6, n) to forces and torques (n, 3).

        pymunk swallows exceptions of its callbacks, so they are carried out of it by hand.
        """
        trouble: list[BaseException] = []

        def before_velocities(_constraint, _space) -> None:
            try:
                self._forces[self._from_batch] = forces(self.motion())
                batch.set_space_bodies(self.space, FORCES, self._write)
            except BaseException as error:
                trouble.append(error)

        self._hook.pre_solve = before_velocities
        self.space.step(dt)
        if trouble:
            raise trouble[0]

    def motion(self) -> np.ndarray:
        """Positions, angles, velocities, spins of all blocks as (6, n)."""
        self._read.clear()
        batch.get_space_bodies(self.space, MOTION, self._read)
        rows = np.frombuffer(self._read.float_buf()).reshape(-1, 6)
        return np.ascontiguousarray(rows[self._from_batch].T)

    def place(self, motion: np.ndarray) -> None:
        """Put the blocks where `motion` (6, n) says, bit for bit."""
        for body, (x, y, angle, *_) in zip(self.bodies, motion.T.tolist(), strict=True):
            body.position, body.angle = (x, y), angle
            if body.body_type == pymunk.Body.DYNAMIC:
                body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        self.space.reindex_static()
        self._find_first_pairs()
        for body, (u, v, spin) in zip(self.bodies, motion[3:].T.tolist(), strict=True):
            if body.body_type == pymunk.Body.DYNAMIC:
                body.velocity, body.angular_velocity = (u, v), spin

    def _find_first_pairs(self) -> None:
        """Let pymunk look for pairs while nothing moves."""
        self._hook.pre_solve = lambda _constraint, _space: None
        self.space.step(1e-9)

    def _pair(self, arbiter: pymunk.Arbiter) -> tuple[int, int] | None:
        numbers = [self._number.get(shape) for shape in arbiter.shapes]
        if len(numbers) < 2 or None in numbers:
            return None
        return min(numbers), max(numbers)

    def _begin(self, arbiter, _space, _data) -> None:
        if pair := self._pair(arbiter):
            self.near.add(pair)

    def _separate(self, arbiter, _space, _data) -> None:
        if pair := self._pair(arbiter):
            self.near.discard(pair)
