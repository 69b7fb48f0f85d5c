r"""
Finite elements: a block pushed over another
============================================

Two elastic blocks with a rough joint between them, in plane strain: Newton's method on
``law.step``, and scikit-fem for the rock.
"""

from dataclasses import replace
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from scipy.sparse import block_diag, csr_matrix
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad
from skfem.models.elasticity import lame_parameters, linear_elasticity

import jointlaw as jl

# %%
# Each block is 100 mm long and 50 mm high, and has nodes of its own along the joint.

LENGTH = 0.1  # m
HEIGHT = 0.05  # m
NORMAL_STRESS = 2e6  # Pa
PUSH = 4e-6  # m
elements = 40  # along the joint
x = np.linspace(0.0, LENGTH, elements + 1)
y_above = np.linspace(0.0, HEIGHT, 11)
lower, upper = (
    Basis(MeshQuad.init_tensor(x, y), ElementVector(ElementQuad2()))
    for y in (y_above - HEIGHT, y_above)
)
rock = linear_elasticity(*lame_parameters(50e9, 0.2))
rocks = block_diag([rock.assemble(block) for block in (lower, upper)]).tocsr()


def unknowns(block, where, component):
    """Numbers of the displacements u^1 or u^2 of the nodes there, in the order of x and y."""
    numbers = block.get_dofs(where).all([component])
    order = np.lexsort(block.doflocs[:, numbers])
    return numbers[order] + (lower.N if block is upper else 0)


# %%
# The matrix ``jump`` gives closure and slip at the n nodes of the joint; the length of joint that
# each represents follows Simpson's rule.

n = 2 * elements + 1
nodal_length = np.full(n, 2.0)
nodal_length[1::2] = 4.0
nodal_length[[0, -1]] = 1.0
nodal_length *= LENGTH / nodal_length.sum()
up, along = (
    [unknowns(block, lambda x: abs(x[1]) < 1e-9, name) for block in (lower, upper)]
    for name in ("u^2", "u^1")
)
columns = np.concatenate([up[0], up[1], along[1], along[0]])  # closure: lower less upper; slip
rows = np.concatenate([np.arange(0, 2 * n, 2)] * 2 + [np.arange(1, 2 * n, 2)] * 2)
signs = np.repeat([1.0, -1.0, 1.0, -1.0], n)
jump = csr_matrix((signs, (rows, columns)), (2 * n, rocks.shape[0]))

# %%
# Each node has a state of the law. It starts under 10 kPa: a joint without stress has no stiffness.
# The lower block is fixed at its bottom, the upper one is loaded from above and then pushed at its
# left side.

law = replace(jl.presets.load("westerly-rough"), plane=0.0)
states = law.joints(n, normal_stress=10e3).snapshot().values
bottom = [unknowns(lower, lambda x: x[1] < 1e-9 - HEIGHT, name) for name in ("u^1", "u^2")]
pushed = unknowns(upper, lambda x: x[0] < 1e-9, "u^1")
free = np.setdiff1d(np.arange(rocks.shape[0]), np.concatenate([*bottom, pushed]))
top = unknowns(upper, lambda x: x[1] > HEIGHT - 1e-9, "u^2")
weight = np.zeros(rocks.shape[0])
weight[top] = -NORMAL_STRESS * nodal_length  # its nodes are those above the joint
law_seconds = []


def solve(u, states, load, push):
    """Displacements, states, tractions (n, 2) at this load, and the residual of each iteration."""
    start = jump @ u
    u = u.copy()
    residuals = []
    for _ in range(20):
        start_time = perf_counter()
        new_states, F, C = law.step(states, (jump @ u - start).reshape(n, 2))
        law_seconds.append(perf_counter() - start_time)
        force = rocks @ u + jump.T @ (nodal_length[:, None] * F).ravel() - load * weight
        correction = np.zeros_like(u)
        correction[pushed] = push - u[pushed]
        if not correction.any():  # the left side is at its prescribed position
            residuals.append(float(np.linalg.norm(force[free])))
            if residuals[-1] < 1e-6:
                return u, new_states, F, residuals
        stiffness = rocks + jump.T @ block_diag(nodal_length[:, None, None] * C) @ jump
        unbalanced = (force + stiffness @ correction)[free]
        correction[free] = spsolve(stiffness[free][:, free].tocsc(), -unbalanced)
        u += correction
    raise RuntimeError(f"no equilibrium at load {load}, push {push}")


# %%
# Eight steps of the load, then twenty of the push.

u = np.zeros(rocks.shape[0])
history = []
results = {}
load_steps = [(k / 8, 0.0) for k in range(1, 9)]
push_steps = [(1.0, PUSH * k / 20) for k in range(1, 21)]
for load, push in load_steps + push_steps:
    u, states, F, residuals = solve(u, states, load, push)
    history.append(residuals)
    results[push] = (jump @ u)[1::2], F

figure, axes = plt.subplots(2, 2, figsize=(7.5, 6.5), layout="constrained")
x = np.linspace(0.0, LENGTH, n) * 1e3
for push in [PUSH * k / 20 for k in (2, 5, 10, 20)]:
    slip, F = results[push]
    axes[0, 0].plot(x, slip * 1e6, label=f"pushed by {push * 1e6:.1f} µm")
    axes[0, 1].plot(x, F[:, 1] / 1e6)
    axes[1, 0].plot(x, F[:, 0] / 1e6)
for axis, label in zip(
    axes.flat, ("slip (µm)", "shear stress (MPa)", "normal stress (MPa)"), strict=False
):
    axis.set(xlabel="along the joint (mm)", ylabel=label)
axes[0, 0].legend(fontsize="small")
labels = {0: "8 steps of the load", 8: "20 steps of the push"}  # of the first step
for number, residuals in enumerate(history):
    colour = "C1" if number >= 8 else "C0"
    axes[1, 1].semilogy(residuals, ".-", color=colour, lw=0.8, label=labels.get(number))
axes[1, 1].set(xlabel="iteration", ylabel="residual (N/m)", ylim=(1e-10, 1e8))
axes[1, 1].legend(fontsize="small")
plt.show()

# %%
# The slip spreads from the pushed end. Newton's method converges quadratically: the order is the
# ratio of the last two reductions of the logarithm of the residual, in the steps of the push.

orders = [np.log(r[-2] / r[-3]) / np.log(r[-3] / r[-4]) for r in history[8:] if len(r) > 3]
most_iterations = max(map(len, history)) - 1
rate = n * len(law_seconds) / sum(law_seconds)
print(f"order {np.median(orders):.1f} (median), at most {most_iterations} iterations a step")
print(f"{rate:.0f} points a second in the law, {n} points")
