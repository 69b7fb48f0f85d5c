r"""
A first curve
=============

Rock, surface and friction in, closure curve and stiffness out.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A joint is described by what its asperities are made of (Hertz contacts of granite, 40 µm in
# radius), which way they face (within 30° of the joint normal), how high they stand (4.8 ± 2.2 µm
# below the highest, two faces that overlap by 2 µm when they are laid on each other), and how many
# there are.

law = jl.JointLaw(
    orientation=jl.Orientation(a=3.0),
    asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.3, R=40e-6, mu=0.6),
    heights=jl.GammaHeights.from_moments(4.8e-6, (2.2e-6) ** 2, overlap=2e-6),
    asperity_density=1e10,
)

# %%
# The virgin curve needs no joint: it is a property of the law.

closure = np.linspace(0.0, 0.25e-6, 200)
stress = law.normal_stress(closure)
at_10_MPa = law.closure(10e6)

# %%
# A joint has memory. ``C`` is the tangent of the step taken: closing gives the normal stiffness, a
# first bit of shear of the closed joint its shear stiffness (``trial`` leaves the joint alone).

joint = law.joint()
F, C = joint.update([at_10_MPa, 0.0, 0.0])
_, sheared = joint.trial([0.0, 1e-6 * at_10_MPa, 0.0])
print(f"closure at 10 MPa    {at_10_MPa * 1e6:.3f} µm")
print(f"normal stiffness     {C[0, 0] / 1e12:.1f} MPa/µm")
print(f"shear stiffness      {sheared[1, 1] / 1e12:.1f} MPa/µm")
print(f"asperities in touch  {law.contacts(at_10_MPa) / 1e6:.0f} per mm²")

# %%
figure, axis = plt.subplots(layout="constrained")
axis.plot(closure * 1e6, stress / 1e6)
axis.plot(at_10_MPa * 1e6, 10, "o")
slope = np.array([-0.04, 0.04])
axis.plot((at_10_MPa + slope * 1e-6) * 1e6, 10 + slope * C[0, 0] / 1e12, "--", label="tangent")
axis.set(xlabel="closure (µm)", ylabel="normal stress (MPa)", title="Virgin closure curve")
axis.legend()
plt.show()
