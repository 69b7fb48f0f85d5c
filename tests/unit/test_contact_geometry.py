"""Geometry of contacts in the compiled library: the same bits as the adapter for YADE in numpy.

The adapter is imported with a module `yade` that holds only the names that it imports.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import jointlaw
from jointlaw.native import build, library
from jointlaw.native.contacts import ContactGeometry
from jointlaw.tables import joint_table

BODIES = 40
CONTACTS = 300  # more than one tile of contacts.c, and no multiple of the width of a vector
LIBRARY = library.load()
VECTOR_WIDTHS = (
    [n for n in build.LEVELS if n & LIBRARY.jlaw_levels() and n <= LIBRARY.jlaw_lanes()]
    if LIBRARY
    else []
)
pytestmark = pytest.mark.skipif(LIBRARY is None, reason="the library was not built")


class Vector(tuple):
    """As YADE's Vector3."""

    def __getinitargs__(self):
        return tuple(self)


@pytest.fixture(scope="module")
def adapter():
    yade = ModuleType("yade")
    for name in ("FrictPhys", "O", "PyRunner", "Quaternion", "ScGeom", "Sphere", "Vector3"):
        setattr(yade, name, object)
    path = Path(jointlaw.__file__).parent / "hosts" / "yade" / "files" / "yade_joint.py"
    spec = importlib.util.spec_from_file_location("yade_joint_without_yade", path)
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "yade", yade)
        patch.setitem(sys.modules, "joint_table", joint_table)
        spec.loader.exec_module(module)
    return module


def make_joints(adapter, has_plane, other_shapes):
    """Joints between bodies at random places before a step, and the bodies' places after it.

    The references of some axes 2 are nearly parallel to the normal. Contacts of other shapes have a
    normal, overlap and contact point by YADE.
    """
    rng = np.random.default_rng(1)
    b1 = rng.integers(0, BODIES, CONTACTS)
    b2 = (b1 + rng.integers(1, BODIES, CONTACTS)) % BODIES
    x0 = rng.normal(0.0, 1.0, (3, BODIES))
    q0 = rng.normal(0.0, 1.0, (4, BODIES))
    q0 /= np.linalg.norm(q0, axis=0)
    x = x0 + rng.normal(0.0, 1e-3, x0.shape)
    q = q0 + rng.normal(0.0, 1e-3, q0.shape)
    q /= np.linalg.norm(q, axis=0)
    normal = adapter.unit(x0[:, b2] - x0[:, b1])
    axis = adapter.unit(rng.normal(0.0, 1.0, (3, CONTACTS)))
    across = adapter.unit(adapter.cross(normal, rng.normal(0.0, 1.0, (3, CONTACTS))))
    plane = adapter.unit(rng.normal(0.0, 1.0, (3, CONTACTS)))
    if has_plane:
        normal = adapter.rotate(q0[:, b1], plane)
    axis[:, ::7] = adapter.rotate(adapter.conjugate(q0[:, b1]), normal + 0.1 * axis)[:, ::7]
    both_spheres = np.ones(CONTACTS)
    both_spheres[other_shapes] = 0.0
    joints = object.__new__(adapter.Joints)
    joints.plane = plane[:, :1] if has_plane else None
    joints.law = SimpleNamespace(geometry=None, mode="live")
    joints.bodies = dict.fromkeys(range(BODIES))
    joints.x = x
    joints.q = q
    joints.contact_data = {
        "b1": b1, "b2": b2, "created": b1, "R1": rng.uniform(0.4, 0.6, CONTACTS),
        "R2": rng.uniform(0.4, 0.6, CONTACTS), "area": rng.uniform(0.5, 1.0, CONTACTS),
        "both_spheres": both_spheres, "zero_overlap": rng.normal(0.0, 1e-3, CONTACTS),
        "closure": rng.normal(0.0, 1e-3, CONTACTS), "n": normal, "t2": across, "axis": axis,
        "c1": 0.5 * normal, "c2": -0.5 * normal, "plane": plane,
    }  # fmt: skip
    joints.interactions = {
        k: SimpleNamespace(geom=SimpleNamespace(
            normal=Vector(normal[:, k] + 1e-3), penetrationDepth=1e-3 * k,
            contactPoint=Vector(x[:, b1[k]] + 0.4 * normal[:, k])))
        for k in other_shapes
    }  # fmt: skip
    return joints, x0, q0


@pytest.mark.parametrize("case", ["spheres", "spheres and other shapes", "flat joint"])
@pytest.mark.parametrize("lanes", VECTOR_WIDTHS)
def test_compiled_geometry_and_forces_have_the_bits_of_numpy(adapter, case, lanes):
    geometry = ContactGeometry()
    geometry._lanes = lanes
    other_shapes = [3, 120, CONTACTS - 1] if case == "spheres and other shapes" else []
    results = []
    for compiled in (None, geometry):
        joints, x0, q0 = make_joints(adapter, case == "flat joint", other_shapes)
        joints.law.geometry = compiled
        motion = joints._motion(x0, q0)
        motion.pop("spin", None)
        start = make_joints(adapter, case == "flat joint", other_shapes)[0].contact_data
        steep = (joints.contact_data["axis"] != start["axis"]).any(axis=0)
        assert 10 < steep.sum() < CONTACTS // 2  # both kinds of references occur
        joints.contact_data.update(motion)
        rng = np.random.default_rng(2)
        F = np.ascontiguousarray(rng.normal(0.0, 1e6, (CONTACTS, 3))).T
        added = np.zeros((CONTACTS, 3))
        added[-5:] = rng.normal(0.0, 1e6, (5, 3))
        for forces_in_step in (None, added):
            if compiled is None:
                force, torque = joints._sum_forces(F, forces_in_step)
            else:
                force, torque = compiled.forces(joints.contact_data, F, forces_in_step, BODIES)
            motion |= {f"force {forces_in_step is None}": force,
                       f"torque {forces_in_step is None}": torque}  # fmt: skip
        results.append(motion | {"axis": joints.contact_data["axis"]})
    by_numpy, by_library = results
    assert by_numpy.keys() == by_library.keys()
    for name, expected in by_numpy.items():
        assert np.isfinite(expected).all()
        assert np.array_equal(by_library[name], expected), name


def test_no_contacts_give_no_forces():
    contacts = {name: np.zeros((3, 0)) for name in ("n", "t2", "c1", "c2", "axis")}
    contacts |= {name: np.zeros(0) for name in ("R1", "R2", "area", "both_spheres", "closure")}
    contacts |= {name: np.zeros(0, int) for name in ("b1", "b2")}
    force, torque = ContactGeometry().forces(contacts, np.zeros((3, 0)), None, 2)
    assert not force.any()
    assert not torque.any()
