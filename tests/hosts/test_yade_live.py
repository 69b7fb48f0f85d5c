"""Live mode: the full path-dependent law inside the real YADE."""

import dataclasses

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.hosts.yade.export import export_yade

LAW = (
    "from jointlaw import JointLaw\nlaw = JointLaw.from_toml('law.toml')\nend = law.closure_range\n"
)


@pytest.fixture
def law(tmp_path):
    law = jl.presets.load("jing-replica")
    law.to_toml(tmp_path / "law.toml")
    return law


def test_direct_shear_of_two_blocks_equals_pure_python(yade, tmp_path, law):
    """The exported script: closure, shear, reversal, opening, re-contact on 36 contacts.

    Against `direct_shear` at the same resolution and steps (within 0.1 %), and
    against the law driven by the same displacements (rounding of positions: 1e-16 m of 1e-3 m).
    """
    export_yade(law, tmp_path, shear_limit=law.closure_range)
    text = yade(None, live=True, args=["live"], folder=tmp_path, name="direct_shear.py")
    assert "live law: 36 contacts" in text
    u, s, F1, F2 = np.loadtxt(tmp_path / "direct_shear.csv", delimiter=",", skiprows=1).T
    peak = np.hypot(F1, F2).max()

    joint = law.joint()
    path = np.stack([u, s, 0 * s], axis=1)
    exact = np.array([joint.update(d)[0] for d in np.diff(path, axis=0, prepend=np.zeros((1, 3)))])
    assert np.abs(F1 - exact[:, 0]).max() < 1e-8 * peak
    assert np.abs(-F2 - exact[:, 1]).max() < 1e-8 * peak

    end = law.closure_range
    seat = float(law.normal_stress(end / 2))
    record = jl.direct_shear(
        law.joint(), [end / 2, -end / 4], normal=seat, control="closure", steps=200
    )
    mine = slice(201, 602)  # rows from the seated joint to the end of the reversal
    # `direct_shear` seats in one step, the blocks in 200: facets slide a little differently
    print(np.abs(-F2[mine] - record.shear_stress).max() / peak)
    assert np.abs(-F2[mine] - record.shear_stress).max() < 1e-3 * peak
    assert np.abs(F1[mine] - record.F1).max() < 1e-3 * peak
    assert F1[u < -0.45 * end].max() == 0.0  # opened, and closed again after that
    assert F1[-1] > 0.1 * peak


def test_a_mistyped_mode_is_an_error(yade, tmp_path, law):
    """`lvie` for `live` ran the table."""
    export_yade(law, tmp_path, azimuths=3, steps=10, shear_limit=law.closure_range)
    text = yade(None, args=["lvie"], folder=tmp_path, name="direct_shear.py")
    assert "lvie is unknown; write live, or nothing for the table" in text
    assert not (tmp_path / "direct_shear.csv").exists()


STRESS = (
    LAW
    + """
slab_and_sphere()
engines(keep=True, damping=0.5)
joints = Joints(LiveLaw(law))
joints.attach()
O.dt = joints.time_step(safety=1, closure=0.4 * end)
area, sphere = pi * 0.25, O.bodies[1].state
sphere.blockedDOFs = "xyXYZ"
stress = float(law.normal_stress(0.2 * end))
O.bodies[1].state.pos = (0, 0, 0.5 - 0.2 * end)
O.forces.setPermF(1, (0, 0, -stress * area))
for _ in range(300): O.step()
n, to, out = 4000, 0.3 * end, []
for k in range(n + 1):
    x = sphere.pos[0]
    sphere.vel = (-to / n / O.dt * min(1, (k + 1) / 800) / 0.9, 0, sphere.vel[2])  # no jerk
    O.step()
    if k % 40 == 0:
        out.append((joints.c["closure"][0], -x, joints.F[1, 0]))
result(rows=out, stress=stress)
"""
)


def test_direct_shear_at_constant_normal_stress(yade, tmp_path, law):
    """The sphere is free to rise: dilation and shear stress against `direct_shear`.

    Sheared slowly (4000 steps, begun gently) so that inertia stays below the bound of 0.1 %.
    """
    out = yade(STRESS, live=True)
    closure, shear, F2 = out["rows"].T
    to = 0.31 * law.closure_range
    record = jl.direct_shear(law.joint(), to, normal=out["stress"], steps=1000)
    exact = np.interp(shear, record.shear, record.shear_stress)
    dilation = np.interp(shear, record.shear, record.closure[0] - record.closure)
    peak = record.shear_stress.max()
    print(
        np.abs(F2 - exact).max() / peak,
        np.abs(closure[0] - closure - dilation).max() / record.closure[0],
    )
    assert np.abs(F2 - exact).max() < 1e-3 * peak
    assert np.abs(closure[0] - closure - dilation).max() < 1e-3 * record.closure[0]


LOOPS = (
    LAW
    + """
rng, n, legs, steps = np.random.default_rng(3), 100, 6, 80
O.reset()
O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
for k in range(n):
    O.bodies.append(utils.sphere((0, 3 * k, 0), 0.5))
    O.bodies.append(utils.sphere((1, 3 * k, 0), 0.5))
for b in O.bodies: b.state.blockedDOFs = "xyzXYZ"
engines(keep=True)
joints = Joints(LiveLaw(law), area=1.0, azimuth=(0, 1, 0))
joints.attach()
O.dt = 1e-3
corners = rng.uniform(-1, 1, (legs, n, 3)) * end * [0.4, 0.5, 0.5] + [0.4 * end, 0, 0]
corners = np.concatenate([np.zeros((1, n, 3)), corners, corners[:1]])   # the loop: 1 ... legs, 1
def go(start, goal, count):
    for k in range(1, count + 1):
        at = start + (goal - start) * (k / count)
        for j, (u, s, t) in enumerate(at.tolist()):
            O.bodies[2 * j + 1].state.pos = (1 - u, 3 * j + s, t)
        O.step()
        global F, work
        order = np.argsort(joints.c["id1"])
        f = joints.F[:, order].T * [1, -1, -1]      # against the motion of id2
        if F is not None:
            work = work + np.sum((f + F) / 2 * (goal - start) / count, axis=1)
        F = f
F, work = None, 0.0
O.step()
go(corners[0], corners[1], steps)
work, least, gross = np.zeros(n), None, None
for a, b in zip(corners[1:-1], corners[2:]):
    go(a, b, steps)
result(work=work, scale=np.abs(F).max(axis=1) * end)
"""
)


def test_closed_loops_never_return_work(yade, law):
    """A hundred random closed loops in displacement (with openings), one per pair of spheres.

    The law's guarantee is for the exact work of a step; the trapezoid of end forces used here has
    an error of second order in the step, below 1e-4 of force times size of the loop.
    """
    out = yade(LOOPS, live=True)
    assert len(out["work"]) == 100
    print((out["work"] / out["scale"]).min(), np.median(out["work"] / out["scale"]))
    assert (out["work"] > -1e-4 * out["scale"]).all()
    assert np.median(out["work"] / out["scale"]) > 1e-3


RELOAD = (
    LAW
    + """
live = {live}
def build():
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
    O.bodies.append(utils.box((0, 0, -1), (20, 20, 1), fixed=True))
    rng = np.random.default_rng(5)
    for k in range(12):
        apart = 0.93 if live else 0.9
        x, y = apart * (k % 3), apart * (k // 3)
        z = 0.5 + (0.37 if live else 0.4) * ((k % 3 + k // 3) % 2)
        O.bodies.append(utils.sphere((x, y, z), 0.5))
        O.bodies[-1].state.vel = Vector3(*rng.uniform(-0.3, 0.3, 3).tolist())
        O.bodies[-1].state.angVel = Vector3(*rng.uniform(-3, 3, 3).tolist())
    engines(keep=live, gravity=(0, 0, -200 if live else -30), damping=0.4 if live else 0.1)
def adapter():
    return Joints(LiveLaw(law), forget=0.1 * end) if live else Joints(TableLaw("joint.txt"))
def picture():
    return [list(b.state.pos) + list(b.state.ori) + list(b.state.vel) + list(b.state.angVel)
            for b in O.bodies]
build()
joints = adapter()
joints.attach()
O.dt = dt = joints.time_step(safety=0.5)
O.run(700, True)
O.save("half.yade.bin")
joints.save("half.npz")
counts = [len(joints)]
O.run(700, True)
whole, last = picture(), joints.contacts()
joints.save("whole.npz")
O.reset()
def refusal():
    O.load("half.yade.bin")
    try:
        O.step()
    except Exception as error:
        return str(error)
refused = refusal()
joints = adapter()
unloaded = refusal()
O.load("half.yade.bin")
joints = adapter()
joints.load("half.npz")
O.run(700, True)
again = joints.contacts()
a, b = np.lexsort(last["ids"].T), np.lexsort(again["ids"].T)
counts += [len(joints), len(last["ids"])]
result(whole=whole, again=picture(), refused=refused, unloaded=unloaded, counts=counts,
       F=last["traction"][a], F_again=again["traction"][b])
"""
)


@pytest.mark.parametrize("live", [False, True])
def test_save_reload_continue_equals_an_unbroken_run(yade, make_table, tmp_path, law, live):
    """Spheres that collide and roll; O.save keeps 17 digits, sums may be taken in another order."""
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4, eta=0.5, uneven=0.2)
    out = yade(RELOAD.format(live=live), live=True)
    assert "load(file)" in out["refused"]  # a reloaded scene without the adapter's state is refused
    assert "neither attached nor loaded" in out["unloaded"]
    assert out["counts"][0] > 5
    assert out["counts"][1] == out["counts"][2]
    moved = np.abs(out["whole"]).max()
    print(np.abs(out["again"] - out["whole"]).max() / moved, out["counts"])
    assert np.abs(out["again"] - out["whole"]).max() < 1e-9 * moved
    assert np.abs(out["F_again"] - out["F"]).max() < 1e-6 * np.abs(out["F"]).max()


DAMAGED = (
    LAW
    + """
O.reset()
O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
for x in (0, 1): O.bodies.append(utils.sphere((x, 0, 0), 0.5))
for b in O.bodies: b.state.blockedDOFs = "xyzXYZ"
engines(keep=True)
live = LiveLaw(law, ledger=True)
add, step, began, taken = live.add, live.step, [], []
def noted_add(closure):
    began.extend(closure)
    add(closure)
def noted_step(d, closure, spin):
    F = step(d, closure, spin)
    taken.append(np.concatenate([d[:, 0], F[:, 0]]))
    return F
live.add, live.step = noted_add, noted_step
joints = Joints(live, area=1.0)
joints.attach()
O.dt = 1e-3
at = np.array([(0.01, 0), (0.6, 0), (0.6, 1.5), (0.2, 1.2), (0.8, 0.3), (-0.5, 0.3), (0.7, 0)])
for a, b in zip(at[:-1], at[1:]):
    for k in range(1, 31):
        u, s = end * (a + (b - a) * (k / 30))
        O.bodies[1].state.pos = (1 - u, s, 0)
        O.step()
result(began=began, taken=np.array(taken), friction=live.batch.friction,
       plastic=live.batch.plastic_work, dissipated=live.batch.dissipated_energy)
"""
)


def test_asperities_yield_and_wear_as_in_pure_python(yade, tmp_path, law):
    """Closure, shear, unloading, opening and re-contact of one contact of two spheres."""
    end = law.closure_range
    damage = {"yield_interference": 0.1 * end, "mu_residual": 0.2, "wear_slip": end}
    law = dataclasses.replace(law, asperity=dataclasses.replace(law.asperity, **damage))
    law.to_toml(tmp_path / "law.toml")
    out = yade(DAMAGED, live=True)
    joint = law.joint()
    joint.update([out["began"][0], 0.0, 0.0])
    d, F = np.split(out["taken"], 2, axis=1)
    exact = np.array([joint.update(step)[0] for step in d])
    # one law, other versions of Python and numpy: rounding of differences of large forces
    assert np.abs(F - exact).max() < 1e-11 * np.abs(exact).max()
    assert (F[:, 0] == 0.0).any()
    assert F[-1, 0] > 0.0
    assert out["friction"][0] == pytest.approx(joint.friction, rel=1e-11)
    assert out["friction"][0] < 0.9 * law.asperity.mu
    assert out["plastic"][0] == pytest.approx(joint.plastic_work, rel=1e-11)
    assert 0.0 < joint.plastic_work < joint.dissipated_energy
    assert out["dissipated"][0] == pytest.approx(joint.dissipated_energy, rel=1e-9)
