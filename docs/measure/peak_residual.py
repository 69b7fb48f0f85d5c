"""Peak and residual shear stress of sandstone joints: a law fitted to three tests.

    python docs/measure/peak_residual.py

Direct shear to 10 mm of profile JA, dry (Mendeley Data, doi 10.17632/g5pf6k9n2w, as parsed by
ybfo/RockJointNet). Fitted are the tests at 1, 3 and 5 MPa, predicted those at 2 and 4 MPa: peak,
its displacement, and the stress at 10 mm, taken as residual. Printed are the law, each figure over
its measured one, and what halving the step changes.
"""

import numpy as np
from scipy.optimize import least_squares
from tables import asked, table

import jointlaw as jl

HEAD = ["normal stress (MPa)", "error of the peak", "its displacement, law / measured",
        "error of the residual", "halved step"]  # fmt: skip
# normal stress (MPa): peak (MPa), its displacement (mm), stress at 10 mm (MPa)
MEASURED = {
    1.0: (1.280, 1.937, 0.862),
    2.0: (2.310, 2.365, 1.775),
    3.0: (3.418, 1.994, 2.575),
    4.0: (4.468, 2.422, 3.483),
    5.0: (5.719, 2.650, 4.331),
}
FITTED = (1.0, 3.0, 5.0)
# K (Pa m^(-1/2)) stands for K times the density, which shear tests cannot tell apart
START = {"K": 3e6, "a": 3.0, "mu": 0.5, "mating_length": 5e-3}
WEIGHTS = np.array([1.0, 0.25, 1.0])  # a peak is flat: its displacement scatters most


def law(x: np.ndarray) -> jl.JointLaw:
    """The law of the logarithms (4,) of the parameters in START."""
    v = dict(zip(START, np.exp(x).tolist(), strict=True))
    return jl.JointLaw(
        orientation=jl.Orientation(v["a"]),
        asperity=jl.Asperity(v["K"], 1.17, 0.5, v["mu"]),
        asperity_density=1e6, closure_range=1e-3, resolution=jl.Resolution(5, 3, 2), plane=0.0,
        mating_length=v["mating_length"],
    )  # fmt: skip


def shear(x: np.ndarray, normal: float, steps: int = 120) -> np.ndarray:
    """Shear stress (MPa) from 0 to 10 mm, (steps + 1,)."""
    record = jl.direct_shear(law(x).joint(), 10e-3, normal * 1e6, steps=steps)
    return np.asarray(record.shear_stress) / 1e6


def figures(stress: np.ndarray) -> np.ndarray:
    """Peak (MPa), its displacement (mm) by a parabola about the peak, and the last stress (MPa)."""
    top = int(np.clip(np.argmax(stress), 1, stress.size - 2))
    before, peak, after = stress[top - 1 : top + 2]
    shift = 0.5 * (before - after) / (before - 2 * peak + after)
    return np.array([peak, 10 * (top + shift) / (stress.size - 1), stress[-1]])


def misfit(x: np.ndarray, normals: tuple[float, ...] = FITTED) -> np.ndarray:
    """Weighted ln(model/measured) of every figure."""
    ratios = [np.log(figures(shear(x, n)) / MEASURED[n]) for n in normals]
    return np.concatenate([WEIGHTS * ratio for ratio in ratios])


def main() -> None:
    start = np.log(list(START.values()))
    found = least_squares(misfit, start, bounds=(start - 3, start + 3), diff_step=1e-3, xtol=1e-6)
    fitted = ", ".join(f"{n} = {v:.4g}" for n, v in zip(START, np.exp(found.x), strict=True))
    print(f"{fitted}; rms of the weighted misfit {np.sqrt(np.mean(found.fun**2)):.4f}")
    rows = []
    for normal, measured in MEASURED.items():
        stress = shear(found.x, normal)
        peak, at, residual = figures(stress) / measured
        halved = np.max(np.abs(shear(found.x, normal, 240)[::2] - stress)) / stress.max()
        note = "" if normal in FITTED else ", predicted"
        rows.append([f"{normal:g}{note}", f"{100 * (peak - 1):+.1f} %", f"x {at:.2f}",
                     f"{100 * (residual - 1):+.1f} %", f"{100 * halved:.2f} %"])  # fmt: skip
    print(table(HEAD, rows))


if __name__ == "__main__":
    asked(__doc__)
    main()
