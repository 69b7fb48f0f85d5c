"""
Figure 19: friction angle against normal stress, concrete replica
=================================================================

The interface of Figure 18 by two definitions of yield: all asperities in contact slide (nearly
independent of normal stress, as the paper says), and a slip of 1 mm (falls with normal stress).
Grey line: arctan μ + π/2a, at zero normal stress for any slip. The contact density is not printed:
with another one the dashed curves shift along the stress axis. Measured points are not printed.
"""

from dataclasses import replace

import numpy as np
from _common import (
    COARSE,
    LAW,
    TOTAL,
    draw,
    preset_law,
    print_comparison,
    ratio,
    replica_yield,
    slip_limit,
    total,
    total_yield,
)

import jointlaw as jl

slip = 1e-3  # m, chosen here
stresses = np.array([0.1e6, 0.3e6, 1e6, 3e6, 10e6])  # Pa, chosen here
coarse = replace(preset_law("jing-replica"), resolution=COARSE)
panels = {TOTAL: {}, LAW: {}}
total_lines, incremental_lines = panels.values()
for degrees in (0, 90):
    azimuth = np.radians(degrees)
    label = f"{degrees}°"
    yields = [replica_yield(s, azimuth) for s in stresses]
    tests = [total("jing-replica", 2 * slip, s, azimuth=azimuth) for s in stresses]
    at_slip = [np.interp(slip, t.shear, np.degrees(np.arctan(ratio(t)))) for t in tests]
    records = [
        jl.direct_shear(coarse.joint(), slip, s, azimuth=azimuth, steps=40) for s in stresses
    ]
    ends = [record.friction_angle[-1] for record in records]
    total_yields = [total_yield(azimuth)] * len(stresses)
    for lines, first, second in (
        (total_lines, total_yields, at_slip),
        (incremental_lines, yields, ends),
    ):
        lines[f"all in contact slide, {label}"] = stresses * 1e-6, np.array(first)
        lines[f"slip of 1 mm, {label}"] = stresses * 1e-6, np.array(second)

labels = {"xlabel": "normal stress (MPa)", "ylabel": "friction angle (°)", "ylim": (0.0, 75.0)}
for axes in draw(panels, ("C0o-", "C0s--", "C1o-", "C1s--"), **labels):
    axes.axhline(slip_limit(), color="0.6", lw=3, zorder=1, label="normal stress 0, any slip")
    axes.set(xscale="log", xticks=stresses * 1e-6, xticklabels=[f"{s * 1e-6:g}" for s in stresses])
    axes.minorticks_off()
    axes.legend(loc="upper right", ncols=2, fontsize=8)

for kind, lines in panels.items():
    for label, (_, angle) in lines.items():
        text = f"{angle[0]:.1f}° to {angle[-1]:.1f}°"
        print_comparison((f"0.1 to 10 MPa, {kind}, {label}", "nearly independent of stress", text))
