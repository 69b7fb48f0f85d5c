r"""
The tangent in a Newton solve
=============================

A block between two joints is pushed sideways: where does it come to rest?
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# An implicit code asks: which displacement of the block balances the load? ``trial`` answers
# without moving the joint, with traction and consistent tangent; ``update`` keeps the step that
# converged. The block (1 m² of joint below and above it) may move in all directions. Its upper
# joint is upside down: motion of the block away from one is closure of the other.

law = jl.presets.load("biegel-rough")
lower, upper = law.joint(normal_stress=10e6), law.joint(normal_stress=10e6)
turn = np.diag([-1.0, 1.0, 1.0])


def balance(load, use_tangent):
    """Displacement (3,) in m and residuals in Pa: Newton, or the stiffness of the start kept."""
    u, residuals, kept = np.zeros(3), [], None
    for _ in range(100):
        F1, C1 = lower.trial(u)
        F2, C2 = upper.trial(turn @ u)
        miss = load - F1 - turn @ F2
        residuals.append(float(np.linalg.norm(miss)))
        if residuals[-1] < 1e-6:
            break
        tangent = C1 + turn @ C2 @ turn
        kept = tangent if kept is None else kept
        u = u + np.linalg.solve(tangent if use_tangent else kept, miss)
    return u, residuals


# %%
# One load step, two ways: 2 MPa downwards, 6 MPa along axis 2 and 1 MPa along axis 3.

load = np.array([2e6, 6e6, 1e6])
u, newton = balance(load, use_tangent=True)
_, modified = balance(load, use_tangent=False)
lower.update(u)
upper.update(turn @ u)
print(f"displacement {u * 1e9} nm in {len(newton)} iterations with the consistent tangent")
print(f"with the tangent of the start {modified[-1]:.0e} Pa are left after {len(modified)}")

figure, axis = plt.subplots(layout="constrained")
axis.semilogy(newton, "o-", label="consistent tangent")
axis.semilogy(modified, "s--", markevery=5, label="tangent of the start")
axis.set(xlabel="iteration", ylabel="imbalance (Pa)")
axis.legend()
plt.show()

# %%
# With the consistent tangent the number of correct digits doubles from step to step once the branch
# (stick or slip of every cell) is found.
