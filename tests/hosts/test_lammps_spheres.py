"""Two free spinning spheres in LAMMPS against an integration in Python; borders and restarts."""

import numpy as np
import pytest
from lammps_host import HEAD, dumped, run, soft

R, DENSITY, DT, STEPS = 1e-2, 2600.0, 4e-7, 400
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
{atoms}
set type 1 diameter 0.02 density 2600
{motion}
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3 damping {damping}
pair_coeff * * rock.jlaw
neighbor 0.002 bin
timestep 4e-7
fix 1 all nve/sphere
dump 1 all custom 1 {out} type x y z vx vy vz omegax omegay omegaz fx fy fz id proc
dump_modify 1 sort id format float %.17g
{run}
"""
)


def scene(out="out", swap=False, velocity=(0, 0, 0), damping=0.0, run=f"run {STEPS}", shift=0.0):
    """Input script of the two spheres; `swap` exchanges their IDs, `shift` (m) is along x."""
    atoms, motion = [], []
    for tag, k in enumerate((1, 0) if swap else (0, 1), 1):
        atoms.append(
            "create_atoms 1 single {!r} {!r} {!r}".format(*(X[k] + [shift, 0, 0]).tolist())
        )
        motion.append(
            "set atom {} vx {!r} vy {!r} vz {!r}".format(tag, *(V[k] + velocity).tolist())
        )
        motion.append("set atom {} omega {!r} {!r} {!r}".format(tag, *W[k].tolist()))
    return SCENE.format(
        atoms="\n".join(atoms), motion="\n".join(motion), out=out, damping=damping, run=run
    )


def in_python(law, damping=0.0):
    """x, v, spin and force (STEPS, 2, 12) of the same by velocity Verlet with `law.joint()`."""
    x, v, w = X.copy(), V.copy(), W.copy()
    joint, axis2, area = law.joint(), None, np.pi * R * R
    F, T, rows = np.zeros((2, 3)), np.zeros((2, 3)), []
    for _ in range(STEPS):
        v, w = v + 0.5 * DT * F / MASS, w + 0.5 * DT * T / INERTIA
        x = x + DT * v
        d = x[1] - x[0]
        r = np.linalg.norm(d)
        n, closure, arm = d / r, 2 * R - r, 0.5 * r
        F, T = np.zeros((2, 3)), np.zeros((2, 3))
        if axis2 is None and closure > 0:
            k = int(np.argmin(np.abs(n)))
            axis2 = np.eye(3)[k] - n[k] * n
            axis2 /= np.linalg.norm(axis2)
        if axis2 is not None:
            slide = v[1] - v[0] - np.cross(arm * (w[0] + w[1]), n)
            twist = 0.5 * DT * ((w[0] + w[1]) @ n)
            axis2 = axis2 + twist * np.cross(n, axis2) - (axis2 @ n) * n
            axis2 /= np.linalg.norm(axis2)
            axis3 = np.cross(axis2, n)
            step = [closure - joint.delta[0], DT * (slide @ axis2), DT * (slide @ axis3)]
            f, C = joint.update(step)
            if closure < 0 and not f.any():
                joint, axis2 = law.joint(), None
            else:
                push = 0.0
                if damping:
                    stiff = area * max(C[0, 0], 0.0)
                    push = -2 * damping * np.sqrt(stiff * MASS / 2) * (slide @ n)
                    push = max(push, -area * f[0])
                F[1] = (area * f[0] + push) * n - area * (f[1] * axis2 + f[2] * axis3)
                F[0] = -F[1]
                T[:] = -arm * np.cross(n, F[1])
        v, w = v + 0.5 * DT * F / MASS, w + 0.5 * DT * T / INERTIA
        rows.append(np.hstack([x, v, w, F]))
    return np.array(rows)


def differ(a, b):
    """Largest difference of places, velocities, spins and forces, as shares of the largest."""
    parts = [slice(k, k + 3) for k in (0, 3, 6, 9)]
    return max(np.abs(a[..., p] - b[..., p]).max() / np.abs(b[..., p]).max() for p in parts)


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_two_free_spinning_spheres(plugin, damping):
    """1e-12 of the largest of each, over an oblique collision: approach, slip, parting.

    Damping takes the tangent, which agrees to 1e-9 with that of Python.
    """
    expected = in_python(soft(), damping)
    run(plugin, scene(damping=damping))
    found = dumped(plugin / "out")[1:, :, 1:13]
    touching = np.flatnonzero(np.abs(expected[..., 9:]).max(axis=(1, 2)))
    assert touching[0] > 0  # the whole collision
    assert touching[-1] < STEPS - 10
    assert differ(found, expected) < (1e-9 if damping else 1e-12)
    run(plugin, scene("swapped", swap=True, damping=damping))
    swapped = dumped(plugin / "swapped")[1:, ::-1, 1:13]
    assert differ(swapped, found) < (1e-12 if damping else 1e-13)
    momentum, start = MASS * found[:, :, 3:6].sum(axis=1), MASS * V.sum(axis=0)
    assert np.abs(momentum - start).max() < 1e-12 * np.abs(MASS * V).max()
    spin = MASS * np.cross(found[..., :3], found[..., 3:6]) + INERTIA * found[..., 6:9]
    about = spin.sum(axis=1)
    assert np.abs(about - about[0]).max() < 1e-12 * np.abs(about[0]).max()
    energy = 0.5 * (MASS * found[..., 3:6] ** 2 + INERTIA * found[..., 6:9] ** 2).sum(axis=(1, 2))
    assert energy[-1] < energy[0]


DRIFT = (150.0, 0.0, 0.0)  # m/s: one sphere after the other crosses the border while they touch
BORDER = 0.0125


def crossing(folder, out, processors, swap=False):
    """The drifting pair on this many processors: the processor of each sphere, and the rest."""
    run(folder, scene(out, swap=swap, velocity=DRIFT), processors)
    frames = dumped(folder / out)[:, :: -1 if swap else 1]
    return frames[..., -1], frames[..., 1:13]


def test_crossing_the_border_of_two_processors(plugin):
    _, one = crossing(plugin, "one", 1)
    owner, two = crossing(plugin, "two", 2)
    force = np.abs(two[..., 9:]).max(axis=(1, 2)) > 0
    assert {tuple(pair) for pair in owner[force].astype(int)} >= {(0, 0), (1, 1)}
    assert (one == two).all()  # to the bit
    _, swapped = crossing(plugin, "swapped", 2, swap=True)
    assert differ(swapped, one) < 1e-12  # the drift leaves 13 digits to the relative velocity


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


@pytest.mark.parametrize("before", [1, 2])
def test_restart_in_the_middle_of_slip(plugin, before):
    """write_restart right after a run, without `run 0`, read without `comm_modify vel yes`.

    At that step an atom is past the border, but still with the old processor: neighbour lists are
    not made anew at every step.
    """
    owner, rows = crossing(plugin, "found", 2)
    late = (rows[..., 0] > BORDER) & (owner == 0)
    moment = int(np.flatnonzero(late.any(axis=1))[-1])
    pause = f"run {moment}\nwrite_restart held\nrun {STEPS - moment}"
    run(plugin, scene("whole", velocity=DRIFT, damping=0.1, run=pause), before)
    whole = dumped(plugin / "whole")[moment:, :, 1:13]
    force = np.abs(whole[..., 9:]).max(axis=(1, 2))
    assert force[0] > 0.2 * force.max()
    for after in (1, 2):
        run(plugin, RESTARTED.format(steps=STEPS - moment), after)
        rest = dumped(plugin / "rest")[..., 1:13]
        assert differ(rest[1:], whole[1:]) < 1e-12, (before, after)


def test_a_processor_without_atoms(plugin):
    """Both spheres in one half, too far from the other for ghosts: fresh, and from a file."""
    pause = "run 150\nwrite_restart held\nrun 150"
    for processors in (1, 2):
        run(plugin, scene(f"on{processors}", damping=0.1, run=pause, shift=-0.1), processors)
    one, two = dumped(plugin / "on1"), dumped(plugin / "on2")
    assert np.abs(one[150, :, 10:13]).max() > 0
    assert (one == two).all()  # to the bit, and the number of the processor too: always the first
    run(plugin, RESTARTED.format(steps=150), 2)
    rest = dumped(plugin / "rest")[..., 1:13]
    assert differ(rest[1:], one[-150:, :, 1:13]) < 1e-12
