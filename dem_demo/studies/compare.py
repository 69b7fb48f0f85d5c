"""The rocks of a scene one by one: for several seeds, with their own laws and with Coulomb's.

"coulomb" has the peak and residual strength that each law itself has at the normal stress that its
joints bear at the start, which is what an engineer would give it: the difference to "joint" is what
the law adds to a strength, such as dilation, and friction that depends on stress and direction.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl

from ..output.monitors import slip_distance
from ..output.record import Record, outcomes
from ..output.run import to_failure
from ..scene import TYPICAL_STRESS, Scene
from .strength import alone

FAR = 20.0  # slip distances: where the strength of a law is its residual one


def compare(scene: Scene, seeds: Sequence[int], until: float | None) -> Iterator[dict]:
    """Every rock of a scene, for each seed and each kind of law; yields outcomes, and `laws`:
    Coulomb's joints that stand for joint laws.

    until: model time to stop at (s), by default the scene's end.
    """
    for name in [rock.name for rock in scene.rocks]:
        for seed in seeds:
            own = alone(scene, name, seed)
            record, refused = to_failure(own, until)
            yield {"law": "joint", "seed": seed, "laws": {}, **_row(record, refused)}
            run = replace(own.run, max_overlap=0.1)  # constant springs are soft in impacts
            laws = {
                name: of_strength(law, stress)
                for (name, law), stress in zip(own.laws.items(), _stresses(record), strict=True)
                if isinstance(law, jl.JointLaw)
            }
            case = to_failure(replace(own, laws=own.laws | laws, run=run), until)
            yield {"law": "coulomb", "seed": seed, "laws": laws, **_row(*case)}


def _row(record: Record, refused: str) -> dict:
    return outcomes(record)[0] | {"time_s": record.times[-1], "refused": refused}


def _stresses(record: Record) -> list[float]:
    """Mean normal stress (Pa) of the joints of each law at the start, weighted by their forces; the
    usual one where none is pressed."""
    law, press, length = (record.joints[0][key] for key in ("law", "normal_stress_Pa", "length_m"))
    forces = (np.maximum(press, 0.0) * length * (law == i) for i in range(len(record.scene.laws)))
    return [float(np.average(press, weights=f)) if f.any() else TYPICAL_STRESS for f in forces]


def of_strength(law: jl.JointLaw, stress: float) -> jl.CoulombLaw:
    """Coulomb's joint with the peak and residual friction of a joint law at a normal stress (Pa),
    which it loses with the same work; its bond as cohesion and tension."""
    record = jl.direct_shear(
        replace(law, bond=None).joint(), to=[FAR * slip_distance(law)], normal=stress, steps=800
    )
    friction, slid = record.shear_stress / stress, record.shear_2
    top, residual = int(friction.argmax()), float(friction[-1])
    fall = float(friction[top] - residual)
    work = float(trapezoid(friction[top:] - residual, slid[top:]))
    bond = {"cohesion": law.bond.cohesion, "tension": law.bond.tension} if law.bond else {}
    return jl.CoulombLaw(
        *law.secant_stiffness(stress), fall + residual, residual_friction=residual,
        residual_cohesion=0.0, weakening=2 * work / fall if fall else 0.0, plane=0.0, **bond,
    )  # fmt: skip
