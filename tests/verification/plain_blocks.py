"""One step of the blocks in numpy, slow and plain: the oracle of `dem_demo/native/blocks.c`."""

import numpy as np

FACE_TILT = 2.0  # degrees: up to this tilt an edge lies on another
CORNER_TILT = 5.0  # degrees: from this tilt on only its corner touches
SLIM_TILT = 20.0  # degrees: up to this tilt a corner has its length of joint at the end of an edge
POINT_TILT = 30.0  # degrees: from this tilt on it has none there
PARALLEL_SINE = 1e-9  # sine of an angle that differs from 0 by rounding only
MIN_OVERLAP = 1e-10  # m: shorter overlaps are rounding
LEVEL_SINE = 1e-6  # least sine of a tilt, for corners beyond the limit of their range
_FACE_SINE = np.sin(np.radians(FACE_TILT))
_CORNER_SINE = np.sin(np.radians(CORNER_TILT))
_SLIM_SINE = np.sin(np.radians(SLIM_TILT))
_POINT_SINE = np.sin(np.radians(POINT_TILT))
_AHEAD = np.array([[1.0], [-1.0]])  # sides of a corner: towards the edge's end, and its start
_END = np.array([[1.0], [0.0]])


class PlainContacts:
    """k corners on edges at a motion of the blocks, as `dem_demo.contact.geometry.Contacts`.

    Vectors are complex; division by the direction of an edge transforms them to its frame.
    """

    def __init__(self, outlines, corner, edge, motion) -> None:
        """Corners (k,) on edges (k,) for a motion (6, n) of the blocks."""
        self.outlines = o = outlines
        self.corner = corner
        self.edge = edge
        turn = np.exp(1j * motion[2])[o.block]
        place = (motion[0] + 1j * motion[1])[o.block] + turn * o.local_corner
        directions = turn * o.local_direction
        corner_block = o.block[corner]
        edge_block = o.block[edge]
        self.block_a = np.minimum(corner_block, edge_block)
        self.block_b = np.maximum(corner_block, edge_block)
        sign = np.where(corner_block > edge_block, 1.0, -1.0)
        self.sides = np.stack([o.previous[corner], corner])
        neighbours = np.stack([o.previous[edge], o.next[edge]])
        self.position = place[corner]
        direction = directions[edge]
        frame = direction.conj()
        # in the frame of the edge, whose block is on its left
        local = (self.position - place[edge]) * frame
        side = directions[self.sides] * (-_AHEAD * frame)
        to_end = o.edge_length[edge] * _END - local
        bisector = _AHEAD + side
        mean = bisector / np.maximum(np.abs(bisector), 1e-9)
        self.tilt_sine = -side.imag
        tilt_cosine = _AHEAD * side.real
        whole_side = o.edge_length[self.sides] * side
        overlap, gradient, rotation = _overlaps(to_end, whole_side, mean, o.transition_length)
        is_near_start = local.real < o.edge_length[edge] - local.real
        inward = np.where(is_near_start, 0, 1), np.arange(len(corner))
        share, by_tilt = _share_at_end(self.tilt_sine[inward], tilt_cosine[inward])
        end = np.where(is_near_start, edge, o.next[edge])
        is_point_of_two = ~(o.is_junction[corner] | o.is_junction[end])
        share = share * is_point_of_two
        by_tilt = by_tilt * is_point_of_two
        standing, along, by_share = _standing_length(
            o.corner_length, o.transition_length, local.real, o.edge_length[edge], share
        )
        # as the block rotates, the tilt of the first side falls, the tilt of the second rises
        turning = -np.where(is_near_start, 1.0, -1.0) * by_tilt * by_share
        self.length, self.overlap_length, gradient, rotation = _lengths(
            standing, along, turning, self.tilt_sine, tilt_cosine, overlap, gradient, rotation
        )
        # At its limit the range of the corner meets another one: of the next corner, along a side
        # of this corner, or of the next edge. The one that is rotated less comes next, and the
        # limit is where both are equally deep. Where a side is raised, its corner comes next. Drawn
        # joints are parallel but for rounding, which must not decide: they count as parallel.
        beyond = _AHEAD * o.local_direction[neighbours] / o.local_direction[edge]
        is_rotated_less = _AHEAD * (side.conj() * beyond).imag <= PARALLEL_SINE
        self.corner_takes_over = is_rotated_less | (self.tilt_sine[::-1] < -PARALLEL_SINE)
        toward = np.where(self.corner_takes_over, bisector, _AHEAD + beyond)
        per_depth = np.where(self.corner_takes_over, np.abs(self.tilt_sine) + LEVEL_SINE, 1.0)
        self.range_margin = -(to_end[::-1] * toward.conj()).real * per_depth
        self.normal = sign * (-1j * direction)
        self.closure = local.imag
        velocity = _velocity(motion, self.block_b, self.position)
        velocity = velocity - _velocity(motion, self.block_a, self.position)
        in_frame = velocity * self.normal.conj()
        self.opening_rate = in_frame.real
        self.sliding_rate = -in_frame.imag
        self.rates = np.stack([-self.opening_rate, self.sliding_rate], axis=1)
        self.area = o.thickness * self.length
        # of the area by displacement and rotation of b relative to a, at the contact
        self.gradient = o.thickness * sign * gradient * direction
        self.per_rotation = o.thickness * sign * rotation

    def assemble(self, motion, push, shear, energy=0.0):
        """Forces and torques (blocks, 3) on the blocks at a motion (6, blocks), in N and N m.

        push, shear (k,) in N: forces on block b along the normal and in the direction of sliding;
        the opposite acts on block a at the same position. energy (k,) in J/m2: a change of the area
        costs it.
        """
        force = (push - 1j * shear) * self.normal - energy * self.gradient
        couple = energy * self.per_rotation
        centroid = motion[0] + 1j * motion[1]
        out = np.zeros((motion.shape[1], 3))
        for block, sign in ((self.block_a, -1.0), (self.block_b, 1.0)):
            torque = ((self.position - centroid[block]).conj() * force).imag - couple
            np.add.at(out, block, sign * np.stack([force.real, force.imag, torque], axis=1))
        return out


def _overlaps(to_end, whole_side, mean, transition_length):
    """Overlap of each side with the edge (2, k), and its derivatives by displacement and rotation
    of the corner's block relative to the edge's block.

    It is measured along the mean direction of both, so that the blocks may swap roles. It runs from
    the corner or the start of the edge, whichever comes later, to the end of the edge or of the
    side, whichever comes first; within the transition length of a tie the choice is gradual.
    """
    along = mean.conj()
    remaining = to_end * along
    whole = whole_side * along
    back = remaining[::-1] * (along * mean[::-1])
    end_size, end_slope = _smooth_size(remaining.real - whole.real, transition_length)
    start_size, start_slope = _smooth_size(back.real, transition_length)
    overlap = 0.5 * (remaining.real + whole.real - end_size - back.real - start_size)
    by_end = 0.5 - 0.5 * end_slope
    by_start = -0.5 - 0.5 * start_slope
    rotation = by_end * (remaining.imag + whole.imag) + by_start * back.imag - whole.imag
    return overlap, -(by_end + by_start) * mean, 0.5 * rotation


def _share_at_end(sine, cosine):
    """Share (k,) of its length of joint that a corner keeps at the end of an edge, by the tilt of
    its side over the edge; and its derivative by the tilt (1/rad)."""
    part = np.clip((_POINT_SINE - sine) / (_POINT_SINE - _SLIM_SINE), 0, 1) * (cosine > 0)
    slope = -6 * part * (1 - part) / (_POINT_SINE - _SLIM_SINE) * cosine
    return part * part * (3 - 2 * part), slope


def _standing_length(corner_length, transition_length, x, edge_length, share):
    """Length of joint (k,) at corners that stand at x on edges, its derivatives by x and by the
    share that is kept at the ends of an edge.

    Beyond the transition length from the ends it is whole.
    """
    width = np.minimum(transition_length, 0.5 * edge_length)
    to_end = edge_length - x
    part = np.clip(np.minimum(x, to_end) / width, 0, 1)
    slope = np.where(x < to_end, 1, -1) * 6 * part * (1 - part) / width
    kept = part * part * (3 - 2 * part)
    length = corner_length * (kept + share * (1 - kept))
    return length, corner_length * (1 - share) * slope, corner_length * (1 - kept)


def _lengths(standing, along, turning, tilt_sine, tilt_cosine, overlap, gradient, rotation):
    """Length of joint at the corners, the part of each side, and derivatives of the length by
    displacement and rotation of the corner's block.

    along, turning: derivatives of `standing` by the position along the edge and by the rotation.
    """
    is_up = tilt_sine > 0
    raised, slope = _raised_fraction(tilt_sine, tilt_cosine)
    overlap_length = np.maximum(overlap, 0.0)
    lies = 0.5 * (1 - raised) * (overlap > MIN_OVERLAP)
    stands = raised * is_up
    length = (lies * overlap_length).sum(axis=0) + standing * stands[0] * stands[1]
    # The tilt of the first side falls as the corner's block rotates, the tilt of the second rises.
    by_tilt = standing * is_up * stands[::-1] - 0.5 * overlap_length * np.sign(tilt_sine)
    total_rotation = (lies * rotation - _AHEAD * slope * by_tilt).sum(axis=0)
    total_rotation = total_rotation + stands.prod(axis=0) * turning
    total_gradient = (lies * gradient).sum(axis=0) + stands.prod(axis=0) * along
    return length, lies * overlap_length, total_gradient, total_rotation


def _raised_fraction(sine: np.ndarray, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """0 for a side that lies on the edge, 1 for one that is raised, smooth between; and its
    derivative by the size of the tilt (1/rad). sine, cosine: of the tilt, any shape."""
    part = (np.abs(sine) - _FACE_SINE) / (_CORNER_SINE - _FACE_SINE)
    part = np.minimum(np.maximum(part, cosine <= 0), 1.0)
    slope = 6 / (_CORNER_SINE - _FACE_SINE) * part * (1 - part) * cosine
    return part * part * (3 - 2 * part), slope


def _smooth_size(x: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """|x| and its derivative, without the kink: differs from |x| only within `width` of 0."""
    size = np.abs(x)
    part = np.minimum(size / width, 1.0)
    return size * part * (2 - part), np.sign(x) * part * (4 - 3 * part)


def _velocity(motion, block, position):
    """Velocities of points of blocks, complex."""
    x, y, _, u, v, spin = motion
    return (u + 1j * v)[block] + 1j * spin[block] * (position - (x + 1j * y)[block])


def plain_step(sim, velocity, dt):
    """Results of a step of `sim`, from its present state, once its joints have been advanced.

    velocity (d,): to which the drives bring their blocks within dt (s). Returns forces (3, n, 3):
    total, dashpots, drives; the energies of the step by name; the next velocities (3, n).
    """
    scene = sim.scene
    blocks = sim.blocks
    now = sim.contacts
    contacts = PlainContacts(now.outlines, now.corner, now.edge, sim.blocks.motion)
    joints = sim.joints
    drives = blocks.drives
    balance = sim.energy_balance
    area = contacts.area
    motion = blocks.motion
    push, shear = (area * part for part in joints.traction.T)
    energy = joints.stored_energy
    forces = np.zeros((3, *blocks.is_free.shape))
    total, dashpots, reactions = forces
    critical = blocks.critical_damping(contacts, joints.stiffness * area)
    lower_bound = np.where(joints.damage < 1, -np.inf, -push)
    resistance = -scene.run.dashpot_normal * critical * contacts.opening_rate
    resistance = np.maximum(resistance, lower_bound)
    stick = np.maximum(1.0 - joints.separated - joints.slipping, 1.0 - joints.damage)
    drag = -scene.run.dashpot_shear * critical * stick * contacts.sliding_rate
    damped = contacts.assemble(motion, resistance, drag)
    dashpots[:] = damped * blocks.is_mobile
    total[:] = contacts.assemble(motion, push, -shear, energy) + damped
    total[:] = (total + (blocks.gravity + blocks.loads)) * blocks.is_mobile
    driven = drives.rows, drives.axes
    change = velocity - motion[3:].T[driven]
    needed = blocks.inertia[driven] * change / dt - total[driven]
    reactions[driven] = needed
    total[driven] += needed
    v = motion[3:].T
    drive_work = 0.5 * dt * ((balance.previous_forces[1] + reactions) * v).sum()
    energies = {
        "kinetic": 0.5 * (v * (blocks.inertia * v + dt * total)).sum(),
        "potential": -dt * (blocks.gravity * v).sum(),
        "stored": area @ joints.stored_energy,
        "dashpots": -0.5 * dt * ((balance.previous_forces[0] + dashpots) * v).sum(),
        "external_work": drive_work + dt * (blocks.loads * v).sum(),
    }
    return forces, energies, (v + dt * total / blocks.inertia * blocks.is_mobile).T
