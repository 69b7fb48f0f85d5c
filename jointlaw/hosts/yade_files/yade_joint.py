"""Rock joints on the contacts of a YADE simulation. Needs YADE and numpy; no other file.

    from yade_joint import Joints, Table        # this file in the script's folder (on sys.path)
    joints = Joints(Table("joint.txt"))         # or Joints(Live(law)), law a jointlaw.JointLaw
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

import gc
import json
import warnings

import numpy as np
from yade import FrictPhys, O, PyRunner, Quaternion, ScGeom, Sphere, Vector3

assert Quaternion((0, 0, 1), 0.0).__getinitargs__() == (1.0, 0.0, 0.0, 0.0)  # w first

_running = {}  # name -> Joints: what the PyRunner of each adapter calls


def run(name):
    """One step of the adapter called `name`: the command of its PyRunner."""
    if name not in _running:
        raise RuntimeError(
            f"no joints called {name!r} in this process: after O.load create Joints(..., "
            f"name={name!r}) again and call .load(file)"
        )
    _running[name].step()


# --------------------------------------------------------------- the two laws


class Table:
    """A tabulated joint: normal stress by closure, and elastic-frictional shear by azimuth.

    path: `joint.txt` or `joint.npz` as jointlaw exports them. As YADE's own laws do, shear is
    incremental and a new contact counts the whole shear of its first step; the shear force turns
    with the contact and with the mean spin of the two bodies about the normal.
    """

    live = False

    def __init__(self, path):
        column, self.metadata = read_table(path)
        self.un, self.kn_secant = column["un"], column["kn_secant"]
        self.kn_tangent, self.sn = column["kn_tangent"], column["sn"]
        angles = sorted(int(name[3:]) for name in column if name.startswith("kt_"))
        psi = np.radians(angles)
        kt = np.array([column[f"kt_{a:03d}"] for a in angles])
        if f"mu_{angles[0]:03d}" in column:
            mu = np.array([column[f"mu_{a:03d}"] for a in angles])
        else:  # a table written by hand may give one friction for all azimuths
            mu = np.repeat(column["mu"][None], len(angles), axis=0)
        # Stiffness over azimuth is e.K.e with a symmetric K: mean and second harmonic give K
        self.kt = kt.mean(axis=0)
        c, s = np.cos(2 * psi)[:, None] * kt, np.sin(2 * psi)[:, None] * kt
        many = len(angles) > 2
        self.kc = 2 * c.mean(axis=0) if many else c.mean(axis=0) * (len(angles) == 2)
        self.ks = 2 * s.mean(axis=0) if many else np.zeros_like(self.kt)
        self.mu, self.mu_low, self.mu_mean = mu, mu.min(), mu.mean(axis=0)
        self.k_max = max(self.kn_tangent.max(), self.kn_secant.max(), kt.max())
        self.f = np.zeros((2, 0))  # shear traction in the contact's frame
        self.K = np.zeros((3, 0))  # shear stiffness K22, K33, K23 of the last step

    def stiffness(self, closure=None):
        """Largest stiffness (Pa/m) up to `closure`; the whole table by default."""
        return self.k_max

    def at(self, closure):
        """Rows and weights of linear interpolation, and secant normal stiffness (Pa/m)."""
        row = np.clip(np.searchsorted(self.un, closure, "right") - 1, 0, len(self.un) - 2)
        low = self.un[row]
        w = np.clip((closure - low) / (self.un[row + 1] - low), 0.0, 1.0)
        secant = between(self.kn_secant, row, w)
        beyond = closure > self.un[-1]
        if beyond.any():  # past the table: along its last tangent
            extra = closure[beyond] - self.un[-1]
            secant[beyond] = (self.sn[-1] + self.kn_tangent[-1] * extra) / closure[beyond]
        return row, w, secant

    def shear_stiffness(self, row, w):
        """K22, K33, K23 (Pa/m)."""
        k, c = between(self.kt, row, w), between(self.kc, row, w)
        return np.array([k + c, k - c, between(self.ks, row, w)])

    def friction(self, f, row, w):
        """Friction coefficient in the direction of the shear tractions f (2, m)."""
        place = (np.arctan2(f[1], f[0]) % np.pi) * (len(self.mu) / np.pi)
        a = place.astype(int) % len(self.mu)
        x, b = place - np.floor(place), (a + 1) % len(self.mu)
        low = self.mu[a, row] * (1 - w) + self.mu[a, row + 1] * w
        high = self.mu[b, row] * (1 - w) + self.mu[b, row + 1] * w
        return low * (1 - x) + high * x

    def step(self, d, closure, spin):
        """Tractions (3, n) after increments d (3, n); `spin` (n) turns the old shear force."""
        row, w, secant = self.at(closure)
        normal = np.where(closure > 0, secant * closure, 0.0)
        K, old = self.shear_stiffness(row, w), self.K
        c, s = np.cos(spin / 2), np.sin(spin / 2)  # half before the new shear is added, half after
        f = np.array([c * self.f[0] - s * self.f[1], s * self.f[0] + c * self.f[1]])
        falls = np.flatnonzero(K[0] + K[1] < old[0] + old[1])
        if falls.size:  # a joint that softens gives back elastic force: no energy is made
            a, b, g = old[:, falls]
            f2, f3 = f[:, falls] / (a * b - g * g)
            f[:, falls] = times(K[:, falls], np.array([b * f2 - g * f3, a * f3 - g * f2]))
        f += times(K, d[1:])
        f = np.array([c * f[0] - s * f[1], s * f[0] + c * f[1]])
        size = np.hypot(f[0], f[1])
        over = np.flatnonzero(size > self.mu_low * normal)
        if over.size:
            cap = normal[over] * self.friction(f[:, over], row[over], w[over])
            f[:, over] *= np.minimum(1.0, cap / np.where(size[over] > 0, size[over], 1.0))
        self.f, self.K = f, K
        return np.array([normal, f[0], f[1]])

    def add(self, closure):
        """Contacts that came, at the end of the list."""
        row, w, _ = self.at(closure)
        self.f = np.concatenate([self.f, np.zeros((2, len(closure)))], axis=1)
        self.K = np.concatenate([self.K, self.shear_stiffness(row, w)], axis=1)

    def keep(self, mask):
        """Forget the contacts where `mask` is False."""
        self.f, self.K = self.f[:, mask], self.K[:, mask]

    def state(self):
        """Arrays to save."""
        return {"f": self.f, "K": self.K}

    def restore(self, data):
        """State from such arrays."""
        self.f, self.K = data["f"].copy(), data["K"].copy()


class Live:
    """The full path-dependent law: a jointlaw batch behind the contacts (`jointlaw` importable).

    Memory belongs to a contact as long as YADE keeps it, so `Law2...(neverErase=True)` is needed:
    a sheared joint dilates and carries stress at negative closure. A new contact counts the shear
    made in touch only. The memory turns with body id1. `ledger` adds up the energy that friction
    takes, for `batch.dissipated_energy`, at some cost.
    """

    live = True

    def __init__(self, law, ledger=False):
        if law.plane is not None:
            raise ValueError("law.plane is set; contacts in YADE move in 3-D, give plane=None")
        if law.closure_only:
            raise ValueError("law.closure_only is set; contacts in YADE shear, set it to False")
        self.law, self.batch = law, law.joints(0, ledger=ledger)
        self.slots, self.free = np.zeros(0, int), []

    def stiffness(self, closure=None):
        """Upper bound of the stiffness (Pa/m) up to `closure`, closure_range by default."""
        return float(self.law.max_stiffness(self.law.closure_range if closure is None else closure))

    def step(self, d, closure, spin):
        """Tractions (3, n) after increments d (3, n)."""
        in_order = len(self.slots) == len(self.batch) and not self.free and self.sorted
        return self.batch.update(d.T, where=None if in_order else self.slots, tangent=False)[0].T

    def add(self, closure):
        """Contacts that came: virgin joints at this closure (m; negative before touch)."""
        reused = [self.free.pop() for _ in range(min(len(self.free), len(closure)))]
        first, more = len(self.batch), len(closure) - len(reused)
        self.batch.resize(first + more)
        new = np.array([*reused, *range(first, first + more)], int)
        start = np.zeros((len(new), 3))
        start[:, 0] = closure
        self.batch.update(start, where=new, tangent=False)
        self.place(np.concatenate([self.slots, new]))

    def keep(self, mask):
        """Forget the contacts where `mask` is False."""
        gone = self.slots[~mask]
        self.batch.reset(gone)
        self.free += gone.tolist()
        self.place(self.slots[mask])

    def place(self, slots):
        """Set the place of every contact in the batch."""
        self.slots, self.sorted = slots, bool((slots == np.arange(len(slots))).all())

    def state(self):
        """Arrays to save."""
        state = self.batch.snapshot()
        return {"values": state.values, "fingerprint": state.fingerprint, "slots": self.slots}

    def restore(self, data):
        """State from such arrays."""
        self.batch.resize(data["values"].shape[1])
        kind = type(self.batch.snapshot())
        self.batch.restore(kind(str(data["fingerprint"]), data["values"]))
        self.place(data["slots"].copy())
        self.free = sorted(set(range(len(self.batch))) - set(self.slots.tolist()))


# ---------------------------------------------------------------- the adapter

# Numbers per contact, shape (n,): ids, step that made it, places of the bodies, radii, area
PER_CONTACT = ["id1", "id2", "made", "b1", "b2", "R1", "R2", "area"]
PER_CONTACT += ["ball", "zero", "closure"]  # two spheres?, overlap at zero closure
VECTORS = ["n", "t2", "c1", "c2", "axis", "plane", "F"]  # shape (3, n)


class Joints:
    """A joint law on contacts of the simulation.

    law: a `Table` or a `Live`.
    area: of one contact in m2: a number, a function of the interaction, or None for the circle of
        the smaller sphere.
    select: function of an interaction: is it a joint? Asked once, when the contact is new.
    azimuth: direction of the law's axis 2 in the axes of body id1.
    plane: None, or the joint's normal in the axes of body id1: contacts then act as pieces of one
        flat joint (a "smooth joint") whatever the direction between the two spheres.
    mated: closure counts from the position in which the contact is first seen, not from touch.
    lagged: instead of adding forces, rewrite kn, ks and friction of YADE's own contact, which acts
        one step late: isotropic, and it makes energy, so that NewtonIntegrator needs a
        damping of 0.7 O.dt/sqrt(m/k) or more (Table only; measured in docs/yade.md).
    forget: with neverErase, contacts without force open by more than this (m) are given up.
    """

    def __init__(self, law, area=None, select=None, azimuth=(1, 0, 0), plane=None, mated=False,
                 lagged=False, forget=np.inf, name="joints"):  # fmt: skip
        if not name.isidentifier():
            raise ValueError(f"name = {name!r} must be a Python identifier: it labels the engine")
        if lagged and law.live:
            raise ValueError("lagged = True works with a Table only: a live law has no kn and ks")
        self.law, self.select, self.name = law, select, name
        self.area = area if area is None or callable(area) else float(area)
        self.azimuth = unit(np.array(azimuth, float))
        self.plane = None if plane is None else unit(np.array(plane, float))
        self.mated, self.lagged, self.forget = mated, lagged, forget
        self.attached = False
        self._clear()
        _running[name] = self

    def _clear(self):
        self.c = {key: np.zeros(0, int if key in "id1 id2 made b1 b2" else float)
                  for key in PER_CONTACT}  # fmt: skip
        self.c.update({key: np.zeros((3, 0)) for key in VECTORS})
        self.own, self.others = [], []  # interactions that are joints, and that are not
        self.odd = []  # (place, geom) of joints that are not between two spheres
        self.states, self.ids, self.index = [], [], {}  # bodies with joints
        self.x, self.q = np.zeros((3, 0)), np.zeros((4, 0))
        self.last, self.waiting = None, None
        self.bodies = len(O.bodies)

    @property
    def F(self):
        """Tractions (3, n) of the last step in the contacts' frames, Pa."""
        return self.c["F"]

    def __len__(self):
        return len(self.own)

    # ------------------------------------------------------------------ set-up

    def attach(self):
        """Put the adapter into O.engines, right after InteractionLoop."""
        engines = list(O.engines)
        kinds = [type(engine).__name__ for engine in engines]
        if "InteractionLoop" not in kinds:
            raise ValueError("O.engines has no InteractionLoop; set O.engines before attach()")
        if any(e.label == f"joint_{self.name}" for e in engines):
            if self.attached or self.waiting is not None:
                return
            raise ValueError(
                f"name = {self.name!r} is taken in O.engines: give another name=, or call "
                ".load(file) instead of .attach() to continue a saved run"
            )
        if O.periodic:
            raise ValueError("O.periodic = True: joints across a periodic boundary are not covered")
        if any(k == "GlobalStiffnessTimeStepper" and not e.dead for k, e in zip(kinds, engines)):
            raise ValueError(
                "GlobalStiffnessTimeStepper sees kn = 0 on joints; remove it and set "
                "O.dt = joints.time_step()"
            )
        if self.lagged:
            warnings.warn(
                "lagged=True acts one step late and makes energy: amplitudes grow without "
                "NewtonIntegrator(damping=...) of at least 0.7 O.dt/sqrt(m/k); k = area*kn_tangent",
                stacklevel=2,
            )
        at = kinds.index("InteractionLoop")
        for law2 in engines[at].lawDispatcher.functors:
            if self.law.live and not getattr(law2, "neverErase", True):
                raise ValueError(
                    f"{type(law2).__name__}.neverErase = False: YADE would drop joints that dilate;"
                    " set neverErase=True (and forget= here, so that open contacts are given up)"
                )
        runner = PyRunner(
            command=f"import yade_joint; yade_joint.run({self.name!r})",
            iterPeriod=1, initRun=True, label=f"joint_{self.name}",
        )  # fmt: skip
        if hasattr(runner, "updateGlobals"):  # else YADE writes the caller's locals into globals
            runner.updateGlobals = False
        engines.insert(at + 1, runner)
        O.engines = engines
        self.attached = True

    def time_step(self, safety=0.25, closure=None):
        """A fixed step (s): `safety` of the shortest stable one over all free spheres.

        closure: the largest expected (m); the end of the table or the closure range by default.
        Every sphere is taken to carry the joints that it has, and six at least. Where `area` is a
        function, only contacts tell the areas: ValueError before there are any.
        """
        k, shortest = self.law.stiffness(closure), np.inf
        place = np.concatenate([self.c["id1"], self.c["id2"]])
        areas = np.tile(self.c["area"], 2)
        count = np.bincount(place, minlength=len(O.bodies))
        if callable(self.area):
            if not len(areas):
                raise ValueError(
                    "area is a function, and no contact tells its values yet: call time_step() "
                    "after the first step, or give O.dt"
                )
            total = np.bincount(place, areas, minlength=len(count))
            largest = np.zeros(len(count))
            np.maximum.at(largest, place, areas)
            largest[count == 0] = areas.max()
        for body in O.bodies:
            if body is None or not isinstance(body.shape, Sphere) or body.state.mass <= 0:
                continue
            if callable(self.area):
                carried = max(6 * largest[body.id], total[body.id])
            else:
                one = np.pi * body.shape.radius**2 if self.area is None else self.area
                carried = one * max(6, count[body.id])
            # two bodies (2), rolling (1 + m R^2/I = 3.5 for a sphere)
            stiffness = 2 * 3.5 * k * carried
            shortest = min(shortest, 2 * np.sqrt(body.state.mass / stiffness))
        if not np.isfinite(shortest):
            raise ValueError("no free sphere in O.bodies: set O.dt by hand")
        return safety * shortest

    # -------------------------------------------------------------------- step

    def step(self):
        """Advance all joints; the PyRunner calls this once per step."""
        now = O.iter
        if self.waiting is not None:
            self._resume()
        if self.last is not None and now != self.last + 1:
            raise RuntimeError(
                f"joints {self.name!r}: O.iter went from {self.last} to {now}. The adapter must "
                "run in every step (iterPeriod=1); after O.load call .load(file)"
            )
        collects = gc.isenabled()
        gc.disable()  # thousands of small YADE handles are made and dropped: no cycles among them
        try:
            self._find(now)
            if self.lagged:
                self._rewrite()
            elif self.own:
                self._act()
            elif self.ids:
                self.x, self.q = self._read()
        finally:
            if collects:
                gc.enable()
        self.last = now

    def _act(self):
        c, x0, q0 = self.c, self.x, self.q
        x, q = self._read()
        self.x, self.q = x, q
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
        spin = None if self.law.live else self._spin(n, t2, w1 + w2)
        fresh = self.fresh
        if fresh.size:
            before = closure[fresh] - dot(du[:, fresh], n[:, fresh])
            if self.mated:
                before, d[:, fresh] = np.zeros(len(fresh)), 0.0
            self.law.add(before)
            d[0, fresh] = closure[fresh] - before
        F = self.law.step(d, closure, spin)
        force = (n * F[0] + t2 * F[1] + cross(n, t2) * F[2]) * -c["area"]
        c.update(n=n, t2=t2, c1=c1, c2=c2, closure=closure, F=F)
        extra = force
        if fresh.size:
            extra = force.copy()
            extra[:, fresh] -= self._take_back(fresh)
        self._add(extra, c1, c2)
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
        for k, geom in self.odd:
            n[:, k], un[k] = geom.normal.__getinitargs__(), geom.penetrationDepth
        c1 = n * (R1 - un / 2)
        c2 = c1 - r
        for k, geom in self.odd:
            point = np.array(geom.contactPoint.__getinitargs__())
            c1[:, k], c2[:, k] = point - x[:, c["b1"][k]], point - x[:, c["b2"][k]]
        return n, un, c1, c2

    def _tangent(self, n, q1):
        """Axis 2: the reference carried by body id1, projected on the contact plane."""
        c = self.c
        a = rotate(q1, c["axis"])
        t2 = a - n * dot(a, n)
        size = np.sqrt(dot(t2, t2))
        steep = np.flatnonzero(size < 0.5)
        if steep.size:  # rolled far from where it touched: take the reference anew, unturned
            old = c["t2"][:, steep] - n[:, steep] * dot(c["t2"][:, steep], n[:, steep])
            t2[:, steep] = old
            size[steep] = np.sqrt(dot(old, old))
            c["axis"][:, steep] = rotate(conjugate(q1[:, steep]), old / size[steep])
        return t2 / size

    def _spin(self, n, t2, w):
        """Angle by which shear forces turn in the frame: minimal turn of n, mean spin about it."""
        n0, old = self.c["n"], self.c["t2"]
        both, share = n + n0, 1 + dot(n, n0)
        old = old - both * (dot(old, n) / share)
        twist = 2 * np.arctan(dot(both, w) / (4 * share + dot(w, cross(n0, n))))
        return twist + np.arctan2(dot(old, cross(n, t2)), dot(old, t2))

    def _take_back(self, fresh):
        """YADE's own force on id1 in the step that made the contact; off from now on."""
        result = np.zeros((3, len(fresh)))
        for column, k in enumerate(fresh):
            phys = self.own[k].phys
            result[:, column] = (-(phys.normalForce + phys.shearForce)).__getinitargs__()
            phys.kn = phys.ks = phys.tangensOfFrictionAngle = 0.0
            phys.shearForce = phys.normalForce = Vector3(0, 0, 0)
        return result

    def _add(self, force, c1, c2):
        c, size = self.c, len(self.ids)
        torque1, torque2 = cross(c1, force), cross(force, c2)
        total = [np.bincount(c["b1"], f, size) - np.bincount(c["b2"], f, size) for f in force]
        turn = [np.bincount(c["b1"], t1, size) + np.bincount(c["b2"], t2, size)
                for t1, t2 in zip(torque1, torque2)]  # fmt: skip
        forces = O.forces
        for k, f, t in zip(self.ids, np.array(total).T.tolist(), np.array(turn).T.tolist()):
            forces.addF(k, f)
            forces.addT(k, t)

    def _rewrite(self):
        """The lagged option: what YADE's own law will use in the next step."""
        c = self.c
        if not self.own:
            return
        x, q = self._read()
        n, un, c1, c2 = self._geometry(x, q.take(c["b1"], axis=1))
        closure = c["closure"] = un - c["zero"]
        row, w, secant = self.law.at(np.maximum(closure, 0.0))
        area, mu = c["area"], between(self.law.mu_mean, row, w)
        kn, ks = area * secant, area * between(self.law.kt, row, w)
        fresh = self.fresh
        if fresh.size:  # made with the stiffness of YADE's material: this step is put right
            force = np.zeros((3, len(self.own)))
            force[:, fresh] = -n[:, fresh] * (kn * np.maximum(closure, 0.0))[fresh]
            force[:, fresh] -= self._take_back(fresh)
            self._add(force, c1, c2)
        for i, a, b, m in zip(self.own, kn.tolist(), ks.tolist(), mu.tolist()):
            phys = i.phys
            phys.kn, phys.ks, phys.tangensOfFrictionAngle = a, b, m

    # ---------------------------------------------------------------- contacts

    def _find(self, now):
        """Follow YADE's list of contacts: some went, some came."""
        self.fresh = np.zeros(0, int)
        real = [i.isReal for i in self.own]
        if not all(real):
            self._keep(np.array(real))
        if self.others:
            self.others = [i for i in self.others if i.isReal]
        missing = O.interactions.countReal() - len(self.own) - len(self.others)
        if missing == 0 and len(O.bodies) == self.bodies:
            return
        contacts = O.interactions.all(True)
        new = [i for i in contacts if i.iterMadeReal == now]
        if len(new) != missing or len(O.bodies) != self.bodies:
            new = self._match(contacts)
        self._join(new)

    def _match(self, contacts):
        """The slow way: compare with what YADE has, by ids and by the step that made them."""
        c = self.c
        have = {key: k for k, key in enumerate(zip(c["id1"], c["id2"], c["made"]))}
        place, others = {}, {(i.id1, i.id2, i.iterMadeReal) for i in self.others}
        new, self.others = [], []
        for i in contacts:
            key = (i.id1, i.id2, i.iterMadeReal)
            if key in have:
                place[have[key]] = i
            elif key in others:
                self.others.append(i)
            else:
                new.append(i)
        kept = sorted(place)
        mask = np.zeros(len(self.own), bool)
        mask[kept] = True
        self._keep(mask)
        self.own = [place[k] for k in kept]
        self.odd = [(k, i.geom) for k, i in enumerate(self.own) if not self.c["ball"][k]]
        self.bodies = len(O.bodies)
        return new

    def _keep(self, mask):
        for key, value in self.c.items():
            self.c[key] = value[..., mask]
        self.own = [i for i, keep in zip(self.own, mask) if keep]
        number = np.cumsum(mask) - 1
        self.odd = [(int(number[k]), geom) for k, geom in self.odd if mask[k]]
        if not self.lagged:
            self.law.keep(mask)

    def _join(self, contacts):
        """New contacts: choose the joints among them and set up what stays constant."""
        rows = []
        for i in contacts:
            if self.select is not None and not self.select(i):
                self.others.append(i)
                continue
            if not isinstance(i.geom, ScGeom) or type(i.phys) is not FrictPhys:
                raise TypeError(
                    f"contact {i.id1}-{i.id2} has {type(i.geom).__name__} and "
                    f"{type(i.phys).__name__}; joints need ScGeom and FrictPhys (Ip2_FrictMat_"
                    "FrictMat_FrictPhys, Law2_ScGeom_FrictPhys_CundallStrack); select= excludes it"
                )
            rows.append((i, *self._radii(i)))
        if not rows:
            return
        first, m = len(self.own), len(rows)
        self.own += [row[0] for row in rows]
        new = {
            "id1": [i.id1 for i, *_ in rows],
            "id2": [i.id2 for i, *_ in rows],
            "made": [i.iterMadeReal for i, *_ in rows],
            "R1": [row[1] for row in rows],
            "R2": [row[2] for row in rows],
            "ball": [row[3] for row in rows],
            "area": [row[4] for row in rows],
        }
        new["b1"], new["b2"] = ([self._body(k) for k in new[key]] for key in ("id1", "id2"))
        self._before()
        self.odd += [(first + k, row[0].geom) for k, row in enumerate(rows) if not row[3]]
        for key, value in self.c.items():
            tail = np.array(new.get(key, np.zeros(m)), value.dtype)
            if key in VECTORS:
                tail = np.zeros((3, m))
            self.c[key] = np.concatenate([value, tail], axis=-1)
        self.fresh = np.arange(first, first + m)
        self._orient(self.fresh)

    def _orient(self, fresh):
        """Reference directions of new contacts in the axes of body id1, and their first frame."""
        c = self.c
        x, q = self._read()
        q1 = q[:, c["b1"]]
        if self.plane is not None:
            r = x[:, c["b2"][fresh]] - x[:, c["b1"][fresh]]
            local = np.repeat(self.plane[:, None], len(fresh), axis=1)
            across = dot(rotate(q1[:, fresh], local), r)
            c["plane"][:, fresh] = local * np.where(across < 0, -1.0, 1.0)
        n, un, c1, c2 = self._geometry(x, q1)
        n, q1 = n[:, fresh], q1[:, fresh]
        a = rotate(q1, np.repeat(self.azimuth[:, None], len(fresh), axis=1))
        t2 = a - n * dot(a, n)
        bad = dot(t2, t2) < 0.01  # the reference is the normal itself: take the next body axis
        a[:, bad] = rotate(q1[:, bad], np.repeat(np.roll(self.azimuth, 1)[:, None], bad.sum(), 1))
        t2 = unit(a - n * dot(a, n))
        c["axis"][:, fresh] = rotate(conjugate(q1), t2)
        c["n"][:, fresh], c["t2"][:, fresh] = n, t2
        c["c1"][:, fresh], c["c2"][:, fresh] = c1[:, fresh], c2[:, fresh]
        if self.mated or self.plane is not None:
            c["zero"][fresh] = un[fresh]

    def _radii(self, i):
        """Radii, whether both bodies are spheres, and the contact area."""
        shapes = [O.bodies[k].shape for k in (i.id1, i.id2)]
        R = [s.radius if isinstance(s, Sphere) else np.nan for s in shapes]
        ball = not np.isnan(R).any()
        if self.plane is not None and not ball:
            raise TypeError(f"contact {i.id1}-{i.id2}: plane= needs two spheres; see select=")
        if self.area is None:
            area = np.pi * np.nanmin([*R, i.geom.refR1, i.geom.refR2]) ** 2
        else:
            area = float(self.area(i)) if callable(self.area) else self.area
        if not 0 < area < np.inf:
            raise ValueError(f"area = {area} m2 of contact {i.id1}-{i.id2} must be > 0 and finite")
        return (*(R if ball else (i.geom.refR1, i.geom.refR2)), ball, area)

    def _body(self, k):
        """Place of body k among the bodies with joints."""
        if k not in self.index:
            self.index[k] = len(self.ids)
            self.ids.append(k)
            self.states.append(O.bodies[k].state)
        return self.index[k]

    def _before(self):
        """Where new bodies were one step ago, as their velocities say (YADE's leapfrog)."""
        x, q = [], []
        for state in self.states[self.x.shape[1] :]:
            angle = state.angVel.norm() * O.dt
            axis = state.angVel.normalized() if angle > 0 else Vector3(0, 0, 1)
            x.append((state.pos - state.vel * O.dt).__getinitargs__())
            q.append((Quaternion(axis, -angle) * state.ori).__getinitargs__())
        if x:
            self.x = np.concatenate([self.x, np.array(x).T], axis=1)
            self.q = np.concatenate([self.q, np.array(q).T], axis=1)

    def _read(self):
        """Positions (3, b) and orientations (4, b; w first) of the bodies with joints."""
        x = np.array([s.pos.__getinitargs__() for s in self.states]).T
        return x.copy(), np.array([s.ori.__getinitargs__() for s in self.states]).T.copy()

    # ------------------------------------------------------------ save and show

    def save(self, path):
        """Write the adapter's state (NPZ): call it with every O.save, between two runs."""
        if self.waiting is not None:
            self._resume()
        data = {f"contact_{key}": value for key, value in self.c.items()}
        data.update({f"law_{key}": value for key, value in self.law.state().items()})
        last = -1 if self.last is None else self.last
        others = np.array([(i.id1, i.id2, i.iterMadeReal) for i in self.others], int)
        with open(path, "wb") as file:
            np.savez(file, ids=self.ids, x=self.x, q=self.q, last=last, others=others, **data)

    def load(self, path):
        """Take up a state that `save` wrote: call it after O.load, before the next step."""
        with np.load(path) as file:
            self.waiting = {key: file[key] for key in file.files}
        self.last = None

    def _resume(self):
        """Bind a loaded state to the contacts that YADE has now."""
        data = self.waiting
        self._clear()
        self.c = {key[8:]: value for key, value in data.items() if key.startswith("contact_")}
        self.law.restore({key[4:]: value for key, value in data.items() if key.startswith("law_")})
        self.ids, self.x, self.q = data["ids"].tolist(), data["x"], data["q"]
        self.index = {k: place for place, k in enumerate(self.ids)}
        self.states = [O.bodies[k].state for k in self.ids]
        self.own = [_Unbound] * len(self.c["id1"])
        other = {tuple(row) for row in data["others"].reshape(-1, 3).tolist()}
        contacts = O.interactions.all(True)
        self.others = [i for i in contacts if (i.id1, i.id2, i.iterMadeReal) in other]
        self.bodies = -1  # makes _find compare by ids
        self.last, self.waiting = int(data["last"]), None
        if self.last < 0:
            self.last = None

    def contacts(self):
        """Arrays: ids (n, 2), closure (n,), traction (n, 3) in Pa, normal (n, 3), area (n,)."""
        c = self.c
        return {
            "ids": np.array([c["id1"], c["id2"]]).T, "closure": c["closure"].copy(),
            "traction": c["F"].T.copy(), "normal": c["n"].T.copy(), "area": c["area"].copy(),
        }  # fmt: skip

    def write_back(self):
        """Show the joint forces in i.phys, for utils.getStress and such, until the next step."""
        c, F = self.c, self.c["F"]
        normal = (c["n"] * F[0] * c["area"]).T.tolist()
        shear = ((c["t2"] * F[1] + cross(c["n"], c["t2"]) * F[2]) * c["area"]).T.tolist()
        for i, a, b in zip(self.own, normal, shear):
            i.phys.normalForce, i.phys.shearForce = Vector3(*a), Vector3(*b)


class _Unbound:
    """Stands for a contact that is not bound yet."""

    isReal = True


# ------------------------------------------------------------------- helpers


def read_table(path):
    """Columns by name, and metadata, of `joint.txt` or `joint.npz`."""
    if str(path).endswith(".npz"):
        with np.load(path) as file:
            names, data = file["names"].tolist(), file["data"]
            metadata = json.loads(str(file["metadata"]))
        return dict(zip(names, data.T)), metadata
    data = np.genfromtxt(path, names=True)
    marker, metadata = "# metadata: ", {}
    with open(path) as file:
        for line in file:
            if line.startswith(marker):
                metadata = json.loads(line[len(marker) :])
    return {name: np.atleast_1d(data[name]) for name in data.dtype.names}, metadata


def between(values, row, w):
    """Linear interpolation."""
    low = values[row]
    return low + (values[row + 1] - low) * w


def times(K, v):
    """Products of symmetric matrices K (22, 33, 23; n) with vectors v (2, n)."""
    return np.array([K[0] * v[0] + K[2] * v[1], K[2] * v[0] + K[1] * v[1]])


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
