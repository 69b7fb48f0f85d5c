"""The blocks in motion, and the loads on their edges.

pymunk holds their shapes and finds pairs that are near, all of it here. Shapes are sensors with a
skin, so pymunk reports which blocks come near each other and never moves them: the compiled step
does, by symplectic Euler (positions with the velocities that they have, then velocities with the
forces at the new positions).
"""

import numpy as np
import pymunk

from ..contact import ContactManager, Contacts, Outlines
from ..scene import Drives, Scene, SceneError, Stress

MOVED = 0.25  # most of its skin that a block may move in a step: else contacts could be missed


class Blocks:
    """The blocks of a scene; arrays (n, 3) run over blocks and motions x, y, turn.

    motion (6, n): positions, angles, and the velocities that led there; velocity (3, n): those to
    go on with. inertia: mass, mass, moment; mobile (n, 1): blocks that move, driven rock too;
    free: motions that forces move; gravity, steady: forces that do not change (N); loads: these
    without gravity, with pressures on edges (`apply_loads`); root: 1/sqrt(inertia) of the free
    motions, else 0; lightness (n,): 1/kg, of what can give way; gone (n,): blocks that were taken
    away; support (n, 3): what is left of what these bore on the others (N). The compiled step
    writes to the first two: change them in place.
    """

    def __init__(self, scene: Scene) -> None:
        blocks = scene.blocks
        self.names, self.skins = [block.name for block in blocks], scene.skins
        sections = [block.section for block in blocks]
        self.inertia = scene.thickness * np.array([[s.mass, s.mass, s.moment] for s in sections])
        self.mobile = np.array([[block.moves] for block in blocks])
        self.drives = Drives(scene.drives)
        self.free = self.mobile.repeat(3, axis=1)
        self.free[self.drives.rows, self.drives.axes] = False
        self.root = np.where(self.free, 1 / np.sqrt(self.inertia), 0.0)
        self.gravity = self.mobile * self.inertia * [*scene.gravity, 0.0]
        self.steady = np.array([[*block.load, 0.0] for block in blocks]) * self.mobile
        self.loads = self.steady.copy()
        self.reach = np.array([block.reach for block in blocks])
        self.lightness = self.free[:, :2].any(axis=1) / self.inertia[:, 0]
        places = np.array([[*block.centroid, 0.0] for block in blocks]).T
        start = np.array([[*block.velocity, block.spin] for block in blocks])
        self.velocity = np.ascontiguousarray((start * self.mobile).T)
        self.motion = np.concatenate([places, self.velocity])
        self._near: set[tuple[int, ...]] = set()
        self._build(scene)
        self.gone, self.support = np.zeros(len(blocks), bool), np.zeros((len(blocks), 3))
        self.remove(list(scene.removed))

    def _build(self, scene: Scene) -> None:
        """pymunk's bodies, and its callbacks."""
        self._space, self._bodies, self._number = pymunk.Space(), [], {}
        for i, block in enumerate(scene.blocks):
            kind = pymunk.Body.DYNAMIC if block.moves else pymunk.Body.STATIC
            body = pymunk.Body(self.inertia[i, 0], self.inertia[i, 2], kind)
            body.position = tuple(block.centroid)
            shape = pymunk.Poly(body, block.local.tolist(), radius=float(self.skins[i]))
            shape.sensor, shape.collision_type = True, 1
            self._space.add(body, shape)
            self._bodies.append(body)
            self._number[shape] = i

        def pair(arbiter: pymunk.Arbiter) -> tuple[int, ...]:
            return tuple(sorted(self._number[shape] for shape in arbiter.shapes))

        self._space.on_collision(
            1, 1, begin=lambda arbiter, *_: self._near.add(pair(arbiter)),
            separate=lambda arbiter, *_: self._near.discard(pair(arbiter)),
        )  # fmt: skip
        self._space.step(1e-9)

    def near(self) -> np.ndarray:
        """Pairs (p, 2) of blocks whose gap is below the sum of their skins, or almost."""
        for i in np.flatnonzero(self.mobile).tolist():
            x, y, angle = self.motion[:3, i].tolist()
            self._bodies[i].position, self._bodies[i].angle = (x, y), angle
        self._space.step(1e-9)  # pymunk looks for pairs in a step, in which nothing moves
        pairs = np.array(sorted(self._near), int).reshape(-1, 2)
        return pairs[~self.gone[pairs].any(axis=1)]

    def remove(self, rows: list[int]) -> None:
        """Take blocks away: nothing moves or meets them any more."""
        self.gone[rows] = True
        for array in (self.mobile, self.free, self.root, self.lightness):
            array[rows] = 0
        self.motion[3:, rows] = self.velocity[:, rows] = 0.0

    def damping(self, contacts: Contacts, stiffness: np.ndarray) -> np.ndarray:
        """Critical damping (k,) in N s/m: 2 sqrt(stiffness times reduced mass of the two blocks);
        stiffness in N/m. Each block carries half of a joint."""
        light = self.lightness[contacts.a] + self.lightness[contacts.b]
        return 2.0 * np.sqrt(stiffness * (0.5 / np.where(light > 0, light, np.inf)))

    def refuse(self, i: int, dt: float) -> None:
        """Refuse block i, which moves too far in a step of dt (s) to find its contacts."""
        u, v, spin = np.abs(self.velocity[:, i])
        path, most = (u + v + spin * self.reach[i]) * dt, MOVED * self.skins[i]
        raise SceneError(
            f"block {self.names[i]!r} moves {path:.3g} m in one step: must stay below {most:.3g} m "
            "(a quarter of its skin, run.skin); resume with a smaller step"
        )


def apply_loads(scene: Scene, blocks: Blocks, manager: ContactManager) -> np.ndarray:
    """Bring the loads of the blocks to what they are with their edges where these are now; returns
    how much more they are (n, 3).

    Water presses on all edges, so the joints carry what is left, the effective stress. The pressure
    that is given for the joints of a law presses on both faces where edges lie on each other:
    uniform, it is the same as half of it at either end.
    """
    given = [stress for stress in (scene.water, scene.in_situ) if stress]
    if not (given or scene.wet or scene.stages):
        return 0.0 * blocks.loads
    contacts, loads, before = manager.contacts, blocks.steady + blocks.support, blocks.loads.copy()
    for stress in given:
        loads += scene.thickness * _on_edges(stress, contacts.outlines, blocks.motion)
    pressure = np.array([scene.pressure.get(name, 0.0) for name in scene.laws])[manager.law]
    push = pressure * contacts.carried.sum(axis=0) * scene.thickness
    loads += contacts.assemble(blocks.motion, push, 0.0 * push)
    blocks.loads[:] = loads * blocks.mobile
    return blocks.loads - before


def _on_edges(stress: Stress, outlines: Outlines, motion: np.ndarray) -> np.ndarray:
    """Forces and torques (n, 3) per m of thickness of a stress on edges of the blocks.

    An edge is split where the line bends and where it crosses the line. Along each part a to b of
    length L the stress goes straight from u_a to u_b: the force is -S.n L (u_a + u_b)/2, at
    a + (b - a)(u_a + 2 u_b)/(3 (u_a + u_b)).
    """
    p, block = outlines.placed, outlines.block
    centre, along = (motion[0] + 1j * motion[1])[block, None], (p[outlines.after] - p)[:, None]
    bends = (stress.line[:, 0] - p.real[:, None]) / np.where(along.real, along.real, np.inf)
    ends = 0.0 * along.real, np.sort(np.clip(bends, 0.0, 1.0)), 0.0 * along.real + 1.0
    at = p[:, None] + np.concatenate(ends, axis=1) * along
    a, b = at[:, :-1], at[:, 1:]
    da, db = stress.signed(a), stress.signed(b)
    crossing = a + (b - a) * da / np.where(da == db, 1.0, da - db)
    crosses = (da > 0) != (db > 0)
    a, b = np.where(crosses & (da <= 0), crossing, a), np.where(crosses & (db <= 0), crossing, b)
    ua, ub = np.maximum(da, 0.0), np.maximum(db, 0.0)
    push = stress.on(1j * (b - a)) * stress.edges[:, None]  # minus the outward normal, times L
    arms = ((a - centre) * (2 * ua + ub) + (b - centre) * (ua + 2 * ub)) / 6
    force, couple = push * (ua + ub) / 2, (arms.conj() * push).imag
    parts = (part.sum(axis=1) for part in (force.real, force.imag, couple))
    return np.stack([np.bincount(block, part, motion.shape[1]) for part in parts], axis=1)
