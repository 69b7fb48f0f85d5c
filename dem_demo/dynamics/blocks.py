"""The blocks in motion. pymunk finds colliding pairs and integrates rigid bodies, all of it here.

Shapes are sensors with a skin, so pymunk reports which blocks come near each other and never
pushes them. Forces go in from the `pre_solve` of a constraint that does nothing, which runs once
per step after the positions have moved and before the velocities do: symplectic Euler.
"""

from collections.abc import Callable

import numpy as np
import pymunk

from ..contact import Contacts
from ..errors import Refused
from ..scene import Drives, Scene


class Blocks:
    """The blocks of a scene; arrays (n, 3) run over blocks and motions x, y, turn.

    motion (6, n): positions, angles, and the velocities that led there. inertia: mass, mass,
    moment; mobile: motions of blocks that move, driven rock too; free: those that forces move;
    gravity, loads: steady forces (N); root: 1/sqrt(inertia) of the free motions, else 0. near:
    pairs of blocks within two skins.
    """

    def __init__(self, scene: Scene) -> None:
        blocks = scene.blocks
        self.names, self.skin = [block.name for block in blocks], scene.run.skin
        mass = np.array([scene.thickness * block.section.mass for block in blocks])
        moment = np.array([scene.thickness * block.section.moment for block in blocks])
        self.inertia = np.stack([mass, mass, moment], axis=1)
        self.mobile = np.array([[block.moves] * 3 for block in blocks])
        self.drives = Drives(scene.drives)
        self.free = self.mobile.copy()
        self.free[self.drives.rows, self.drives.axes] = False
        self.root = np.where(self.free, 1 / np.sqrt(self.inertia), 0.0)
        self.gravity = self.mobile * self.inertia * [*scene.gravity, 0.0]
        self.loads = np.array([[*block.load, 0.0] for block in blocks]) * self.mobile
        self.reach = np.array([block.reach for block in blocks])
        self._lightness = self.free[:, :2].any(axis=1) / mass  # 1/kg, of what can give way
        self.near: set[tuple[int, int]] = set()
        self._build(scene)
        self.motion = self.read()
        velocity = np.array([[*block.velocity, block.spin] for block in blocks])
        self.motion[3:] = (velocity * self.mobile).T

    def _build(self, scene: Scene) -> None:
        """pymunk's bodies, and its callbacks."""
        self.space, self.bodies, self._number = pymunk.Space(), [], {}
        for i, block in enumerate(scene.blocks):
            if not block.moves:
                body = pymunk.Body(body_type=pymunk.Body.STATIC)
            else:
                body = pymunk.Body(self.inertia[i, 0], self.inertia[i, 2])
            body.position = tuple(block.centroid)
            shape = pymunk.Poly(body, block.local.tolist(), radius=self.skin)
            shape.sensor, shape.collision_type = True, 1
            self.space.add(body, shape)
            self.bodies.append(body)
            self._number[shape] = i

        def heard(note: Callable[[tuple[int, int]], None]) -> Callable[..., None]:
            return lambda arbiter, *_: note(tuple(sorted(self._number[s] for s in arbiter.shapes)))

        begin, separate = heard(self.near.add), heard(self.near.discard)
        self.space.on_collision(1, 1, begin=begin, separate=separate)
        mover = next(body for body in self.bodies if body.body_type == pymunk.Body.DYNAMIC)
        self._hook = pymunk.SimpleMotor(mover, self.space.static_body, 0.0)
        self._hook.max_force = 0.0
        self.space.add(self._hook)
        self._find_first_pairs()

    def step(self, dt: float, forces: Callable[[], np.ndarray]) -> None:
        """One step; `forces` gives forces and torques (n, 3) at the `motion` just reached.

        pymunk swallows exceptions of its callbacks, so they are carried out of it by hand.
        """
        trouble: list[BaseException] = []

        def before_velocities(_constraint, _space) -> None:
            try:
                self.motion = self.read()
                for body, (x, y, torque) in zip(self.bodies, forces().tolist(), strict=True):
                    body.force, body.torque = (x, y), torque
            except BaseException as error:
                trouble.append(error)

        self._hook.pre_solve = before_velocities
        self.space.step(dt)
        if trouble:
            raise trouble[0]

    def read(self) -> np.ndarray:
        """Positions, angles, velocities, spins (6, n) as pymunk has them by now."""
        rows = [(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in self.bodies]
        return np.array(rows).T.copy()

    def place(self, motion: np.ndarray, velocity: np.ndarray) -> None:
        """Put the blocks where `motion` (6, n) says, to go on with a velocity (3, n)."""
        self.motion = motion.copy()
        for body, (x, y, angle, *_) in zip(self.bodies, motion.T.tolist(), strict=True):
            body.position, body.angle = (x, y), angle
            if body.body_type == pymunk.Body.DYNAMIC:
                body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        self.space.reindex_static()
        self._find_first_pairs()
        for body, (u, v, spin) in zip(self.bodies, velocity.T.tolist(), strict=True):
            if body.body_type == pymunk.Body.DYNAMIC:
                body.velocity, body.angular_velocity = (u, v), spin

    def damping(self, contacts: Contacts, stiffness: np.ndarray) -> np.ndarray:
        """Critical damping (k,) in N s/m: 2 sqrt(stiffness times reduced mass of the two blocks);
        stiffness in N/m. Each block carries half of a joint."""
        light = self._lightness[contacts.a] + self._lightness[contacts.b]
        return 2.0 * np.sqrt(stiffness * (0.5 / np.where(light > 0, light, np.inf)))

    def require_slow(self, dt: float) -> None:
        """Refuse blocks that move too far in a step of dt (s) to find their contacts."""
        motion = np.abs(self.motion)
        path = (motion[3] + motion[4] + motion[5] * self.reach) * dt
        if not (path < 0.25 * self.skin).all():  # also true for NaN
            raise Refused(
                f"block {self.names[int(path.argmax())]!r} moves {path.max():.3g} m in one step: "
                f"must stay below {0.25 * self.skin:.3g} m (a quarter of run.skin); resume with a "
                "smaller step"
            )

    def _find_first_pairs(self) -> None:
        """Let pymunk look for pairs while nothing moves."""
        self._hook.pre_solve = lambda _constraint, _space: None
        self.space.step(1e-9)
