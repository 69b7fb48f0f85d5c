"""What becomes of the paper's claims when its asperities yield.

    python benchmarks/claims_yielding.py --share 0.2

Every preset of the paper gets a yield_interference of this share of its closure (that at 10 MPa,
or the 1 um that Figures 14 to 16 keep), and its claims on closure and shear are decided again.
"""

from __future__ import annotations

import argparse
import multiprocessing as mp
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import jointlaw as jl
from jointlaw.paper import runs
from jointlaw.paper.contents import CLAIMS

KEPT = 1e-6  # m, closure of the figures for a law without heights
SHOWN = {  # of every claim, numbers of the incremental law that decide it
    "closure-hardening": ("growth of dF₁/dδ₁: smooth, rough", "smooth", "rough"),
    "shear-stiffness": ("smooth over rough at 0.1, 50 MPa", "law_0", "law_3"),
    "friction-tends-to-mu": ("F₂/F₁, a = 2, 3, 6, 9", *(f"law_a{a}_2" for a in (2, 3, 6, 9))),
    "nonlinear-above-linear": ("excess of F₂/F₁, a = 3, 6", "law_a3", "law_a6"),
    "smooth-stronger": ("F₂/F₁ at 1.5 µm: smooth, rough", "law_smooth_2", "law_rough_2"),
    "smooth-hardens": ("rise of F₂/F₁: smooth, rough", "law_smooth", "law_rough"),
    "friction-anisotropy": ("angle at 0 and 90° (°)", "law_0", "law_90"),
    "friction-independent": ("angle at 1 mm, 0.1 and 10 MPa (°)", "law_first", "law_last"),
}
LOAD = jl.presets.load


def decided(share: float) -> dict[str, tuple[str, str]]:
    """Verdict and numbers of every claim, with a yield interference of this share; 0 is elastic."""

    def load(name: str) -> jl.JointLaw:
        law = LOAD(name)
        if not share:
            return law
        closure = KEPT if law.heights is None else float(law.closure(10e6))
        asperity = replace(law.asperity, yield_interference=share * closure)
        return replace(law, asperity=asperity)

    runs.presets.load = load
    found = {}
    for key, (_, *names) in SHOWN.items():
        numbers = CLAIMS[key].measure()
        shown = ", ".join(f"{numbers[name]:.3g}" for name in names)
        found[key] = CLAIMS[key].verdict(numbers), shown
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--share", type=float, default=0.2, help="of the closure (0.2)")
    args = parser.parse_args()
    # a process each: the figures keep what they have computed
    with ProcessPoolExecutor(1, mp.get_context("spawn"), max_tasks_per_child=1) as pool:
        elastic, yielding = pool.map(decided, (0.0, args.share))
    print("| the paper says | numbers | elastic | yielding |\n|---|---|---|---|")
    for key, (label, *_) in SHOWN.items():
        cells = " | ".join(
            f"{verdict}: {shown}" for verdict, shown in (elastic[key], yielding[key])
        )
        print(f"| {CLAIMS[key].says} | {label} | {cells} |")


if __name__ == "__main__":
    main()
