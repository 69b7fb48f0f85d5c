"""Regenerate the tables of docs/only-what-is-needed.md.

`python docs/make_only_what_is_needed.py [PART ...]`: all parts take about a quarter of an hour of
processor time. A part is what stands between its two marks in the page: savings, slip, plane,
angles, or a scene that comes with dem_demo.
"""

import sys
from dataclasses import replace
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "benchmarks"))

import numpy as np  # noqa: E402
import reductions  # noqa: E402

import jointlaw as jl  # noqa: E402
from dem_demo import ablate, load  # noqa: E402
from dem_demo.predict import friction_angle  # noqa: E402
from dem_demo.scene import names  # noqa: E402
from jointlaw.resolution import NAMED  # noqa: E402

STRESS = 10e6  # Pa
PAGE = HERE / "only-what-is-needed.md"


def table(head, rows):
    """A table in Markdown."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in lines) + "\n"


def savings():
    """What each reduction saves, all timed in one run."""
    return reductions.table(reductions.measure()) + "\n"


def slip():
    """Sliders that slip in a closure test, where no asperity reaches its friction limit."""
    asperity = replace(reductions.WHOLE.asperity, mu=0.6)  # mu lam = 0.72, tan(pi/(2a)) = 0.58
    rows = []
    for name in NAMED:
        law = replace(reductions.WHOLE, asperity=asperity, resolution=name, closure_only=True)
        joint, steps = law.joint(), 200
        top, found = float(law.closure(STRESS)), []
        for closing in np.repeat([top / steps, -top / steps], steps):
            joint.update([closing], tangent=False)
            found.append(joint.slipping)
        shut, opened = np.array(found).reshape(2, steps)
        work = float(law.curve.energy(np.array(top)) * law.normal_stress(top))
        work /= float(law.curve.force(np.array(top))[0])
        lost = joint.dissipated_energy / work
        rows.append([name, f"{(shut > 0).mean():.0%}", f"{(opened > 0).mean():.0%}", f"{lost:.2%}"])
    return table(["resolution", "closing steps with slip", "opening", "work lost"], rows)


def plane():
    """A law with a plane against the law in 3-D on a path of shear in that plane."""
    rows, orientation = [], jl.Orientation(3.0, 0.0, 0.3)
    for degrees in (0.0, 22.5, 45.0, 67.5, 90.0):
        way, cells = np.radians(degrees), []
        for name in ("balanced", "fine", "reference"):
            law = replace(reductions.WHOLE, orientation=orientation, resolution=name)
            change, across = _planes_apart(law, way)
            cells.append(f"{change:.0e}")
        rows.append([f"{degrees:g}", *cells, f"{across:.1%}"])
    head = ["azimuth (deg)", "change at balanced", "fine", "reference", "shear across, dropped"]
    return table(head, rows)


def _planes_apart(law, way):
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


def angles():
    """Friction angle of the two laws of the tilt test, alone, by stress and resolution."""
    rows, laws = [], load("tilt").laws
    for u, phi, depth in ((2, 3, 1), (2, 4, 1), (2, 10, 1), (4, 6, 1), (4, 10, 1), (4, 10, 6),
                          (16, 24, 1)):  # fmt: skip
        found = []
        for stress in (26e3, 6e3):
            for name in ("along", "across"):
                law = replace(laws[name], resolution=jl.Resolution(u, phi, depth))
                found.append(f"{friction_angle(law, stress):.2f}")
        rows.append([f"{u} x {phi} x {depth}", *found])
    head = ["u x phi x depth", "along, 26 kPa", "across, 26 kPa", "along, 6 kPa", "across, 6 kPa"]
    return table(head, rows)


def main():
    parts = {"savings": savings, "slip": slip, "plane": plane, "angles": angles}
    parts |= {name: lambda name=name: ablate.table(ablate.ablate(load(name))) for name in names()}
    for key in sys.argv[1:] or parts:
        if f"<!-- {key} -->\n" not in PAGE.read_text(encoding="utf-8"):
            print(f"{key} is left out: {PAGE.name} has no marks <!-- {key} --> for it")
            continue
        made = parts[key]().rstrip() + "\n"
        page = PAGE.read_text(encoding="utf-8")
        before, rest = page.split(f"<!-- {key} -->\n")
        after = rest[rest.index(f"<!-- end of {key} -->") :]
        PAGE.write_text(f"{before}<!-- {key} -->\n{made}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
