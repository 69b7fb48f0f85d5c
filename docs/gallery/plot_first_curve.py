r"""
A first curve
=============

Rock, surface and friction in, closure curve and stiffness out.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A joint is described by the stiffness and friction of its asperities (Hertz contacts of granite,
# 40 µm in radius), their orientations (within 30° of the joint normal), their heights (4.8 ± 2.2 µm
# below the highest, on two faces that overlap by 2 µm at first contact), and their density.

law = jl.JointLaw(
    orientation=jl.Orientation(a=3.0),
    asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.3, R=40e-6, mu=0.6),
    heights=jl.GammaHeights.from_moments(4.8e-6, (2.2e-6) ** 2, overlap=2e-6),
    asperity_density=1e10,
)

# %%
# The first-loading curve needs no joint: it is a property of the law.

closure = np.linspace(0.0, 0.25e-6, 200)
stress = law.normal_stress(closure)
at_10_MPa = law.closure(10e6)

# %%
# A joint is path-dependent. ``C`` is the tangent of the step: closing gives the normal stiffness, a
# small step of shear of the closed joint its shear stiffness (``trial`` does not change the joint).

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
axis.set(xlabel="closure (µm)", ylabel="normal stress (MPa)", title="Closure under first loading")
axis.legend()
plt.show()
