"""Largest error, in % of the peak, of the named resolutions by preset: on the standard paths and on
the random ones of `at_tolerance`."""

from dataclasses import replace

from tables import asked, table

import jointlaw as jl
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tolerance import EXCURSIONS
from jointlaw.parameters.resolution import NAMED

asked(__doc__)

sliders, rows = dict.fromkeys(NAMED, 0), []
for preset in jl.presets.names():
    law = replace(jl.presets.load(preset), plane=0.0)
    suite, cells = standard_suite(law, excursions=EXCURSIONS), []
    for name, resolution in NAMED.items():
        made = replace(law, resolution=resolution)
        sliders[name] = max(sliders[name], made.tables.sliders)
        cells.append(f"{100 * suite.miss(made).largest.max():.2f}")
    rows.append([preset, *cells])
print(table(["preset", *NAMED], [*rows, ["sliders, at most", *sliders.values()]]))
