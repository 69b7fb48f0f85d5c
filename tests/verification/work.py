"""Work of a joint's own force along a step, integrated without the joint's ledger."""

import numpy as np

from jointlaw.joints.state import JointState

_X, _W = np.polynomial.legendre.leggauss(2)


def nodes(panels):
    """Composite two-point Gauss rule on [0, 1]: t (2 panels,) and weights."""
    t = (np.arange(panels)[:, None] + 0.5 * (_X + 1.0)) / panels
    return t.ravel(), np.tile(0.5 * _W / panels, panels)


class WorkMeter:
    """Advances n joints of a law, and measures int_0^1 F(trial(t d)) . d dt of each step.

    Every joint is carried once per quadrature point, so that one call of `trial` evaluates the
    force at all points of all steps.
    """

    def __init__(self, law, n, panels):
        self.n, (self.t, self.w) = n, nodes(panels)
        self.copies = law.joints(n * len(self.t))

    def start(self, state):
        """Put all joints into one state (rows, 1)."""
        values = np.repeat(state.T, len(self.copies), axis=0)
        self.copies.restore(JointState(self.copies.law.fingerprint, values))

    def step(self, d):
        """Work (n,) of the increments d (n, dim); the joints move on."""
        spread = np.repeat(d, len(self.t), axis=0)
        part = spread * np.tile(self.t, self.n)[:, None]
        force = self.copies.trial(part, tangent=False)[0]
        self.copies.update(spread, tangent=False)
        power = np.sum(force * spread, axis=1).reshape(self.n, -1)
        return power @ self.w

    @property
    def stored(self):
        """Stored energy (n,)."""
        return self.copies.stored_energy.reshape(self.n, -1)[:, 0]
