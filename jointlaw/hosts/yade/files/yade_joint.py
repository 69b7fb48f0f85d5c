"""Rock joints on the contacts of a YADE simulation. Needs YADE, numpy and `joint_table.py`.

    from yade_joint import Joints, TableLaw     # both files in the script's folder (on sys.path)
    joints = Joints(TableLaw("joint.txt"))      # or Joints(LiveLaw("law.toml")): the law itself
    joints.attach()                             # after O.engines is set
    O.dt = joints.time_step()

YADE finds the contacts. In every step, after `InteractionLoop`, the adapter computes the joint's
traction on all of them at once and adds force and torque to the bodies; YADE's own contact force
is switched off (kn = ks = 0) on these contacts, and taken back in the one step in which a contact
is new. So the force on a body is that of the law at the positions of the same step.

Frame of a contact: axis 1 is YADE's contact normal (from body id1 to id2), axis 2 the direction
`azimuth`, which is fixed to body id1 and projected on the contact plane, axis 3 = axis 1 x axis 2.
Displacement is that of body id1 against body id2, closure positive; the force on id1 is -area * F.
SI units: m, Pa, N, s, kg.
"""

# ruff: noqa: B905 (runs on older Python too)

import numpy as np
from joint_table import load_table
from yade import Body, FrictPhys, O, PyRunner, Quaternion, ScGeom, Sphere, Vector3

VERSION = 1  # of the files that `Joints.save` writes

_running = {}  # name -> Joints that were attached or loaded: what the PyRunner of each calls


def run(name):
    """One step of the adapter called `name`: the command of its PyRunner."""
    if name not in _running:
        raise RuntimeError(
            f"no joints {name!r} are attached or loaded in this process: to continue a saved run, "
            f"create Joints(..., name={name!r}) after O.load and call .load(file). For new joints "
            f"remove the engine joint_{name} from O.engines and call .attach()"
        )
    _running[name].step()


# ------------------------------------------------------- the law behind the contacts


class TableLaw:
    """The law's table, a text file: normal stress by closure, elastic-frictional shear."""

    mode = "table"

    def __init__(self, path):
        self.table = load_table(path)
        self.f = np.zeros((2, 0))  # shear traction in the frames of the contacts
        self.K = np.zeros((3, 0))  # shear stiffness K22, K33, K23 of the last step

    def stiffness(self, closure=None):
        """Largest stiffness (Pa/m) of the table."""
        t = self.table
        return float(max(t.kn_tangent.max(), t.kn_secant.max(), t.shear_stiffness.max()))

    def step(self, d, closure, spin):
        """Tractions (3, n) after increments d (3, n); spin (n,) turns the old shear traction."""
        F, self.K = self.table.step(self.f, self.K, d, closure, spin)
        self.f = F[1:]
        return F

    def add(self, closure, bonded):
        """Contacts that came: unsheared joints at this closure (m)."""
        row, w, _ = self.table.locate(closure)
        self.f = np.concatenate([self.f, np.zeros((2, len(closure)))], axis=1)
        self.K = np.concatenate([self.K, self.table.shear_matrix(row, w)], axis=1)

    def keep(self, mask):
        """Forget the contacts where `mask` is False."""
        self.f, self.K = self.f[:, mask], self.K[:, mask]

    def state(self):
        """Arrays to save."""
        return {"f": self.f, "K": self.K, "stress": self.table.normal_stress}

    def restore(self, data):
        """Take up such arrays. Raises ValueError if they belong to another table."""
        if not np.array_equal(data["stress"], self.table.normal_stress):
            raise ValueError("the state was saved with another table: give TableLaw that one")
        self.f, self.K = data["f"], data["K"]


class LiveLaw:
    """The full path-dependent law: a pool of joints behind the contacts (`jointlaw` importable).

    Memory belongs to a contact as long as YADE keeps it, so `Law2...(neverErase=True)` is needed:
    a sheared joint dilates and carries stress at negative closure. A new contact counts the shear
    made in touch only. The memory turns with body id1. `law` is a law of jointlaw, or the path of
    its file. `track_dissipation` sums the dissipated energy, for
    `batch.dissipated_energy`, at some cost; `pool.places` tell the joints of the contacts there.
    """

    mode = "live"

    def __init__(self, law, track_dissipation=False):
        from jointlaw import JointLaw, JointPool  # table mode does without

        law = law if hasattr(law, "dim") else JointLaw.from_toml(law)
        if law.dim != 3:
            raise ValueError(
                "contacts in YADE shear in 3-D: set law.plane=None, closure_only=False"
            )
        self.law, self.pool = law, JointPool(law, track_dissipation)
        self.find()

    def stiffness(self, closure=None):
        """Upper bound of the stiffness (Pa/m) up to `closure`, closure_range by default."""
        return float(self.law.max_stiffness(self.law.closure_range if closure is None else closure))

    def step(self, d, closure, spin):
        """Tractions (3, n) after increments d (3, n)."""
        return self.batch.update(d.T, where=self.where, tangent=False)[0].T

    def add(self, closure, bonded):
        """Contacts that came: virgin joints at this closure (m; negative before touch).

        bonded: whether they have the bond of the law.
        """
        new = self.pool.add([object() for _ in closure])  # keys; contacts are told by their order
        if not bonded:
            self.batch.break_bond(new)
        self.batch.update(np.outer(closure, [1.0, 0.0, 0.0]), where=new, tangent=False)
        self.find()

    def keep(self, mask):
        """Forget the contacts where `mask` is False."""
        self.pool.remove([key for key, kept in zip(self.pool.keys, mask) if not kept])
        self.find()

    def find(self):
        """Find the joints and the places of all contacts; None if these are all, in order."""
        self.batch, places = self.pool.batch, self.pool.places
        self.where = None if np.array_equal(places, np.arange(len(self.batch))) else places

    def state(self):
        """Arrays to save."""
        state = self.pool.snapshot()
        return {"fingerprint": state.fingerprint, "values": state.values.T}

    def restore(self, data):
        """Take up such arrays. Raises ValueError if another law wrote them."""
        from jointlaw.joints.state import JointState

        values = data["values"].T
        self.pool.restore([object() for _ in values], JointState(str(data["fingerprint"]), values))
        self.find()


# ---------------------------------------------------------------- the adapter

# Numbers per contact, shape (n,): ids, step that made it, places of the bodies; radii, area
# ball: two spheres?; zero: overlap at zero closure
PER_CONTACT = {int: ["id1", "id2", "made", "b1", "b2"],
               float: ["R1", "R2", "area", "ball", "zero", "closure"]}  # fmt: skip
VECTORS = ["n", "t2", "c1", "c2", "axis", "plane", "F"]  # shape (3, n)


class Joints:
    """A joint law on contacts of the simulation.

    law: a `TableLaw` or a `LiveLaw`.
    area: of one contact in m2: a number, a function of the interaction, or None for the circle of
        the smaller sphere.
    select: function of an interaction: is it a joint? Asked once, when the contact is new.
    azimuth: direction of the law's axis 2 in the axes of body id1.
    plane: None, or the joint's normal in the axes of body id1: contacts then act as pieces of one
        flat joint (a "smooth joint") whatever the direction between the two spheres.
    mated: closure counts from the position in which the contact is first seen, not from touch.
    forget: with neverErase, contacts without force open by more than this (m) are given up.
    """

    def __init__(self, law, area=None, select=None, azimuth=(1, 0, 0), plane=None, mated=False,
                 forget=np.inf, name="joints"):  # fmt: skip
        if not name.isidentifier():
            raise ValueError(f"name = {name!r} must be a Python identifier: it labels the engine")
        self.law, self.select, self.name = law, select, name
        self.area = area if area is None or callable(area) else float(area)
        if not (area is None or callable(area) or 0 < area < np.inf):
            raise ValueError(f"area = {area} m2 must be > 0 and finite")
        if not forget >= 0:
            raise ValueError(f"forget = {forget} m must be >= 0")
        self.azimuth = unit(np.reshape(azimuth, (3, 1)).astype(float))
        self.plane = None if plane is None else unit(np.reshape(plane, (3, 1)).astype(float))
        self.mated, self.forget = mated, forget
        _running.pop(name, None)  # of an earlier scene
        self.c = {one: np.zeros(0, kind) for kind, names in PER_CONTACT.items() for one in names}
        self.c.update({one: np.zeros((3, 0)) for one in VECTORS})
        self.own, self.others = [], {}  # interactions that are joints; that are not, by `key`
        self.states = {}  # of bodies with joints, by their ids; None until a loaded scene is there
        self.x, self.q = np.zeros((3, 0)), np.zeros((4, 0))
        self.last = None  # O.iter of the last step
        self.bodies = len(O.bodies)

    @property
    def F(self):
        """Tractions (3, n) of the last step in the contacts' frames, Pa."""
        return self.c["F"]

    def __len__(self):
        return len(self.c["made"])

    # ------------------------------------------------------------------ set-up

    def attach(self):
        """Put the adapter into O.engines, right after InteractionLoop."""
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
            raise ValueError("O.periodic = True: joints across a periodic boundary are not covered")
        if any(k == "GlobalStiffnessTimeStepper" and not e.dead for k, e in zip(kinds, engines)):
            raise ValueError(
                "GlobalStiffnessTimeStepper sees kn = 0: remove it, set O.dt = joints.time_step()"
            )
        at = kinds.index("InteractionLoop")
        for law2 in engines[at].lawDispatcher.functors:
            if self.law.mode == "live" and not getattr(law2, "neverErase", True):
                raise ValueError(
                    f"{type(law2).__name__}.neverErase = False: YADE would drop joints that dilate;"
                    " set neverErase=True (and forget= here, so that open contacts are given up)"
                )
        runner = PyRunner(
            command=f"import yade_joint; yade_joint.run({self.name!r})",
            iterPeriod=1, initRun=True, label=f"joint_{self.name}",
            updateGlobals=False,  # else YADE writes the caller's local variables into the globals
        )  # fmt: skip
        O.engines = [*engines[: at + 1], runner, *engines[at + 1 :]]
        _running[self.name] = self

    def time_step(self, safety=0.25, closure=None):
        """A fixed step (s): `safety` of the shortest stable one over all free spheres.

        closure: the largest expected (m); the end of the table or the closure range by default.
        Every sphere is taken to carry the joints that it has, and six at least. Where `area` is a
        function, only contacts tell the areas: ValueError before there are any.
        """
        k, shortest = self.law.stiffness(closure), np.inf
        if callable(self.area) and not len(self):
            raise ValueError(
                "area is a function, and no contact tells its values yet: call time_step() after "
                "the first step, or give O.dt"
            )
        place, areas = np.concatenate([self.c["id1"], self.c["id2"]]), np.tile(self.c["area"], 2)
        total = np.bincount(place, areas, minlength=len(O.bodies))
        largest = np.zeros(len(O.bodies))
        np.maximum.at(largest, place, areas)
        default = areas.max() if callable(self.area) else self.area
        for body in O.bodies:
            if body is None or not isinstance(body.shape, Sphere) or body.state.mass <= 0:
                continue
            one = np.pi * body.shape.radius**2 if self.area is None else largest[body.id] or default
            carried = max(6 * one, total[body.id])
            # two bodies (2), rolling (1 + m R^2/I = 3.5 for a sphere)
            shortest = min(shortest, 2 * np.sqrt(body.state.mass / (2 * 3.5 * k * carried)))
        if not np.isfinite(shortest):
            raise ValueError("no free sphere in O.bodies: set O.dt by hand")
        return safety * shortest

    # -------------------------------------------------------------------- step

    def step(self):
        """Advance all joints; the PyRunner calls this once per step."""
        now = O.iter
        if self.last is not None and now != self.last + 1:
            raise RuntimeError(
                f"joints {self.name!r}: O.iter went from {self.last} to {now}. The adapter must "
                "run in every step (iterPeriod=1); after O.load call .load(file)"
            )
        self._advance(self._find(now))
        self.last = now

    def _advance(self, fresh):
        """Displacements since the last step, the law's tractions, forces on the bodies.

        fresh: places of the new contacts, the last ones.
        """
        c, x0, q0 = self.c, self.x, self.q
        x, q = self.x, self.q = self._read()
        b1, b2 = c["b1"], c["b2"]
        q1 = q.take(b1, axis=1)
        n, un, c1, c2 = self._geometry(x, q1)
        closure = un - c["zero"]
        t2 = self._tangent(n, q1)
        # Displacement of id1 against id2 at the contact, in the frame of mid-step: rigid motion of
        # the pair, however large and about whatever axis, gives exactly none
        turn, dx = turned(q, q0), x - x0
        w1, w2 = turn.take(b1, axis=1), turn.take(b2, axis=1)
        du = dx.take(b1, axis=1) - dx.take(b2, axis=1)
        du += (cross(w1, c1 + c["c1"]) - cross(w2, c2 + c["c2"])) / 2
        middle, across = unit(n + c["n"]), unit(t2 + c["t2"])
        d = np.array([closure - c["closure"], dot(du, across), dot(du, cross(middle, across))])
        spin = self._spin(n, t2, w1 + w2) if self.law.mode == "table" else None
        if fresh.size:
            before = closure[fresh] - dot(du[:, fresh], n[:, fresh])
            if self.mated:
                before, d[:, fresh] = np.zeros(len(fresh)), 0.0
            self.law.add(before, self.last is None)  # bonds: in the first step
            d[0, fresh] = closure[fresh] - before
        F = self.law.step(d, closure, spin)
        force = (n * F[0] + t2 * F[1] + cross(n, t2) * F[2]) * -c["area"]
        c.update(n=n, t2=t2, c1=c1, c2=c2, closure=closure, F=F)
        force[:, fresh] -= self._switch_off(fresh)
        self._apply(force, c1, c2)
        if self.forget < np.inf:
            for k in np.flatnonzero((closure < -self.forget) & ~F.any(axis=0)):
                O.interactions.erase(int(c["id1"][k]), int(c["id2"][k]))

    def _geometry(self, x, q1):
        """Normal, overlap, and the contact point seen from either centre."""
        c = self.c
        r = x.take(c["b2"], axis=1) - x.take(c["b1"], axis=1)
        R1, R2 = c["R1"], c["R2"]
        if self.plane is not None:
            n = rotate(q1, c["plane"])
            c1 = r * (R1 / (R1 + R2))
            return n, -dot(r, n), c1, c1 - r
        length = np.sqrt(dot(r, r))
        n = r / length
        un = R1 + R2 - length
        c1 = n * (R1 - un / 2)
        c2 = c1 - r
        for k in np.flatnonzero(c["ball"] == 0).tolist():
            geom = self.own[k].geom
            n[:, k], un[k] = geom.normal.__getinitargs__(), geom.penetrationDepth
            point = np.array(geom.contactPoint.__getinitargs__())
            c1[:, k], c2[:, k] = point - x[:, c["b1"][k]], point - x[:, c["b2"][k]]
        return n, un, c1, c2

    def _tangent(self, n, q1):
        """Axis 2: the reference carried by body id1, projected on the contact plane."""
        c = self.c
        a = rotate(q1, c["axis"])
        t2 = a - n * dot(a, n)
        # rolled so far that the reference is within 30 degrees of the normal: go on with the last
        steep = np.flatnonzero(dot(t2, t2) < 0.25)
        old = c["t2"][:, steep]
        t2[:, steep] = unit(old - n[:, steep] * dot(old, n[:, steep]))
        c["axis"][:, steep] = rotate(conjugate(q1[:, steep]), t2[:, steep])
        return unit(t2)

    def _spin(self, n, t2, w):
        """Angle by which shear forces turn in the frame: minimal turn of n, mean spin about it."""
        n0, old = self.c["n"], self.c["t2"]
        both, share = n + n0, 1 + dot(n, n0)
        old = old - both * (dot(old, n) / share)
        twist = 2 * np.arctan(dot(both, w) / (4 * share + dot(w, cross(n0, n))))
        return twist + np.arctan2(dot(old, cross(n, t2)), dot(old, t2))

    def _switch_off(self, fresh):
        """Switch YADE's own force off; what it is on id1 in this step, which made the contact."""
        result = np.zeros((3, len(fresh)))
        for column, k in enumerate(fresh):
            phys = self.own[k].phys
            result[:, column] = (-(phys.normalForce + phys.shearForce)).__getinitargs__()
            phys.kn = phys.ks = phys.tangensOfFrictionAngle = 0.0
            phys.shearForce = phys.normalForce = Vector3(0, 0, 0)
        return result

    def _apply(self, force, c1, c2):
        """Add the forces on id1, their opposites on id2, and their torques to the bodies."""
        c, size = self.c, len(self.states)
        torque1, torque2 = cross(c1, force), cross(force, c2)
        total = [np.bincount(c["b1"], f, size) - np.bincount(c["b2"], f, size) for f in force]
        turn = [np.bincount(c["b1"], t1, size) + np.bincount(c["b2"], t2, size)
                for t1, t2 in zip(torque1, torque2)]  # fmt: skip
        forces = O.forces
        for k, f, t in zip(self.states, np.array(total).T.tolist(), np.array(turn).T.tolist()):
            forces.addF(k, f)
            forces.addT(k, t)

    # ---------------------------------------------------------------- contacts

    def _find(self, now):
        """Follow YADE's list of contacts, some of which went, some came; the places of these."""
        if len(O.bodies) != self.bodies:
            return self._join(self._match())
        real = [i.isReal for i in self.own]
        if not all(real):
            self._keep(np.array(real))
        self.others = {one: i for one, i in self.others.items() if i.isReal}
        missing = O.interactions.countReal() - len(self.own) - len(self.others)
        new = [i for i in O.interactions.all(True) if i.iterMadeReal == now] if missing else []
        return self._join(new if len(new) == missing else self._match())

    def _match(self):
        """The slow way: compare with what YADE has, by `key`. New contacts."""
        real, c = {key(i): i for i in O.interactions.all(True)}, self.c
        own = list(zip(c["id1"].tolist(), c["id2"].tolist(), c["made"].tolist()))
        self._keep(np.array([one in real for one in own], bool))
        self.own = [real.pop(one) for one in own if one in real]
        self.others = {one: real.pop(one) for one in self.others if one in real}
        # a body that was erased before the state was saved has no contacts
        self.states = {k: one or (O.bodies[k] or Body()).state for k, one in self.states.items()}
        self.bodies = len(O.bodies)
        return list(real.values())

    def _keep(self, mask):
        """Forget the contacts where `mask` is False."""
        self.c = {key: value[..., mask] for key, value in self.c.items()}
        self.own = [i for i, keep in zip(self.own, mask) if keep]
        self.law.keep(mask)

    def _join(self, contacts):
        """Choose the joints among new contacts, set up what stays constant; their places."""
        own, rows = [], []
        for i in contacts:
            if self.select is not None and not self.select(i):
                self.others[key(i)] = i
                continue
            if not isinstance(i.geom, ScGeom) or type(i.phys) is not FrictPhys:
                raise TypeError(
                    f"contact {i.id1}-{i.id2} has {type(i.geom).__name__} and "
                    f"{type(i.phys).__name__}; joints need ScGeom and FrictPhys (Ip2_FrictMat_"
                    "FrictMat_FrictPhys, Law2_ScGeom_FrictPhys_CundallStrack); select= excludes it"
                )
            own.append(i)
            rows.append((*key(i), *self._radii(i)))
        fresh = np.arange(len(self), len(self) + len(own))
        if not own:
            return fresh
        self.own += own
        new = dict(zip(("id1", "id2", "made", "R1", "R2", "ball", "area"), zip(*rows)))
        for k in (*new["id1"], *new["id2"]):
            self.states.setdefault(k, O.bodies[k].state)
        self._add_bodies()
        place = {k: n for n, k in enumerate(self.states)}
        new["b1"], new["b2"] = ([place[k] for k in new[ids]] for ids in ("id1", "id2"))
        for name, value in self.c.items():
            more = np.broadcast_to(new.get(name, 0), (*value.shape[:-1], len(own)))
            self.c[name] = np.concatenate([value, more], axis=-1)
        self._orient(fresh)
        return fresh

    def _orient(self, fresh):
        """Reference directions of new contacts in the axes of body id1, and their first frame."""
        c = self.c
        x, q = self._read()
        q1 = q[:, c["b1"]]
        if self.plane is not None:
            r = x[:, c["b2"][fresh]] - x[:, c["b1"][fresh]]
            across = dot(rotate(q1[:, fresh], self.plane), r)
            c["plane"][:, fresh] = self.plane * np.where(across < 0, -1.0, 1.0)
        n, un, c1, c2 = self._geometry(x, q1)
        n, q1 = n[:, fresh], q1[:, fresh]
        a = rotate(q1, self.azimuth)
        t2 = a - n * dot(a, n)
        bad = dot(t2, t2) < 0.01  # the reference is the normal itself: take the next body axis
        a[:, bad] = rotate(q1[:, bad], np.roll(self.azimuth, 1))
        t2 = unit(a - n * dot(a, n))
        c["axis"][:, fresh] = rotate(conjugate(q1), t2)
        c["n"][:, fresh], c["t2"][:, fresh] = n, t2
        c["c1"][:, fresh], c["c2"][:, fresh] = c1[:, fresh], c2[:, fresh]
        if self.mated or self.plane is not None:
            c["zero"][fresh] = un[fresh]

    def _radii(self, i):
        """Radii, whether both bodies are spheres, and the contact area."""
        ball = all(isinstance(O.bodies[k].shape, Sphere) for k in (i.id1, i.id2))
        if self.plane is not None and not ball:
            raise TypeError(f"contact {i.id1}-{i.id2}: plane= needs two spheres; see select=")
        if self.area is None:
            area = np.pi * min(i.geom.refR1, i.geom.refR2) ** 2
        else:
            area = float(self.area(i)) if callable(self.area) else self.area
        if not 0 < area < np.inf:
            raise ValueError(f"area = {area} m2 of contact {i.id1}-{i.id2} must be > 0 and finite")
        return i.geom.refR1, i.geom.refR2, ball, area

    def _add_bodies(self):
        """Positions of new bodies one step ago, from their velocities (YADE's leapfrog)."""
        x, q = [], []
        for state in list(self.states.values())[self.x.shape[1] :]:
            angle = state.angVel.norm() * O.dt
            axis = state.angVel.normalized() if angle > 0 else Vector3(0, 0, 1)
            x.append((state.pos - state.vel * O.dt).__getinitargs__())
            q.append((Quaternion(axis, -angle) * state.ori).__getinitargs__())
        self.x = np.concatenate([self.x, columns(x, 3)], axis=1)
        self.q = np.concatenate([self.q, columns(q, 4)], axis=1)

    def _read(self):
        """Positions (3, b) and orientations (4, b; w first) of the bodies with joints."""
        states = self.states.values()
        return (
            columns([s.pos.__getinitargs__() for s in states], 3),
            columns([s.ori.__getinitargs__() for s in states], 4),
        )

    # ------------------------------------------------------------ save and show

    def save(self, path):
        """Write the adapter's state (NPZ): call it with every O.save, between two runs."""
        data = {f"contact_{key}": value for key, value in self.c.items()}
        data.update({f"law_{key}": value for key, value in self.law.state().items()})
        data["others"] = np.array(list(self.others), int)
        data["last"] = -1 if self.last is None else self.last
        with open(path, "wb") as file:
            np.savez(file, version=VERSION, ids=list(self.states), x=self.x, q=self.q, **data)

    def load(self, path):
        """Take up a state that `save` wrote: call it after O.load, before the next step.

        Raises ValueError for another version, for a state of live mode loaded into table mode or
        the other way round, and for another law or table; nothing is changed then.
        """
        with np.load(path) as file:
            data = {key: file[key] for key in file.files}
        if data.get("version") != VERSION:
            raise ValueError(
                f"{path!r} has version {data.get('version')}, this adapter reads {VERSION}: start "
                "the run anew, or go on with the yade_joint.py that saved it"
            )
        mode = "live" if "law_fingerprint" in data else "table"
        if mode != self.law.mode:
            law = {"live": "LiveLaw(law)", "table": 'TableLaw("joint.txt")'}[mode]
            raise ValueError(
                f"{path!r} was saved in {mode} mode, and these joints are in {self.law.mode} mode: "
                f"create Joints({law}, ...) and load the file into them"
            )
        self.law.restore({key[4:]: value for key, value in data.items() if key.startswith("law_")})
        self.own = []
        self.c = {key[8:]: value for key, value in data.items() if key.startswith("contact_")}
        self.states, self.x, self.q = dict.fromkeys(data["ids"].tolist()), data["x"], data["q"]
        self.last = int(data["last"]) if data["last"] >= 0 else None
        self.others = dict.fromkeys(map(tuple, data["others"].reshape(-1, 3).tolist()))
        self.bodies = -1  # the next step matches these with the scene
        _running[self.name] = self

    def contacts(self):
        """Arrays: ids (n, 2), closure (n,), traction (n, 3) in Pa, normal (n, 3), area (n,)."""
        c = self.c
        return {
            "ids": np.array([c["id1"], c["id2"]]).T, "closure": c["closure"].copy(),
            "traction": c["F"].T.copy(), "normal": c["n"].T.copy(), "area": c["area"].copy(),
        }  # fmt: skip

    def write_back(self):
        """Show the joint forces in i.phys, for utils.getStress and such, until the next step."""
        c, F = self.c, self.F
        normal = (c["n"] * F[0] * c["area"]).T.tolist()
        shear = ((c["t2"] * F[1] + cross(c["n"], c["t2"]) * F[2]) * c["area"]).T.tolist()
        for i, a, b in zip(self.own, normal, shear):
            i.phys.normalForce, i.phys.shearForce = Vector3(*a), Vector3(*b)


# ------------------------------------------------ contacts, vectors and rotations


def key(i):
    """What tells an interaction from all others, and from an earlier one of the same bodies."""
    return i.id1, i.id2, i.iterMadeReal


def columns(rows, size):
    """Array (size, n) of n rows."""
    return np.reshape(rows, (-1, size)).T.copy()


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def unit(a):
    return a / np.sqrt(dot(a, a))


def conjugate(q):
    return np.array([q[0], -q[1], -q[2], -q[3]])


def rotate(q, v):
    """Vectors v (3, n) turned by the unit quaternions q (4, n)."""
    u = q[1:]
    t = 2 * cross(u, v)
    return v + q[0] * t + cross(u, t)


def turned(q, old):
    """Rotations from the orientations `old` to `q` as vectors 2 tan(angle/2) axis (3, n).

    With these a rigid turn moves a lever c0 to c1 by exactly turn x (c0 + c1)/2 (Cayley).
    """
    u = old[0] * q[1:] - q[0] * old[1:] + cross(old[1:], q[1:])
    return 2 * u / (q[0] * old[0] + dot(q[1:], old[1:]))
