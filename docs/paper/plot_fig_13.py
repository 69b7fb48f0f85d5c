"""
Figure 13: directional initial shear stiffness of the concrete replica
======================================================================

Parameters of section 4.2 (a = 3, b = −1, c = −0.3, λ = 0.33), stiffness along the motion divided by
its mean over all azimuths, since the contact density is not printed. The three stresses fall on one
curve. Direction 2 (0 degrees) is the stiffer one although c < 0, because λ < 1 makes asperities
stiffer in shear than in closure. Measured points are not printed.
"""

import numpy as np
from _common import LAW, TOTAL, draw, initial_stiffness, mirrored, preset_law, print_comparison

azimuth = np.arange(0.0, 361.0, 7.5)  # degrees
panels = {TOTAL: {}, LAW: {}}
for form, lines in enumerate(panels.values()):
    for stress in (0.5e6, 2e6, 10e6):
        quarter = np.radians(azimuth)[:13]
        values = [initial_stiffness(preset_law("jing-replica"), stress, x)[form] for x in quarter]
        circle = mirrored(values)
        lines[f"{stress * 1e-6:g} MPa"] = azimuth, circle / circle[:-1].mean()

labels = {"xlabel": "azimuth φ (°)", "ylabel": "stiffness/mean", "ylim": (0.0, 1.4)}
for axes in draw(panels, ("C0", "C1s", "C2o"), polar=True, **labels):
    for line, markers in zip(axes.get_lines()[1:], ((0, 4), (2, 4)), strict=True):
        line.set_markevery(markers)

for kind, lines in panels.items():
    along = [y[0] / y[12] for _, y in lines.values()]
    text = ", ".join(f"{x:.3f}" for x in along) + " at 0.5, 2, 10 MPa"
    print_comparison((f"stiffness along axis 2 over axis 3, {kind}", "depends on direction", text))
