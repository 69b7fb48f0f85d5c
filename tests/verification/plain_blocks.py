"""One step of the blocks in numpy, slow and plain: the oracle of `jointlaw/native/blocks.c`."""

import numpy as np

FACE, CORNER = 2.0, 5.0  # degrees: up to the first an edge lies on another, from the second not
TIE, EVEN = 1e-9, 1e-10  # sine of an angle, and m, up to which two are the same but for rounding
LEVEL = 1e-6  # sine of a tilt that is none, for corners past the limit of their range
_LOW, _HIGH = np.sin(np.radians([FACE, CORNER]))
_AHEAD = np.array([[1.0], [-1.0]])  # the sides of a corner: towards the edge's end, and its start
_END = np.array([[1.0], [0.0]])


class PlainContacts:
    """k corners on edges at a motion of the blocks, as `dem_demo.contact.geometry.Contacts`.

    Dividing by the direction of an edge takes all into its frame.
    """

    def __init__(self, outlines, corner, edge, motion) -> None:
        """Corners (k,) on edges (k,) for a motion (6, n) of the blocks."""
        self.outlines, self.corner, self.edge, o = outlines, corner, edge, outlines
        turn = np.exp(1j * motion[2])[o.block]
        place, ways = (motion[0] + 1j * motion[1])[o.block] + turn * o.local, turn * o.way
        x, y = o.block[corner], o.block[edge]
        self.a, self.b = np.minimum(x, y), np.maximum(x, y)
        sign = np.where(x > y, 1.0, -1.0)
        self.sides = np.stack([o.before[corner], corner])
        self.behind = np.stack([o.before[edge], o.after[edge]])
        self.at, way = place[corner], ways[edge]
        frame = way.conj()
        here = (self.at - place[edge]) * frame  # in the frame of the edge: its block is on the left
        side = ways[self.sides] * (-_AHEAD * frame)
        rest = o.side[edge] * _END - here
        both = _AHEAD + side
        mean = both / np.maximum(np.abs(both), 1e-9)
        self.rise, level = -side.imag, _AHEAD * side.real
        overlap, pull, twist = _overlaps(rest, o.side[self.sides] * side, mean, o.soft)
        stood, along = _stood_on(o.corner_length, o.soft, here.real, o.side[edge])
        self.length, self.carried, pull, twist = _lengths(
            stood, along, self.rise, level, overlap, pull, twist
        )
        self.pull, self.twist = sign * pull * way, sign * twist
        # Behind a corner its edge ends at another corner. Of what follows there, a side of this
        # corner or the next edge of the other block, the one that is turned less is next; the limit
        # is where both are equally deep. The raised end of an edge on an edge has its side next.
        # Drawn joints are parallel but for rounding, which must not choose: they count as parallel.
        beyond = _AHEAD * o.way[self.behind] / o.way[edge]
        self.own = (_AHEAD * (side.conj() * beyond).imag <= TIE) | (self.rise[::-1] < -TIE)
        toward = np.where(self.own, both, _AHEAD + beyond)
        self.inside = -(rest[::-1] * toward.conj()).real
        self.inside *= np.where(self.own, np.abs(self.rise) + LEVEL, 1.0)
        self.normal, self.closure = sign * (-1j * way), here.imag
        v = _velocity(motion, self.b, self.at) - _velocity(motion, self.a, self.at)
        v *= self.normal.conj()
        self.opening, self.sliding = v.real, -v.imag


def _overlaps(rest, whole, mean, soft):
    """Overlap of each side with the edge (2, k), measured along the mean of both so that the blocks
    may trade roles; its derivatives by motion of the corner's block relative to the edge's.

    It runs from the corner or from what lies behind it, whichever comes later, to where the edge
    or the side ends, whichever comes first; within `soft` (m) of a tie the choice is gradual.
    """
    along = mean.conj()
    rest, whole = rest * along, whole * along
    back = rest[::-1] * (along * mean[::-1])
    size, slope = _soft_size(rest.real - whole.real, soft)
    step, rate = _soft_size(back.real, soft)
    overlap = 0.5 * (rest.real + whole.real - size - back.real - step)
    by_edge, by_end = 0.5 - 0.5 * slope, -0.5 - 0.5 * rate
    twist = by_edge * (rest.imag + whole.imag) + by_end * back.imag - whole.imag
    return overlap, -(by_edge + by_end) * mean, 0.5 * twist


def _stood_on(corner_length, soft, x, whole_edge):
    """Length of joint (k,) at corners that stand at x on edges: none at the end of an edge, where
    blocks meet in a point, all of it from `soft` (m) on; and its derivative by x."""
    reach = np.minimum(soft, 0.5 * whole_edge)
    left = whole_edge - x
    part = np.clip(np.minimum(x, left) / reach, 0, 1)
    slope = np.where(x < left, 1, -1) * 6 * part * (1 - part) / reach
    return corner_length * part * part * (3 - 2 * part), corner_length * slope


def _lengths(stood, along, rise, level, overlap, pull, twist):
    """Length of joint at the corners and that of each side, and the derivatives of the length by
    motion of the corner's block relative to the edge's."""
    up = rise > 0
    gone, bend = _raised(rise, level)
    held = np.maximum(overlap, 0.0)
    lies = 0.5 * (1 - gone) * (overlap > EVEN)
    stands = gone * up
    length = (lies * held).sum(axis=0) + stood * stands[0] * stands[1]
    # The tilt of the first side falls as the corner's block turns, that of the second rises.
    by_tilt = stood * up * stands[::-1] - 0.5 * held * np.sign(rise)
    twist = (lies * twist - _AHEAD * bend * by_tilt).sum(axis=0)
    return length, lies * held, (lies * pull).sum(axis=0) + stands.prod(axis=0) * along, twist


def _raised(sine: np.ndarray, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """0 for an edge that lies on the other, 1 for one that does not, smooth between; and its
    derivative by the size of the tilt (1/rad). sine, cosine: of the tilt, any shape."""
    part = (np.abs(sine) - _LOW) / (_HIGH - _LOW)
    part = np.minimum(np.maximum(part, cosine <= 0), 1.0)
    return part * part * (3 - 2 * part), 6 / (_HIGH - _LOW) * part * (1 - part) * cosine


def _soft_size(x: np.ndarray, soft: float) -> tuple[np.ndarray, np.ndarray]:
    """|x| and its derivative, without the kink: differs from |x| only within `soft` of 0."""
    size = np.abs(x)
    part = np.minimum(size / soft, 1.0)
    return size * part * (2 - part), np.sign(x) * part * (4 - 3 * part)


def _velocity(motion, block, at):
    x, y, _, u, v, spin = motion
    return (u + 1j * v)[block] + 1j * spin[block] * (at - (x + 1j * y)[block])


def plain_step(sim, velocity, dt):
    """What a step of `sim` makes of the state that it is in, once its joints have been advanced.

    velocity (d,): to which the drives bring their blocks within dt (s). Returns forces (3, n, 3):
    all, dashpots, drives; the energies booked over dt by name; the velocities (3, n) to go on with.
    """
    scene, blocks, contacts, joints = sim.scene, sim.blocks, sim.contacts, sim.joints
    area, motion = contacts.length * scene.thickness, blocks.motion
    stress, shear = (area * part for part in joints.traction.T)
    energy = joints.stored_energy * scene.thickness  # J/m: what a change of the length costs
    out = np.zeros((3, *blocks.free.shape))
    critical = blocks.damping(contacts, joints.stiffness * area)
    least = np.where(joints.damage < 1, -np.inf, -stress)
    push = np.maximum(-scene.run.dashpot_normal * critical * contacts.opening, least)
    stick = np.maximum(1.0 - joints.separated - joints.slipping, 1.0 - joints.damage)
    resist = -scene.run.dashpot_shear * critical * stick * contacts.sliding
    damped = contacts.assemble(motion, push, resist)
    out[1] = damped * blocks.mobile
    out[0] = contacts.assemble(motion, stress, -shear, energy) + damped
    out[0] = (out[0] + (blocks.gravity + blocks.loads)) * blocks.mobile
    driven = blocks.drives.rows, blocks.drives.axes
    needed = blocks.inertia[driven] * (velocity - motion[3:].T[driven]) / dt - out[0][driven]
    out[2][driven] = needed
    out[0][driven] += needed
    went = motion[3:].T
    booked = {
        "kinetic": 0.5 * (went * (blocks.inertia * went + dt * out[0])).sum(),
        "potential": -dt * (blocks.gravity * went).sum(),
        "stored": area @ joints.stored_energy,
        "dashpots": -0.5 * dt * ((sim.energy_balance.last[0] + out[1]) * went).sum(),
        "work": 0.5 * dt * ((sim.energy_balance.last[1] + out[2]) * went).sum()
        + dt * (blocks.loads * went).sum(),
    }
    return out, booked, (went + dt * out[0] / blocks.inertia * blocks.mobile).T
