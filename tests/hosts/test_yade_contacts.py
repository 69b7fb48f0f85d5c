"""Which contact a joint belongs to in the real YADE, while bodies and interactions are erased."""

import numpy as np
import pytest
from yade_host import make_table, run_scene

import jointlaw as jl

SCENES = """
from jointlaw import JointLaw
law = JointLaw.from_toml("law.toml")
end = law.closure_range
TOUCHING = .5 - .3 * end
FAR = .5 + .3 * end

def erase_interaction():
    O.interactions.erase(0, 1)
    O.bodies[1].state.pos = (0, 0, 2)

def erase_body():
    O.bodies.erase(1)

def replace_body():
    O.bodies.erase(1)
    O.bodies.append(utils.sphere((9, 9, 9), .5))

def reuse_id():
    O.bodies.erase(1)
    O.bodies.insertAtId(utils.sphere((0, 0, TOUCHING), .5), 1)
    O.bodies[1].state.blockedDOFs = "xyzXYZ"

def erase_and_meet_again():
    O.interactions.erase(0, 1)

def clear_interactions():
    O.interactions.clear()

CHANGES = [erase_interaction, erase_body, replace_body, reuse_id, erase_and_meet_again,
           clear_interactions]

def shear(k, steps=10):
    for _ in range(steps):
        O.bodies[k].state.pos += Vector3(.02 * end, 0, 0)
        O.step()

def change_contacts(live, change, is_joint, arrives=True):
    # sphere 1 is sheared, then changed; in the same step sphere 2 forms a contact if it arrives
    material()
    O.bodies.append(utils.box((0, 0, -1), (20, 20, 1), fixed=True))
    O.bodies.append(utils.sphere((0, 0, TOUCHING), .5))
    O.bodies.append(utils.sphere((3, 0, FAR), .5))
    O.bodies.append(utils.sphere((6, 0, TOUCHING), .5))
    engines(keep=True)
    O.dt = 1e-3
    for k in (1, 2, 3): O.bodies[k].state.blockedDOFs = "xyzXYZ"
    joints = attached(LiveLaw(law) if live else TableLaw("joint.txt"),
                      select=None if is_joint else lambda i: i.id2 != 1)
    O.step()
    shear(1)
    for k in range(5):
        O.bodies[3].state.pos += Vector3(.02 * end, 0, 0)
        O.step()
    sheared = [list(O.forces.f(k)) for k in (1, 3)]
    change()
    if arrives: O.bodies[2].state.pos = (3, 0, TOUCHING)
    O.step()
    at_change = list(O.forces.f(1))
    shear(2)
    return dict(sheared=sheared, at_change=at_change, force=[list(O.forces.f(k)) for k in (2, 3)],
                ids=sorted(joints.contacts()["ids"][:, 1].tolist()),
                known=len(joints.interactions), law=joints.law.shear_traction.shape[1]
                if not live else len(joints.law.pool))

out = {f"{mode} {change.__name__} {is_joint}": change_contacts(mode == "live", change, is_joint)
       for mode in ("live", "table") for change in CHANGES for is_joint in (True, False)}
for mode in ("live", "table"):
    for change in (reuse_id, erase_and_meet_again):
        alone = change_contacts(mode == "live", change, True, arrives=False)
        out[f"{mode} {change.__name__} alone"] = alone
result(**out)
"""


@pytest.fixture(scope="module", params=["1", "2"])
def scenes(request, tmp_path_factory):
    """All scenes of this file, in one YADE with one or two threads."""
    folder = tmp_path_factory.mktemp("contacts")
    law = jl.presets.load("jing-replica")
    law.to_toml(folder / "law.toml")
    make_table(folder / "joint.txt", eta=0.5, end=law.closure_range)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JOINTLAW_THREADS", request.param)
        return run_scene(folder, SCENES, live=True, threads=request.param)


@pytest.mark.parametrize("mode", ["live", "table"])
@pytest.mark.parametrize("is_joint", [True, False])
@pytest.mark.parametrize(
    "change",
    ["erase_interaction", "erase_body", "replace_body", "reuse_id", "erase_and_meet_again",
     "clear_interactions"],
)  # fmt: skip
def test_each_contact_has_its_own_joint(scenes, mode, is_joint, change):
    """Sphere 2, whose contact forms as another ends, has the force that sphere 1 had when sheared
    alike; a body that has the id of an erased one starts unsheared."""
    out = scenes[f"{mode} {change} {is_joint}"]
    remains = change in ("reuse_id", "erase_and_meet_again", "clear_interactions")
    ids = [1, 2, 3] if remains and is_joint else [2, 3]
    assert out["ids"] == ids
    assert out["known"] == out["law"] == len(ids)
    sheared, sheared_less = np.array(out["sheared"])
    force, untouched = np.array(out["force"])
    peak = np.abs(force).max()
    assert abs(force[0]) > 0.1 * force[2] > 0.0
    if is_joint:
        assert np.abs(force - sheared).max() < 1e-9 * peak
        # the contact of a body that was not erased is kept, unless all interactions were cleared
        if change != "clear_interactions":
            assert np.abs(untouched - sheared_less).max() < 1e-9 * peak
        else:
            assert abs(untouched[0]) < 1e-9 * peak
        if remains:
            assert abs(out["at_change"][0]) < 1e-9 * peak < out["at_change"][2]


@pytest.mark.parametrize("mode", ["live", "table"])
@pytest.mark.parametrize("change", ["reuse_id", "erase_and_meet_again"])
def test_a_contact_of_the_same_ids_is_a_new_one(scenes, mode, change):
    """Also where the number of contacts is the same before and after the step."""
    out = scenes[f"{mode} {change} alone"]
    assert out["ids"] == [1, 3]
    shear_force, _, normal_force = out["at_change"]
    assert abs(shear_force) < 1e-9 * normal_force
    assert abs(out["sheared"][0][0]) > 0.1 * normal_force
