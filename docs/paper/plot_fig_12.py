"""
Figure 12: initial shear stiffness against normal stress
========================================================

dF₂/dδ₂ at zero shear and constant closure, after closing to the normal stress. The smooth interface
is the stiffer one, and the stiffness grows ever more slowly with stress. (a) Parameters of
section 4.1, friction 0.3 as in section 4.3. (b) Parameters of section 4.2; the paper prints no
contact density for the replica, so its stiffness is normalised by its value at 10 MPa, and the
stress axis shifts with the assumed density. The incremental law is stiffer, since asperities that
slid in closure stick when the shear begins. Measured points and axis ranges are not printed.
"""

import numpy as np
from _common import LAW, TOTAL, WESTERLY, draw, initial_stiffness, preset_law, print_comparison

granite = np.linspace(0.5e6**0.5, 50e6**0.5, 34) ** 2  # Pa, dense where the curves bend
concrete = np.linspace(0.1e6**0.5, 10e6**0.5, 34) ** 2
replica = preset_law("jing-replica")
unit = initial_stiffness(replica, 10e6)[1]
panels = {
    f"{letter}, {kind}": {} for letter in ("(a) granite", "(b) replica") for kind in (TOTAL, LAW)
}
cases = [("(a) granite", label, preset_law(name), 0, granite, 1e12) for name, label in WESTERLY]
cases += [
    ("(b) replica", f"azimuth {azimuth}°", replica, azimuth, concrete, unit)
    for azimuth in (0, 45, 90)
]
for joint, label, law, azimuth, stresses, scale in cases:
    pairs = [initial_stiffness(law, float(s), np.radians(azimuth)) for s in stresses]
    for kind, values in zip((TOTAL, LAW), np.transpose(pairs), strict=True):
        panels[f"{joint}, {kind}"][label] = stresses * 1e-6, values / scale

styles = [("C0", "C1"), ("C0", "C1"), ("C2", "C2--", "C2:"), ("C2", "C2--", "C2:")]
axes = draw(panels, styles, xlabel="normal stress (MPa)")
for panel in axes[:2]:
    panel.set(ylabel="initial shear stiffness (MPa/µm)", ylim=(0.0, 210.0))
for panel in axes[2:]:
    panel.set(ylabel="stiffness/(incremental, 0°, 10 MPa)", ylim=(0.0, 1.05))

for stress in (1e6, 50e6):
    total, incremental = np.divide(
        *(initial_stiffness(preset_law(name), stress) for name, _ in WESTERLY)
    )
    text = f"{total:.2f} (total form), {incremental:.2f} (incremental law)"
    print_comparison((f"smooth over rough at {stress * 1e-6:g} MPa", "above 1", text))
