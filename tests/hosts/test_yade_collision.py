"""Spheres that collide, spin and bounce: shear, frame, momentum and energy of a contact."""

import numpy as np
import pytest
from yade_host import make_table, run_scene

R = 0.5  # m
KN = 1e5  # Pa/m: stiffnesses of the anisotropic joint
K2 = 7.5e4
K3 = 2.5e4
FRICTION = (0.4, 5.0)
RELATIVE_TIME_STEPS = (0.02, 0.1, 0.3)  # time step over sqrt(m/k)
OVERLAP = 0.1  # m
SPIN = 0.02  # rad, of id2 about z
TURNS = (2.0, -0.5)  # rad, of both about x

SCENES = f"""
R = {R}
area, m = pi * R**2, 2600 * 4 / 3 * pi * R**3

def collide(joint, mu, touch, N=2000):
    kn, ks = 1e11, 5e10
    length = pi * sqrt(m / 2 / (kn * area))
    material()
    O.bodies.append([utils.sphere((0, 0, 0), R), utils.sphere((touch, 0, 0), R)])
    a, b = [body.state for body in O.bodies]
    a.angVel, b.angVel, a.vel, b.vel = (3, .5, 2), (-1, 2, 1.2), (.1, .02, .01), (-.1, -.03, .02)
    engines(kn * area, ks * area, mu, ratchet=False)
    O.dt = length / N
    if joint:
        attached(TableLaw(f"linear-{{mu}}.txt"))
    def momenta():
        spins = [s.mass * s.pos.cross(s.vel) + s.inertia[0] * s.angVel for s in (a, b)]
        return list(a.mass * a.vel + b.mass * b.vel) + list(spins[0] + spins[1])
    before = momenta()
    O.run(int(1.5 * N + (touch - 1) / .2 / O.dt), True)
    assert O.interactions.countReal() == 0
    return [list(s.vel) + list(s.angVel) for s in (a, b)], before, momenta()

def twist(N=400):
    # sheared by a spin of id2, both turned about the normal, sheared again by the same spin
    material()
    O.bodies.append([utils.sphere((0, 0, 0), R), utils.sphere((1 - {OVERLAP}, 0, 0), R)])
    for b in O.bodies: b.state.blockedDOFs = "xyzXYZ"
    engines()
    O.dt = 1e-3
    joints, out = attached(TableLaw("uneven.txt"), azimuth=(0, 1, 0)), []
    O.step()
    shear, turns = [(0, 0, 0), (0, 0, {SPIN})], [(turn, 0, 0) for turn in {TURNS}]
    for angles in (shear, turns, shear):
        for body, angle in zip(O.bodies, angles): body.state.angVel = Vector3(angle) / (N * O.dt)
        O.run(N, True)
        for body in O.bodies: body.state.angVel = (0, 0, 0)
        O.step()
        f, n, t2 = joints.F[:, 0], joints.contact_data["n"][:, 0], joints.contact_data["t2"][:, 0]
        out.append(area * (f[0] * n + f[1] * t2 + f[2] * np.cross(n, t2)))
    return out

def bounce(share, cycles=50, kn=1e8, eta=0.5, u0=1e-3):
    k = (1 + eta) * area * kn * u0**eta           # stiffness at rest, at the closure u0
    slab_and_sphere(R)
    engines(mu=0.4)
    O.bodies[1].state.pos = (0, 0, R - 0.3 * u0)  # let go at 0.3 of the closure at rest
    attached(TableLaw("grown.txt"))
    O.dt = share * sqrt(m / k)
    O.forces.setPermF(1, (0, 0, -area * kn * u0 ** (1 + eta)))
    z, state = [], O.bodies[1].state
    for _ in range(int(cycles * 2 * pi / share * 1.05)):
        O.step()
        z.append(state.pos[2])
    z = np.array(z) - (R - u0)
    v = np.diff(z)
    turns = np.flatnonzero((v[1:] < 0) & (v[:-1] > 0)) + 1     # highest points
    a, b, c = z[turns - 1], z[turns], z[turns + 1]             # parabola through three
    return b + (a - c) ** 2 / (16 * b - 8 * a - 8 * c)

touches = (1.0, 1.00003)
result(
    native=[[collide(False, mu, touch)[0] for touch in touches] for mu in {FRICTION}],
    joint=[[collide(True, mu, touch) for touch in touches] for mu in {FRICTION}],
    twist=twist(),
    tops=[bounce(share) for share in {RELATIVE_TIME_STEPS}],
)
"""


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """All scenes of this file, in one YADE."""
    folder = tmp_path_factory.mktemp("collision")
    for mu in FRICTION:
        make_table(folder / f"linear-{mu}.txt", 1e11, 5e10, mu)
    make_table(folder / "uneven.txt", KN, (K2 + K3) / 2, mu=1e9, uneven=0.5, end=0.2)
    make_table(folder / "grown.txt", eta=0.5)
    return run_scene(folder, SCENES)


@pytest.mark.parametrize("case", range(len(FRICTION)), ids=FRICTION)
def test_oblique_collision_equals_yades_own_linear_law(scenes, case):
    """At mu = 0.4 the contact slides throughout, at 5 it sticks and slides.

    The contact point of both is half-way in the overlap and shear is the true motion there
    (avoidGranularRatcheting off). YADE takes the frame at the end of a step, we the one at its
    middle, a difference of first order in the step: 2000 steps per collision put it below 1e-6.
    """
    native = np.array(scenes["native"][case])
    joint, before, after = (np.array(part) for part in zip(*scenes["joint"][case], strict=True))
    speed = 0.1
    spin = 3.0
    off = np.abs(joint - native)
    turned = np.abs(native[..., 3:] - [[3, 0.5, 2], [-1, 2, 1.2]])
    assert turned.max() > 0.3 * min(FRICTION[case], 1)
    assert off[..., :3].max() < 1e-6 * speed
    assert off[..., 3:].max() < 1e-6 * spin
    # linear and angular momentum: sums of equal and opposite forces at one point, to rounding
    # (of position times momentum, and leapfrog holds them at half steps)
    change = np.abs(after - before)
    assert change[:, :3].max() < 1e-12 * np.abs(before).max()
    assert change[:, 3:].max() < 1e-9 * np.abs(before).max()


@pytest.mark.parametrize(
    ("case", "bound"), [(0, 1e-4), (1, 1e-4), (2, 5e-4)], ids=RELATIVE_TIME_STEPS
)
def test_an_undamped_bounce_keeps_its_amplitude(scenes, case, bound):
    """Change of the amplitude per cycle over 50 cycles: slope of a line through its logarithm.

    Leapfrog with a force that depends on position only conserves a nearby energy. The remaining
    change is the error of the peak between two steps.
    """
    top = scenes["tops"][case]
    assert len(top) >= 50
    assert abs(np.expm1(np.polyfit(np.arange(len(top)), np.log(top), 1)[0])) < bound


def test_axes_turn_with_one_body_and_the_force_with_both(scenes):
    """Shear, a turn of both bodies about the normal, and shear again, in the plane y + iz.

    Stiffness differs by a factor 3 between the azimuths, which body id1 carries; the force turns
    with the mean of the two. The contact is half-way in the overlap. The mean of two turns has an
    error of second order in the step: 2e-6 in 400 steps.
    """
    area = np.pi * R**2
    turn = np.exp(1j * TURNS[0])
    slip = SPIN * (R - OVERLAP / 2)
    first, turned, last = (F[1] + 1j * F[2] for F in scenes["twist"])
    assert first == pytest.approx(area * K2 * slip, rel=1e-5)
    assert turned == pytest.approx(first * np.exp(0.5j * sum(TURNS)), rel=1e-5)
    along = turn.real * turn
    across = -turn.imag * 1j * turn  # parts of y, by the axes of id1
    more = area * slip * (K2 * along + K3 * across)
    assert last == pytest.approx(turned + more, rel=1e-5)
    assert [F[0] for F in scenes["twist"]] == pytest.approx([area * KN * OVERLAP] * 3, rel=1e-5)
