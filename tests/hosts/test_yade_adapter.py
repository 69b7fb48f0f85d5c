"""The adapter's bookkeeping: contacts that come and go, large turns, refusals."""

from pathlib import Path

import numpy as np

import jointlaw as jl

RIGID = """
def turn(N):
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
    O.bodies.append([utils.sphere((0, 0, 0), 0.5), utils.sphere((.999, 0, 0), 0.4999)])
    for b in O.bodies: b.state.blockedDOFs = "xyzXYZ"
    engines()
    joints = Joints(TableLaw("joint.txt"))
    joints.attach()
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
    return force.tolist(), joints.F[:, 0].tolist()
result(steps=[turn(40), turn(400)])
"""


def test_rigid_motion_of_the_pair_changes_nothing(yade, make_table, tmp_path):
    """Four radians about an oblique axis in 40 and in 400 steps: exact but for rounding.

    Rounding: 1e-16 m of position per step against a shear of 1e-4 m.
    """
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4, eta=0.5, uneven=0.3, uneven_mu=0.2)
    for before, after in yade(RIGID)["steps"]:
        assert abs(before[1]) > 0.01 * before[0]
        assert np.abs(np.array(after) - before).max() < 1e-10 * before[0]


COMING = (
    "from jointlaw import JointLaw\nlaw = JointLaw.from_toml('law.toml')\nend = law.closure_range\n"
    + """
def scene(joints, keep, gone):
    slab_and_sphere()
    O.bodies.append(utils.sphere((3, 0, 0.5), 0.5))
    engines(keep=keep)
    joints.attach()
    O.dt = 1e-4
    for k in (1, 2): O.bodies[k].state.blockedDOFs = "xyzXYZ"
    out = []
    path = [(u, 0) for u in (.1, .2, .3)] + [(.3, s) for s in (.05, .1, .15)]
    for visit in range(3):
        forces = []
        for u, s in path:
            O.bodies[1].state.pos = (s * end, 0, .5 - u * end)
            # the second sphere stays in touch during the second visit: contacts change places
            O.bodies[2].state.pos = (3 + s * end, 0, .5 - u * end if visit == 1 else .5 + gone)
            O.step()
            forces.append([list(O.forces.f(1)), list(O.forces.f(2))])
        out.append(forces)
        if visit == 1: O.bodies[2].state.pos = (3, 0, .5 + gone); O.step()
        O.bodies[1].state.pos = (s * end, 0, .5 + gone)
        O.step(); O.step()
        O.bodies[1].state.pos = (0, 0, .5 + gone)
        O.step()
    return out
result(table=scene(Joints(TableLaw("joint.txt")), False, 1e-3),
       live=scene(Joints(LiveLaw(law), forget=.1 * end), True, .3 * end))
"""
)


def test_a_contact_that_comes_back_is_new(yade, make_table, tmp_path):
    """Three visits of one sphere, joined by another in the second: all are alike."""
    law = jl.presets.load("jing-replica")
    law.to_toml(tmp_path / "law.toml")
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4, eta=0.5, end=law.closure_range)
    out = yade(COMING, live=True)
    for mode in ("table", "live"):
        first, second, third = np.array(out[mode])
        assert np.abs(first[-1, 0]).min() >= 0
        assert abs(first[-1, 0, 0]) > 0.05 * first[-1, 0, 2] > 0
        scale = np.abs(first).max()
        assert np.abs(second[:, 0] - first[:, 0]).max() < 1e-9 * scale
        assert np.abs(third[:, 0] - first[:, 0]).max() < 1e-9 * scale
        assert np.abs(second[:, 1] - first[:, 0]).max() < 1e-9 * scale
        assert np.abs(third[:, 1]).max() == 0


REFUSALS = """
messages = {}
def attempt(name, action):
    try:
        action()
        messages[name] = ""
    except Exception as error:
        messages[name] = str(error)
def joints(**options):
    return Joints(TableLaw("joint.txt"), **options)
slab_and_sphere()
attempt("no loop", lambda: joints().attach())
engines()
O.engines = O.engines[:3] + [GlobalStiffnessTimeStepper()] + O.engines[3:]
attempt("stepper", lambda: joints().attach())
engines()
class LiveStub:  # no TableLaw
    pass
attempt("keep", lambda: Joints(LiveStub()).attach())
attempt("lagged live", lambda: Joints(LiveStub(), lagged=True))
attempt("lagged plane", lambda: joints(lagged=True, plane=(0, 0, 1)))
attempt("lagged forces", lambda: joints(lagged=True).write_back())
attempt("name", lambda: joints(name="a b"))
attempt("run", lambda: yade_joint.run("nobody"))
np.savez("old.npz", ids=[])
attempt("version", lambda: joints().load("old.npz"))
O.periodic = True
attempt("periodic", lambda: joints().attach())
O.periodic = False
O.bodies[1].state.pos = (0, 0, .499)
def stepped(setup, adapter):
    setup()
    adapter.attach()
    O.dt = 1e-6
    O.step()
attempt("area", lambda: stepped(engines, joints(area=-1)))
def hertz():
    engines()
    O.engines = O.engines[:2] + [InteractionLoop([Ig2_Box_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys()], [Law2_ScGeom_MindlinPhys_Mindlin()])] + O.engines[3:]
slab_and_sphere()
O.bodies[1].state.pos = (0, 0, .499)
attempt("phys", lambda: stepped(hertz, joints()))
slab_and_sphere()
engines()
j = joints()
j.attach()
j.attach()
count = len(O.engines)
attempt("taken", lambda: joints().attach())
yade_joint._running["joints"] = j
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
j = joints(select=lambda i: 1 in (i.id1, i.id2))
j.attach()
O.dt = 1e-7
O.step(); O.step()
forces = [O.forces.f(k)[2] for k in (1, 2)]
selected = len(j)
j.write_back()
shown = O.interactions[0, 1].phys.normalForce[2]
O.bodies.erase(1)
O.step()
result(messages=messages, count=count, forces=forces, shown=shown, left=[selected, len(j)])
"""


def test_refusals_name_the_remedy(yade, make_table, tmp_path):
    """Set-ups that would give wrong forces are refused, each with what to do instead."""
    table = make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4)
    out = yade(REFUSALS)
    told = {
        "no loop": "set O.engines before attach", "stepper": "joints.time_step()",
        "keep": "neverErase=True", "lagged live": "needs a TableLaw", "name": "identifier",
        "lagged plane": "or lagged", "lagged forces": "read i.phys",
        "run": ".load(file)", "periodic": "O.periodic", "area": "area = -1", "phys": "select=",
        "version": "start the run anew", "missed": "every step", "taken": "give another name=",
    }  # fmt: skip
    for name, words in told.items():
        assert words in out["messages"][name], (name, out["messages"][name])
    assert out["count"] == 5  # attach() twice adds one engine
    area = np.pi * 0.25
    assert np.isclose(out["forces"][0], area * table.lookup(1e-3).normal_stress, rtol=1e-6)
    assert np.isclose(out["forces"][1], 1e3 * 1e-3, rtol=1e-6)
    assert np.isclose(out["shown"], out["forces"][0], rtol=1e-9)
    assert out["left"].tolist() == [1, 0]


AREAS = """
def steps(area):
    slab_and_sphere()
    O.bodies.append(utils.sphere((3, 0, .5), .5))       # no contact: takes the largest area seen
    for k in (1, 2): O.bodies[k].state.blockedDOFs = "xyzXYZ"
    O.bodies[1].state.pos = (0, 0, .499)
    engines()
    joints = Joints(TableLaw("joint.txt"), area=area)
    joints.attach()
    try:
        before = joints.time_step()
    except ValueError as error:
        before = str(error)
    O.dt = 1e-7
    O.step()
    return before, joints.time_step()
result(number=steps(10.0), array=steps(np.array(10.0)), function=steps(lambda i: 10.0),
       circle=steps(None), k=TableLaw("joint.txt").stiffness(), m=O.bodies[1].state.mass)
"""


def test_time_step_knows_the_area_however_it_is_given(yade, make_table, tmp_path):
    """A number, an array without axes and a function of the same value give the same safe step.

    Rounding of a sum of one area against a product: 1e-12.
    """
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4)
    out = yade(AREAS)
    expected = 0.25 * 2 * np.sqrt(out["m"] / (2 * 3.5 * out["k"] * 10.0 * 6))
    for name in ("number", "array"):
        assert np.allclose(out[name], expected, rtol=1e-12, atol=0)
    before, after = out["function"]
    assert "area is a function" in before
    assert "after the first step" in before
    assert np.isclose(float(after), expected, rtol=1e-12, atol=0)
    assert np.allclose(out["circle"], expected * np.sqrt(10.0 / (np.pi * 0.25)), rtol=1e-12, atol=0)


SPECIMEN = """
slab_and_sphere()
engines()
joints = Joints(TableLaw("joint.txt"))
joints.attach()
O.dt = 1e-4
path = [(1e-3 * k, 2e-4 * k, 1e-4 * k) for k in range(10)]
drive(path[:6])
joints.save("now.npz")
if specimen:
    joints.load(specimen)
result(force=drive(path[6:]))
"""


def test_a_saved_state_of_version_1_is_read(yade, make_table, tmp_path):
    """The run goes on from the specimen as from the state in memory."""
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4, eta=0.5, uneven=0.2)
    there = Path(__file__).with_name("specimens") / "joints.npz"
    unbroken, resumed = (
        yade(f"specimen = {str(file)!r}\n" + SPECIMEN)["force"] for file in ("", there)
    )
    assert unbroken[-1, 1] < 0 < unbroken[-1, 0]
    np.testing.assert_array_equal(resumed, unbroken)
