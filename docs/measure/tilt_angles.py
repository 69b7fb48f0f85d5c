"""Friction angles (deg) of the two laws of the tilt test, alone, by stress and resolution."""

from dataclasses import replace

from tables import asked, table

import dem_demo
import jointlaw as jl

asked(__doc__)

HEAD = ["u, phi, depth", "along, 26 kPa", "across, 26 kPa", "along, 6 kPa", "across, 6 kPa"]
RULES = (2, 3, 1), (2, 4, 1), (2, 10, 1), (4, 6, 1), (4, 10, 1), (4, 10, 6), (16, 24, 1)

laws, rows = dem_demo.load("tilt").laws, []
for rule in RULES:
    found = []
    for stress in (26e3, 6e3):
        for name in ("along", "across"):
            law = replace(laws[name], resolution=jl.Resolution(*rule))
            # friction peaks within a mating length
            record = jl.direct_shear(law.joint(), 1.2 * law.mating_length, stress, steps=120)
            found.append(f"{record.peak_friction_angle:.2f}")
    rows.append([", ".join(map(str, rule)), *found])
print(table(HEAD, rows))
