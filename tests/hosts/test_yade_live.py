"""Live mode in the real YADE: the path-dependent law; checkpoints."""

import dataclasses
import re

import numpy as np
import pytest
from yade_host import make_table, run_scene, run_yade

import jointlaw as jl

SCENES = """
from dataclasses import replace
from jointlaw import JointLaw
law, worn, degrading = (
    JointLaw.from_toml(f"{name}.toml") for name in ("law", "worn", "degrading"))
bonded = replace(law, bond=worn.bond)
end = law.closure_range

CORNERS = (-.1, .05), (.5, 0), (.5, .5), (.5, -.25), (-.5, -.25), (.5, -.25)

def pieces(law, corners=CORNERS, steps=100):
    # eight pairs in several directions, all pieces of one flat joint; the upper spheres move
    material()
    for k in range(8):
        start = 5.0 * k
        O.bodies.append(utils.sphere((start, 0, 0), .5))
        O.bodies.append(utils.sphere((start + .1 * k - .4, .05 * k, .8), .5))
    engines(keep=True)
    for b in O.bodies: b.state.blockedDOFs = "xyzXYZ"
    joints = attached(LiveLaw(law, track_dissipation=True), area=2.0, plane=(0, 0, 1))
    O.dt = 1e-3
    O.step()
    home, here = [Vector3(b.state.pos) for b in O.bodies], np.zeros(2)
    moved, F, force = [], [], []
    for corner in corners:
        for k in range(1, steps + 1):
            at = here + (np.array(corner) - here) * k / steps
            for b in range(1, 16, 2):
                O.bodies[b].state.pos = home[b] + Vector3(end * at[1], 0, -end * at[0])
            O.step()
            moved.append(end * at)
            F.append(joints.F.T)
            force.append([list(O.forces.f(b)) for b in range(1, 16, 2)])
        here = np.array(corner)
    batch = joints.law.batch
    return dict(moved=moved, F=F, force=force, measures=[
        batch.slope_retention, batch.plastic_work, batch.dissipated_energy])

def visits(law, keep, gone, late=False, **options):
    slab_and_sphere()
    O.bodies[1].state.pos = (0, 0, .5 + gone)
    O.bodies.append(utils.sphere((3, 0, 0.5 + gone), 0.5))
    engines(keep=keep)
    attached(law, **options)
    O.dt = 1e-4
    if late: O.step()
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

def reload(live):
    material()
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
        if live: return Joints(LiveLaw(law), max_opening=0.1 * end)
        return Joints(TableLaw("joint.txt"))
    def picture():
        return [list(b.state.pos) + list(b.state.ori) + list(b.state.vel) + list(b.state.angVel)
                for b in O.bodies if b]
    def reloaded_step():
        O.load("half.yade.bin")
        O.step()
    joints = adapter()
    joints.attach()
    O.dt = joints.time_step(safety=0.5)
    O.run(600, True)
    O.bodies.erase(12)
    O.run(100, True)
    O.save("half.yade.bin")
    joints.save(f"half-{live}.npz")
    early = len(joints)
    O.run(700, True)
    unbroken, last = picture(), joints.contacts()
    O.reset()
    attempt(f"not loaded {live}", reloaded_step)
    joints = adapter()
    attempt(f"not attached {live}", reloaded_step)
    O.load("half.yade.bin")
    joints = adapter()
    joints.load(f"half-{live}.npz")
    O.run(700, True)
    again = joints.contacts()
    a, b = np.lexsort(last["ids"].T), np.lexsort(again["ids"].T)
    return dict(unbroken=unbroken, again=picture(), counts=[len(last["ids"]), len(joints), early],
                F=last["traction"][a], F_again=again["traction"][b])

out = dict(
    pieces=[pieces(worn), pieces(degrading)],
    reload=[reload(False), reload(True)],
    visits=dict(table=visits(TableLaw("short.txt"), False, 1e-3),
                live=visits(LiveLaw("law.toml"), True, .3 * end, max_opening=.1 * end),
                bonded=visits(LiveLaw(bonded), True, .3 * end, max_opening=.1 * end),
                late=visits(LiveLaw(bonded), True, .3 * end, True, max_opening=.1 * end),
                coulomb=visits(LiveLaw("coulomb.toml"), True,
                               .3 * end, True, max_opening=.1 * end)))

slab_and_sphere()
O.bodies[1].state.pos = (0, 0, .5 - .1 * end)
engines(keep=True)
table, live, other = Joints(TableLaw("joint.txt")), Joints(LiveLaw(law)), Joints(LiveLaw(worn))
attempt("live into table", lambda: table.load("half-True.npz"))
attempt("table into live", lambda: live.load("half-False.npz"))
attempt("another law", lambda: other.load("half-True.npz"))
attempt("another table", lambda: Joints(TableLaw("short.txt")).load("half-False.npz"))
untouched = [len(joints) for joints in (table, live, other)]
live = attached(LiveLaw(law), name="mine")
O.bodies[1].state.blockedDOFs = "xyzXYZ"
O.step()
before = live.F.copy()
attempt("while it runs", lambda: live.load("half-False.npz"))
O.step()
out.update(untouched=untouched, running=[before, live.F], told=told)
result(**out)
"""


@pytest.fixture(scope="module")
def law():
    return jl.presets.load("jing-replica")


@pytest.fixture(scope="module")
def worn(law):
    """The same law with asperities that yield, slopes that wear, and a bond."""
    end = law.closure_range
    tension = 5e6
    return dataclasses.replace(
        law, asperity=dataclasses.replace(law.asperity, yield_interference=0.1 * end),
        mating_length=4 * end, slope_wear=1e4, slope_residual=0.3,
        bond=jl.Bond(tension / (0.04 * end), tension / (0.04 * end), tension, tension,
                     energy_I=0.1 * end * tension, energy_II=0.2 * end * tension),
    )  # fmt: skip


@pytest.fixture(scope="module")
def degrading(worn):
    """The same with slopes that decrease by the contact stress, not by work."""
    return dataclasses.replace(worn, slope_wear=np.inf, degradation_stress=2e7)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory, law, worn, degrading):
    """All scenes of this file, in one YADE."""
    folder = tmp_path_factory.mktemp("live")
    law.to_toml(folder / "law.toml")
    worn.to_toml(folder / "worn.toml")
    degrading.to_toml(folder / "degrading.toml")
    jl.CoulombLaw(1e9, 5e9, friction=0.6, cohesion=1e4).to_toml(folder / "coulomb.toml")
    make_table(folder / "joint.txt", eta=0.5, uneven=0.2)
    make_table(folder / "short.txt", eta=0.5, end=law.closure_range)
    return run_scene(folder, SCENES, live=True)


@pytest.mark.parametrize("number", [0, 1], ids=["by work", "by stress"])
def test_pieces_of_one_plane_equal_pure_python(scenes, worn, degrading, number):
    """Bond pulled and sheared till it softens; closure, shear, reversal, opening, re-contact.

    The law on the displacements of the plane, whatever the direction of a pair is. Rounding of
    positions: 1e-16 m of 1e-3 m.
    """
    law = (worn, degrading)[number]
    displaced, F, force, measures = (np.array(part) for part in scenes["pieces"][number].values())
    path = displaced @ [[1, 0, 0], [0, -1, 0]]
    joint = law.joint()  # of id1 against id2
    exact = np.array([joint.update(d)[0] for d in np.diff(path, axis=0, prepend=np.zeros((1, 3)))])
    peak = np.abs(exact).max()
    assert np.abs(exact[:, 1]).max() > 0.1 * peak
    assert exact[:, 0].min() < -0.8 * law.bond.tension
    assert (exact[:, 0] == 0.0).any()
    assert np.abs(F - exact[:, None]).max() < 1e-8 * peak
    on_upper = 2.0 * exact[:, [1, 2, 0]]  # x, y, z; area 2 m2
    assert np.abs(force - on_upper[:, None]).max() < 1e-8 * 2.0 * peak
    alone = [joint.slope_retention, joint.plastic_work, joint.dissipated_energy]
    assert np.allclose(measures, np.reshape(alone, (3, 1)), rtol=1e-8, atol=0)
    assert 0.0 < joint.plastic_work < joint.dissipated_energy
    assert joint.slope_retention < 0.96


def test_exported_script_agrees_with_a_shear_test(tmp_path, law):
    """The sphere is free to slide and to rise: against `direct_shear` at constant normal stress.

    Tilted in 4000 steps without a jerk: inertia leaves 0.4 % of the small slip at 15 degrees, and
    0.1 % at 30.
    """
    jl.export_yade(law, tmp_path, azimuths=3, steps=10)
    text = run_yade(tmp_path, "settle_and_incline.py", "live", live=True)
    assert float(re.search(r"to the load (\S+)", text)[1]) < 1e-3
    numbers = np.array(re.findall(r"(\S+) m\b", text.split("tilt", 1)[1]), float)
    host, test = numbers.reshape(2, 2, 2).swapaxes(0, 1)  # angles; slip and rise
    assert np.allclose(host[0], test[0], rtol=1e-2, atol=0)
    assert np.allclose(host[1], test[1], rtol=2e-3, atol=0)


@pytest.mark.parametrize("name", ["table", "live", "late", "coulomb"])
def test_a_contact_that_comes_back_is_new(scenes, name):
    """Three visits of one sphere, joined by another in the second: all are alike."""
    first, second, third = np.array(scenes["visits"][name])
    assert abs(first[-1, 0, 0]) > 0.05 * first[-1, 0, 2] > 0
    for alike in (second[:, 0], third[:, 0], second[:, 1]):
        assert np.abs(alike - first[:, 0]).max() < 1e-9 * np.abs(first).max()
    assert np.abs(third[:, 1]).max() == 0


def test_contacts_of_the_first_step_alone_have_a_bond(scenes):
    """One that comes later has none, be it the first of all."""
    bonded, late = (np.array(scenes["visits"][name]) for name in ("bonded", "late"))
    peak = np.abs(late).max()
    assert np.abs(bonded[1:] - late[1:]).max() < 1e-9 * peak
    assert bonded[0, -1, 0, 0] < 2 * late[0, -1, 0, 0] < 0.0


@pytest.mark.parametrize("live", [False, True])
def test_save_reload_continue_equals_an_unbroken_run(scenes, live):
    """Spheres that collide and roll, one of them erased.

    O.save keeps 17 digits, sums may be taken in another order.
    """
    out = scenes["reload"][live]
    assert ".load(file)" in scenes["told"][f"not loaded {live}"]
    assert "are attached or loaded in this process" in scenes["told"][f"not attached {live}"]
    last, repeated, early = out["counts"]
    assert early > 5
    assert last == repeated
    unbroken = np.array(out["unbroken"])
    F = np.array(out["F"])
    assert np.abs(out["again"] - unbroken).max() < 1e-9 * np.abs(unbroken).max()
    assert np.abs(out["F_again"] - F).max() < 1e-6 * np.abs(F).max()


def test_a_state_of_the_other_mode_or_law_is_refused_and_changes_nothing(scenes):
    words = {
        "live into table": "saved in live mode, and these joints are in table mode: create "
        "Joints(LiveLaw(law), ...) and load",
        "table into live": "saved in table mode, and these joints are in live mode: create "
        'Joints(TableLaw("joint.txt"), ...) and load',
        "another law": "state belongs to a joint law with other parameters",
        "another table": "the state was saved with another table",
        "while it runs": "saved in table mode",
    }
    assert {name: part for name, part in words.items() if part not in scenes["told"][name]} == {}
    assert scenes["untouched"] == [0, 0, 0]
    before, after = scenes["running"]
    assert before == after
    assert before[0][0] > 0.0
