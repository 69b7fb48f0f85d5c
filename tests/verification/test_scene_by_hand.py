"""Plane scenes computed by hand: every number that a run writes is compared with a closed form.

The comparison goes through the columns of `blocks.csv` and `history.csv`, the fields of the VTK
files and the keys of `summary.json` as they are written. A column, field or key without an expected
value fails the test, so that a new one needs its closed form here.

flight   a block flies with spin under gravity and a load, seen from fixed rock that a record moves
stack    two blocks stand on a base, pore pressure between them, water beside them that is deeper
         on the left
slide    a block slides down a plane with constant friction
anchored a block that a bolt and a pressure on its top press on a base

Lengths of joint, forces and energies are those of a section `THICKNESS` thick. Expected values are
pairs: the value, and the absolute tolerance.
"""

import json
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from by_hand import assign_fractions, columns, compare
from scene_text import block, coulomb, lines
from scipy.linalg import eigh

from dem_demo import Simulation, parse
from dem_demo.cli import main
from dem_demo.output.record import _read_joints
from dem_demo.output.run import SUMMARY_VERSION

THICKNESS = 1.5  # m
DASHPOT = 0.05  # fraction of critical damping, the default of scenes
ROUNDING = 1e-9  # absolute, of numbers of order one


def turned(points, angle):
    """Points (..., 2) rotated by an angle (rad)."""
    cosine = np.cos(angle)
    sine = np.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def corners_of(box, centre, angle=0.0):
    """Corners (4, 2) of a box at its centre."""
    half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * box
    return turned(half, angle) + centre


def in_space(vectors):
    """Vectors (n, 2) with a third component 0."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def zeros(count):
    return np.zeros(count), ROUNDING


class Flight:
    """Parabola of the centroid, constant spin; the base moves with constant acceleration.

    Velocities belong to half a step before the positions (at time 0: after). Energies are tested
    to 0.05 J of 1e4 J, because the kinetic energy of the driven base at time 0 is half a step off.
    """

    title = "flight"
    block_names = ("ground", "flyer")
    times = np.array([0.0, 0.1, 0.2])
    time_step = 1e-3
    density = 2000.0
    box = np.array([0.8, 0.6])
    start = np.array([3.0, 4.0])
    ground = np.array([-10.0, -20.0])
    ground_box = np.array([2.0, 1.0])
    gravity = np.array([1.0, -9.0])
    velocity = np.array([2.0, -1.5])
    spin = 2.0
    load = np.array([720.0, -480.0])
    point = np.array([3.3, 4.2])
    shaking = np.array([2.5, 0.0])  # m/s2; 1 gal is 0.01 m/s2
    files = (("quake.csv", "Time (s),Acc (gal)\n0,250\n1,250\n"),)
    text = (
        lines(title=title, gravity=gravity, density=density, thickness=THICKNESS)
        + f"[laws.plain]\n{coulomb()}"
        + block("ground", box=ground_box, at=ground, fixed=True)
        + block("flyer", box=box, at=start, velocity=velocity, spin=spin, load=load)
        + '[[drive]]\nmotion = "x"\nfile = "quake.csv"\n[monitor]\n'
        + lines(points=[point])
        + f"[run]\nend = 0.2\nrecord = 0.1\nstep = {time_step}\nskin = 0.05\n"
    )
    mass = THICKNESS * density * box.prod()
    ground_mass = THICKNESS * density * ground_box.prod()
    acceleration = gravity + load / mass

    def at(self, t):
        """Displacement of flyer and ground (2,), velocities half a step earlier, and rotation."""
        t_velocity = abs(t - 0.5 * self.time_step)
        flown = self.velocity * t + 0.5 * self.acceleration * t**2
        velocity = self.velocity + self.acceleration * t_velocity
        return flown, 0.5 * self.shaking * t**2, velocity, self.shaking * t_velocity, self.spin * t

    def energies(self, t):
        flown, ground_moved, *_ = self.at(t)
        inertia = self.mass * (self.box**2).sum() / 12
        velocity = self.velocity + self.acceleration * t
        of_ground = 0.5 * self.ground_mass * ((self.shaking * t) ** 2).sum()
        kinetic = 0.5 * (self.mass * (velocity**2).sum() + inertia * self.spin**2) + of_ground
        fallen = self.gravity @ (self.mass * flown + self.ground_mass * ground_moved)
        driven = of_ground - self.ground_mass * self.gravity @ ground_moved
        work = self.load @ flown + driven
        at_rest = 0.5 * (self.mass * (self.velocity**2).sum() + inertia * self.spin**2)
        return {
            "kinetic": kinetic,
            "potential": -fallen,
            "stored": 0.0,
            "friction": 0.0,
            "dashpots": 0.0,
            "discarded": 0.0,
            "bolts": 0.0,
            "external_work": work,
            "turnover": at_rest + fallen + work,  # all work is positive
        }

    energy_tolerance = 0.05

    def energy_error(self, t):
        return 0.0

    def monitors(self, t):
        flown, ground_moved, velocity, ground_velocity, angle = self.at(t)
        arm = turned(self.point - self.start, angle)
        place = self.start + flown + arm - ground_moved
        x, y = place
        u, v = velocity + self.spin * np.array([-arm[1], arm[0]]) - ground_velocity
        return {
            "point 1: x_m": (x, ROUNDING),
            "point 1: y_m": (y, ROUNDING),
            "point 1: vx_m/s": (u, ROUNDING),
            "point 1: vy_m/s": (v, ROUNDING),
            "point 1: displacement_m": (np.hypot(*(place - self.point)), ROUNDING),
            "base: x_m": (ground_moved[0], ROUNDING),
            "base: y_m": (0.0, ROUNDING),
            "base: vx_m/s": (ground_velocity[0], ROUNDING),
            "base: vy_m/s": (0.0, ROUNDING),
        }

    def blocks(self):
        flown, ground_moved, velocity, ground_velocity, angle = self.at(self.times[-1])
        relative = flown - ground_moved
        return {
            "x_m": ([self.ground[0] + ground_moved[0], self.start[0] + flown[0]], ROUNDING),
            "y_m": ([self.ground[1], self.start[1] + flown[1]], ROUNDING),
            "displacement_m": ([0.0, np.hypot(*relative)], ROUNDING),
            "displacement_x_m": ([0.0, relative[0]], ROUNDING),
            "displacement_y_m": ([0.0, relative[1]], ROUNDING),
            "rotation_deg": ([0.0, angle * 180 / np.pi], ROUNDING),
            "speed_m/s": ([ground_velocity[0], np.hypot(*velocity)], ROUNDING),
            "largest_joint_slip_m": zeros(2),
            "unstable_at_start": ([0, 1], 0),
        }

    def cells(self):
        flown, ground_moved, velocity, ground_velocity, angle = self.at(self.times[-1])
        return {
            "block": ([0, 1], 0),
            "displacement_m": (in_space([[0.0, 0.0], flown - ground_moved]), ROUNDING),
            "rotation_rad": ([0.0, angle], ROUNDING),
            "velocity_m/s": (in_space([ground_velocity, velocity]), ROUNDING),
            "spin_rad/s": ([0.0, self.spin], ROUNDING),
            "unstable": ([0, 1], 0),
        }

    def stresses(self):
        return [None, np.zeros((2, 2))], ROUNDING

    def corners(self):
        flown, ground_moved, _, _, angle = self.at(self.times[-1])
        return np.concatenate(
            [
                corners_of(self.ground_box, self.ground + ground_moved),
                corners_of(self.box, self.start + flown, angle),
            ]
        ), ROUNDING

    def segments(self):
        return np.zeros((0, 2, 2)), ROUNDING

    def joints(self):
        return {}

    def summary(self):
        flown, ground_moved, *_ = self.at(self.times[-1])
        displaced = np.hypot(*(flown - ground_moved))
        x, y = self.start
        return {
            "steps": 200,
            "time_step_limit_s": None,  # without contacts there is no limit
            "time_step_margin": None,
            "equilibrium": "without equilibrium",
            "started_in_equilibrium": False,
            "unstable": [{"block": "flyer", "x_m": x, "y_m": y}],
            "contact_points": 0,
            "joint_stresses": "total",
            "slip": [],
            "bolts": [],
            "rocks": [
                {
                    "rock": "blocks",
                    "state": "displacing",
                    "blocks": 1,
                    "settlement_m": pytest.approx(0.0, abs=ROUNDING),
                    "displacement_m": pytest.approx(displaced),
                    "failed_blocks": 1,
                    "failure_displacement_m": pytest.approx(0.1 * np.sqrt(self.box.prod())),
                    "creep_m_per_s": pytest.approx(displaced / 0.2),  # the run is shorter than 1 s
                }
            ],
        }


def critical_step(blocks, springs, dashpots=(DASHPOT, DASHPOT)):
    """Largest stable step (s) of symplectic Euler; by hand: eigenvalues of K and of M.

    blocks: (mass, moment of inertia, centroid) of each; springs: (stiffness in N/m along normal and
    tangent, place, block below or None for fixed rock, block above). dashpots: along tangent and
    normal, fractions of critical damping of each spring, on half of each mass.
    """
    size = 3 * len(blocks)
    K = np.zeros((size, size))
    C = np.zeros((size, size))
    M = np.diag([entry for mass, inertia, _ in blocks for entry in (mass, mass, inertia)])
    for k, place, below, above in springs:
        inverse_mass = sum(1 / blocks[i][0] for i in (below, above) if i is not None)
        critical = 2 * np.sqrt(k * 0.5 / inverse_mass)
        for direction, fraction in zip(np.eye(2), dashpots, strict=True):
            row = np.zeros(size)
            for i, sign in ((below, -1.0), (above, 1.0)):
                if i is not None:
                    x, y = np.subtract(place, blocks[i][2])
                    row[3 * i : 3 * i + 3] = sign * np.array([*direction, 0.0])
                    row[3 * i + 2] = sign * (x * direction[1] - y * direction[0])
            K += k * np.outer(row, row)
            C += fraction * critical * np.outer(row, row)
    step = 0.0
    upper = 2 / np.sqrt(eigh(K, M, eigvals_only=True)[-1])  # without dashpots
    for _ in range(60):  # bisection
        middle = 0.5 * (step + upper)
        largest = eigh(middle**2 * K + 2 * middle * C, M, eigvals_only=True)[-1]
        step, upper = (middle, upper) if largest < 4 else (step, middle)
    return step


class Stack:
    """Equilibrium of forces and moments, on linear springs.

    The settlement of 3e-5 m changes the water pressure by 1e-5 of it: stresses are tested to
    1e-4, displacements to 1e-9 m.
    """

    title = "stack"
    block_names = ("base", "stack 1", "stack 2")
    times = np.array([0.0, 0.01, 0.02])
    time_step = 2e-4
    width = 2.0
    low, high = 1.0, 0.5  # heights of the two blocks
    base_box = np.array([4.0, 1.0])
    base = np.array([1.0, -0.5])
    density = 2000.0
    g = 10.0
    water_weight = 9000.0
    left, right = 0.6, 0.2  # m, depths of the water at both sides
    pressure = 3e3  # Pa, in the seam
    bed = (1e9, 5e8)  # normal and shear stiffness, Pa/m
    seam = (2e9, 1e9)
    point = np.array([0.5, 0.5])
    files = ()
    text = (
        lines(title=title, gravity=[0.0, -g], thickness=THICKNESS, law="bed")
        + f"[laws.bed]\n{coulomb(0.3, *bed)}[laws.seam]\n{coulomb(0.5, *seam, pressure=pressure)}"
        + block("base", box=base_box, at=base, fixed=True)
        + "[[rock]]\n"
        + lines(name="stack", density=density, outline=[[0, 0], [2, 0], [2, 1.5], [0, 1.5]])
        + "[[rock.set]]\n"
        + lines(dip=0.0, spacing=5.0, through=[0.0, low], law="seam")
        + "[water]\n"
        + lines(table=[[0.0, left], [width, right]], unit_weight=water_weight)
        + "[monitor]\n"
        + lines(shear=[["stack 1", "base"]], joints=[[1.0, low]], points=[point])
        + f"[run]\nend = 0.02\nrecord = 0.01\nstep = {time_step}\n"
    )
    # per m of thickness: forces (N/m) on the lower block, and moments (N) about the middle of its
    # bottom, positive counter-clockwise
    weight_above = density * g * width * high
    push_left = water_weight * left**2 / 2
    push_right = water_weight * right**2 / 2
    uplift = water_weight * (left + right) / 2 * width
    normal = density * g * width * (low + high) - uplift
    shear = push_left - push_right
    overturning = (
        push_right * right / 3
        - push_left * left / 3
        + water_weight * (right - left) / width * width**3 / 12
    )
    # each corner bears half of the bottom; the pair of forces balances the moment
    stress_left = (normal + 2 * overturning / width) / width
    stress_right = (normal - 2 * overturning / width) / width
    shear_stress = shear / width
    seam_stress = weight_above / width - pressure
    closure = normal / width / bed[0]
    seam_closure = seam_stress / seam[0]
    slip = shear_stress / bed[1]
    rotation = (stress_left - stress_right) / bed[0] / width
    place_1 = np.array([width / 2 + slip - rotation * low / 2, low / 2 - closure])
    height_2 = low + high / 2
    place_2 = np.array([width / 2 + slip - rotation * height_2, height_2 - closure - seam_closure])
    stress_tolerance = 1e-4 * normal / width

    def energies(self, t):
        normal_energy = (self.stress_left**2 + self.stress_right**2) / self.bed[0] / 2
        normal_energy += 2 * self.seam_stress**2 / self.seam[0] / 2
        shear_energy = 2 * self.shear_stress**2 / self.bed[1] / 2
        half_width = self.width / 2
        stored = THICKNESS * half_width * (normal_energy + shear_energy)
        nothing = dict.fromkeys(
            ("kinetic", "potential", "friction", "dashpots", "discarded", "bolts", "external_work"),
            0.0,
        )
        return nothing | {"stored": stored, "turnover": stored}

    energy_tolerance = 1e-4

    def energy_error(self, t):
        return 0.0

    def monitors(self, t):
        displaced = self.place_1 - [1.0, 0.5]
        displaced += self.rotation * np.array([0.0, self.point[0] - 1.0])
        pa = self.stress_tolerance
        x, y = self.point + displaced
        return {
            "stack 1: base angle_deg": (0.0, ROUNDING),
            "stack 1: normal_Pa": (self.normal / self.width, pa),
            "stack 1: shear_Pa": (self.shear_stress, pa),
            "stack 1: closure_m": (self.closure, ROUNDING),
            "stack 1: slip_m": (self.slip, ROUNDING),
            "stack 1: sliding_fraction": (0.0, 0),
            "joint 1: normal_Pa": (self.seam_stress, pa),
            "joint 1: shear_Pa": (0.0, pa),
            "joint 1: closure_m": (self.seam_closure, ROUNDING),
            "joint 1: slip_m": (0.0, ROUNDING),
            "joint 1: sliding_fraction": (0.0, 0),
            "point 1: x_m": (x, ROUNDING),
            "point 1: y_m": (y, ROUNDING),
            "point 1: vx_m/s": (0.0, ROUNDING),
            "point 1: vy_m/s": (0.0, ROUNDING),
            "point 1: displacement_m": (np.hypot(*displaced), ROUNDING),
        }

    def blocks(self):
        x, y = np.transpose([self.base, self.place_1, self.place_2])
        still = ("displacement_m", "displacement_x_m", "displacement_y_m", "rotation_deg")
        return dict.fromkeys((*still, "speed_m/s"), zeros(3)) | {
            "x_m": (x, ROUNDING),
            "y_m": (y, ROUNDING),
            "largest_joint_slip_m": ([self.slip, self.slip, 0.0], ROUNDING),
            "unstable_at_start": zeros(3),
        }

    def cells(self):
        vectors = (np.zeros((3, 3)), ROUNDING)
        return {
            "block": ([0, 1, 2], 0),
            "displacement_m": vectors,
            "rotation_rad": zeros(3),
            "velocity_m/s": vectors,
            "spin_rad/s": zeros(3),
            "unstable": zeros(3),
        }

    def stresses(self):
        """Minus the sum of force times arm of the corners, over the area; symmetric part."""
        area = self.width * self.low
        force = np.array(
            [[-self.shear / 2, self.stress_left], [-self.shear / 2, self.stress_right]]
        )
        arm = np.array([[-1.0, -0.5], [1.0, -0.5]])
        of_top = np.array([[0.0, -self.seam_stress], [0.0, -self.seam_stress]])
        lower = -(force.T @ arm + of_top.T @ -arm[::-1]) / area
        upper = np.diag([0.0, self.seam_stress / 2])
        return [None, 0.5 * (lower + lower.T), upper], self.stress_tolerance

    def corners(self):
        lower = corners_of([self.width, self.low], self.place_1, self.rotation)
        upper = corners_of([self.width, self.high], self.place_2, self.rotation)
        return np.concatenate([corners_of(self.base_box, self.base), lower, upper]), ROUNDING

    def segments(self):
        left, middle, right = [0.0, 0.0], [1.0, 0.0], [2.0, 0.0]
        bottom = np.array([[left, middle], [middle, right]])
        return np.concatenate([bottom, bottom + np.array([0.0, self.low])]), 1e-4  # settlement

    def joints(self):
        stress = np.array([self.stress_left, self.stress_right, *[self.seam_stress] * 2])
        stiffness = np.repeat([self.bed[0], self.seam[0]], 2)
        pa = self.stress_tolerance
        return {
            "law": ([0, 0, 1, 1], 0),
            "closure_m": (stress / stiffness, ROUNDING),
            "shear_m": ([self.slip, self.slip, 0.0, 0.0], ROUNDING),
            "normal_stress_Pa": (stress, pa),
            "shear_stress_Pa": ([self.shear_stress, self.shear_stress, 0.0, 0.0], pa),
            "sliding": zeros(4),
            "slipping": zeros(4),
            "separated": zeros(4),
            "length_m": ([1.0] * 4, ROUNDING),
            "slip_rate_m/s": zeros(4),
            "state": zeros(4),
        }

    def summary(self):
        mass = THICKNESS * self.density * self.width * np.array([self.low, self.high])
        inertia = mass * (self.width**2 + np.array([self.low, self.high]) ** 2) / 12
        centroids = [[1.0, 0.5], [1.0, 1.25]]
        corner = THICKNESS * self.width / 2  # m2
        springs = [(corner * max(self.bed), [x, 0.0], None, 0) for x in (0.0, 2.0)]
        springs += [(corner * max(self.seam), [x, self.low], 0, 1) for x in (0.0, 2.0)]
        limit = critical_step(list(zip(mass, inertia, centroids, strict=True)), springs)
        sizes = np.sqrt(self.width * np.array([self.low, self.high]))
        settlement = np.hypot(*(self.place_2 - [1.0, 1.25]))
        return {
            "steps": 100,
            "time_step_limit_s": pytest.approx(limit, rel=1e-4),
            "time_step_margin": pytest.approx(limit / self.time_step, rel=1e-4),
            "equilibrium": "in equilibrium",
            "started_in_equilibrium": True,
            "unstable": [],
            "contact_points": 4,
            "joint_stresses": "effective",
            "slip": [],
            "bolts": [],
            "rocks": [
                {
                    "rock": "stack",
                    "state": "stable",
                    "blocks": 2,
                    "settlement_m": pytest.approx(settlement, rel=1e-4),
                    "displacement_m": pytest.approx(0.0, abs=ROUNDING),
                    "failed_blocks": 0,
                    "failure_displacement_m": pytest.approx(0.1 * np.sqrt(np.median(sizes**2))),
                    "creep_m_per_s": pytest.approx(0.0, abs=ROUNDING),
                }
            ],
        }


class Slide:
    """Newton: the acceleration is g (sin - mu cos) along the plane; normal forces balance friction.

    The block is drawn as it lies on its springs, and starts so fast that its joint slides after the
    first step; without a dashpot along the joint, which would act until then. Friction is missing
    in half a step, 1e-4 m/s of 0.5: tested to 1e-3.
    """

    title = "slide"
    block_names = ("base", "slider")
    times = np.array([0.0, 0.05, 0.1])
    time_step = 1e-4
    gravity = np.array([4.905, -8.4957])
    density = 2600.0  # default
    friction = 0.3
    stiffness = 1e9
    box = np.array([1.0, 0.5])
    base_box = np.array([4.0, 1.0])
    base = np.array([1.0, -0.5])
    speed = 0.5
    mass = THICKNESS * density * box.prod()
    stress = density * box[1] * -gravity[1]
    stress_left, stress_right = stress * (1 + friction * box[1] / box[0] * np.array([-1.0, 1.0]))
    rotation = (stress_left - stress_right) / stiffness / box[0]
    start = np.array([0.3, box[1] / 2 - stress / stiffness])
    acceleration = gravity[0] + friction * gravity[1]
    files = ()
    text = (
        lines(title=title, gravity=gravity, thickness=THICKNESS)
        + f"[laws.plain]\n{coulomb(friction, stiffness, stiffness)}"
        + block("base", box=base_box, at=base, fixed=True)
        + block("slider", box=box, at=start, angle=np.degrees(rotation), velocity=[speed, 0.0])
        + '[monitor]\nslip = [["slider", "base"]]\n[run]\nend = 0.1\nrecord = 0.05\n'
        + f"settle = false\nstep = {time_step}\ndashpot_shear = 0.0\n"
    )
    velocity_tolerance = 1e-3 * speed
    tolerance = 1e-3 * speed * 0.1  # of displacements (m)
    stress_tolerance = 1e-3 * stress

    def at(self, t):
        """Displacement (m) and velocity (m/s) along the plane."""
        return self.speed * t + 0.5 * self.acceleration * t**2, self.speed + self.acceleration * t

    def energies(self, t):
        slid, velocity = self.at(t)
        kinetic = 0.5 * self.mass * velocity**2
        fallen = self.mass * self.gravity[0] * slid
        springs = self.stress_left**2 + self.stress_right**2
        elastic_slip = self.friction * self.stress / self.stiffness
        if t > 0:
            springs *= 1 + self.friction**2
        stored = THICKNESS * self.box[0] / 2 * springs / self.stiffness / 2
        force = self.friction * THICKNESS * self.box[0] * self.stress
        return {
            "kinetic": kinetic,
            "potential": -fallen,
            "stored": stored,
            "friction": force * max(slid - elastic_slip, 0.0),
            "dashpots": 0.0,
            "discarded": 0.0,
            "bolts": 0.0,
            "external_work": 0.0,
            "turnover": 0.5 * self.mass * self.speed**2 + fallen,
        }

    energy_tolerance = 2e-3 * 0.5 * mass * speed**2

    def energy_error(self, t):
        """The law takes the shear stress at the end of the first step for the whole of it."""
        if t == 0:
            return 0.0
        slip = self.speed * self.time_step - self.friction * self.stress / self.stiffness
        force = self.friction * THICKNESS * self.box[0] * self.stress
        return 0.5 * force * slip / self.energies(t)["turnover"]

    def monitors(self, t):
        slid, _ = self.at(t)
        sliding = float(t > 0)
        pa = self.stress_tolerance
        return {
            "slider: base angle_deg": (np.degrees(np.arctan2(4.905, 8.4957)), ROUNDING),
            "slider: normal_Pa": (self.stress, pa),
            "slider: shear_Pa": (self.friction * self.stress * sliding, pa),
            "slider: closure_m": (
                self.stress / self.stiffness,
                1e-3 * self.stress / self.stiffness,
            ),
            "slider: slip_m": (slid, self.tolerance),
            "slider: sliding_fraction": (sliding, 0),
        }

    def blocks(self):
        slid, velocity = self.at(self.times[-1])
        return {
            "x_m": ([self.base[0], self.start[0] + slid], self.tolerance),
            "y_m": ([self.base[1], self.start[1]], 1e-7),
            "displacement_m": ([0.0, slid], self.tolerance),
            "displacement_x_m": ([0.0, slid], self.tolerance),
            "displacement_y_m": ([0.0, 0.0], 1e-7),
            "rotation_deg": ([0.0, 0.0], 1e-5),
            "speed_m/s": ([0.0, velocity], self.velocity_tolerance),
            "largest_joint_slip_m": ([slid, slid], self.tolerance),
            "unstable_at_start": ([0, 1], 0),
        }

    def cells(self):
        slid, velocity = self.at(self.times[-1])
        return {
            "block": ([0, 1], 0),
            "displacement_m": (in_space([[0.0, 0.0], [slid, 0.0]]), self.tolerance),
            "rotation_rad": ([0.0, 0.0], 2e-7),
            "velocity_m/s": (in_space([[0.0, 0.0], [velocity, 0.0]]), self.velocity_tolerance),
            "spin_rad/s": ([0.0, 0.0], self.velocity_tolerance),
            "unstable": ([0, 1], 0),
        }

    def stresses(self):
        mu = self.friction
        return [None, self.stress / 2 * np.array([[mu**2, -mu], [-mu, 1.0]])], self.stress_tolerance

    def corners(self):
        slid, _ = self.at(self.times[-1])
        slider = corners_of(self.box, self.start + np.array([slid, 0.0]), self.rotation)
        return np.concatenate([corners_of(self.base_box, self.base), slider]), self.tolerance

    def segments(self):
        slid, _ = self.at(self.times[-1])
        x = self.start[0] + slid
        left, middle, right = [x - 0.5, 0.0], [x, 0.0], [x + 0.5, 0.0]
        return np.array([[left, middle], [middle, right]]), self.tolerance

    def joints(self):
        slid, velocity = self.at(self.times[-1])
        stress = np.array([self.stress_left, self.stress_right])
        ones = np.ones(2)
        return {
            "law": zeros(2),
            "closure_m": (stress / self.stiffness, 1e-3 * self.stress / self.stiffness),
            "shear_m": (slid * ones, self.tolerance),
            "normal_stress_Pa": (stress, self.stress_tolerance),
            "shear_stress_Pa": (self.friction * stress, self.stress_tolerance),
            "sliding": (ones, 0),
            "slipping": (ones, 0),
            "separated": zeros(2),
            "length_m": (0.5 * ones, ROUNDING),
            "slip_rate_m/s": (velocity * ones, self.velocity_tolerance),
            "state": (2 * ones, 0),
        }

    def summary(self):
        slid, _ = self.at(self.times[-1])
        inertia = self.mass * (self.box**2).sum() / 12
        corner = THICKNESS * self.box[0] / 2 * self.stiffness
        springs = [(corner, [x, 0.0], None, 0) for x in (-0.2, 0.8)]
        limit = critical_step([(self.mass, inertia, [0.3, 0.25])], springs, (0.0, DASHPOT))
        weight = self.density * self.box[1] * np.hypot(*self.gravity)
        root = np.sqrt(self.speed**2 + 2 * self.acceleration * 2e-3)
        x, y = self.start
        return {
            "steps": 1000,
            "time_step_limit_s": pytest.approx(limit, rel=1e-4),
            "time_step_margin": pytest.approx(limit / self.time_step, rel=1e-4),
            "equilibrium": None,  # it was not searched
            "started_in_equilibrium": False,
            "unstable": [{"block": "slider", "x_m": pytest.approx(x), "y_m": pytest.approx(y)}],
            "contact_points": 2,
            "joint_stresses": "total",
            "slip": [
                {
                    "block": "slider",
                    "base": "base",
                    "law": "plain",
                    "slip_distance": 2e-3,
                    "slip_angle": pytest.approx(np.degrees(np.arctan2(4.905, 8.4957))),
                    # slip is looked for in every eighth step
                    "slip_time": pytest.approx(
                        (root - self.speed) / self.acceleration, abs=8 * self.time_step
                    ),
                    "slipped_before": False,
                    "predicted_angle": pytest.approx(np.degrees(np.arctan(self.friction))),
                    # of the block on a plane of that angle
                    "normal_stress": pytest.approx(
                        weight / np.sqrt(1 + self.friction**2), rel=1e-4
                    ),
                }
            ],
            "bolts": [],
            "rocks": [
                {
                    "rock": "blocks",
                    "state": "displacing",
                    "blocks": 1,
                    "settlement_m": pytest.approx(0.0, abs=ROUNDING),
                    "displacement_m": pytest.approx(slid, abs=self.tolerance),
                    "failed_blocks": 0,
                    "failure_displacement_m": pytest.approx(0.1 * np.sqrt(self.box.prod())),
                    "creep_m_per_s": pytest.approx(slid / 0.1, abs=self.velocity_tolerance),
                }
            ],
        }


class Anchored:
    """Equilibrium of a spring below and a bolt through the middle, which slackens with closure."""

    title = "anchored"
    block_names = ("base", "slab")
    times = np.array([0.0, 0.01, 0.02])
    time_step = 2e-4
    density = 2500.0
    g = 10.0
    box = np.array([2.0, 1.0])
    base_box = np.array([4.0, 1.0])
    base = np.array([1.0, -0.5])
    stiffness = 1e9
    bolt_stiffness = 4e8
    pretension = 6e4
    capacity = 2e5
    bolt_ends = np.array([[1.0, 0.75], [1.0, -0.75]])
    pressure = 2e4
    files = ()
    text = (
        lines(title=title, gravity=[0.0, -g], density=density, thickness=THICKNESS)
        + f"[laws.bed]\n{coulomb(0.5, stiffness, 5e8)}"
        + block("base", box=base_box, at=base, fixed=True)
        + block("slab", box=box, at=[1.0, 0.5])
        + "[[bolt]]\n"
        + lines(**{"from": bolt_ends[0], "to": bolt_ends[1]})
        + lines(stiffness=bolt_stiffness, capacity=capacity, pretension=pretension)
        + "[[pressure]]\n"
        + lines(**{"from": [0.0, 1.0], "to": [2.0, 1.0]}, value=pressure)
        + "[monitor]\n"
        + lines(convergence=[[[1.0, 1.0], [1.0, -0.5]]])
        + f"[run]\nend = 0.02\nrecord = 0.01\nstep = {time_step}\n"
    )
    mass = THICKNESS * density * box.prod()
    area = THICKNESS * box[0]
    closure = (mass * g + pressure * area + pretension) / (stiffness * area + bolt_stiffness)
    tension = pretension - bolt_stiffness * closure
    stress = stiffness * closure
    place = np.array([1.0, 0.5 - closure])

    energy_tolerance = 1e-4

    def energies(self, t):
        stored = self.area * self.stress**2 / self.stiffness / 2
        bolts = self.tension**2 / self.bolt_stiffness / 2
        nothing = dict.fromkeys(
            ("kinetic", "potential", "friction", "dashpots", "discarded", "external_work"), 0.0
        )
        return nothing | {"stored": stored, "bolts": bolts, "turnover": stored + bolts}

    def energy_error(self, t):
        return 0.0

    def monitors(self, t):
        return {
            "convergence 1: distance_m": (1.5 - self.closure, ROUNDING),
            "convergence 1: convergence_m": (self.closure, ROUNDING),
            "bolt 1: force_N": (self.tension, 1e-3),
            "bolt 1: elongation_m": (self.tension / self.bolt_stiffness, ROUNDING),
            "bolt 1: yielding_m": (0.0, 0),
        }

    def blocks(self):
        still = ("displacement_m", "displacement_x_m", "displacement_y_m", "rotation_deg")
        x, y = np.transpose([self.base, self.place])
        return dict.fromkeys((*still, "speed_m/s", "largest_joint_slip_m"), zeros(2)) | {
            "x_m": (x, ROUNDING),
            "y_m": (y, ROUNDING),
            "unstable_at_start": zeros(2),
        }

    def cells(self):
        vectors = (np.zeros((2, 3)), ROUNDING)
        return {
            "block": ([0, 1], 0),
            "displacement_m": vectors,
            "rotation_rad": zeros(2),
            "velocity_m/s": vectors,
            "spin_rad/s": zeros(2),
            "unstable": zeros(2),
        }

    def stresses(self):
        """Of the joint below, the pressure above, and the bolt at its end: force times arm."""
        arms = 0.5 * self.box[1] * (self.stress + self.pressure) * self.box[0]
        arms += self.tension / THICKNESS * (self.bolt_ends[0, 1] - 0.5)
        return [None, np.diag([0.0, arms / self.box.prod()])], 1.0

    def corners(self):
        corners = [corners_of(self.base_box, self.base), corners_of(self.box, self.place)]
        return np.concatenate(corners), ROUNDING

    def segments(self):
        left, middle, right = [0.0, 0.0], [1.0, 0.0], [2.0, 0.0]
        return np.array([[left, middle], [middle, right]]), 1e-4  # settlement

    def joints(self):
        ones = np.ones(2)
        return dict.fromkeys(
            ("law", "shear_m", "sliding", "slipping", "separated", "slip_rate_m/s", "state"),
            zeros(2),
        ) | {
            "closure_m": (self.closure * ones, ROUNDING),
            "normal_stress_Pa": (self.stress * ones, 1.0),
            "shear_stress_Pa": (0.0 * ones, 1.0),
            "length_m": (ones, ROUNDING),
        }

    def bolts(self):
        return {"tension_N": ([self.tension], 1e-3), "yielding_m": ([0.0], 0)}

    def summary(self):
        inertia = self.mass * (self.box**2).sum() / 12
        # the bolt acts along y, where the block vibrates more slowly than it rocks
        corner = self.stiffness * self.area / 2
        limit = critical_step(
            [(self.mass, inertia, [1.0, 0.5])], [(corner, [x, 0.0], None, 0) for x in (0.0, 2.0)]
        )
        return {
            "steps": 100,
            "time_step_limit_s": pytest.approx(limit, rel=1e-4),
            "time_step_margin": pytest.approx(limit / self.time_step, rel=1e-4),
            "equilibrium": "in equilibrium",
            "started_in_equilibrium": True,
            "unstable": [],
            "contact_points": 2,
            "joint_stresses": "total",
            "slip": [],
            "bolts": [
                {
                    "from": self.bolt_ends[0].tolist(),
                    "to": self.bolt_ends[1].tolist(),
                    "capacity_N": self.capacity,
                    "force_N": pytest.approx(self.tension, abs=1e-3),
                    "largest_force_N": pytest.approx(self.tension, abs=1e-3),
                    "yielding_m": 0.0,
                }
            ],
            "rocks": [
                {
                    "rock": "blocks",
                    "state": "stable",
                    "blocks": 1,
                    "settlement_m": pytest.approx(self.closure, rel=1e-6),
                    "displacement_m": pytest.approx(0.0, abs=ROUNDING),
                    "failed_blocks": 0,
                    "failure_displacement_m": pytest.approx(0.1 * np.sqrt(self.box.prod())),
                    "creep_m_per_s": pytest.approx(0.0, abs=ROUNDING),
                }
            ],
        }


SCENES = {scene.title: scene for scene in (Flight(), Stack(), Slide(), Anchored())}


@pytest.fixture(scope="module", params=SCENES)
def written(request, tmp_path_factory):
    """A scene and the folder that its run has written."""
    scene = SCENES[request.param]
    folder = tmp_path_factory.mktemp(scene.title)
    for name, text in ((f"{scene.title}.toml", scene.text), *scene.files):
        (folder / name).write_text(text)
    words = [str(folder / f"{scene.title}.toml"), "--no-pictures", "--vtk"]
    assert main([*words, "--out", str(folder / "out")]) == 0
    return scene, folder / "out"


def test_files_are_the_known_ones(written):
    """Each file is read by a test of this module."""
    scene, folder = written
    kinds = ["blocks", "joints"] + ["bolts"] * ("[[bolt]]" in scene.text)
    frames = [f"vtk/{kind}_{i:04d}.vtu" for kind in kinds for i in range(3)]
    tables = ["history.csv", "blocks.csv", "summary.json", *(f"vtk/{kind}.pvd" for kind in kinds)]
    actual = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert actual == {*frames, *tables, "state/state.npz"}
    for kind in kinds:
        listed = list(ElementTree.parse(folder / "vtk" / f"{kind}.pvd").iter("DataSet"))
        times = [float(entry.get("timestep")) for entry in listed]
        assert times == pytest.approx(scene.times, abs=1e-12)
        assert [entry.get("file") for entry in listed] == [f"{kind}_{i:04d}.vtu" for i in range(3)]


def test_every_column_of_history(written):
    scene, folder = written
    actual = columns(folder / "history.csv")
    np.testing.assert_allclose([float(t) for t in actual["time_s"]], scene.times, atol=1e-12)
    rows = [
        dict(zip(actual, map(float, row), strict=True))
        for row in zip(*actual.values(), strict=True)
    ]
    for t, row in zip(scene.times, rows, strict=True):
        energies = {f"{k}_J": (v, scene.energy_tolerance) for k, v in scene.energies(t).items()}
        expected = {"time_s": (t, ROUNDING), "energy_error": (scene.energy_error(t), 1e-6)}
        compare(row, expected | energies | scene.monitors(t), f"history.csv at {t:g} s")


def test_fractions_of_joints_by_their_names():
    """They are equal in the scenes above."""
    sim = Simulation(parse(Stack.text))
    fractions = assign_fractions(sim.joints)
    joints = _read_joints(sim)
    assert {name: {*joints[name]} for name in fractions} == {
        name: {value} for name, value in fractions.items()
    }


def test_every_column_of_blocks(written):
    scene, folder = written
    actual = columns(folder / "blocks.csv")
    assert actual.pop("block") == scene.block_names
    numbers = {name: [float(text) for text in texts] for name, texts in actual.items()}
    compare(numbers, scene.blocks(), "blocks.csv")


def test_every_field_of_blocks_in_vtk(written):
    """Principal stresses against the tensor: S v = s v, with the vector v = s e of the file."""
    scene, folder = written
    mesh = meshio.read(folder / "vtk" / "blocks_0002.vtu")
    assert not mesh.point_data
    actual = {name: np.concatenate(parts) for name, parts in mesh.cell_data.items()}
    first, second, along = (
        actual.pop(name) for name in ("stress_1_Pa", "stress_2_Pa", "along_stress_1_Pa")
    )
    compare(actual, scene.cells(), "blocks.vtu")
    tensors, tolerance = scene.stresses()
    for tensor, one, two, vector in zip(tensors, first, second, along, strict=True):
        if tensor is None:
            assert np.isnan([one, two]).all()
            continue
        np.testing.assert_allclose([two, one], np.linalg.eigvalsh(tensor), atol=tolerance)
        assert vector[2] == 0.0
        assert np.hypot(*vector[:2]) == pytest.approx(abs(one), abs=tolerance)
        np.testing.assert_allclose(
            tensor @ vector[:2], one * vector[:2], atol=2 * tolerance * abs(one)
        )
    points, tolerance = scene.corners()
    np.testing.assert_allclose(np.sort(mesh.points[:, 2]), 0.0)
    for cells in mesh.cells:
        assert cells.type == "polygon"
        for outline in cells.data:
            own = mesh.points[outline, :2]
            expected = points[outline]
            first = np.argmin(np.hypot(*(own - expected[0]).T))  # it may begin at any corner
            np.testing.assert_allclose(np.roll(own, -first, axis=0), expected, atol=tolerance)


def test_every_field_of_joints_in_vtk(written):
    scene, folder = written
    path = folder / "vtk" / "joints_0002.vtu"
    segments, tolerance = scene.segments()
    if not len(segments):  # meshio writes such a file, but does not read it
        (piece,) = ElementTree.parse(path).iter("Piece")
        assert piece.get("NumberOfCells") == "0"
        return
    mesh = meshio.read(path)
    (cells,) = mesh.cells
    assert cells.type == "line"
    ends = mesh.points[cells.data]
    assert (ends[..., 2] == 0.0).all()
    x, y = ends[..., :2].mean(axis=1).T
    order = np.lexsort([x, y.round(2)])
    ends = np.take_along_axis(ends, ends[..., :1].argsort(axis=1), axis=1)[order, :, :2]
    np.testing.assert_allclose(ends, segments, atol=tolerance)
    actual = {name: part[order] for name, (part,) in mesh.cell_data.items()}
    compare(actual, scene.joints(), "joints.vtu")


def test_every_field_of_bolts_in_vtk(written):
    scene, folder = written
    if "[[bolt]]" not in scene.text:
        return
    mesh = meshio.read(folder / "vtk" / "bolts_0002.vtu")
    (cells,) = mesh.cells
    assert cells.type == "line"
    ends = scene.bolt_ends - [[0.0, scene.closure], [0.0, 0.0]]
    np.testing.assert_allclose(mesh.points[cells.data], [in_space(ends)], atol=ROUNDING)
    compare({name: part for name, (part,) in mesh.cell_data.items()}, scene.bolts(), "bolts.vtu")


def test_every_key_of_summary(written):
    scene, folder = written
    actual = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
    assert 0 < actual.pop("wall_time_s") < np.inf
    energies = scene.energies(scene.times[-1])
    errors = [scene.energy_error(t) for t in scene.times]
    expected = scene.summary() | {
        "version": SUMMARY_VERSION,
        "scene": scene.title,
        "model_time_s": pytest.approx(scene.times[-1], abs=1e-12),
        "time_step_s": scene.time_step,
        "stage_start_s": [],
        "energy_J": {k: pytest.approx(v, abs=scene.energy_tolerance) for k, v in energies.items()},
        "energy_error": pytest.approx(errors[-1], abs=1e-6),
        "max_energy_error": pytest.approx(max(errors), abs=1e-6),
        "stopped": None,
        "files": ["history.csv", "blocks.csv"],
    }
    assert actual == expected
