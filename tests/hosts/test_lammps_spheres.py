"""Two spheres in LAMMPS: free and spinning, against an integration in Python, over borders and
restarts; bonded and pulled apart, where the joint exists until the bond fails."""

import numpy as np
import pytest
from lammps_host import HEAD, LAWS, T, dumped, run
from scipy.spatial.transform import Rotation

R = 1e-2
DENSITY = 2600.0
DT = 4e-7
STEPS = 400
MASS = DENSITY * 4.0 / 3.0 * np.pi * R**3
INERTIA = 0.4 * MASS * R * R
APART = np.array([1.2e-2, 1.4e-2, 0.79e-2])
X = np.array([[-2e-3, 0.0, 0.0], APART * (2 * R + 2e-6) / np.linalg.norm(APART) - [2e-3, 0, 0]])
V = np.array([[0.3, 0.1, -0.2], [-0.35, -0.5, 0.15]])
W = np.array([[20.0, -35.0, 10.0], [5.0, 30.0, -40.0]])

SCENE = (
    HEAD
    + """boundary f f f
processors * 1 1
region box block -0.2 0.225 -0.2 0.2 -0.2 0.2
create_box 1 box
{atoms}set type 1 diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping {damping}
pair_coeff * * {law}.jlaw
neighbor 0.002 bin
timestep 4e-7
fix 1 all nve/sphere
dump 1 all custom 1 {out} type x y z vx vy vz omegax omegay omegaz fx fy fz id proc
dump_modify 1 sort id format float %.17g
{run}
"""
)
ATOM = """create_atoms 1 single {1!r} {2!r} {3!r}
set atom {0} vx {4!r} vy {5!r} vz {6!r}
set atom {0} omega {7!r} {8!r} {9!r}
"""


def scene(
    out="out",
    swap=False,
    velocity=(0, 0, 0),
    damping=0.0,
    run=f"run {STEPS}",
    shift=0.0,
    law="rock",
):
    """Input script of the two spheres; `swap` exchanges their IDs, `shift` (m) is along x."""
    x = (X + np.array([shift, 0, 0])).tolist()
    v = (V + velocity).tolist()
    order = (1, 0) if swap else (0, 1)
    atoms = "".join(
        ATOM.format(tag, *x[k], *v[k], *W[k].tolist()) for tag, k in enumerate(order, 1)
    )
    return SCENE.format(atoms=atoms, out=out, damping=damping, run=run, law=law)


def in_python(law):
    """x, v, spin and force (STEPS, 2, 12) of the same by velocity Verlet with `law.joint()`.

    Then the smallest slope retention of the joint.
    """
    retention = 1.0
    x = X.copy()
    v = V.copy()
    w = W.copy()
    joint = law.joint()
    axis2 = None
    last = None  # separation in the last step
    area = np.pi * R * R
    F = np.zeros((2, 3))
    T = np.zeros((2, 3))
    rows = []
    for _ in range(STEPS):
        v = v + 0.5 * DT * F / MASS
        w = w + 0.5 * DT * T / INERTIA
        x = x + DT * v
        d = x[1] - x[0]
        r = np.linalg.norm(d)
        n = d / r
        closure = 2 * R - r
        arm = 0.5 * r
        F = np.zeros((2, 3))
        T = np.zeros((2, 3))
        if axis2 is None and closure > 0:
            k = int(np.argmin(np.abs(n)))
            axis2 = np.eye(3)[k] - n[k] * n
            axis2 /= np.linalg.norm(axis2)
        if axis2 is not None:
            # the pair rotates with the mean spin; the spheres are equal, so their spins cancel else
            rotation = Rotation.from_rotvec(0.5 * DT * (w[0] + w[1]))
            slip = DT * (v[1] - v[0] - np.cross(arm * (w[0] + w[1]), n))  # they touch in this step
            if last is not None:
                slip = d - rotation.apply(last)
            last = d
            axis2 = rotation.apply(axis2)
            axis2 -= (axis2 @ n) * n
            axis2 /= np.linalg.norm(axis2)
            axis3 = np.cross(axis2, n)
            f, _ = joint.update([closure - joint.delta[0], slip @ axis2, slip @ axis3])
            retention = min(retention, joint.slope_retention)
            if closure < 0 and not f.any():
                joint = law.joint()
                axis2 = None
                last = None
            else:
                F[1] = area * (f[0] * n - f[1] * axis2 - f[2] * axis3)
                F[0] = -F[1]
                T[:] = -arm * np.cross(n, F[1])
        v = v + 0.5 * DT * F / MASS
        w = w + 0.5 * DT * T / INERTIA
        rows.append(np.hstack([x, v, w, F]))
    return np.array(rows), retention


def differ(a, b):
    """Largest difference of places, velocities, spins and forces, as shares of the largest."""
    parts = [slice(k, k + 3) for k in (0, 3, 6, 9)]
    return max(np.abs(a[..., p] - b[..., p]).max() / np.abs(b[..., p]).max() for p in parts)


@pytest.mark.parametrize("law", ["rock", "degrading"])
def test_two_free_spinning_spheres(plugin, law):
    """1e-12 of the largest of each, over an oblique collision: approach, slip, parting."""
    expected, retention = in_python(LAWS[law])
    assert (retention < 0.9) == (law == "degrading")
    run(plugin, scene(law=law))
    result = dumped(plugin / "out")[1:, :, 1:13]
    touching = np.flatnonzero(np.abs(expected[..., 9:]).max(axis=(1, 2)))
    assert 0 < touching[0] < touching[-1] < STEPS - 10  # the whole collision
    assert differ(result, expected) < 1e-12
    run(plugin, scene(swap=True, law=law))
    assert differ(dumped(plugin / "out")[1:, ::-1, 1:13], result) < 1e-13


DRIFT = (150.0, 0.0, 0.0)  # m/s: one sphere after the other crosses the border while they touch
BORDER = 0.0125

RESTARTED = (
    HEAD.replace("comm_modify vel yes\n", "")  # the restart file holds it
    + """processors * 1 1
read_restart held
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping 0.1
pair_coeff * * rock.jlaw
neighbor 0.002 bin
timestep 4e-7
fix 1 all nve/sphere
dump 1 all custom 1 rest type x y z vx vy vz omegax omegay omegaz fx fy fz id proc
dump_modify 1 sort id format float %.17g
run {steps}
"""
)


@pytest.mark.parametrize("kind", ["crossing", "empty"])
def test_two_processors_and_restart(plugin, kind):
    """The same to the bit as on one, from write_restart right after a run on as well.

    crossing: both spheres pass the border in the middle of slip; written at a step at which one is
    past it, but still with the old processor, as neighbour lists are not made anew at every step.
    empty: one processor has neither atoms nor ghosts. The file is read without `comm_modify vel`.
    """
    motion = {"velocity": DRIFT} if kind == "crossing" else {"shift": -0.1}
    run(plugin, scene(damping=0.1, **motion), 2)
    frames = dumped(plugin / "out")
    owner = frames[..., -1].astype(int)
    moment = 150
    force = np.abs(frames[..., 10:13]).max(axis=(1, 2))
    if kind == "crossing":
        assert {tuple(pair) for pair in owner[force > 0]} >= {(0, 0), (1, 1)}
        moment = int(np.flatnonzero((frames[..., 1] > BORDER) & (owner == 0))[-1] // 2)
    assert (kind == "empty") == (not owner.any())
    assert force[moment] > 0.2 * force.max()
    pause = f"run {moment}\nwrite_restart held\nrun {STEPS - moment}"
    one = None
    for before in (1, 2):
        run(plugin, scene(damping=0.1, run=pause, **motion), before)
        whole = dumped(plugin / "out")[..., 1:13]
        one = whole if one is None else one
        assert (whole == one).all(), before
        for after in (1, 2):
            run(plugin, RESTARTED.format(steps=STEPS - moment), after)
            rest = dumped(plugin / "rest")[1:, :, 1:13]
            assert differ(rest, whole[moment + 1 :]) < 1e-12, (before, after)


PULLED = (
    HEAD
    + """boundary f f f
region box block -0.2 0.225 -0.2 0.2 -0.2 0.2
create_box 1 box
create_atoms 1 single 0.0 0.0 0.0
create_atoms 1 single {apart!r} 0.0 0.0
set type 1 diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-4 damping 0.5
pair_coeff * * {law}.jlaw
neighbor 0.002 bin
timestep 1e-7
group moving id 2
dump 1 all custom 1 out type x fx id y fy
dump_modify 1 sort id format float %.17g
fix 1 moving move linear {motion}
"""
)


def pulled(folder, motion, apart, law="bonded"):
    """Opening (m) of two spheres, one of which is moved, and the force on the other."""
    run(folder, PULLED.format(apart=apart, law=law, motion=motion))
    frames = dumped(folder / "out")
    return frames[:, 1, 1] - 2 * R, frames[:, 0, 2]


@pytest.mark.parametrize("law", ["bonded", "coulomb"])
@pytest.mark.parametrize("closed", [1e-9, -4e-18])
def test_pulled_apart(plugin, law, closed):
    """The force is the traction of the law at each opening: up to tension times area, then zero.
    Spheres at the distance of touch are in contact, whichever way the distance is rounded."""
    opening, force = pulled(plugin, "1.0 0.0 0.0\nrun 600", 2 * R - closed, law)
    area = np.pi * R * R
    joint = LAWS[law].joint()
    steps = np.diff(-opening, prepend=0.0)
    expected = [-area * joint.update([d, 0.0, 0.0])[0][0] for d in steps]
    np.testing.assert_allclose(force, expected, atol=1e-6 * T * area)
    assert force.max() == pytest.approx(T * area, rel=0.01)
    assert not force[opening > 4.1e-5].any()


def test_spheres_that_meet_have_no_bond(plugin):
    """They touch during the run and separate again without tension."""
    back = "unfix 1\nfix 1 moving move linear 1.0 0.0 0.0\nrun 900"
    opening, force = pulled(plugin, f"-1.0 0.0 0.0\nrun 60\n{back}", 2 * R + 1e-6)
    assert (force[:61] < 0.0).any()
    assert opening[-1] > 1e-5
    assert (force <= 0.0).all()


CROWD = (
    HEAD
    + """boundary f f f
region box block -0.3 0.3 -0.3 0.3 -0.3 0.3
create_box 2 box
{atoms}set type 1 diameter 0.02 density 2600
set type 2 diameter 0.016 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping 0.1
pair_coeff 1 1 rock.jlaw
pair_coeff 1 2 worn.jlaw
pair_coeff 2 2 NULL
neighbor 0.002 bin
timestep 4e-7
fix 1 all nve/sphere
dump 1 all custom 10 out id x y z vx vy vz omegax omegay omegaz fx fy fz
dump_modify 1 sort id format float %.17g
run 400
"""
)


def crowd(folder, clusters, processors=1):
    """Places, velocities, spins and forces (frames, clusters, 3, 12) of clusters of three spheres.

    Two spheres collide with the first one. A cluster has its own place, speed and distances, and in
    every third one the second sphere is smaller.
    """
    atoms = []
    direction = APART / np.linalg.norm(APART)
    for place, cluster in enumerate(clusters):
        two_sizes = cluster % 3 == 0
        first = X[0] + 0.07 * (np.array([cluster % 5, cluster // 5 % 5, cluster // 25]) - 2)
        distance = 2 * R + 2e-6 * (cluster % 7) - (2e-3 if two_sizes else 0.0)
        other_distance = 2 * R + 2e-6 * (cluster % 4)
        x = [first, first + distance * direction, first - other_distance * direction]
        v = np.array([V[0], V[1], 2 * V[0] - V[1]]) * (1.0 + 0.05 * (cluster % 11))
        w = [*W, -W[1]]
        for k in range(3):
            lines = ATOM.format(3 * place + 1 + k, *x[k].tolist(), *v[k].tolist(), *w[k].tolist())
            smaller = two_sizes and k == 1
            atoms.append(lines.replace("create_atoms 1", "create_atoms 2") if smaller else lines)
    run(folder, CROWD.format(atoms="".join(atoms)), processors)
    frames = dumped(folder / "out")
    return frames[..., 1:].reshape(len(frames), len(clusters), 3, 12)


def test_spheres_among_many_move_as_alone(plugin):
    """To the bit: joints that begin and end at different steps are advanced in groups of many."""
    together = crowd(plugin, range(125))
    in_contact = together[:, :, 1:, 9:].any(axis=3)
    assert in_contact.sum(axis=(1, 2)).max() > 200
    assert len({tuple(contact) for contact in in_contact.reshape(len(together), -1).T}) > 4
    assert (crowd(plugin, range(125), processors=2) == together).all()
    for cluster in (0, 31, 62, 93, 124):
        assert (crowd(plugin, [cluster])[:, 0] == together[:, cluster]).all(), cluster
