"""Three synthetic direct shear tests, for the tutorial on calibration: `python
docs/measure/synthetic_shear.py [FOLDER]`.

The joint is `TRUE_LAW`. A machine holds the normal stress within 1 %, and gauges add noise: the
load cell 1.5 % of its reading and 0.5 % of its largest, the gauges of shear and opening 5 and 3
micrometres. The specimens differ by 3 % in friction and roughness, like specimens of a joint set.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import jointlaw as jl
from jointlaw.calibration import datasets

TRUE_LAW = jl.JointLaw(
    orientation=jl.Orientation(a=4.4),
    asperity=jl.Asperity(K=9.5e8, lam=1.2, eta=0.5, mu=0.58),
    heights=jl.GammaHeights(alpha=4.0, beta=1e-4, formation="individual"),
    asperity_density=6.5e5,
    mating_length=4.5e-3,
)
NORMAL_STRESSES = (1, 3, 5)  # MPa
SHEAR = 6e-3  # m
ROWS = 41
SEED = 20


def specimen(rng: np.random.Generator) -> jl.JointLaw:
    """The joint of one specimen: `TRUE_LAW` with another friction and roughness."""
    friction, roughness = 1.0 + 0.03 * rng.normal(size=2)
    asperity = replace(TRUE_LAW.asperity, mu=TRUE_LAW.asperity.mu * friction)
    orientation = jl.Orientation(TRUE_LAW.orientation.a * roughness)
    return replace(TRUE_LAW, asperity=asperity, orientation=orientation)


def test_file(rng: np.random.Generator, normal: int) -> str:
    """Text of the file of one test at a normal stress in MPa, as a machine would write it."""
    record = jl.direct_shear(specimen(rng).joint(), to=SHEAR, normal=1e6 * normal, steps=400)
    rows = np.unique(np.round(400 * np.linspace(0.0, 1.0, ROWS) ** 1.5).astype(int))
    stress = record.shear_stress[rows] / 1e6
    shear = 1e3 * record.shear[rows]
    opening = 1e3 * (record.closure[0] - record.closure[rows])
    started = np.arange(len(rows)) > 0  # gauges read zero at the start
    table = np.column_stack(
        [
            shear + 0.005 * started * rng.normal(size=len(rows)),
            stress * (1 + 0.015 * rng.normal(size=len(rows)))
            + 0.005 * stress.max() * started * rng.normal(size=len(rows)),
            normal * (1 + 0.003 * rng.normal(size=len(rows))),
            opening + 0.003 * started * rng.normal(size=len(rows)),
        ]
    )
    lines = [";".join(f"{value:.4f}" for value in row) for row in np.maximum(table, [0, 0, 0, -9])]
    return "\n".join(["us [mm];tau [MPa];sigma_n [MPa];dn [mm]", *lines]) + "\n"


def write(folder: Path) -> None:
    """Write the three files."""
    rng = np.random.default_rng(SEED)
    folder.mkdir(parents=True, exist_ok=True)
    for normal in NORMAL_STRESSES:
        (folder / f"shear-{normal}MPa.csv").write_text(test_file(rng, normal), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else datasets.SHEAR_TESTS)
