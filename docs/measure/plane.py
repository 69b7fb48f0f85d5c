"""A law with a plane against the law in 3-D, on a path of shear in that plane."""

from dataclasses import replace

import numpy as np
from tables import asked, table

import jointlaw as jl

asked(__doc__)

LAW = jl.JointLaw(
    orientation=jl.Orientation(3.0, 0.0, 0.3),
    asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3),
    heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation="individual"),
    asperity_density=1e10,
    closure_range=2e-6,
)
NAMES = "balanced", "fine", "reference"
HEAD = ["azimuth (deg)", *(f"change at {name}" for name in NAMES), "shear across, dropped"]


def planes_apart(law, way):
    """Largest change of the shear in the plane, and shear across it, as shares of the peak."""
    along, found = np.array([np.cos(way), np.sin(way)]), []
    space, flat = law.joint(), replace(law, plane=way).joint()
    for k in range(300):  # shut, shear, shear back
        d = [5e-7, 0.0] if k == 0 else [0.0, 1e-8 if k < 150 else -1e-8]
        F, _ = space.update([d[0], *(d[1] * along)], tangent=False)
        G, _ = flat.update(d, tangent=False)
        found.append([F[1:] @ along, G[1], F[1:] @ [-along[1], along[0]]])
    full, reduced, across = np.array(found).T
    peak = np.abs(full).max()
    return np.abs(full - reduced).max() / peak, np.abs(across).max() / peak


rows = []
for degrees in (0.0, 22.5, 45.0, 67.5, 90.0):
    cells = []
    for name in NAMES:
        change, across = planes_apart(replace(LAW, resolution=name), np.radians(degrees))
        cells.append(f"{change:.0e}")
    rows.append([f"{degrees:g}", *cells, f"{across:.1%}"])
print(table(HEAD, rows))
