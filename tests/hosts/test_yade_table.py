"""Table mode in the real YADE: the force on the body follows from the table."""

from pathlib import Path

import numpy as np
import pytest
from lattice import lattice_contacts
from yade_host import make_table, run_scene, run_yade

import jointlaw as jl

AREA = np.pi * 0.5**2
TWICE = (1.0, -1.0, -1.0)  # displacement of the slab against the sphere, from the sphere's own

SCENES = """
legs, paths = np.load("path.npy"), []
for leg in legs:
    slab_and_sphere()
    engines()
    attached(TableLaw("jing.txt"))
    O.dt = 1e-6
    paths.append(drive(leg))

def turned_pair(N):
    material()
    O.bodies.append([utils.sphere((0, 0, 0), 0.5), utils.sphere((.999, 0, 0), 0.4999)])
    for b in O.bodies: b.state.blockedDOFs = "xyzXYZ"
    engines()
    joints = attached(TableLaw("uneven.txt"))
    O.dt = 1e-3
    O.step()
    O.bodies[1].state.pos = (.999, 1e-4, 5e-5)
    O.step()
    force = joints.F[:, 0].copy()
    axis = Vector3(1, 2, .5).normalized()
    start = [(b.state.pos, b.state.ori) for b in O.bodies]
    for k in range(1, N + 1):
        turn = Quaternion(axis, 4.0 * k / N)
        for b, (x, q) in zip(O.bodies, start):
            b.state.pos, b.state.ori = turn * x, turn * q
        O.step()
    return force, joints.F[:, 0]
turns = [turned_pair(40), turned_pair(400)]

def steps(area):
    slab_and_sphere()
    O.bodies.append(utils.sphere((3, 0, .5), .5))       # no contact: takes the largest area seen
    for k in (1, 2): O.bodies[k].state.blockedDOFs = "xyzXYZ"
    O.bodies[1].state.pos = (0, 0, .499)
    engines()
    joints = attached(TableLaw("joint.txt"), area=area)
    attempt("early", joints.time_step)
    early = told.pop("early")
    O.dt = 1e-7
    O.step()
    return joints.time_step(), early
areas = dict(number=steps(10.0), array=steps(np.array(10.0)), function=steps(lambda i: 10.0),
             circle=steps(None), k=TableLaw("joint.txt").stiffness(), m=O.bodies[1].state.mass)

def go_on(specimen):
    slab_and_sphere()
    engines()
    joints = attached(TableLaw("grown.txt"))
    O.dt = 1e-4
    path = [(1e-3 * k, 2e-4 * k, 1e-4 * k) for k in range(10)]
    drive(path[:6])
    joints.save("now.npz")
    if specimen: joints.load(specimen)
    return drive(path[6:])
resumed = [go_on(""), go_on(open("specimen").read())]

slab_and_sphere()
engines()
attached(TableLaw("joint.txt"), mated=True)
O.dt = 1e-6
mated = drive([(1e-3, 0, 0), (1.2e-3, 0, 0)])[:, 0]

def joints(**options):
    return Joints(TableLaw("joint.txt"), **options)
slab_and_sphere()
attempt("no loop", lambda: joints().attach())
engines()
O.engines = O.engines[:3] + [GlobalStiffnessTimeStepper()] + O.engines[3:]
attempt("stepper", lambda: joints().attach())
engines()
class Live:
    mode = "live"
attempt("keep", lambda: Joints(Live()).attach())
attempt("name", lambda: joints(name="a b"))
attempt("run", lambda: yade_joint.run("nobody"))
np.savez("old.npz", ids=[])
attempt("version", lambda: joints().load("old.npz"))
attempt("npz table", lambda: TableLaw("old.npz"))
O.periodic = True
attempt("periodic", lambda: joints().attach())
O.periodic = False
def stepped(**options):
    attached(TableLaw("joint.txt"), **options)
    O.dt = 1e-6
    O.step()
O.bodies[1].state.pos = (0, 0, .499)
attempt("area", lambda: joints(area=-1))
attempt("max_opening", lambda: joints(max_opening=nan))
attempt("areas", lambda: stepped(area=lambda i: -1))
slab_and_sphere()
O.bodies[1].state.pos = (0, 0, .499)
engines()
O.engines = O.engines[:2] + [InteractionLoop([Ig2_Box_Sphere_ScGeom()],
    [Ip2_FrictMat_FrictMat_MindlinPhys()], [Law2_ScGeom_MindlinPhys_Mindlin()])] + O.engines[3:]
attempt("phys", stepped)
slab_and_sphere()
engines()
first = attached(TableLaw("joint.txt"))
attempt("taken", lambda: joints().attach())
yade_joint._attached["joints"] = first
O.dt = 1e-6
O.run(5, True)
O.engines[3].dead = True
O.step()
O.engines[3].dead = False
attempt("missed", O.step)

# a joint that is not selected keeps YADE's own force; erased bodies take their contacts along
slab_and_sphere()
O.bodies.append(utils.sphere((3, 0, .499), .5))
O.bodies[1].state.pos = (0, 0, .499)
engines(kn=1e3, ks=1e3)
j = attached(TableLaw("joint.txt"), select=lambda i: 1 in (i.id1, i.id2))
O.dt = 1e-7
O.step(); O.step()
selected = dict(forces=[O.forces.f(k)[2] for k in (1, 2)], left=[len(j)])
j.write_back()
selected["shown"] = O.interactions[0, 1].phys.normalForce[2]
O.bodies.erase(1)
O.step()
selected["left"].append(len(j))
result(paths=paths, turns=turns, areas=areas, resumed=resumed, mated=mated, told=told,
       selected=selected)
"""


@pytest.fixture(scope="module")
def jing(tmp_path_factory):
    """A folder with the exported Jing replica (anisotropic, mm-sized), and its table."""
    folder = tmp_path_factory.mktemp("export")
    return folder, jl.export_yade(jl.presets.load("jing-replica"), folder)


@pytest.fixture(scope="module")
def legs(jing):
    """Paths (closure, x, y) of the sphere, 400 points each.

    Closure in uneven steps with opening; then shear at three azimuths, reversal, unloading.
    """
    end = jing[1].closure[-1]
    rng = np.random.default_rng(1)
    closure = np.concatenate([np.sort(rng.uniform(0, end, 240)), rng.uniform(-end / 9, end, 160)])
    at = [0, 50, 170, 300, 350, 399]
    u = np.interp(np.arange(400), at, end * np.array([0, 0.5, 0.5, 0.5, 1 / 9, 1 / 9]))
    s = np.interp(np.arange(400), at, end * np.array([0, 0, 1, -0.5, -0.5, -0.5]))
    sheared = [
        np.stack([u, s * np.cos(azimuth), s * np.sin(azimuth)], axis=1)
        for azimuth in np.radians([0.0, 40.0, 110.0])
    ]
    return np.array([np.stack([closure, 0 * closure, 0 * closure], axis=1), *sheared])


@pytest.fixture(scope="module")
def scenes(tmp_path_factory, jing, legs):
    """All scenes of this file, in one YADE."""
    folder = tmp_path_factory.mktemp("table")
    np.save(folder / "path.npy", legs)
    jing[1].save(folder / "jing.txt")
    make_table(folder / "joint.txt")
    make_table(folder / "uneven.txt", eta=0.5, uneven=0.3, uneven_mu=0.2)
    make_table(folder / "grown.txt", eta=0.5, uneven=0.2)
    specimen = Path(__file__).with_name("specimens") / "joints.npz"
    (folder / "specimen").write_text(str(specimen))
    return run_scene(folder, SCENES)


def test_normal_force_and_shear_follow_the_table(scenes, jing, legs):
    """Positions of 0.5 m resolve 1e-16 m, closures are 1e-3 m: 1e-9 of the peak."""
    table = jing[1]
    peak = AREA * table.normal_stress[-1]
    for leg, force in zip(legs, scenes["paths"], strict=True):
        F = table.follow(leg * TWICE)
        assert np.abs(force - AREA * F).max() < 1e-9 * peak
    assert np.abs(F[:, 1:]).max() > 0.1 * table.normal_stress[-1]


def test_rigid_motion_of_the_pair_changes_nothing(scenes):
    """Four radians about an oblique axis in 40 and in 400 steps: exact but for rounding.

    Rounding: 1e-16 m of position per step against a shear of 1e-4 m.
    """
    for before, after in scenes["turns"]:
        assert abs(before[1]) > 0.01 * before[0]
        assert np.abs(np.subtract(after, before)).max() < 1e-10 * before[0]


def test_time_step_knows_the_area_however_it_is_given(scenes):
    """A number, an array without axes and a function of the same value give the same safe step.

    Rounding of a sum of one area against a product: 1e-12.
    """
    out = scenes["areas"]
    expected = 0.25 * 2 * np.sqrt(out["m"] / (2 * 3.5 * out["k"] * 10.0 * 6))
    for name in ("number", "array", "function"):
        assert out[name][0] == pytest.approx(expected, rel=1e-12), name
    assert out["circle"][0] == pytest.approx(expected * np.sqrt(10.0 / AREA), rel=1e-12)
    assert "call time_step() after the first step" in out["function"][1]
    # six joints at every sphere: the step of a lattice by Python's function
    first, second = lattice_contacts(4)
    mass = np.full(64, out["m"])
    R = 0.5
    arm = np.full((len(first), 2), R)
    dt = jl.stable_time_step(first, second, mass, 10.0, out["k"], 0.4 * mass * R**2, arm)
    assert expected == pytest.approx(0.25 * dt, rel=1e-3)


def test_a_checkpoint_of_version_2_is_read(scenes):
    """The run continues from the file in specimens as from the state in memory."""
    unbroken, resumed = np.array(scenes["resumed"])
    assert unbroken[-1, 1] < 0 < unbroken[-1, 0]
    np.testing.assert_array_equal(resumed, unbroken)


def test_refusals_name_the_remedy(scenes):
    """Set-ups that would give wrong forces are refused, each with what to do instead."""
    words = {
        "no loop": "set O.engines before attach", "stepper": "joints.time_step()",
        "keep": "neverErase=True", "name": "identifier",
        "run": ".load(file)", "periodic": "O.periodic", "area": "area = -1", "phys": "select=",
        "max_opening": "max_opening = nan", "areas": "area = -1.0 m2 of contact",
        "version": "start the run again", "missed": "every step", "taken": "give another name=",
        "npz table": "export the law again",
    }  # fmt: skip
    assert {name: part for name, part in words.items() if part not in scenes["told"][name]} == {}
    assert scenes["told"].keys() == words.keys()


def test_only_selected_contacts_are_joints(scenes):
    """The other contact keeps the linear force of YADE; the joint of an erased body is deleted.

    A mated joint starts at zero closure in the position in which its contact forms, here at an
    overlap of 1 mm.
    """
    out = scenes["selected"]
    law = AREA * 1e8 * 1e-3
    assert out["forces"] == pytest.approx([law, 1e3 * 1e-3], rel=1e-6)
    assert out["shown"] == pytest.approx(out["forces"][0], rel=1e-9)
    assert out["left"] == [1, 0]
    assert scenes["mated"] == pytest.approx([0.0, 0.2 * law], rel=1e-9)


def test_exported_script_runs_without_jointlaw(jing):
    """A sphere settles; it sticks 0.1 degree below the friction angle and slides above.

    At rest, except for an oscillation of 2e-6 of the load.
    """
    text = run_yade(jing[0], "settle_and_incline.py")
    settled = next(line for line in text.splitlines() if line.startswith("settled"))
    assert float(settled.rsplit(" ", 1)[1]) < 1e-5
    lines = [line for line in text.splitlines() if line.startswith("azimuth")]
    assert [line.split(" deg: ")[2].split(" ")[0] for line in lines] == ["sticks", "slides"] * 3
    mistyped = run_yade(jing[0], "settle_and_incline.py", "lvie", code=1)
    assert "lvie is unknown; write live, or nothing for the table" in mistyped
    assert "settled" not in mistyped


ASK = """
import json
print("\\nRESULT " + json.dumps(
    {k: v.tolist() for k, v in joints.contacts().items()}), flush=True)
"""


def test_script_of_the_page(tmp_path):
    """A sphere comes to rest on the joint, by the script of docs/particles.md.

    After 10 000 damped steps the bounce is 0.02 % of the load.
    """
    jl.export_yade(jl.presets.load("jing-replica"), tmp_path, azimuths=3, steps=10)
    page = Path(__file__).parents[2] / "docs" / "particles.md"
    block = page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    contacts = run_scene(tmp_path, block + ASK, preamble="")
    (area,) = contacts["area"]
    (traction,) = contacts["traction"]
    assert area * traction[0] == pytest.approx(2600 * 4 / 3 * np.pi * 0.1**3 * 9.81, rel=0.01)
    assert (tmp_path / "half.npz").exists()
