"""The price list of a preset on one thread, shortened; `print(law.tradeoff())` shows it all."""

import os
from dataclasses import replace

from tables import asked, table

import jointlaw as jl

asked(__doc__)

os.environ["JOINTLAW_THREADS"] = "1"
HEAD = ["`Resolution`", "sliders", "bytes", "error", "friction", "dilation", "ns", "with tangent"]

found = replace(jl.presets.load("westerly-smooth"), plane=0.0).tradeoff()
names = {resolution: f"{name}: " for name, resolution in found.named.items()}
shown = {price.resolution for price in found.frontier()} | set(names)
rows = []
for price in sorted(found.rows, key=lambda price: price.sliders):
    r = price.resolution
    if r in shown:
        rows.append([f"{names.get(r, '')}{r.u}, {r.phi}, {r.depth}", price.sliders, price.bytes,
                     f"{price.worst:.2%}", f"{price.friction:.2f}°", f"{price.dilation:.2f}°",
                     f"{price.ns:.0f}", f"{price.ns_tangent:.0f}"])  # fmt: skip
print(table(HEAD, rows))
