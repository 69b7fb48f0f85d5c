"""Rock joints on the contacts of a YADE simulation. Needs YADE, numpy and `joint_table.py`.

    from yade_joint import Joints, TableLaw     # both files in the script's folder (on sys.path)
    joints = Joints(TableLaw("joint.txt"))      # or Joints(LiveLaw("law.toml")): the law itself
    joints.attach()                             # after O.engines is set
    O.dt = joints.time_step()

Why it works as it does:

- Python cannot define a contact law (`Law2`) in YADE. The adapter is a `PyRunner` that runs after
  `InteractionLoop`. YADE does contact detection and geometry; the adapter computes the traction of
  all joints at once and adds force and torque to the bodies. So a force belongs to the positions of
  the same step, which keeps the time integration symplectic.
- The contact force of YADE is switched off by kn = ks = 0. YADE has already applied its force
  in the step in which a contact forms; the adapter subtracts it.
- The history of a joint belongs to a contact, not to a pair of ids: two bodies that separate and
  meet again form a new contact, and YADE may give the id of an erased body to another one. So
  `interaction_key` is the two ids and the iteration in which the interaction became real.
- To read the keys of all interactions in every step would cost as much as YADE's own contact law.
  Each step instead checks that no contact can have ended unnoticed. An interaction that ended has
  another `iterMadeReal`, or none. Erasing a body removes its interactions, which look as before
  from Python, but the id of the erased body becomes -1: the adapter keeps all bodies whose
  interactions it knows, and compares their ids. After `O.interactions.clear()` a known interaction
  is no longer found by its ids. If any check fails, or the number of bodies changed, all
  interactions are matched by key. Otherwise the known contacts exist, the difference to YADE's
  number of real interactions is the number of new ones, and these have the present `iterMadeReal`.
- Arrays hold one column per contact, in the order of `interactions`. Law, geometry and forces are
  computed for all contacts in a few calls: of numpy in table mode, which needs no package jointlaw,
  of its compiled library in live mode, which gives the same bits.
- The frame of a contact rotates with the bodies. Increments are computed in the mean frame of a
  step, with rotation vectors for which a rigid motion of the pair, however large, gives exactly
  zero.
- Python objects are not part of `O.save`: `Joints.save` and `Joints.load` store the state.

Frame of a contact: axis 1 is the contact normal of YADE (from body id1 to id2), axis 2 the
direction `azimuth`, which is fixed to body id1 and projected on the contact plane, axis 3 =
axis 1 x axis 2.
Displacements are of body id1 relative to body id2, closure positive; the force on id1 is -area * F.
SI units: m, Pa, N, s, kg.
"""

# ruff: noqa: B905 (older versions of Python lack strict=)

from collections import deque
from itertools import chain
from operator import attrgetter

import numpy as np
from joint_table import load_table
from yade import FrictPhys, O, PyRunner, Quaternion, ScGeom, Sphere, Vector3

VERSION = 2  # of the files that `Joints.save` writes

_attached = {}  # name -> Joints; the PyRunner of each finds them here


def run(name):
    """One step of the adapter called `name`: the command of its PyRunner."""
    if name not in _attached:
        raise RuntimeError(
            f"no joints {name!r} are attached or loaded in this process: to continue a saved run, "
            f"create Joints(..., name={name!r}) after O.load and call .load(file). For new joints "
            f"remove the engine joint_{name} from O.engines and call .attach()"
        )
    _attached[name].step()


# -------------------------------------------------------------- laws of the contacts


class TableLaw:
    """A law as a table, a text file: normal stress by closure, elastic-perfectly plastic shear."""

    mode = "table"
    geometry = None  # compiled geometry of contacts; None: numpy

    def __init__(self, path):
        self.table = load_table(path)
        self.shear_traction = np.zeros((2, 0))  # in the frames of the contacts
        self.K = np.zeros((3, 0))  # shear stiffness K22, K33, K23 of the last step

    def stiffness(self, closure=None):
        """Largest stiffness (Pa/m) of the table."""
        t = self.table
        return float(max(t.kn_tangent.max(), t.kn_secant.max(), t.shear_stiffness.max()))

    def step(self, d, closure, spin):
        """Tractions (3, n) after increments d (3, n); spin (n,) rotates the old shear traction."""
        F, self.K = self.table.step(self.shear_traction, self.K, d, closure, spin)
        self.shear_traction = F[1:]
        return F

    def add_contacts(self, closure, bonded):
        """Add new contacts: unsheared joints at this closure (m)."""
        row, w, _ = self.table.locate(closure)
        self.shear_traction = np.concatenate(
            [self.shear_traction, np.zeros((2, len(closure)))], axis=1
        )
        self.K = np.concatenate([self.K, self.table.shear_matrix(row, w)], axis=1)

    def keep_contacts(self, mask):
        """Remove the contacts for which `mask` is False."""
        self.shear_traction = self.shear_traction[:, mask]
        self.K = self.K[:, mask]

    def state(self):
        """Arrays of a checkpoint."""
        return {"f": self.shear_traction, "K": self.K, "stress": self.table.normal_stress}

    def restore(self, data):
        """Restore a checkpoint. Raises ValueError if it belongs to another table."""
        if not np.array_equal(data["stress"], self.table.normal_stress):
            raise ValueError(
                "the state was saved with another table: create TableLaw with that table"
            )
        self.shear_traction = data["f"]
        self.K = data["K"]


class LiveLaw:
    """The path-dependent law: a pool with one joint per contact (needs the package `jointlaw`).

    The history variables exist as long as the interaction in YADE, so `Law2...(neverErase=True)` is
    required: a sheared joint dilates and carries stress at negative closure. For a new contact only
    the shear after first touch counts. The frame rotates with body id1.

    law: a law of jointlaw, or the path of its file.
    track_dissipation: sum up the dissipated energy, for `batch.dissipated_energy`, at some cost;
        `pool.places` are the places of the contacts in `batch`.
    """

    mode = "live"

    def __init__(self, law, track_dissipation=False):
        from jointlaw import JointLaw, JointPool  # not needed in table mode

        law = law if hasattr(law, "dim") else JointLaw.from_toml(law)
        if law.dim != 3:
            raise ValueError(
                "contacts in YADE shear in 3-D: set law.plane=None, closure_only=False"
            )
        self.law = law
        self.pool = JointPool(law, track_dissipation)
        self.geometry = None
        if self.pool.batch.kernel == "native":
            from jointlaw.native.contacts import ContactGeometry

            self.geometry = ContactGeometry()
        self._update_places()

    def stiffness(self, closure=None):
        """Upper bound of the stiffness (Pa/m) up to `closure`, closure_range by default."""
        return float(self.law.max_stiffness(self.law.closure_range if closure is None else closure))

    def step(self, d, closure, spin):
        """Tractions (3, n) after increments d (3, n)."""
        if self.prepared_step is None or len(self.prepared_step.d) != d.shape[1]:
            self.prepared_step = self._prepare_step(d.shape[1])
        self.prepared_step.d[:] = d.T
        self.batch.advance(self.prepared_step)
        return self.prepared_step.F.T

    def _prepare_step(self, n):
        """A step of all contacts, whose arrays and sorted list of places are used again."""
        from jointlaw.kernels.engine import Step

        return Step(np.empty((n, 3)), np.empty((n, 3)), None, self.where)

    def add_contacts(self, closure, bonded):
        """Add new contacts: virgin joints at this closure (m; negative before touch).

        bonded: whether they have the bond of the law.
        """
        keys = [object() for _ in closure]  # unique; contacts are identified by their order
        new = self.pool.add(keys)
        if not bonded:
            self.batch.break_bond(new)
        self.batch.update(np.outer(closure, [1.0, 0.0, 0.0]), where=new, tangent=False)
        self._update_places()

    def keep_contacts(self, mask):
        """Remove the contacts for which `mask` is False."""
        self.pool.remove([key for key, keep in zip(self.pool.keys, mask) if not keep])
        self._update_places()

    def _update_places(self):
        """Update the batch and the places of all contacts in it; None: all places, in order."""
        self.batch = self.pool.batch
        places = self.pool.places
        self.prepared_step = None
        self.where = None if np.array_equal(places, np.arange(len(self.batch))) else places

    def state(self):
        """Arrays of a checkpoint."""
        state = self.pool.snapshot()
        return {"fingerprint": state.fingerprint, "values": state.values.T}

    def restore(self, data):
        """Restore a checkpoint. Raises ValueError if another law wrote it."""
        from jointlaw.joints.state import JointState

        values = data["values"].T
        self.pool.restore([object() for _ in values], JointState(str(data["fingerprint"]), values))
        self._update_places()


# ---------------------------------------------------------------- the adapter

# Numbers per contact, shape (n,). created: iteration in which the interaction became real; b1, b2:
# places of the bodies in the arrays of bodies; zero_overlap: overlap at zero closure
PER_CONTACT = {int: ["id1", "id2", "created", "b1", "b2"],
               float: ["R1", "R2", "area", "both_spheres", "zero_overlap", "closure"]}  # fmt: skip
VECTORS = ["n", "t2", "c1", "c2", "axis", "plane", "F"]  # shape (3, n)


class Joints:
    """A joint law on contacts of the simulation.

    law: a `TableLaw` or a `LiveLaw`.
    area: of one contact in m2: a number, a function of the interaction, or None for the
        cross-section of the smaller sphere.
    select: function of an interaction that returns whether it is a joint; called when it forms.
    azimuth: direction of the law's axis 2 in the axes of body id1.
    plane: None, or the normal of the joint in the axes of body id1: contacts then are parts of one
        flat joint (a "smooth joint"), whatever the direction between the two spheres.
    mated: closure counts from the position in which the contact forms, not from touch.
    max_opening: with neverErase, opening (m) beyond which a contact without force is deleted.
    """

    def __init__(self, law, area=None, select=None, azimuth=(1, 0, 0), plane=None, mated=False,
                 max_opening=np.inf, name="joints"):  # fmt: skip
        if not name.isidentifier():
            raise ValueError(f"name = {name!r} must be a Python identifier: it labels the engine")
        self.law = law
        self.select = select
        self.name = name
        self.area = area if area is None or callable(area) else float(area)
        if not (area is None or callable(area) or 0 < area < np.inf):
            raise ValueError(f"area = {area} m2 must be > 0 and finite")
        if not max_opening >= 0:
            raise ValueError(f"max_opening = {max_opening} m must be >= 0")
        self.azimuth = unit(np.reshape(azimuth, (3, 1)).astype(float))
        self.plane = None if plane is None else unit(np.reshape(plane, (3, 1)).astype(float))
        self.mated = mated
        self.max_opening = max_opening
        _attached.pop(name, None)  # joints of an earlier scene
        self.contact_data = {
            one: np.zeros(0, kind) for kind, names in PER_CONTACT.items() for one in names
        }
        self.contact_data.update({one: np.zeros((3, 0)) for one in VECTORS})
        self.interactions = []
        self.created = []  # `iterMadeReal` of the interactions
        self.other_interactions = {}  # not joints, by `interaction_key`
        # of bodies with joints, by id; None before the first step after `load`
        self.bodies = {}
        self.states = []
        self.other_bodies = {}  # of other interactions, by id
        self.x = np.zeros((3, 0))
        self.q = np.zeros((4, 0))
        self.last_iteration = None  # O.iter
        self.body_count = len(O.bodies)

    @property
    def F(self):
        """Tractions (3, n) of the last step in the contacts' frames, Pa, as a copy."""
        return self.contact_data["F"].copy()

    def __len__(self):
        return len(self.contact_data["created"])

    # ------------------------------------------------------------------ set-up

    def attach(self):
        """Insert the adapter into O.engines, right after InteractionLoop."""
        engines = list(O.engines)
        kinds = [type(engine).__name__ for engine in engines]
        if "InteractionLoop" not in kinds:
            raise ValueError("O.engines has no InteractionLoop; set O.engines before attach()")
        if any(e.label == f"joint_{self.name}" for e in engines):
            raise ValueError(
                f"name = {self.name!r} is taken in O.engines: give another name=, or call "
                ".load(file) instead of .attach() to continue a saved run"
            )
        if O.periodic:
            raise ValueError(
                "O.periodic = True: joints across a periodic boundary are not supported"
            )
        if any(k == "GlobalStiffnessTimeStepper" and not e.dead for k, e in zip(kinds, engines)):
            raise ValueError(
                "GlobalStiffnessTimeStepper reads kn = 0: remove it, set O.dt = joints.time_step()"
            )
        at = kinds.index("InteractionLoop")
        for law2 in engines[at].lawDispatcher.functors:
            if self.law.mode == "live" and not getattr(law2, "neverErase", True):
                raise ValueError(
                    f"{type(law2).__name__}.neverErase = False: YADE deletes joints that dilate;"
                    " set neverErase=True (and max_opening= here, to delete open contacts)"
                )
        runner = PyRunner(
            command=f"import yade_joint; yade_joint.run({self.name!r})",
            iterPeriod=1, initRun=True, label=f"joint_{self.name}",
            updateGlobals=False,  # otherwise YADE copies local variables to globals
        )  # fmt: skip
        O.engines = [*engines[: at + 1], runner, *engines[at + 1 :]]
        _attached[self.name] = self

    def time_step(self, safety=0.25, closure=None):
        """A fixed time step (s): a fraction `safety` of the stable one of all free spheres.

        closure: the largest expected (m); the end of the table or the closure range by default.
        Each sphere counts with its present joints, or six if it has fewer. If `area` is a function,
        the areas are known from contacts only: ValueError before the first one.
        """
        k = self.law.stiffness(closure)
        shortest = np.inf
        if callable(self.area) and not len(self):
            raise ValueError(
                "area is a function, and there is no contact to evaluate it for: call time_step() "
                "after the first step, or set O.dt"
            )
        place = np.concatenate([self.contact_data["id1"], self.contact_data["id2"]])
        areas = np.tile(self.contact_data["area"], 2)
        total = np.bincount(place, areas, minlength=len(O.bodies))
        largest = np.zeros(len(O.bodies))
        np.maximum.at(largest, place, areas)
        default = areas.max() if callable(self.area) else self.area
        for body in O.bodies:
            if body is None or not isinstance(body.shape, Sphere) or body.state.mass <= 0:
                continue
            one = np.pi * body.shape.radius**2 if self.area is None else largest[body.id] or default
            carried = max(6 * one, total[body.id])
            # factors: two bodies (2), rolling (1 + m R^2/I = 3.5 for a sphere)
            shortest = min(shortest, 2 * np.sqrt(body.state.mass / (2 * 3.5 * k * carried)))
        if not np.isfinite(shortest):
            raise ValueError("no free sphere in O.bodies: set O.dt by hand")
        return safety * shortest

    # -------------------------------------------------------------------- step

    def step(self):
        """Advance all joints; the PyRunner calls this once per step."""
        now = O.iter
        if self.last_iteration is not None and now != self.last_iteration + 1:
            raise RuntimeError(
                f"joints {self.name!r}: O.iter went from {self.last_iteration} to {now}. "
                "The adapter must run in every step (iterPeriod=1); after O.load call .load(file)"
            )
        self._advance(self._update_contacts(now))
        self.last_iteration = now

    def _advance(self, fresh):
        """Compute displacement increments, tractions of the law, and forces on the bodies.

        fresh: indices of the new contacts, which are the last ones.
        """
        c = self.contact_data
        x0 = self.x
        q0 = self.q
        self.x, self.q = self._read_bodies()
        motion = self._motion(x0, q0)
        closure = motion["closure"]
        d = motion.pop("d")
        approach = motion.pop("approach")
        spin = motion.pop("spin", None)
        if fresh.size:
            before = closure[fresh] - approach[fresh]
            if self.mated:
                before = np.zeros(len(fresh))
                d[:, fresh] = 0.0
            self.law.add_contacts(
                before, self.last_iteration is None
            )  # bonds in the first step only
            d[0, fresh] = closure[fresh] - before
        F = self.law.step(d, closure, spin)
        c.update(motion, F=F)
        self._apply_forces(F, fresh)
        if self.max_opening < np.inf:
            for k in np.flatnonzero((closure < -self.max_opening) & ~F.any(axis=0)):
                O.interactions.erase(int(c["id1"][k]), int(c["id2"][k]))

    def _motion(self, x0, q0):
        """Frames of all contacts and increments of their displacements in the step from x0, q0.

        Returns arrays over contacts by name: n, t2, c1, c2, closure; the increments d of the
        displacement; approach, the displacement of body id1 along the normal; and in table mode
        spin, by which shear forces rotate in the frame.
        """
        c = self.contact_data
        x = self.x
        q = self.q
        if self.law.geometry is not None:
            geometry = self._read_other_shapes(x, self._empty_geometry())
            return self.law.geometry.motion(
                c, (x0.T, q0.T), (x.T, q.T), self.plane is not None, geometry
            )
        b1 = c["b1"]
        b2 = c["b2"]
        q1 = q.take(b1, axis=1)
        n, un, c1, c2 = self._geometry(x, q1).values()
        closure = un - c["zero_overlap"]
        t2 = self._tangent(n, q1)
        # displacement of id1 relative to id2 at the contact, in the mean frame of the step: a rigid
        # motion of the pair, however large, gives exactly zero
        turn = rotation_vectors(q, q0)
        dx = x - x0
        w1 = turn.take(b1, axis=1)
        w2 = turn.take(b2, axis=1)
        du = dx.take(b1, axis=1) - dx.take(b2, axis=1)
        du += (cross(w1, c1 + c["c1"]) - cross(w2, c2 + c["c2"])) / 2
        middle = unit(n + c["n"])
        across = unit(t2 + c["t2"])
        d = np.array([closure - c["closure"], dot(du, across), dot(du, cross(middle, across))])
        spin = self._spin(n, t2, w1 + w2) if self.law.mode == "table" else None
        return {"n": n, "t2": t2, "c1": c1, "c2": c2, "closure": closure, "d": d,
                "approach": dot(du, n), "spin": spin}  # fmt: skip

    def _geometry(self, x, q1):
        """Normal n, overlap un, and the contact point c1, c2 relative to either centre, by name."""
        c = self.contact_data
        r = x.take(c["b2"], axis=1) - x.take(c["b1"], axis=1)
        R1 = c["R1"]
        R2 = c["R2"]
        if self.plane is not None:
            n = rotate(q1, c["plane"])
            c1 = r * (R1 / (R1 + R2))
            return {"n": n, "un": -dot(r, n), "c1": c1, "c2": c1 - r}
        length = np.sqrt(dot(r, r))
        n = r / length
        un = R1 + R2 - length
        c1 = n * (R1 - un / 2)
        return self._read_other_shapes(x, {"n": n, "un": un, "c1": c1, "c2": c1 - r})

    def _empty_geometry(self):
        """Arrays for n, un, c1, c2 of `_geometry`."""
        size = len(self)
        vectors = {name: np.empty((3, size)) for name in ("n", "c1", "c2")}
        return vectors | {"un": np.empty(size)}

    def _read_other_shapes(self, x, geometry):
        """Write the geometry of contacts that are not of two spheres, by YADE, into the arrays."""
        c = self.contact_data
        for k in np.flatnonzero(c["both_spheres"] == 0).tolist():
            geom = self.interactions[k].geom
            geometry["n"][:, k] = geom.normal.__getinitargs__()
            geometry["un"][k] = geom.penetrationDepth
            point = np.array(geom.contactPoint.__getinitargs__())
            geometry["c1"][:, k] = point - x[:, c["b1"][k]]
            geometry["c2"][:, k] = point - x[:, c["b2"][k]]
        return geometry

    def _tangent(self, n, q1):
        """Axis 2: the reference direction of body id1, projected on the contact plane."""
        c = self.contact_data
        a = rotate(q1, c["axis"])
        t2 = a - n * dot(a, n)
        # within 30 degrees of the normal, after rolling: continue with the last axis
        steep = np.flatnonzero(dot(t2, t2) < 0.25)
        old = c["t2"][:, steep]
        t2[:, steep] = unit(old - n[:, steep] * dot(old, n[:, steep]))
        c["axis"][:, steep] = rotate(conjugate(q1[:, steep]), t2[:, steep])
        return unit(t2)

    def _spin(self, n, t2, w):
        """Rotation of shear forces in the frame: minimal rotation of n, and mean spin about it."""
        n0 = self.contact_data["n"]
        old = self.contact_data["t2"]
        both = n + n0
        one_plus_cosine = 1 + dot(n, n0)
        old = old - both * (dot(old, n) / one_plus_cosine)
        twist = 2 * np.arctan(dot(both, w) / (4 * one_plus_cosine + dot(w, cross(n0, n))))
        return twist + np.arctan2(dot(old, cross(n, t2)), dot(old, t2))

    def _remove_yade_force(self, fresh):
        """Set the stiffness in YADE to zero; returns YADE's forces on id1 in the present step."""
        result = np.zeros((3, len(fresh)))
        for column, k in enumerate(fresh):
            phys = self.interactions[k].phys
            result[:, column] = (-(phys.normalForce + phys.shearForce)).__getinitargs__()
            phys.kn = phys.ks = phys.tangensOfFrictionAngle = 0.0
            phys.shearForce = phys.normalForce = Vector3(0, 0, 0)
        return result

    def _apply_forces(self, F, fresh):
        """Add the forces of tractions F on id1, the opposite on id2, and torques to the bodies.

        In a step in which contacts form, the forces that YADE has applied to them are subtracted.
        """
        added = None
        if fresh.size:
            added = np.zeros((len(self), 3))
            added[fresh] = -self._remove_yade_force(fresh).T
        if self.law.geometry is None:
            force, torque = self._sum_forces(F, added)
        else:
            force, torque = self.law.geometry.forces(self.contact_data, F, added, len(self.bodies))
        # deque: calls without the cost of a loop in Python; zip: no list for each body
        deque(map(O.forces.addF, self.bodies, zip(*force.T.tolist())), maxlen=0)
        deque(map(O.forces.addT, self.bodies, zip(*torque.T.tolist())), maxlen=0)

    def _sum_forces(self, F, added):
        """Forces and torques (bodies, 3) by tractions F (3, n), and forces added (n, 3) on id1."""
        c = self.contact_data
        n = c["n"]
        t2 = c["t2"]
        force = (n * F[0] + t2 * F[1] + cross(n, t2) * F[2]) * -c["area"]
        if added is not None:
            force += added.T
        size = len(self.bodies)
        torque1 = cross(c["c1"], force)
        torque2 = cross(force, c["c2"])
        total = [np.bincount(c["b1"], f, size) - np.bincount(c["b2"], f, size) for f in force]
        turn = [np.bincount(c["b1"], t1, size) + np.bincount(c["b2"], t2, size)
                for t1, t2 in zip(torque1, torque2)]  # fmt: skip
        return np.transpose(total), np.transpose(turn)

    # ---------------------------------------------------------------- contacts

    def _update_contacts(self, now):
        """Update the joints after YADE's contact detection; returns the indices of new ones."""
        if self._may_have_lost_contacts():
            return self._create_joints(self._match_by_key())
        created = list(map(iter_made_real, self.interactions))
        if created != self.created:
            self._keep_contacts(np.array(created, int) == self.contact_data["created"])
        others = self.other_interactions
        if list(map(iter_made_real, others.values())) != [key[2] for key in others]:
            self.other_interactions = {
                key: i for key, i in others.items() if i.iterMadeReal == key[2]
            }
        missing = O.interactions.countReal() - len(self.interactions) - len(self.other_interactions)
        new = [i for i in O.interactions.all(True) if i.iterMadeReal == now] if missing else []
        return self._create_joints(new if len(new) == missing else self._match_by_key())

    def _may_have_lost_contacts(self):
        """Whether bodies or all interactions were erased since the last step, or a scene loaded."""
        if len(O.bodies) != self.body_count:
            return True
        for bodies in (self.bodies, self.other_bodies):
            if list(map(body_id, bodies.values())) != list(bodies):
                return True
        known = self.interactions or list(self.other_interactions.values())
        return any(not O.interactions.has(i.id1, i.id2) for i in known[:1])

    def _match_by_key(self):
        """Match all interactions by key, which is slow; returns the new ones."""
        real = {interaction_key(i): i for i in O.interactions.all(True)}
        c = self.contact_data
        keys = list(zip(c["id1"].tolist(), c["id2"].tolist(), c["created"].tolist()))
        self._keep_contacts(np.array([one in real for one in keys], bool))
        self.interactions = [real.pop(one) for one in keys if one in real]
        self.other_interactions = {
            one: real.pop(one) for one in self.other_interactions if one in real
        }
        ids = {k for key in self.other_interactions for k in key[:2]}
        self.other_bodies = {k: O.bodies[k] for k in ids}
        self._keep_bodies()
        self.body_count = len(O.bodies)
        return list(real.values())

    def _keep_bodies(self):
        """Keep the bodies of the present joints, and forget all others."""
        c = self.contact_data
        used = {*c["id1"].tolist(), *c["id2"].tolist()}
        place = [n for n, k in enumerate(self.bodies) if k in used]
        self.bodies = {k: O.bodies[k] for k in self.bodies if k in used}
        self.states = [body.state for body in self.bodies.values()]
        self.x = self.x[:, place]
        self.q = self.q[:, place]
        self._number_bodies()

    def _number_bodies(self):
        """Write the places of the bodies in the arrays of bodies."""
        c = self.contact_data
        place = {k: n for n, k in enumerate(self.bodies)}
        for b, ids in (("b1", "id1"), ("b2", "id2")):
            c[b] = np.array([place[k] for k in c[ids].tolist()], int)

    def _keep_contacts(self, mask):
        """Remove the contacts for which `mask` is False."""
        self.contact_data = {key: value[..., mask] for key, value in self.contact_data.items()}
        self.created = self.contact_data["created"].tolist()
        self.interactions = [i for i, keep in zip(self.interactions, mask) if keep]
        self.law.keep_contacts(mask)

    def _create_joints(self, contacts):
        """Create joints for the selected new interactions; returns their indices."""
        created = []
        rows = []
        for i in contacts:
            if self.select is not None and not self.select(i):
                self.other_interactions[interaction_key(i)] = i
                self.other_bodies.update({k: O.bodies[k] for k in (i.id1, i.id2)})
                continue
            if not isinstance(i.geom, ScGeom) or type(i.phys) is not FrictPhys:
                raise TypeError(
                    f"contact {i.id1}-{i.id2} has {type(i.geom).__name__} and "
                    f"{type(i.phys).__name__}; joints need ScGeom and FrictPhys (Ip2_FrictMat_"
                    "FrictMat_FrictPhys, Law2_ScGeom_FrictPhys_CundallStrack); select= excludes it"
                )
            created.append(i)
            rows.append((*interaction_key(i), *self._radii(i)))
        fresh = np.arange(len(self), len(self) + len(created))
        if not created:
            return fresh
        self.interactions += created
        new = dict(zip(("id1", "id2", "created", "R1", "R2", "both_spheres", "area"), zip(*rows)))
        for k in (*new["id1"], *new["id2"]):
            self.bodies.setdefault(k, O.bodies[k])
        self._add_bodies()
        for name, value in self.contact_data.items():
            more = np.broadcast_to(new.get(name, 0), (*value.shape[:-1], len(created)))
            self.contact_data[name] = np.concatenate([value, more], axis=-1)
        self.created = self.contact_data["created"].tolist()
        self._number_bodies()
        self._initialise_frames(fresh)
        return fresh

    def _initialise_frames(self, fresh):
        """Initialise reference directions (in the axes of body id1) and frames of new contacts."""
        c = self.contact_data
        x, q = self._read_bodies()
        q1 = q[:, c["b1"]]
        if self.plane is not None:
            r = x[:, c["b2"][fresh]] - x[:, c["b1"][fresh]]
            across = dot(rotate(q1[:, fresh], self.plane), r)
            c["plane"][:, fresh] = self.plane * np.where(across < 0, -1.0, 1.0)
        n, un, c1, c2 = self._geometry(x, q1).values()
        n = n[:, fresh]
        q1 = q1[:, fresh]
        a = rotate(q1, self.azimuth)
        t2 = a - n * dot(a, n)
        bad = dot(t2, t2) < 0.01  # the reference is parallel to the normal: use the next body axis
        a[:, bad] = rotate(q1[:, bad], np.roll(self.azimuth, 1))
        t2 = unit(a - n * dot(a, n))
        c["axis"][:, fresh] = rotate(conjugate(q1), t2)
        c["n"][:, fresh] = n
        c["t2"][:, fresh] = t2
        c["c1"][:, fresh] = c1[:, fresh]
        c["c2"][:, fresh] = c2[:, fresh]
        if self.mated or self.plane is not None:
            c["zero_overlap"][fresh] = un[fresh]

    def _radii(self, i):
        """Radii, whether both bodies are spheres, and the contact area."""
        both_spheres = all(isinstance(O.bodies[k].shape, Sphere) for k in (i.id1, i.id2))
        if self.plane is not None and not both_spheres:
            raise TypeError(f"contact {i.id1}-{i.id2}: plane= needs two spheres; see select=")
        if self.area is None:
            area = np.pi * min(i.geom.refR1, i.geom.refR2) ** 2
        else:
            area = float(self.area(i)) if callable(self.area) else self.area
        if not 0 < area < np.inf:
            raise ValueError(f"area = {area} m2 of contact {i.id1}-{i.id2} must be > 0 and finite")
        return i.geom.refR1, i.geom.refR2, both_spheres, area

    def _add_bodies(self):
        """Positions of new bodies one step ago, from their velocities (YADE's leapfrog)."""
        x = []
        q = []
        self.states = [body.state for body in self.bodies.values()]
        for state in self.states[self.x.shape[1] :]:
            angle = state.angVel.norm() * O.dt
            axis = state.angVel.normalized() if angle > 0 else Vector3(0, 0, 1)
            x.append((state.pos - state.vel * O.dt).__getinitargs__())
            q.append((Quaternion(axis, -angle) * state.ori).__getinitargs__())
        self.x = np.concatenate([self.x, columns(x, 3)], axis=1)
        self.q = np.concatenate([self.q, columns(q, 4)], axis=1)

    def _read_bodies(self):
        """Positions (3, b) and orientations (4, b; w first) of the bodies with joints."""
        positions = map(Vector3.__getinitargs__, map(attrgetter("pos"), self.states))
        orientations = map(Quaternion.__getinitargs__, map(attrgetter("ori"), self.states))
        return read_columns(positions, 3), read_columns(orientations, 4)

    # ------------------------------------------------------ checkpoints and output

    def save(self, path):
        """Write a checkpoint (NPZ) of the adapter: call it with every O.save, between two runs."""
        data = {f"contact_{key}": value for key, value in self.contact_data.items()}
        data.update({f"law_{key}": value for key, value in self.law.state().items()})
        data["others"] = np.array(list(self.other_interactions), int)
        data["last"] = -1 if self.last_iteration is None else self.last_iteration
        with open(path, "wb") as file:
            np.savez(file, version=VERSION, ids=list(self.bodies), x=self.x, q=self.q, **data)

    def load(self, path):
        """Restore a checkpoint of `save`: call it after O.load, before the next step.

        Raises ValueError, without a change, for a file of another version, mode, law or table.
        """
        with np.load(path) as file:
            data = {key: file[key] for key in file.files}
        if data.get("version") != VERSION:
            raise ValueError(
                f"{path!r} has version {data.get('version')}, this adapter reads {VERSION}: start "
                "the run again, or continue with the yade_joint.py that saved it"
            )
        mode = "live" if "law_fingerprint" in data else "table"
        if mode != self.law.mode:
            law = {"live": "LiveLaw(law)", "table": 'TableLaw("joint.txt")'}[mode]
            raise ValueError(
                f"{path!r} was saved in {mode} mode, and these joints are in {self.law.mode} mode: "
                f"create Joints({law}, ...) and load the file into them"
            )
        self.law.restore({key[4:]: value for key, value in data.items() if key.startswith("law_")})
        self.interactions = []
        self.contact_data = {
            key[8:]: value for key, value in data.items() if key.startswith("contact_")
        }
        self.bodies = dict.fromkeys(data["ids"].tolist())
        self.states = []
        self.other_bodies = {}
        self.x = data["x"]
        self.q = data["q"]
        self.last_iteration = int(data["last"]) if data["last"] >= 0 else None
        self.other_interactions = dict.fromkeys(map(tuple, data["others"].reshape(-1, 3).tolist()))
        self.body_count = -1  # forces a match by key in the next step
        _attached[self.name] = self

    def contacts(self):
        """Arrays: ids (n, 2), closure (n,), traction (n, 3) in Pa, normal (n, 3), area (n,)."""
        c = self.contact_data
        return {
            "ids": np.array([c["id1"], c["id2"]]).T, "closure": c["closure"].copy(),
            "traction": c["F"].T.copy(), "normal": c["n"].T.copy(), "area": c["area"].copy(),
        }  # fmt: skip

    def write_back(self):
        """Copy the joint forces to i.phys, for utils.getStress and others, until the next step."""
        c = self.contact_data
        F = self.F
        normal = (c["n"] * F[0] * c["area"]).T.tolist()
        shear = ((c["t2"] * F[1] + cross(c["n"], c["t2"]) * F[2]) * c["area"]).T.tolist()
        for i, a, b in zip(self.interactions, normal, shear):
            i.phys.normalForce = Vector3(*a)
            i.phys.shearForce = Vector3(*b)


# ------------------------------------------------ contacts, vectors and rotations


iter_made_real = attrgetter("iterMadeReal")
body_id = attrgetter("id")


def interaction_key(i):
    """Identifies an interaction, also among successive ones of the same two ids."""
    return i.id1, i.id2, i.iterMadeReal


def columns(rows, size):
    """Array (size, n) from n rows."""
    return np.reshape(rows, (-1, size)).T.copy()


def read_columns(rows, size):
    """As `columns`, from an iterator over rows, without a list of them."""
    return np.fromiter(chain.from_iterable(rows), float).reshape(-1, size).T


def dot(a, b):
    """Dot products (n,) of vectors (3, n)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Cross products (3, n) of vectors (3, n)."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def unit(a):
    """Unit vectors (3, n) in the directions of a."""
    return a / np.sqrt(dot(a, a))


def conjugate(q):
    """Conjugate quaternions (4, n)."""
    return np.array([q[0], -q[1], -q[2], -q[3]])


def rotate(q, v):
    """Rotate vectors v (3, n) by unit quaternions q (4, n)."""
    u = q[1:]
    t = 2 * cross(u, v)
    return v + q[0] * t + cross(u, t)


def rotation_vectors(q, old):
    """Rotations from the orientations `old` to `q` as vectors 2 tan(angle/2) axis (3, n).

    With these a rigid rotation moves a lever arm c0 exactly to c1 = c0 + rotation x (c0 + c1)/2
    (Cayley).
    """
    u = old[0] * q[1:] - q[0] * old[1:] + cross(old[1:], q[1:])
    return 2 * u / (q[0] * old[0] + dot(q[1:], old[1:]))
