r"""
The tangent in a Newton solve
=============================

A block between two joints is loaded in shear: where is its equilibrium?

`Shear this rock and open it in the browser <../browser.html#rock=biegel-rough&play=opening>`__.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# An implicit code looks for the displacement of the block that balances the load. ``trial`` returns
# traction and consistent tangent and does not change the joint; ``update`` commits the converged
# step. The block (1 m² of joint below and above it) may move in all directions. Its upper joint is
# upside down: motion of the block away from one joint closes the other.

law = jl.presets.load("biegel-rough")
lower = law.joint(normal_stress=10e6)
upper = law.joint(normal_stress=10e6)
flip = np.diag([-1.0, 1.0, 1.0])


def solve(load, use_consistent_tangent):
    """Displacement (3,) in m and residuals in Pa, with the consistent or the initial tangent."""
    u = np.zeros(3)
    residuals = []
    initial_tangent = None
    for _ in range(100):
        F1, C1 = lower.trial(u)
        F2, C2 = upper.trial(flip @ u)
        residual = load - F1 - flip @ F2
        residuals.append(float(np.linalg.norm(residual)))
        if residuals[-1] < 1e-6:
            break
        tangent = C1 + flip @ C2 @ flip
        initial_tangent = tangent if initial_tangent is None else initial_tangent
        u = u + np.linalg.solve(tangent if use_consistent_tangent else initial_tangent, residual)
    return u, residuals


# %%
# One load step by two methods: 2 MPa downwards, 6 MPa along axis 2 and 1 MPa along axis 3.

load = np.array([2e6, 6e6, 1e6])
u, newton = solve(load, use_consistent_tangent=True)
_, modified = solve(load, use_consistent_tangent=False)
lower.update(u)
upper.update(flip @ u)
print(f"displacement {u * 1e9} nm in {len(newton)} iterations with the consistent tangent")
print(f"with the initial tangent the residual is {modified[-1]:.0e} Pa after {len(modified)}")

figure, axis = plt.subplots(layout="constrained")
axis.semilogy(newton, "o-", label="consistent tangent")
axis.semilogy(modified, "s--", markevery=5, label="initial tangent")
axis.set(xlabel="iteration", ylabel="residual (Pa)")
axis.legend()
plt.show()

# %%
# With the consistent tangent the number of correct digits doubles in each iteration once the branch
# (stick or slip of every cell) is right.
