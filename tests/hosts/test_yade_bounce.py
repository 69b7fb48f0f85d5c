"""Undamped bounce: the default adapter neither makes nor loses energy, the lagged one makes it."""

import numpy as np

BOUNCE = """
kn, eta, R = 1e8, 0.5, 0.5
m, area = 2600 * 4 / 3 * pi * R**3, pi * R**2
u0 = 1e-3                                     # closure at rest
load = area * kn * u0 ** (1 + eta)
k = (1 + eta) * area * kn * u0**eta           # stiffness there
def bounce(lagged, share, cycles=50):
    slab_and_sphere(R)
    engines(mu=0.4)
    O.bodies[1].state.pos = (0, 0, R - 0.3 * u0)  # let go at 0.3 of the closure at rest
    joints = Joints(TableLaw("joint.txt"), lagged=lagged)
    joints.attach()
    O.dt = share * sqrt(m / k)
    O.forces.setPermF(1, (0, 0, -load))
    z, n = [], int(cycles * 2 * pi / share * 1.05)
    state = O.bodies[1].state
    for _ in range(n):
        O.step()
        z.append(state.pos[2])
    z = np.array(z) - (R - u0)
    v = np.diff(z)
    turns = np.flatnonzero((v[1:] < 0) & (v[:-1] > 0)) + 1     # highest points
    a, b, c = z[turns - 1], z[turns], z[turns + 1]             # parabola through three
    return (b + (a - c) ** 2 / (16 * b - 8 * a - 8 * c)).tolist()
"""


def growth(top):
    """Change of the amplitude per cycle: slope of a line through its logarithm."""
    return np.expm1(np.polyfit(np.arange(len(top)), np.log(top), 1)[0])


def test_same_step_correction_keeps_the_amplitude(yade, make_table, tmp_path):
    """50 cycles at dt = 0.02, 0.1, 0.3 sqrt(m/k).

    Leapfrog with a force that depends on position alone conserves a nearby energy: what is left is
    the reading of the peak between steps.
    """
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4, eta=0.5)
    out = yade(BOUNCE + "result(**{f'at{s}': bounce(False, s) for s in (0.02, 0.1, 0.3)})")
    for share, bound in ((0.02, 1e-4), (0.1, 1e-4), (0.3, 5e-4)):
        top = out[f"at{share}"]
        assert len(top) >= 50
        print(share, growth(top))
        assert abs(growth(top)) < bound


def test_lagged_rewrite_pumps_energy(yade, make_table, tmp_path):
    """The option says so: it acts a step late. Growth is of the order of pi/2 dt eta per cycle."""
    make_table(tmp_path / "joint.txt", 1e8, 5e7, 0.4, eta=0.5)
    out = yade(BOUNCE + "result(**{f'at{s}': bounce(True, s, 6) for s in (0.02, 0.1, 0.3)})")
    for share in (0.02, 0.1, 0.3):
        print(share, out[f"at{share}"], growth(out[f"at{share}"][:3]))
    assert 0.01 < growth(out["at0.02"][:3]) < 0.1
    assert growth(out["at0.1"][:3]) > 0.05
