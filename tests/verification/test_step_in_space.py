"""The compiled step with 6 motions of a block, on rows that a test fills: a block that slides on an
incline, a block that rotates freely, and the bound of the time step."""

import ctypes
from types import SimpleNamespace

import numpy as np
import pytest

import jointlaw as jl
from dem_demo.compiled import StepArrays, address
from dem_demo.contact import ContactRows, Joints
from dem_demo.dynamics.energy_balance import EnergyBalance
from dem_demo.dynamics.timestep import bound_of_blocks, closure_and_shear_rates, largest_step

UPDATE_GEOMETRY = ctypes.CFUNCTYPE(
    ctypes.c_longlong, ctypes.c_void_p, ctypes.c_longlong, ctypes.c_longlong
)
FRICTION = 0.6
SIZE = np.array([1.0, 0.8, 0.2])  # m, of the block
DENSITY = 2600.0
CORNERS = np.array([[x, y, -1.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)]) * SIZE / 2


class BlockOnPlane:
    """Block 1 over the fixed block 0, whose top is z = 0; its four lower corners are the contact
    points, each with a quarter of the area."""

    def __init__(self, gravity, law, n_points=4, azimuth=0.0):
        """gravity in m/s2; azimuth (rad): of the law's axis 2, from x."""
        mass = DENSITY * SIZE.prod()
        moments = mass / 12 * ((SIZE**2).sum() - SIZE**2)
        self.inertia = np.tile([mass] * 3 + moments.tolist(), (2, 1))
        self.gravity = np.array([[0.0] * 6, [*(mass * np.array(gravity)), 0.0, 0.0, 0.0]])
        self.is_mobile = np.array([False, True])
        self.is_free = self.is_mobile[:, None].repeat(6, axis=1)
        cosine, sine = np.cos(azimuth), np.sin(azimuth)
        self.directions = np.array([[0.0, 0.0, -1.0], [cosine, sine, 0.0], [-sine, cosine, 0.0]])
        self.inverse_sqrt_inertia = self.is_free / np.sqrt(self.inertia)
        self.inverse_mass = self.is_mobile / mass
        self.motion = np.zeros((12, 2))
        self.motion[2, 1] = SIZE[2] / 2
        self.velocity = np.zeros((6, 2))
        self.axes = np.tile(np.eye(3), (2, 1, 1))
        self.bolts = SimpleNamespace(n=0, pull=lambda: 0.0)
        self.rows = ContactRows.zeros(n_points, dim=3, dof=6, n_keys=1)
        self.rows.block_b[:] = 1
        self.rows.area[:] = SIZE[0] * SIZE[1] / 4
        self.joints = Joints(
            SimpleNamespace(laws={"rock": law}, reduction=1.0, gravity=np.zeros(3))
        )
        zero = np.zeros(n_points, int)
        self.joints.rearrange(zero - 1, zero, np.stack([zero, zero], axis=1))
        self.balance = EnergyBalance(2, dof=6)
        self.balance.booked_area = self.rows.area.copy()
        self.balance.booked_dissipation = np.zeros(n_points)
        self.fill_rows()

    def fill_rows(self):
        """Closure is the depth of a corner below the plane; shears are along axes 2 and 3."""
        rows = self.rows
        place = self.motion[:3, 1]
        axes = self.axes[1]
        for i in range(len(rows.area)):
            arm = axes @ CORNERS[i]
            rows.closure[i] = -(place + arm)[2]
            rows.kinematics[i, :, 6:9] = self.directions
            rows.kinematics[i, :, 9:] = np.cross(arm, self.directions) @ axes
            rows.kinematics[i, :, :6] = -rows.kinematics[i, :, 6:]  # a fixed block: any value

    def start(self, fraction=0.3, dt=None, driven=None):
        """Bind the arrays; velocities are half a step ahead of positions.

        driven: velocities of prescribed motions of the block, by their number.
        """
        axes = np.array([*(driven or {})], np.int64)
        speeds = np.array([*(driven or {}).values()], float)
        self.is_free[1, axes] = False
        self.inverse_sqrt_inertia *= self.is_free
        self.velocity[axes, 1] = speeds
        joints, rows, n = self.joints, self.rows, 2
        stiffness = joints.interpolate("stiffness", "closure", rows.closure) * rows.area
        self.dt = dt or fraction * bound_of_blocks(self, rows, stiffness, 0.0 * stiffness)
        self.arrays = StepArrays(
            n_blocks=n, n_contacts=joints.n, dim=3, dof=6, law_steps=1.0, dashpot_normal=0.1,
            dashpot_shear=0.1, max_skin_per_step=np.inf, max_skin_until_rebuild=np.inf,
            n_driven=len(axes),
        )  # fmt: skip
        self.arrays.bind(
            driven_block=np.ones(len(axes), np.int64), driven_axis=axes, driven_velocity=speeds
        )
        self.callback = UPDATE_GEOMETRY(lambda *_: self.fill_rows() or 0)
        self.arrays.update_geometry = ctypes.cast(self.callback, ctypes.c_void_p).value
        self.arrays.bind(
            self, "motion", "velocity", "axes", "inertia", "gravity", "inverse_mass", "is_mobile"
        )
        self.arrays.bind(
            self.rows, "block_a", "block_b", "closure", "area", "kinematics", "area_gradient",
            "rates",
        )  # fmt: skip
        self.arrays.bind(
            self.balance, "forces", "previous_forces", "booked_area", "booked_dissipation", "energy"
        )
        self.arrays.bind(
            loads=np.zeros((n, 6)), bolt_forces=np.zeros((n, 6)), rebuilt_at=np.zeros((6, n)),
            radius=np.full(n, 1.0), skin=np.full(n, 1.0), max_overlap=np.full(n, 1.0),
            needs_rebuild=np.zeros(n, bool), closure_offset=np.zeros(joints.n),
            checked_stiffness=np.full(joints.n, np.inf),
        )  # fmt: skip
        joints.bind(self.arrays)
        self.arrays.divide(self.rows.block_a, self.rows.block_b)
        self.motion[6:] = self.velocity
        self.arrays.call("compute_rates")
        self.arrays.call("compute_forces", 0.5 * self.dt)
        self.balance.open(self, joints, self.dt)
        half_step = 0.5 * self.dt * self.balance.forces[0] / self.inertia
        self.velocity += (half_step * self.is_free).T

    def run(self, time):
        for _ in range(round(time / self.dt)):
            self.arrays.call("move_blocks", self.dt)
            self.joints.advance(1)
            self.arrays.call("finish_step", self.dt)
        return round(time / self.dt) * self.dt


def on_incline(degrees, azimuth):
    """A block on a plane that dips by an angle towards an azimuth from x, in equilibrium or, where
    it slides, with its joints at their friction limit."""
    dip = np.radians(degrees)
    down = np.array([np.cos(azimuth), np.sin(azimuth)])
    gravity = 9.81 * np.array([*(np.sin(dip) * down), -np.cos(dip)])
    law = jl.CoulombLaw(normal_stiffness=1e10, shear_stiffness=5e9, friction=FRICTION)
    block = BlockOnPlane(gravity, law)
    stress = DENSITY * SIZE[2] * 9.81 * np.cos(dip)
    carried = min(np.tan(dip), FRICTION)
    # shear forces act below the centroid: normal forces balance their moment
    tilt = carried * stress * SIZE[2] / 2 * down / (1e10 * (SIZE[:2] / 2) ** 2)
    block.axes[1] += np.cross([-tilt[1], tilt[0], 0.0], np.eye(3)).T
    block.motion[2, 1] -= stress / 1e10
    block.fill_rows()
    shear = carried * block.rows.closure[:, None] * 1e10 / 5e9 * down
    block.joints.update(block.rows.closure, shear)
    block.start()
    return block, down


@pytest.mark.parametrize(
    ("degrees", "azimuth"), [(30.9, 0.7), (31.1, 0.0), (31.1, -2.0), (35.0, 0.7), (35.0, -2.0)]
)
def test_block_on_an_incline(degrees, azimuth):
    """Friction of 0.6 carries the block up to 30.964 degrees. Beyond, it moves down the dip line by
    g (sin - 0.6 cos) t^2/2, along any direction between the axes of the law."""
    block, down = on_incline(degrees, azimuth)
    place = block.motion[:2, 1].copy()
    time = block.run(0.25)
    displaced = block.motion[:2, 1] - place
    dip = np.radians(degrees)
    acceleration = 9.81 * max(np.sin(dip) - FRICTION * np.cos(dip), 0.0)
    expected = 0.5 * acceleration * time**2
    assert displaced @ down == pytest.approx(expected, rel=1e-6, abs=1e-11)
    assert displaced @ [-down[1], down[0]] == pytest.approx(0.0, abs=1e-12)
    assert block.motion[3:6, 1] == pytest.approx(np.zeros(3), abs=1e-12)  # does not turn
    assert abs(block.balance.error) < 1e-7
    if expected > 0:
        work = block.balance.value["friction"]
        normal_force = block.inertia[1, 0] * 9.81 * np.cos(dip)
        assert work == pytest.approx(FRICTION * normal_force * expected, rel=1e-3)


def test_a_block_that_rotates_freely_keeps_energy_and_angular_momentum():
    """A block of three different moments tumbles through 30 turns about no principal axis."""
    law = jl.CoulombLaw(normal_stiffness=1e9, shear_stiffness=1e9, friction=FRICTION)
    errors = []
    for dt in (2e-3, 1e-3):
        block = BlockOnPlane([0.0, 0.0, 0.0], law, n_points=0)
        block.velocity[:, 1] = [0.3, -0.2, 0.1, 2.0, 15.0, 1.0]
        moments = block.inertia[1, 3:]
        momentum = block.axes[1] @ (moments * block.velocity[3:, 1])
        energy = 0.5 * moments @ block.velocity[3:, 1] ** 2
        block.start(dt=dt)
        deviation = []
        for _ in range(120):
            block.run(0.1)
            spin = block.velocity[3:, 1]
            deviation.append(
                [
                    0.5 * moments @ spin**2 / energy - 1,
                    np.linalg.norm(block.axes[1] @ (moments * spin) - momentum)
                    / np.linalg.norm(momentum),
                ]
            )
        errors.append(np.abs(deviation).max(axis=0))
        assert block.axes[1].T @ block.axes[1] == pytest.approx(np.eye(3), abs=1e-14)
        assert block.motion[:3, 1] == pytest.approx([3.6, -2.4, 1.2 + SIZE[2] / 2])
        assert abs(block.balance.total - block.balance.start) < 1e-12 * energy
    energy_error, momentum_error = np.transpose(errors)
    assert energy_error.max() < 1e-12
    assert momentum_error[0] < 0.01  # axes and velocities are half a step apart
    assert momentum_error[1] < 0.55 * momentum_error[0]


def test_bound_of_the_time_step_in_space():
    """The bound of single blocks is exact for one block on springs of equal stiffness."""
    block, _ = on_incline(20.0, 0.4)
    stiffness = np.full(4, 5e9)
    rates = closure_and_shear_rates(block, block.rows)
    assert rates.shape == (12, 6)
    exact = largest_step(rates, np.tile(stiffness, 3), np.zeros(12))
    assert bound_of_blocks(block, block.rows, stiffness, 0.0 * stiffness) == pytest.approx(
        exact, rel=1e-6
    )
    assert address(block.rows.keys)  # contiguous, as for the compiled step


@pytest.mark.parametrize("rough", [False, True], ids=["coulomb", "rough"])
def test_a_drive_pulls_a_block_over_its_base(rough):
    """A drive pulls a block along x, at 45 degrees to the axes of the law; y and z are free.

    The work of the drive is friction, stored and kinetic energy. A joint that is rougher along axis
    2 lets the block yield along axis 3; Coulomb's joint does not.
    """
    speed = 0.02
    if rough:
        law = jl.JointLaw(
            asperity_density=1e4,
            mating_length=2e-3,
            orientation=jl.Orientation(a=3.0, c=0.3),
            asperity=jl.Asperity(K=9.5e6, lam=1.2, eta=0.5, mu=0.4),
            heights=jl.GammaHeights(alpha=3.82, beta=1.15e-3, overlap=3e-3),
        )
    else:
        law = jl.CoulombLaw(normal_stiffness=1e9, shear_stiffness=5e8, friction=FRICTION)
    block = BlockOnPlane([0.0, 0.0, -9.81], law, azimuth=np.pi / 4)
    stress = DENSITY * SIZE[2] * 9.81
    block.motion[2, 1] -= float(law.closure(stress)) if rough else stress / 1e9
    block.fill_rows()
    block.joints.update(block.rows.closure, np.zeros((4, 2)))
    block.start(driven={0: speed, 3: 0.0, 4: 0.0, 5: 0.0})
    time = block.run(0.2)
    assert block.motion[0, 1] == pytest.approx(speed * time, rel=1e-3)  # half a step later
    sideways = block.motion[1, 1]
    work = block.balance.value["external_work"]
    if rough:
        assert sideways < -1e-4
        assert block.motion[2, 1] > SIZE[2] / 2 + 1e-4  # dilates
        assert 0.3 < work / (stress * SIZE[0] * SIZE[1] * speed * time) < 1.2
    else:
        assert sideways == pytest.approx(0.0, abs=1e-12)
        friction = FRICTION * stress * SIZE[0] * SIZE[1] * speed * time
        assert work == pytest.approx(friction, rel=1e-2)
    assert abs(block.balance.error) < 1e-3  # friction is first-order accurate in the sudden start
