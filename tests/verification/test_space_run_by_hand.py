"""Runs of blocks in space computed by hand: every number in their files, as in the plane.

flight    a block flies with spin about a principal axis under gravity and a load
resting   the slab of test_space_by_hand.py at rest on its springs
sliding   a thin plate under water is slowed down by friction

Velocities belong to half a step before the positions (at time 0: after). A column, field or key
without an expected value fails.
"""

import json
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import test_space_by_hand as overhang
from by_hand import assign_fractions, columns, compare
from scene_text import block, coulomb, lines

from dem_demo.cli import main
from dem_demo.output.run import SUMMARY_VERSION
from dem_demo.space import SpaceSimulation, parse
from dem_demo.space.record import read_joints

ROUNDING = 1e-9
TURNOVER = 1e-4  # relative: a sum over steps
MESHES = {"blocks", "contacts"}
NOTHING = np.zeros(3)
NO_ENERGY = dict.fromkeys(
    ("kinetic", "potential", "stored", "friction", "dashpots", "discarded", "bolts",
     "external_work", "turnover"),
    0.0,
)  # fmt: skip


class Flight:
    """Parabola of the centroid, constant spin about the y axis of the block."""

    title = "flight"
    names = ("ground", "flyer")
    end = 0.2
    time_step = 1e-3
    density = 2000.0
    box = np.array([0.8, 0.6, 0.5])
    start = np.array([3.0, 4.0, 5.0])
    ground_box = np.array([2.0, 1.5, 1.0])
    ground = np.array([-10.0, -12.0, -20.0])
    gravity = np.array([1.0, -0.5, -9.0])
    velocity = np.array([2.0, -1.5, 0.7])
    spin = np.array([0.0, 2.0, 0.0])
    load = np.array([720.0, -480.0, 240.0])
    arm = np.array([0.3, 0.2, -0.15])  # of the history point from the centroid
    text = (
        lines(title=title, gravity=gravity, density=density)
        + f"[laws.plain]\n{coulomb()}"
        + block("ground", box=ground_box, at=ground, fixed=True)
        + block("flyer", box=box, at=start, velocity=velocity, spin=spin, load=load)
        + f"[monitor]\n{lines(points=[start + arm])}"
        + f"[run]\nend = {end}\nrecord = 0.1\nstep = {time_step}\nskin = 0.05\n"
    )
    mass = density * box.prod()
    inertia = mass * (box[0] ** 2 + box[2] ** 2) / 12
    acceleration = gravity + load / mass
    energy_tolerance = 1e-6

    def energy_error(self, t):
        return 0.0

    def flown(self, t):
        return self.velocity * t + 0.5 * self.acceleration * t**2

    def velocity_at(self, t):
        return self.velocity + self.acceleration * abs(t - 0.5 * self.time_step)

    def energies(self, t):
        """Kinetic energy of the velocities half a step before and after. In the turnover the work
        of gravity counts without its sign: it is negative until the stone falls."""
        velocity = self.velocity + self.acceleration * t
        squares = velocity @ velocity - (0.5 * self.time_step) ** 2 * (self.acceleration**2).sum()
        rotating = 0.5 * self.inertia * self.spin @ self.spin
        fallen = self.mass * self.gravity @ self.flown(t)
        work = self.load @ self.flown(t)
        power = self.mass * self.gravity @ self.velocity  # at the start
        change = self.mass * self.gravity @ self.acceleration
        risen = power**2 / change / 2
        at_rest = 0.5 * self.mass * self.velocity @ self.velocity + rotating
        return NO_ENERGY | {
            "kinetic": 0.5 * self.mass * squares + rotating,
            "potential": -fallen,
            "external_work": work,
            "turnover": at_rest + (fallen + 2 * risen) * (t > 0) + work,
        }

    def turned(self, points, t):
        """Vectors (n, 3) of the block as drawn, turned as at a time (s)."""
        x, y, z = np.transpose(points)
        cosine, sine = np.cos(self.spin[1] * t), np.sin(self.spin[1] * t)
        return np.column_stack([cosine * x + sine * z, y, cosine * z - sine * x])

    def readings(self, t):
        """Columns of the history point."""
        (arm,) = self.turned([self.arm], t)
        place = self.start + self.flown(t) + arm
        velocity = self.velocity_at(t) + np.cross(self.spin, arm)
        values = dict(zip(("x_m", "y_m", "z_m"), place, strict=True))
        values |= dict(zip(("vx_m/s", "vy_m/s", "vz_m/s"), velocity, strict=True))
        values["displacement_m"] = np.linalg.norm(place - self.start - self.arm)
        return {f"point 1: {name}": value for name, value in values.items()}

    def motion(self):
        """Values of blocks.csv and blocks.vtu at the end."""
        flown = self.flown(self.end)
        return {
            "place": [self.ground, self.start + flown],
            "displacement": [NOTHING, flown],
            "rotation": [NOTHING, self.spin * self.end],
            "velocity": [NOTHING, self.velocity_at(self.end)],
            "spin": [NOTHING, self.spin],
            "slip": [0.0, 0.0],
            "unstable": [0, 1],
        }

    tolerance = ROUNDING

    def corners(self):
        """Corners (8, 3) of the flyer at the end, as a set of rows."""
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return self.start + self.flown(self.end) + self.turned(0.5 * signs * self.box, self.end)

    def summary(self):
        x, y, z = self.start
        displaced = np.linalg.norm(self.flown(self.end))
        size = np.cbrt(self.box.prod())
        return {
            "steps": 200,
            "time_step_limit_s": None,
            "time_step_margin": None,
            "equilibrium": "without equilibrium",
            "started_in_equilibrium": False,
            "unstable": [{"block": "flyer", "x_m": x, "y_m": y, "z_m": z}],
            "contact_points": 0,
            "joint_stresses": "total",
            "rocks": [
                {
                    "rock": "blocks",
                    "state": "failed",
                    "blocks": 1,
                    "settlement_m": pytest.approx(0.0, abs=ROUNDING),
                    "displacement_m": pytest.approx(displaced),
                    "failed_blocks": 1,
                    "failure_displacement_m": pytest.approx(0.1 * size),
                    "creep_m_per_s": pytest.approx(displaced / self.end),
                }
            ],
        }


class Resting:
    """Equilibrium of forces and moments, on linear springs at the corners of the contact."""

    title = "resting"
    names = ("base", "slab")
    end = 0.02
    time_step = 1e-4
    text = (
        lines(title=title, gravity=[0.0, 0.0, -overhang.G], seismic=overhang.SEISMIC, law="other")
        + f"[laws.other]\n{coulomb()}[laws.bed]\n{coulomb(0.5, overhang.NORMAL, overhang.SHEAR)}"
        + block("base", box=overhang.BASE, at=overhang.BASE_CENTRE, fixed=True)
        + block(
            "slab",
            box=overhang.SLAB,
            at=overhang.SLAB_CENTRE,
            density=overhang.DENSITY,
            load=overhang.LOAD,
        )
        + "[[joint]]\n"
        + lines(between=["base", "slab"], law="bed", rough=30.0)
        + f"[run]\nend = {end}\nrecord = 0.01\nstep = {time_step}\n"
    )
    tolerance = overhang.SECOND_ORDER * 6e-5
    energy_tolerance = 1e-4

    def energy_error(self, t):
        return 0.0

    def energies(self, t):
        springs = overhang.NORMAL * overhang.CLOSURE**2 / 2
        springs += overhang.SHEAR * (overhang.SLIP**2).sum(axis=1) / 2
        stored = springs.sum() * overhang.AREA / 4
        return NO_ENERGY | {"stored": stored, "turnover": stored}

    def motion(self):
        place = overhang.SLAB_CENTRE + overhang.DISPLACEMENT
        still = [NOTHING, NOTHING]
        return {
            "place": [overhang.BASE_CENTRE, place],
            **dict.fromkeys(("displacement", "rotation", "velocity", "spin"), still),
            "slip": [np.linalg.norm(overhang.SLIP, axis=1).max()] * 2,
            "unstable": [0, 0],
        }

    def corners(self):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        drawn = overhang.SLAB_CENTRE + 0.5 * signs * overhang.SLAB
        return drawn + overhang.displacement_of_slab(drawn)

    def summary(self):
        return {
            "steps": 200,
            "equilibrium": "in equilibrium",
            "started_in_equilibrium": True,
            "unstable": [],
            "contact_points": 4,
            "joint_stresses": "total",
            "rocks": [
                {
                    "rock": "blocks",
                    "state": "stable",
                    "blocks": 1,
                    "settlement_m": pytest.approx(
                        np.linalg.norm(overhang.DISPLACEMENT), abs=self.tolerance
                    ),
                    "displacement_m": pytest.approx(0.0, abs=ROUNDING),
                    "failed_blocks": 0,
                    "failure_displacement_m": pytest.approx(0.1 * np.cbrt(overhang.SLAB.prod())),
                    "creep_m_per_s": pytest.approx(0.0, abs=1e-6),
                }
            ],
        }


class Sliding:
    """A thin plate under water slides until friction has slowed it down.

    The effective weight carries the friction. Water pressure is larger below the plate than above
    by its height. The plate is drawn as it lies on its springs, and starts so fast that its joint
    slides after the first step. The moment of friction about the centroid, of half the height of
    4 mm, changes stresses at the corners by 0.2 %.
    """

    title = "sliding"
    names = ("base", "plate")
    end = 0.1
    time_step = 1e-4
    density = 2600.0  # default
    friction = 0.3
    stiffness = 1e7
    water_weight = 9000.0
    box = np.array([1.0, 0.8, 0.004])
    base = np.array([0.0, 0.0, -0.5])
    direction = np.array([0.6, 0.8, 0.0])
    speed = 0.5
    mass = density * box.prod()
    area = box[0] * box[1]
    stress = (density * 10.0 - water_weight) * box[2]  # effective
    closure = stress / stiffness
    start = np.array([0.2, -0.3, box[2] / 2 - closure])
    acceleration = -friction * stress * area / mass
    elastic_slip = friction * stress / stiffness
    text = (
        lines(title=title, gravity=[0.0, 0.0, -10.0])
        + f"[laws.bed]\n{coulomb(friction, stiffness, stiffness)}"
        + block("base", box=[6.0, 6.0, 1.0], at=base, fixed=True)
        + block("plate", box=box, at=start, velocity=speed * direction)
        + "[water]\n"
        + lines(table=[[0.0, 0.0, 2.0]], unit_weight=water_weight)
        + f"[run]\nend = {end}\nrecord = 0.05\nsettle = false\nstep = {time_step}\n"
        + "dashpot_shear = 0.0\nskin = 0.002\n"
    )
    # the shear stress is zero at the start: friction misses half a step, after which the elastic
    # slip of 2 um counts as sliding
    start_speed = speed - 0.5 * time_step * acceleration
    tolerance = 2e-6  # m, and degrees: the moment of friction tilts the plate by 2e-8 rad
    energy_tolerance = 2e-3 * 0.5 * mass * speed**2
    stress_tolerance = 4e-3 * stress

    def at(self, t):
        """Displacement (m), and velocity (m/s) half a step before, in the direction of sliding."""
        slid = self.start_speed * t + 0.5 * self.acceleration * t**2
        return slid, self.start_speed + self.acceleration * (t - 0.5 * self.time_step)

    def energies(self, t):
        slid, velocity = self.at(t)
        force = self.friction * self.stress * self.area
        stored = self.stress * self.closure / 2 * self.area
        return NO_ENERGY | {
            "kinetic": 0.5 * self.mass * velocity**2,
            "stored": stored * (1 + self.friction**2 * (t > 0)),
            "friction": force * max(slid - self.elastic_slip, 0.0),
            "turnover": 0.5 * self.mass * self.speed**2 + stored,
        }

    def energy_error(self, t):
        """The law takes the shear stress at the end of the first step for the whole of it."""
        slip = self.speed * self.time_step - self.elastic_slip
        force = self.friction * self.stress * self.area
        return 0.5 * force * slip / self.energies(t)["turnover"] if t > 0 else 0.0

    def motion(self):
        slid, velocity = self.at(self.end)
        flown = slid * self.direction
        return {
            "place": [self.base, self.start + flown],
            "displacement": [NOTHING, flown],
            "rotation": [NOTHING, NOTHING],
            "velocity": [NOTHING, velocity * self.direction],
            "spin": [NOTHING, NOTHING],
            "slip": [slid, slid],
            "unstable": [0, 0],
        }

    def corners(self):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return self.start + self.at(self.end)[0] * self.direction + 0.5 * signs * self.box

    def contacts(self):
        """Fields of contacts.vtu at the four corners of the plate."""
        ones = np.ones(4)
        return {
            "closure_m": (self.closure * ones, 4e-3 * self.closure),
            "shear_m": (self.at(self.end)[0] * ones, self.tolerance),
            "normal_stress_Pa": (self.stress * ones, self.stress_tolerance),
            "shear_stress_Pa": (
                [self.friction * self.stress * self.direction] * 4, self.stress_tolerance
            ),
            "normal": ([[0.0, 0.0, -1.0]] * 4, 1e-6),
            "axis_2": ([[0.0, 1.0, 0.0]] * 4, 1e-6),
            "area_m2": (self.area / 4 * ones, 1e-9),
            "sliding": (ones, 0),
            "slipping": (ones, 0),
            "separated": (0 * ones, 0),
        }  # fmt: skip

    def summary(self):
        slid, _ = self.at(self.end)
        near = pytest.approx(slid, abs=self.tolerance)
        return {
            "steps": 1000,
            "equilibrium": None,
            "started_in_equilibrium": True,
            "unstable": [],
            "contact_points": 4,
            "joint_stresses": "effective",
            "rocks": [
                {
                    "rock": "blocks",
                    "state": "failed",
                    "blocks": 1,
                    "settlement_m": pytest.approx(0.0, abs=ROUNDING),
                    "displacement_m": near,
                    "failed_blocks": 1,
                    "failure_displacement_m": pytest.approx(0.1 * np.cbrt(self.box.prod())),
                    "creep_m_per_s": pytest.approx(slid / self.end, rel=1e-2),
                }
            ],
        }


SCENES = {scene.title: scene for scene in (Flight(), Resting(), Sliding())}


@pytest.fixture(scope="module", params=SCENES)
def written(request, tmp_path_factory):
    """A scene and the folder that its run has written."""
    scene = SCENES[request.param]
    folder = tmp_path_factory.mktemp(scene.title)
    path = folder / f"{scene.title}.toml"
    path.write_text(scene.text)
    assert main([str(path), "--no-pictures", "--vtk", "--out", str(folder / "out")]) == 0
    return scene, folder / "out"


def test_files_are_the_known_ones(written):
    scene, folder = written
    actual = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    frames = {f"vtk/{kind}_{i:04d}.vtu" for kind in MESHES for i in range(3)}
    lists = {f"vtk/{kind}.pvd" for kind in MESHES}
    assert (
        actual == {"history.csv", "blocks.csv", "summary.json", "state/state.npz"} | frames | lists
    )
    for kind in MESHES:
        entries = list(ElementTree.parse(folder / "vtk" / f"{kind}.pvd").iter("DataSet"))
        times = [float(entry.get("timestep")) for entry in entries]
        assert times == pytest.approx([0.0, scene.end / 2, scene.end], abs=1e-12)
        assert [entry.get("file") for entry in entries] == [f"{kind}_{i:04d}.vtu" for i in range(3)]


def test_every_column_of_history(written):
    scene, folder = written
    actual = columns(folder / "history.csv")
    rows = [
        dict(zip(actual, map(float, row), strict=True))
        for row in zip(*actual.values(), strict=True)
    ]
    assert len(rows) == 3
    for t, row in zip((0.0, scene.end / 2, scene.end), rows, strict=True):
        energies = scene.energies(t)
        expected = {
            f"{name}_J": (value, scene.energy_tolerance) for name, value in energies.items()
        }
        expected["turnover_J"] = energies["turnover"], TURNOVER * energies["turnover"]
        error = scene.energy_error(t)
        expected |= {"time_s": (t, ROUNDING), "energy_error": (error, ROUNDING + 1e-3 * error)}
        readings = getattr(scene, "readings", lambda t: {})(t)
        expected |= {name: (value, ROUNDING) for name, value in readings.items()}
        compare(row, expected, f"history.csv at {t:g} s")


def test_fractions_of_joints_by_their_names():
    """They are equal in the scenes above."""
    sim = SpaceSimulation(parse(Resting.text))
    fractions = assign_fractions(sim.joints)
    joints = read_joints(sim)
    assert {name: [*joints[name]] for name in fractions} == {
        name: 4 * [value] for name, value in fractions.items()
    }


def test_every_column_of_blocks(written):
    scene, folder = written
    actual = columns(folder / "blocks.csv")
    assert actual.pop("block") == scene.names
    motion = {name: np.array(values) for name, values in scene.motion().items()}
    expected = {
        "displacement_m": (np.linalg.norm(motion["displacement"], axis=1), scene.tolerance),
        "largest_joint_slip_m": (motion["slip"], scene.tolerance),
        "unstable_at_start": (motion["unstable"], 0),
    }
    for title, name in (
        ("{}_m", "place"), ("displacement_{}_m", "displacement"), ("rotation_{}_deg", "rotation"),
        ("velocity_{}_m/s", "velocity"), ("spin_{}_rad/s", "spin"),
    ):  # fmt: skip
        values = np.degrees(motion[name]) if "deg" in title else motion[name]
        for i, axis in enumerate("xyz"):
            expected[title.format(axis)] = values[:, i], max(scene.tolerance, 1e-8)
    compare(
        {name: np.array(texts, float) for name, texts in actual.items()}, expected, "blocks.csv"
    )


def test_every_field_of_blocks_in_vtk(written):
    scene, folder = written
    mesh = meshio.read(folder / "vtk" / "blocks_0002.vtu")
    assert not mesh.point_data
    actual = {name: np.concatenate(parts) for name, parts in mesh.cell_data.items()}
    motion = scene.motion()
    tolerance = max(scene.tolerance, 1e-8)
    expected = {
        "block": ([0, 1], 0),
        "displacement_m": (motion["displacement"], tolerance),
        "rotation_rad": (motion["rotation"], tolerance),
        "velocity_m/s": (motion["velocity"], tolerance),
        "spin_rad/s": (motion["spin"], tolerance),
        "fixed": ([1, 0], 0),
        "unstable": (motion["unstable"], 0),
    }
    compare(actual, expected, "blocks.vtu")
    distance = np.linalg.norm(mesh.points[8:16, None] - scene.corners(), axis=-1)
    assert {*distance.argmin(axis=0).tolist()} == {*range(8)}
    assert distance.min(axis=0).max() < tolerance


def test_every_field_of_contacts_in_vtk(written):
    scene, folder = written
    path = folder / "vtk" / "contacts_0002.vtu"
    if isinstance(scene, Flight):  # meshio does not read a file without cells
        (piece,) = ElementTree.parse(path).iter("Piece")
        assert piece.get("NumberOfCells") == piece.get("NumberOfPoints") == "0"
        return
    mesh = meshio.read(path)
    order = np.lexsort(mesh.points[:, :2].round(3).T)
    actual = {name: values[order] for name, values in mesh.point_data.items()}
    cells = {name: np.concatenate(parts) for name, parts in mesh.cell_data.items()}
    if isinstance(scene, Sliding):
        compare(actual, scene.contacts(), "points of contacts.vtu")
        expected = {"block_a": ([0], 0), "block_b": ([1], 0), "law": ([0], 0)}
        compare(cells, expected | {"contact_area_m2": (scene.area, 1e-9)}, "cells of contacts.vtu")
        return
    np.testing.assert_allclose(mesh.points[order], overhang.CORNERS, rtol=0, atol=1e-4)
    ones = np.ones(4)
    close = overhang.close
    expected = {
        "closure_m": close(overhang.CLOSURE, 4e-5),
        "shear_m": close(np.linalg.norm(overhang.SLIP, axis=1), 2e-4),
        "normal_stress_Pa": close(overhang.NORMAL * overhang.CLOSURE, 4e4),
        "shear_stress_Pa": close(overhang.SHEAR * overhang.SLIP, 1e5),
        "normal": ([[0.0, 0.0, -1.0]] * 4, 1e-4),
        "axis_2": ([overhang.ROUGH] * 4, 1e-4),
        "area_m2": (overhang.AREA / 4 * ones, 1e-4),
        "sliding": (0 * ones, 0),
        "slipping": (0 * ones, 0),
        "separated": (0 * ones, 0),
    }
    compare(actual, expected, "points of contacts.vtu")
    expected = {
        "block_a": ([0], 0),
        "block_b": ([1], 0),
        "law": ([1], 0),
        "contact_area_m2": (overhang.AREA, 1e-4),
    }
    compare(cells, expected, "cells of contacts.vtu")


def test_every_key_of_summary(written):
    scene, folder = written
    actual = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
    assert 0 < actual.pop("wall_time_s") < np.inf
    energies = scene.energies(scene.end)
    turnover = pytest.approx(energies.pop("turnover"), rel=TURNOVER)
    assert actual["energy_J"].pop("turnover") == turnover
    error = scene.energy_error(scene.end)
    energy_error = pytest.approx(error, rel=1e-3, abs=ROUNDING)
    expected = scene.summary() | {
        "version": SUMMARY_VERSION,
        "scene": scene.title,
        "model_time_s": pytest.approx(scene.end, abs=1e-12),
        "time_step_s": scene.time_step,
        "stage_start_s": [],
        "energy_J": {k: pytest.approx(v, abs=scene.energy_tolerance) for k, v in energies.items()},
        "energy_error": energy_error,
        "max_energy_error": energy_error,
        "stopped": None,
        "slip": [],
        "bolts": [],
        "files": ["history.csv", "blocks.csv"],
    }
    if not isinstance(scene, Flight):  # of the six motions of one block on four springs
        expected |= {name: actual[name] for name in ("time_step_limit_s", "time_step_margin")}
        assert actual["time_step_margin"] == pytest.approx(
            actual["time_step_limit_s"] / scene.time_step
        )
    assert actual == expected
