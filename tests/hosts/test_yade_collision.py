"""Free spinning spheres: momentum, moments and the frame of a contact that turns."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

COLLISION = """
kn, ks, mu, R = {kn}, {ks}, {mu}, 0.5
area, m = pi * R**2, 2600 * 4 / 3 * pi * R**3
T = pi * sqrt(m / 2 / (kn * area))
def go(joint, N, touch):
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
    O.bodies.append([utils.sphere((0, 0, 0), R), utils.sphere((touch, 0, 0), R)])
    a, b = [body.state for body in O.bodies]
    a.angVel, b.angVel, a.vel, b.vel = (3, .5, 2), (-1, 2, 1.2), (.1, .02, .01), (-.1, -.03, .02)
    engines(kn * area, ks * area, mu, ratchet=False)
    O.dt = T / N
    if joint:
        Joints(TableLaw("joint.txt")).attach()
    def momenta():
        spins = [s.mass * s.pos.cross(s.vel) + s.inertia[0] * s.angVel for s in (a, b)]
        L = spins[0] + spins[1]
        return list(a.mass * a.vel + b.mass * b.vel) + list(L)
    a, b = [body.state for body in O.bodies]
    before = momenta()
    O.run(int(1.5 * N + (touch - 1) / .2 / O.dt), True)
    assert O.interactions.countReal() == 0
    return [list(s.vel) + list(s.angVel) for s in (a, b)], before, momenta()
out = dict(N=2000)
for touch in (1.0, 1.00003):
    native, joint = go(False, 2000, touch), go(True, 2000, touch)
    out.setdefault("native", []).append(native[0])
    out.setdefault("joint", []).append(joint[0])
    out.setdefault("before", []).append(joint[1])
    out.setdefault("after", []).append(joint[2])
result(**out)
"""


@pytest.mark.parametrize("mu", [0.4, 5.0])
def test_oblique_collision_equals_yades_own_linear_law(yade, make_table, tmp_path, mu):
    """At mu = 0.4 the contact slides throughout, at 5 it sticks and slides.

    The contact point of both is half-way in the overlap and shear is the true motion there
    (avoidGranularRatcheting off). YADE takes the frame at the end of a step, we the one at its
    middle, a difference of first order in the step: 2000 steps per collision put it below 1e-6.
    """
    kn, ks = 1e11, 5e10
    make_table(tmp_path / "joint.txt", kn, ks, mu)
    out = yade(COLLISION.format(kn=kn, ks=ks, mu=mu))
    speed, spin = 0.1, 3.0
    off = np.abs(out["joint"] - out["native"])
    assert np.abs(out["native"][..., 3:] - [[3, 0.5, 2], [-1, 2, 1.2]]).max() > 0.3 * min(mu, 1)
    print(off[..., :3].max() / speed, off[..., 3:].max() / spin)
    assert off[..., :3].max() < 1e-6 * speed
    assert off[..., 3:].max() < 1e-6 * spin
    # linear and angular momentum: sums of equal and opposite forces at one point, to rounding
    # (of position times momentum, and leapfrog holds them at half steps)
    change = np.abs(out["after"] - out["before"])
    print(change.max(axis=0) / np.abs(out["before"]).max())
    assert change[:, :3].max() < 1e-12 * np.abs(out["before"]).max()
    assert change[:, 3:].max() < 1e-9 * np.abs(out["before"]).max()


TURNING = """
R = 0.5
def go(N):
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=.3, frictionAngle=.5, density=2600))
    O.bodies.append([utils.sphere((0, 0, 0), R), utils.sphere((1.0, 0, 0), R)])
    a, b = [body.state for body in O.bodies]
    (a.angVel, b.angVel), (a.vel, b.vel) = {spins}, {speeds}
    engines()
    O.dt = {T} / N
    joints = Joints(TableLaw("joint.txt"), azimuth=(.2, 1, .1))
    joints.attach()
    O.run(N + 1, True)   # the last step computes the force at time T
    f = joints.F[:, 0] * joints.c["area"][0]
    turned = [2 * acos(min(1, abs(s.ori[3]))) for s in (a, b)]
    n, t2 = joints.c["n"][:, 0], joints.c["t2"][:, 0]
    force = f[0] * n + f[1] * t2 + f[2] * np.cross(n, t2)
    x = joints.x
    return dict(x=x.T.tolist(), force=force.tolist(), turned=turned, n=n.tolist())
result(coarse=go(2000), fine=go(4000))
"""


def test_anisotropic_joint_on_turning_bodies(yade, make_table, tmp_path):
    """Against scipy's integration of the continuous equations, written in global vectors.

    Both bodies turn by more than 90 degrees about oblique axes while in touch; shear stiffness
    differs by a factor 3 between the azimuths, which body id1 carries. The step error is that of
    YADE's leapfrog, second order: halving the step quarters it, and the extrapolated value agrees.
    """
    kn, ks, R, T = 1e5, 5e4, 0.5, 0.06
    table = make_table(tmp_path / "joint.txt", kn, ks, mu=1e9, uneven=0.5, end=0.2)
    spins = ((40.0, 12.0, -6.0), (30.0, -20.0, 12.0))
    speeds = ((0.5, 0.0, 0.1), (-0.5, 0.1, 0.0))
    out = yade(TURNING.format(spins=spins, speeds=speeds, T=T))
    coarse, fine = out["coarse"], out["fine"]
    assert min(fine["turned"]) > np.pi / 2

    mass = 2600 * 4 / 3 * np.pi * R**3
    inertia, area = 0.4 * mass * R * R, np.pi * R * R
    K2, K3 = ks * 1.5, ks * 0.5
    assert np.isclose(table.lookup(0.1, 0.0).shear_stiffness, K2)
    reference = np.array([0.2, 1, 0.1]) / np.linalg.norm([0.2, 1, 0.1])
    reference = reference - np.array([reference[0], 0, 0])  # projected when the contact is new
    reference /= np.linalg.norm(reference)

    def rate(t, y):
        x1, x2, v1, v2, w1, w2, a, f = y.reshape(8, 3)
        r = x2 - x1
        length = np.linalg.norm(r)
        n = r / length
        un = 2 * R - length
        t2 = a - (a @ n) * n
        t2 /= np.linalg.norm(t2)
        t3 = np.cross(n, t2)
        c = R - un / 2
        slip = v1 - v2 + np.cross(w1, c * n) + np.cross(w2, c * n)
        turn_n = np.cross(n, (v2 - v1) / length)  # of the normal
        turn = turn_n + n * (n @ (w1 + w2)) / 2
        f_rate = np.cross(turn, f) + area * (K2 * (slip @ t2) * t2 + K3 * (slip @ t3) * t3)
        force = -(area * kn * un * n + f)  # on id1
        torque = c * np.cross(n, force)
        return np.concatenate(
            [v1, v2, force / mass, -force / mass, torque / inertia, torque / inertia,
             np.cross(w1, a), f_rate]
        )  # fmt: skip

    start = np.concatenate([[0, 0, 0, 1.0, 0, 0], *speeds, *spins, reference, [0, 0, 0]])
    end = solve_ivp(rate, (0, T), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    end = end.reshape(8, 3)
    r = end[1] - end[0]
    n = r / np.linalg.norm(r)
    exact = area * kn * (2 * R - np.linalg.norm(r)) * n + end[7]
    shear = np.linalg.norm(end[7])
    error = [np.abs(np.array(run["force"]) - exact).max() / shear for run in (coarse, fine)]
    print(error)
    assert error[1] < 1e-4
    assert 3.0 < error[0] / error[1] < 5.0
    extrapolated = (4 * np.array(fine["force"]) - np.array(coarse["force"])) / 3
    assert np.abs(extrapolated - exact).max() < 1e-6 * shear
    assert np.abs(np.array(fine["x"]) - end[:2]).max() < 1e-6
