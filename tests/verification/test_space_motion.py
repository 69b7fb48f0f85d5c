"""Motion of blocks in space: sliding, the law alone on an incline, seams, walls, free flight, saved
states."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scene_text import ROCK, block, coulomb, dipping, lines
from scipy.special import ellipj

from dem_demo import Simulation
from dem_demo.contact import tabulate_first_loading
from dem_demo.space import SpaceSimulation, parse
from dem_demo.space.record import read_monitors

FRICTION = 0.6  # carries a block up to 30.964 degrees
GRAVITY = 9.81


def inclined(degrees, azimuth=0.0):
    """Gravity (m/s2) in the frame of an incline that dips towards an azimuth (rad) from x."""
    dip = np.radians(degrees)
    down = np.sin(dip) * np.array([np.cos(azimuth), np.sin(azimuth)])
    return GRAVITY * np.array([*down, -np.cos(dip)])


def block_on_bed(gravity, law, end, size=(1.0, 1.0, 0.2), bed=None, run="", at=None):
    """A block on a fixed bed whose top is z = 0."""
    text = lines(gravity=gravity) + f"[laws.rock]\n{law}"
    for number, (low, high) in enumerate(bed or [(-4.0, 8.0)]):
        middle = [0.5 * (low + high), 0.0, -0.5]
        text += block(f"bed {number}", box=[high - low, 8.0, 1.0], at=middle, fixed=True)
    text += block("block", box=size, at=at or [0.0, 0.0, 0.5 * size[2]])
    return f"{text}[run]\nend = {end}\n{run}"


def run_to(sim, end):
    """Advance a simulation to a time (s)."""
    while sim.time < end - 0.5 * sim.dt:
        sim.step()


@pytest.mark.parametrize("azimuth", [0.0, 0.9])
@pytest.mark.parametrize(
    ("degrees", "end", "tolerance"),
    [(30.96, 0.3, 0.0), (30.97, 1.0, 3e-3), (32.0, 0.4, 1e-4), (45.0, 0.3, 1e-4)],
)
def test_coulomb_block_on_an_incline(degrees, azimuth, end, tolerance):
    """A block stands up to atan(0.6) = 30.964 degrees; beyond it slides down the dip line by
    g (sin - 0.6 cos) t^2/2, while its contact is renewed every millimetre."""
    sim = SpaceSimulation(parse(block_on_bed(inclined(degrees, azimuth), coulomb(FRICTION), end)))
    start = sim.blocks.motion[:3, -1].copy()
    run_to(sim, end)
    path = sim.blocks.motion[:3, -1] - start
    dip = np.radians(degrees)
    slope = max(np.sin(dip) - FRICTION * np.cos(dip), 0.0)
    expected = 0.5 * GRAVITY * slope * sim.time**2
    down = np.array([np.cos(azimuth), np.sin(azimuth)])
    assert path[:2] @ down == pytest.approx(expected, rel=tolerance, abs=1e-9)
    assert path[:2] @ [-down[1], down[0]] == pytest.approx(0.0, abs=1e-6 * expected + 1e-12)
    assert abs(sim.energy_balance.error) < 1e-5


ROUGH = """\
from = "jing-replica"
mating_length = 2e-3
closure_range = 2e-5
resolution = "balanced"
"""


def slide_of_the_law(sim, law, gravity, steps):
    """Path (steps, 3) of a point mass on one joint of the law and the same dashpots as a block on
    its four contact points, from the state of a simulation at time 0."""
    blocks = sim.blocks
    area = sim.contacts.area.sum()
    mass = blocks.inertia[1, 0]
    directions = sim.contacts.directions[0] * [[1.0], [-1.0], [-1.0]]  # of closure, shears by it
    share = sim.contacts.area / area
    curve = tabulate_first_loading(law)
    joint = law.joints(1)
    joint.update((share @ sim.joints.delta)[None], tangent=False)
    velocity = blocks.velocity[:3, 1].copy()
    place = np.zeros(3)
    path = []
    for _ in range(steps):
        place = place + sim.dt * velocity
        rates = directions @ velocity
        joint.update(sim.dt * rates[None], tangent=False)
        traction = joint.F[0]
        _, slipping, separated, _ = joint.measures()[:4]
        stick = max(1.0 - slipping[0] - separated[0], 0.0)
        stiffness = np.interp(traction[0], curve["stress"], curve["stiffness"]) * area / 4
        critical = 8.0 * np.sqrt(stiffness * 0.5 * mass)  # of four points
        dashpot = 0.05 * critical * rates * [1.0, stick, stick]
        force = area * traction + dashpot
        velocity = velocity + sim.dt * (gravity - directions.T @ force / mass)
        path.append(place)
    return np.array(path)


def thin_block(height, gravity, law, end, fraction):
    """Scene of a block on a bed whose axis 2 is along x, at the same stress for any height (m)."""
    run = f"fraction = {fraction}\nskin = 0.02\nmax_overlap = 0.9\n"
    text = block_on_bed(gravity, law, end, (1.0, 1.0, height), run=run)
    scene = parse(f"rough = -90.0\n{text}")
    thin = replace(scene.blocks[1], density=520.0 / height)
    return replace(scene, blocks=(scene.blocks[0], thin))


@pytest.mark.slow
def test_thin_rough_block_slides_as_its_law_alone():
    """A block on a joint whose rough direction is at 45 degrees to the dip line veers, by the law
    alone: the difference falls with the square of the height, to 1e-7 of the path at 1 mm, at any
    time step. The forces act at the bottom of the block and the weight half a height above."""
    gravity = inclined(56.0, np.pi / 4)
    differences = {}
    for height, fraction in ((0.02, 0.15), (4e-3, 0.15), (1e-3, 0.15), (1e-3, 0.3)):
        scene = thin_block(height, gravity, ROUGH, 0.25, fraction)
        sim = SpaceSimulation(scene)
        steps = round(0.25 / sim.dt)
        alone = slide_of_the_law(sim, scene.laws["rock"], gravity, steps)
        start = sim.blocks.motion[:3, 1].copy()
        azimuths = {}
        for i in range(steps):
            sim.step()
            path = sim.blocks.motion[:3, 1] - start
            if i in (steps // 25, steps - 1):
                azimuths[i] = np.degrees(np.arctan2(path[1], path[0]))
        length = np.linalg.norm(path)
        differences[height, fraction] = np.linalg.norm(path - alone[-1]) / length
        assert length > 0.05
        early, late = azimuths.values()
        assert 42.5 < early < 43.9 < late < 44.9  # rougher along axis 3, as c < 0
    assert differences[0.02, 0.15] < 1e-4
    assert differences[4e-3, 0.15] < 4e-6
    assert differences[1e-3, 0.15] < 2e-7
    ratio = differences[4e-3, 0.15] / differences[1e-3, 0.15]
    assert ratio == pytest.approx(16.0, rel=0.1)
    assert differences[1e-3, 0.3] == pytest.approx(differences[1e-3, 0.15], rel=0.1)


def test_a_block_at_rest_veers_most_in_its_first_slip():
    """A block at rest on 10 degrees, whose slope is at 55 degrees from one moment on, its dip line
    at 45 degrees to axis 2: its displacement has an azimuth of 39 degrees at 0.2 mm, where the
    joint is loaded for the first time, and 42.7 degrees at 1.5 mm. A block that has settled on a
    slope of 56 degrees has a slip of 0.3 mm towards 43 degrees behind it, and goes on there."""
    law = 'from = "jing-replica"\nmating_length = 2e-3\nresolution = {u = 3, phi = 6, depth = 3}\n'
    tilts = {}
    for settled, slope in ((10.0, 55.0), (56.0, 56.0)):
        gravity = inclined(slope, np.pi / 4)
        sim = SpaceSimulation(thin_block(0.02, inclined(settled, np.pi / 4), law, 0.2, 0.5))
        change = gravity - inclined(settled, np.pi / 4)
        sim.blocks.gravity[1, :3] += sim.blocks.inertia[1, 0] * change
        sim.blocks.velocity[:3, 1] += 0.5 * sim.dt * change
        start = sim.blocks.motion[:2, 1].copy()
        tilts[settled] = [np.hypot(*start), np.degrees(np.arctan2(*start[::-1]))]
        for distance in (0.2e-3, 1.5e-3):
            displacement = start * 0.0
            while np.hypot(*displacement) < distance:
                sim.step()
                displacement = sim.blocks.motion[:2, 1] - start
            tilts[settled].append(np.degrees(np.arctan2(displacement[1], displacement[0])))
    slipped, _, first, later = tilts[10.0]
    assert slipped < 5e-6
    assert 38.8 < first < 39.4
    assert 42.4 < later < 43.0
    slipped, azimuth, first, later = tilts[56.0]
    assert 2e-4 < slipped < 5e-4
    assert [azimuth, first, later] == pytest.approx([43.2, 43.2, 43.1], abs=0.3)


@pytest.mark.parametrize(
    ("cuts", "end"), [((0.6,), 0.42), pytest.param((0.31, 0.63, 1.4), 0.6, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("rough", [False, True], ids=["coulomb", "rough"])
def test_block_that_crosses_joints_of_its_bed(rough, cuts, end):
    """A block that slides obliquely over the seams of its bed, beside the same on one plate.

    Coulomb: the same path. A rough block keeps its dilation over a seam that it reaches in the run.
    """
    law = ROCK.replace("a = 3.0", "a = 3.0, b = -1.0, c = 0.3") if rough else coulomb(0.6, 2e9, 1e9)
    gravity = inclined(47.0 if rough else 38.0, 0.35)
    paths, lifts = [], []
    for edges in ((), cuts):
        ends = [-2.0, *edges, 8.0]
        bed = list(pairwise(ends))
        run = "fraction = 0.15\n"
        text = block_on_bed(gravity, law, end, (1.0, 1.0, 0.3), bed, run)
        sim = SpaceSimulation(parse(f"rough = 0.0\n{text}"))
        start = sim.blocks.motion[:3, -1].copy()
        run_to(sim, end)
        path = sim.blocks.motion[:3, -1] - start
        paths.append(path / sim.time**2)
        lifts.append(path[2])
        assert abs(sim.energy_balance.error) < 1e-4
        assert any(0.5 < cut < 0.5 + path[0] for cut in cuts)  # the block reaches a seam
    difference = np.linalg.norm(paths[1] - paths[0]) / np.linalg.norm(paths[0])
    if not rough:
        assert difference < 1e-4
    elif cuts == (0.6,):
        assert difference < 1e-3
        assert lifts[1] == pytest.approx(lifts[0], rel=2e-2)


def wall(wide, high, law, run, gap=0.0):
    """A dry wall of bricks 0.6 m wide in half-brick bond, `gap` (m) above the ground."""
    text = f"rough = 0.0\n[laws.rock]\n{law}"
    text += block("ground", box=[0.6 * wide + 2, 2.0, 0.5], at=[0.3 * wide, 0, -0.25], fixed=True)
    for row in range(high):
        for i in range(wide - row % 2):
            at = [0.6 * i + 0.3 + 0.3 * (row % 2), 0.0, 0.3 * row + 0.15 + gap]
            text += block(f"brick {row} {i}", box=[0.6, 0.3, 0.3], at=at)
    return SpaceSimulation(parse(f"{text}[run]\n{run}"))


WALL = coulomb(0.6, 2e9, 1e9)


@pytest.mark.slow
@pytest.mark.parametrize("law", [WALL, ROCK], ids=["coulomb", "rough"])
def test_297_bricks_stand(law):
    sim = wall(17, 18, law, "end = 0.02\n")
    assert len(sim.blocks.names) == 298
    start = sim.blocks.motion[:3].copy()
    run_to(sim, 0.02)
    assert np.abs(sim.blocks.motion[:3] - start).max() < 1e-8
    assert sim.verdict == "in equilibrium"
    assert abs(sim.energy_balance.error) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("law", [WALL, ROCK], ids=["coulomb", "rough"])
@pytest.mark.parametrize(("wide", "high", "moving"), [(5, 6, 0.02), (17, 18, 0.1)])
def test_dropped_bricks_keep_the_balance_of_energy(wide, high, moving, law):
    """Walls of 27 and 297 bricks fall by 1 mm on the ground. After 0.3 s the kinetic energy is at
    most a share of the energy of the dashpots; the higher wall still sways on its joints."""
    sim = wall(wide, high, law, "end = 0.3\nsettle = false\n", gap=1e-3)
    start = sim.blocks.motion[:3].copy()
    errors = []
    while sim.time < 0.3:
        sim.step()
        errors.append(sim.energy_balance.error)
    assert np.abs(errors).max() < 3e-4
    fallen = sim.blocks.motion[2] - start[2]
    assert (fallen[1:] < -9e-4).all()
    assert sim.energy_balance.value["kinetic"] < moving * sim.energy_balance.value["dashpots"]


def driven(drive, end, load=(0.0, 0.0, 0.0), more="", tilt=0.0):
    """A slab on a base that drives may move; 255 kg/m2, so 2503 Pa on the joint.

    tilt (degrees): of gravity, as if the base dipped towards x."""
    text = lines(gravity=inclined(tilt)) + f"[laws.rock]\n{coulomb(FRICTION)}"
    text += block("base", box=[6.0, 3.0, 1.0], at=[0.0, 0.0, -0.5], fixed=True)
    text += block("slab", box=[1.0, 0.8, 0.1], at=[0.3, 0.2, 0.05], load=load)
    return SpaceSimulation(parse(f"{text}{drive}{more}[run]\nend = {end}\n"))


def test_base_that_tilts_lets_a_slab_slip_at_its_friction_angle():
    """A drive rotates a base that dips at 30.5 degrees further about y; the slab slips at 30.964
    degrees and a little later, as the base goes on."""
    drive = '[[drive]]\nblock = "base"\nmotion = "turn_y"\n'
    sim = driven(f"{drive}times = [0, 0.12]\nvalues = [0, 1]\n", 0.12, tilt=30.5)
    angle = 0.0
    while sim.shear_displacement(1, 0) < 1e-5 and sim.time < 0.12:
        sim.step()
        turned = sim.blocks.axes[0] @ sim.initial_axes[0].T
        angle = 30.5 + np.degrees(np.arctan2(turned[0, 2], turned[2, 2]))
    assert np.degrees(np.arctan(FRICTION)) - 0.03 < angle < 31.3
    assert turned[1] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert abs(sim.energy_balance.error) < 1e-5


def test_shaken_base_displaces_a_slab_as_newmark_s_block():
    """A sine of 8 m/s2 along x, more than the friction of 5.89 m/s2: the slab slides as a rigid
    block on a rigid base with Coulomb friction."""
    end = 0.35
    sine = "sine = { acceleration = 8.0, frequency = 4.0, cycles = 1 }\n"
    sim = driven(f'[[drive]]\nmotion = "x"\n{sine}', end)
    start = sim.blocks.motion[:2].copy()
    base = sim.scene.drives[0]
    limit = FRICTION * GRAVITY
    dt = 2e-5
    velocity = 0.0
    relative = 0.0
    for i in range(round(end / dt)):
        of_base = (base((i + 1) * dt) - base(i * dt)) / dt
        velocity += np.clip(of_base - velocity, -limit * dt, limit * dt)
        relative += (velocity - of_base) * dt
    run_to(sim, end)
    slid = (sim.blocks.motion[0] - start[0]) @ [-1.0, 1.0]
    assert relative < -2e-3
    assert slid == pytest.approx(relative, rel=5e-3)
    assert abs(sim.energy_balance.error) < 1e-4


def test_constant_force_and_constant_velocity():
    """A load beyond friction accelerates the slab; a drive that pulls it at a constant velocity
    does the work of friction."""
    mass = 2600.0 * 0.08
    sim = driven("", 0.15, load=[0.8 * mass * GRAVITY, 0.0, 0.0])
    start = sim.blocks.motion[0, 1]
    run_to(sim, 0.15)
    expected = 0.5 * (0.8 - FRICTION) * GRAVITY * sim.time**2
    assert sim.blocks.motion[0, 1] - start == pytest.approx(expected, rel=1e-3)
    pull = '[[drive]]\nblock = "slab"\nmotion = "y"\ntimes = [0, 1]\nvalues = [0, 0.05]\n'
    points = "[monitor]\npoints = [[0.3, 0.2, 0.06]]\n"
    sim = driven(pull, 0.25, more=points)
    run_to(sim, 0.25)
    slid = sim.blocks.motion[1, 1] - 0.2
    assert slid == pytest.approx(0.05 * (0.25 - 0.05), rel=1e-3)  # half of the ramp of 0.1 s later
    work = sim.energy_balance.value["external_work"]
    kinetic = 0.5 * mass * 0.05**2
    assert work == pytest.approx(FRICTION * mass * GRAVITY * slid + kinetic, rel=2e-3)
    reading = read_monitors(sim)
    assert reading["point 1: y_m"] == pytest.approx(0.2 + slid)
    assert reading["point 1: vy_m/s"] == pytest.approx(0.05, rel=1e-6)
    assert reading["point 1: displacement_m"] == pytest.approx(slid, rel=1e-6)


def rotor(spin, end=1.0, step=1e-3):
    """A free block of three different moments of inertia far above a fixed one, without gravity."""
    text = lines(gravity=[0.0, 0.0, 0.0]) + f"[laws.rock]\n{coulomb()}"
    text += block("base", box=[1, 1, 1], fixed=True)
    text += block("rotor", box=[1.0, 0.8, 0.3], at=[0, 0, 50], velocity=[0.3, -0.2, 0.1], spin=spin)
    return SpaceSimulation(parse(f"{text}[run]\nend = {end}\nstep = {step}\nskin = 0.5\n"))


def test_free_flight_with_spin():
    """A block thrown with a spin about a principal axis: a parabola, and a steady rotation."""
    text = f"[laws.rock]\n{coulomb()}" + block("base", box=[1, 1, 1], fixed=True)
    text += block(
        "stone", box=[1.0, 0.8, 0.3], at=[0, 0, 50], velocity=[2.0, -1.0, 3.0], spin=[0, 0, 1.5]
    )
    sim = SpaceSimulation(parse(f"{text}[run]\nend = 1.0\nstep = 1e-3\nskin = 0.1\n"))
    run_to(sim, 1.0)
    t = sim.time
    assert sim.blocks.motion[:3, 1] == pytest.approx(
        [2.0 * t, -t, 50 + 3 * t - 0.5 * GRAVITY * t**2], rel=1e-12
    )
    turned = sim.blocks.axes[1] @ sim.initial_axes[1].T
    angle = 1.5 * t
    cosine, sine = np.cos(angle), np.sin(angle)
    assert turned == pytest.approx(np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))
    assert abs(sim.energy_balance.error) < 1e-12


def test_torque_free_rotation_follows_elliptic_functions():
    """The angular velocities of a free block about its axes are Jacobi's elliptic functions; the
    angular momentum in space stays. The error is of second order in the time step."""
    spin = np.array([1.0, 0.0, 0.5])
    errors = []
    for step in (4e-3, 2e-3):
        sim = rotor(spin.tolist(), step=step)
        blocks = sim.blocks
        moments = blocks.inertia[1, 3:]
        one, two, three = moments  # rising
        start = blocks.axes[1].T @ spin  # of the axes, which have signs
        energy = start**2 @ moments  # twice
        square = start**2 @ moments**2
        rate = np.sqrt((two - one) * (three * energy - square) / moments.prod())
        modulus = (three - two) * (square - one * energy)
        modulus /= (two - one) * (three * energy - square)
        largest = np.sqrt((square - one * energy) / (two * (two - one)))
        run_to(sim, 8.0)
        sn, cn, dn, _ = ellipj(rate * sim.time, modulus)
        sign = np.sign(start[0] * start[2])
        expected = np.array([start[0] * dn, sign * largest * sn, start[2] * cn])
        present = 0.5 * (blocks.motion[9:, 1] + blocks.velocity[3:, 1])
        momentum = blocks.axes[1] @ (moments * present)
        conserved = sim.initial_axes[1] @ (moments * start)
        errors.append([np.abs(present - expected).max(), np.abs(momentum - conserved).max()])
        assert abs(sim.energy_balance.total / sim.energy_balance.start - 1) < 1e-12
    errors = np.array(errors) / [1.0, np.sqrt(square)]
    assert errors[0].max() < 1e-4
    assert (errors[1] < 0.3 * errors[0]).all()


def test_a_spinning_top_precesses():
    """A moment m g l about the horizontal axis normal to a symmetric top: it precesses steadily at
    the rate of I1 W^2 cos a - I3 w W + m g l = 0, a its angle from the vertical."""
    tilt, w, moment = 0.5, 30.0, 6000.0
    axis = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    text = lines(gravity=[0.0, 0.0, 0.0]) + f"[laws.rock]\n{coulomb()}"
    text += block("base", box=[1, 1, 1], fixed=True)
    across = np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    frame = np.stack([across, [0.0, 1.0, 0.0], axis], axis=1)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = (signs * [0.5, 0.5, 0.2]) @ frame.T + [0.0, 0.0, 50.0]
    one, three = 2600.0 * 0.4 * np.array([1.16, 2.0]) / 12  # moments of inertia
    root = np.sqrt((three * w) ** 2 - 4 * one * np.cos(tilt) * moment)
    precession = (three * w - root) / (2 * one * np.cos(tilt))
    own = w - precession * np.cos(tilt)  # w is the angular velocity about the axis in space
    spin = own * axis + [0.0, 0.0, precession]
    text += block("top", corners=corners, spin=spin)
    sim = SpaceSimulation(parse(f"{text}[run]\nend = 1.0\nstep = 2e-4\nskin = 0.2\n"))
    blocks = sim.blocks
    own_axis = int(np.abs(blocks.axes[1].T @ axis).argmax())
    sign = np.sign(blocks.axes[1][:, own_axis] @ axis)
    while sim.time < 0.6:
        pointing = sign * blocks.axes[1][:, own_axis]
        in_space = moment * np.cross(pointing, [0.0, 0.0, -1.0])
        blocks.loads[1, 3:] = blocks.axes[1].T @ in_space
        sim.step()
    pointing = sign * blocks.axes[1][:, own_axis]
    angle = precession * sim.time
    assert np.arccos(pointing[2]) == pytest.approx(tilt, abs=5e-3)
    turned = np.arctan2(pointing[1], pointing[0])
    assert turned == pytest.approx(angle, abs=1e-4)
    assert angle > 0.6


def test_saved_state_continues_bit_for_bit(tmp_path):
    """A run that is saved while its contact is renewed ends as an uninterrupted run."""
    text = block_on_bed(inclined(38.0, 0.4), coulomb(FRICTION), 0.1)
    whole = SpaceSimulation(parse(text))
    first = SpaceSimulation(parse(text))
    run_to(whole, 0.06)
    run_to(first, 0.03)
    first.save(tmp_path)
    second = SpaceSimulation.load(tmp_path)
    run_to(second, 0.06)
    one, other = whole.state(), second.state()
    assert one.keys() == other.keys()
    for name, value in one.items():
        assert np.array_equal(value, other[name]), name


CUBES = """\
[[rock]]
name = "rock"
box = [3.0, 3.0, 3.0]
at = [0.0, 0.0, 1.5]
set = [
  { dip = 0.0, dip_direction = 0.0, spacing = 1.0 },
  { dip = 90.0, dip_direction = 90.0, spacing = 1.0, through = [0.5, 0.0, 0.0] },
  { dip = 90.0, dip_direction = 0.0, spacing = 1.0, through = [0.0, 0.5, 0.0] },
]
[in_situ]
k0 = 0.8
surface = [[0.0, 0.0, 20.0]]
bottom = "fixed"
left = "rollers"
right = "rollers"
front = "rollers"
back = "rollers"
top = "loaded"
[[excavate]]
box = [0.9, 0.9, 1.0]
at = [0.0, 0.0, 1.5]
start = 0.02
release_time = 0.1
"""


def test_excavation_under_stress():
    """The middle of 27 cubes is removed at 0.02 s: nothing moves before, its support goes within
    0.1 s, and the rock around comes to rest with the unloading of its neighbours."""
    sim = SpaceSimulation(parse(f"[laws.rock]\n{coulomb(0.9)}{CUBES}[run]\nend = 0.2\n"))
    start = sim.blocks.motion[:3].copy()
    run_to(sim, 0.019)
    assert np.abs(sim.blocks.motion[:3] - start).max() < 1e-9
    assert not sim.blocks.is_removed.any()
    run_to(sim, 0.0205)
    (middle,) = np.flatnonzero(sim.blocks.is_removed)
    assert start[:, middle] == pytest.approx([0.0, 0.0, 1.5])
    assert np.abs(sim.blocks.support).max() > 1e5
    assert np.abs(sim.blocks.motion[:3] - start).max() < 1e-5  # no impact
    run_to(sim, 0.2)
    assert not sim.blocks.support.any()
    displaced = sim.blocks.motion[:3] - start
    above = np.flatnonzero((np.abs(start - [[0.0], [0.0], [2.5]]) < 1e-6).all(axis=0))[0]
    assert displaced[2, above] < -1e-6  # the roof sinks
    assert np.abs(sim.blocks.velocity[:3]).max() < 1e-2
    assert abs(sim.energy_balance.error) < 1e-8


@pytest.mark.parametrize(("degrees", "slides"), [(18.0, False), (28.0, True)])
def test_extruded_scene_moves_as_in_the_plane(degrees, slides):
    """Two blocks on each other slide down an incline, the upper one carried by the lower one."""
    laws = f"[laws.low]\n{coulomb(0.4, 2e9, 1e9)}[laws.high]\n{coulomb(0.7, 2e9, 1e9)}"
    joint = '[[joint]]\nbetween = ["one", "two"]\nlaw = "high"\n'
    parts = {
        "base": (8.0, 1.0, 1.5, -0.5),
        "one": (1.2, 0.4, 0.0, 0.2),
        "two": (0.6, 0.4, 0.1, 0.6),
    }
    accelerations = []
    for in_space in (False, True):
        x, y = dipping(degrees)
        text = lines(gravity=[x, 0.0, y] if in_space else [x, y], law="low") + laws
        for name, (width, height, at, above) in parts.items():
            size = [width, 1.0, height] if in_space else [width, height]
            place = [at, 0.0, above] if in_space else [at, above]
            text += block(name, box=size, at=place, fixed=name == "base")
        sim_of = SpaceSimulation if in_space else Simulation
        sim = sim_of(parse(f"{text}{joint}[run]\nend = 0.3\nfraction = 0.1\n"))
        start = sim.blocks.motion[:3].copy()
        run_to(sim, 0.3)
        path = sim.blocks.motion[:3] - start
        accelerations.append(path[[0, 2 if in_space else 1], 1:] / sim.time**2)
    in_plane, in_space = accelerations
    assert in_space == pytest.approx(in_plane, rel=1e-4, abs=1e-7)
    assert (in_plane[0] > 0.1).all() == slides


def test_results_do_not_depend_on_the_number_of_threads(monkeypatch):
    """A wall of rough joints that falls on the ground, on one thread, two and three: the same bits.

    Blocks, points and joints are divided among the threads, and contacts are searched again."""
    monkeypatch.setattr("dem_demo.space.simulation.MIN_POINTS_FOR_THREADS", 0)
    monkeypatch.setattr("jointlaw.kernels.engine.MIN_SLIDERS_FOR_THREADS", 0)
    states = []
    for threads in (1, 2, 3):
        monkeypatch.setenv("JOINTLAW_THREADS", str(threads))
        sim = wall(8, 6, ROCK, "end = 0.3\nsettle = false\n", gap=2e-4)
        contacts = sim.contacts
        assert sim.arrays.threads == threads
        first_block = sim.arrays.bound_arrays["first_block"]
        assert (np.diff(first_block) > 0).all()
        assert len(first_block) == threads + 1
        for _ in range(100):
            sim.step()
        assert sim.contacts is not contacts
        states.append(sim.state())
    one, *others = states
    for other in others:
        for name, value in one.items():
            assert np.array_equal(value, other[name]), name
