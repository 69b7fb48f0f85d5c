"""Files with a slip in each, that docs/wrong-inputs.md names, as people make them."""

import numpy as np
from scene_text import PLAIN, ROCK
from scipy.ndimage import gaussian_filter

import jointlaw as jl

SHEAR = {  # rows below the title: displacement and shear stress
    "no-names.csv": "",
    "no-unit.csv": "us [mm],tau",
    "Mpa.csv": "us [mm],tau [Mpa]",
    "no-normal.csv": "us [mm],tau [MPa]",
    "not-shear.csv": "time [s],force [kN]",
}
ROWS = [(0.0, 0.0), (0.1, 0.9), (0.2, 1.3), (0.4, 1.4)]
CLOSURE = [(0.2, 0.0), (0.5, 12.0), (1.0, 25.0), (2.0, 40.0), (4.0, 55.0), (8.0, 70.0)]

SCENE = f"""
gravity = [0.0, -9.81]
density = 2600.0
[laws.rock]
plane = 0.0
{ROCK}[laws.plain]
{PLAIN}[[block]]
name = "base"
box = [4.0, 1.0]
at = [0.0, -0.5]
fixed = true
[[block]]
name = "top"
box = [1.0, 0.5]
at = [0.0, 0.25]
[run]
end = 0.002
record = 0.001
step = 1e-4
"""
SCENES = {  # what is put for what
    "mu-35.toml": ("mu = 0.4", "mu = 35"),
    "friction-30.toml": ("friction = 0.3", "friction = 30"),
    "density.toml": ("density = 2600.0", "density = 2.6"),
    "plane-90.toml": ("plane = 0.0", "plane = 90"),
    "up.toml": ("[0.0, -9.81]", "[0.0, 9.81]"),
    "all-fall.toml": ("fixed = true", "fixed = false"),
    "long.toml": ("end = 0.002", "end = 2000"),
    "good.toml": ("", ""),
}


def make(folder):
    """Write all of them."""

    def table(name, title, rows, mark="{:g},{:g}"):
        lines = [title] * bool(title) + [mark.format(*row) for row in rows]
        (folder / name).write_text("\n".join(lines) + "\n")

    for name, title in SHEAR.items():
        table(name, title, ROWS)
    table("sign.csv", "us [mm],tau [MPa]", [(u, -t) for u, t in ROWS])
    table("word.csv", "us [mm],tau [MPa]", [*ROWS[:3], (0.4, "n/a")], "{},{}")
    table("comma.csv", "us [mm],tau [MPa]", [(u, 1 + t) for u, t in ROWS], "{:.1f}|{:.1f}")
    text = (folder / "comma.csv").read_text()
    (folder / "comma.csv").write_text(text.replace(".", ",").replace("|", ","))
    table("drift.csv", "us [mm],tau [MPa],sn [MPa]", [(u, t, 1 + u) for u, t in ROWS],
          "{:g},{:g},{:g}")  # fmt: skip
    table("below-zero.csv", "us [mm],tau [MPa],sn [MPa]", [(u, t, -1) for u, t in ROWS],
          "{:g},{:g},{:g}")  # fmt: skip
    table("closure.csv", "sigma_n [MPa],closure [um]", CLOSURE)
    table("no-unit-closure.csv", "sigma_n,closure", CLOSURE)
    table("metres.csv", "sigma_n [MPa],closure [m]", CLOSURE)
    table("pascals.csv", "sigma_n [Pa],closure [um]", CLOSURE)
    table("opening.csv", "sigma_n [MPa],closure [um]", [(s, -u) for s, u in CLOSURE])
    table("tension.csv", "sigma_n [MPa],closure [um]", [(-s, u) for s, u in CLOSURE])
    for name, (old, new) in SCENES.items():
        assert old in SCENE
        (folder / name).write_text(SCENE.replace(old, new, 1))
    law = jl.presets.text("biegel-rough")
    (folder / "law-mu-35.toml").write_text(law.replace("mu = 0.3", "mu = 35"))
    (folder / "done").mkdir()
    (folder / "done" / "summary.json").write_text('{"files": ["shear.csv"]}')
    (folder / "done" / "shear.csv").write_text("of an earlier run")
    (folder / "thousands.csv").write_text("us [mm]\ttau [kPa]\n0.0\t0\n0.1\t900\n0.2\t1,201\n")
    z = gaussian_filter(np.random.default_rng(0).standard_normal((160, 160)), 6)
    np.savetxt(folder / "scan.csv", 500 * z, delimiter=",")
