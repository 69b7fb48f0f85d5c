"""
Figure 18: directional friction angle of the concrete replica
=============================================================

arctan(shear resistance/normal stress) when all asperities in contact first slide, μ = 0.47 and the
parameters of section 4.2. The paper finds it to depend on the direction, hardly on a normal stress
above zero, and to be larger at zero. In the total form it does not depend on the normal stress at
all. Grey: arctan μ + π/2a, reached when the slip is far above the closure, hence at any slip when
the normal stress is zero. Measured points are not printed.
"""

import numpy as np
from _common import (
    LAW,
    TOTAL,
    draw,
    mirrored,
    print_comparison,
    replica_yield,
    slip_limit,
    total_yield,
)

azimuth = np.arange(0.0, 361.0, 7.5)  # degrees
circle = np.arange(0.0, 361.0, 2.0)  # degrees
quarter = np.radians(azimuth)[:13]
limit = circle, np.full(circle.shape, slip_limit())
panels = {
    TOTAL: {"every normal stress": (azimuth, mirrored([total_yield(x) for x in quarter]))},
    LAW: {},
}
for stress, label in ((10.0, "normal stress to 0"), (1e6, "1 MPa"), (10e6, "10 MPa")):
    panels[LAW][label] = azimuth, mirrored([replica_yield(stress, x) for x in quarter])
for lines in panels.values():
    lines["slip far above closure"] = limit

labels = {"xlabel": "azimuth φ (°)", "ylabel": "friction angle (°)", "ylim": (0.0, 60.0)}
draw(panels, [("C0", "0.4"), ("C0--", "C1", "C2:", "0.4")], polar=True, **labels)

for kind, lines in panels.items():
    for label, (_, angle) in lines.items():
        text = "{:.1f}°, {:.1f}°, {:.1f}°".format(*angle[[0, len(angle) // 8, len(angle) // 4]])
        print_comparison(
            (f"at 0, 45, 90°, {kind}, {label}", "directional; larger at zero stress", text)
        )
