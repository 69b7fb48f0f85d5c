"""The rocks of a scene one by one: for several seeds, with their own laws and with Coulomb's law.

The Coulomb law has the peak and residual strength of the joint law at the normal stress that its
joints carry at the start, as an engineer would choose it. The difference of the two runs shows what
a joint law adds to a strength, such as dilation, and friction that depends on stress and direction.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl

from ..output.monitors import slip_distance
from ..output.record import RunRecord, outcomes
from ..output.run import run_to_failure
from ..scene import TYPICAL_STRESS, Scene
from .strength import alone

RESIDUAL_SLIP = 20.0  # slip distances at which the strength of a law is its residual strength
SHEAR_STEPS = 800
COULOMB_OVERLAP = 0.1  # max_overlap of the Coulomb runs: constant springs are soft in impacts


def compare(scene: Scene, seeds: Sequence[int], until: float | None) -> Iterator[dict]:
    """Run every rock of a scene alone, for each seed, with its joint laws and with Coulomb's law.

    until: model time to stop at (s), by default the scene's end.

    Yields outcomes with `law` ("joint" or "coulomb"), `seed`, `laws` (the Coulomb laws by name),
    `time_s` at the end, and `stopped`: the message of an error that ended the run.
    """
    for name in [rock.name for rock in scene.rocks]:
        for seed in seeds:
            rock = alone(scene, name, seed)
            record, message = run_to_failure(rock, until)
            yield {"law": "joint", "seed": seed, "laws": {}, **_row(record, message)}
            coulomb_rock, laws = with_coulomb_laws(rock, record)
            record, message = run_to_failure(coulomb_rock, until)
            yield {"law": "coulomb", "seed": seed, "laws": laws, **_row(record, message)}


def with_coulomb_laws(scene: Scene, record: RunRecord) -> tuple[Scene, dict[str, jl.CoulombLaw]]:
    """The scene with Coulomb's law of the same strength in place of each joint law, and these laws.

    record: of a run of the scene, for the normal stresses of its joints at the start.
    """
    laws = {
        name: coulomb_of_same_strength(law, stress)
        for (name, law), stress in zip(scene.laws.items(), _mean_stresses(record), strict=True)
        if isinstance(law, jl.JointLaw)
    }
    settings = replace(scene.run, max_overlap=COULOMB_OVERLAP)
    return replace(scene, laws=scene.laws | laws, run=settings), laws


def _row(record: RunRecord, message: str) -> dict:
    """Outcome of a run of one rock."""
    return outcomes(record)[0] | {"time_s": record.times[-1], "stopped": message}


def _mean_stresses(record: RunRecord) -> list[float]:
    """Mean normal stress (Pa) of the joints of each law at the start, weighted by their forces.

    TYPICAL_STRESS for a law without closed joints.
    """
    law, normal, length = (record.joints[0][key] for key in ("law", "normal_stress_Pa", "length_m"))
    means = []
    for i in range(len(record.scene.laws)):
        forces = np.maximum(normal, 0.0) * length * (law == i)
        mean = np.average(normal, weights=forces) if forces.any() else TYPICAL_STRESS
        means.append(float(mean))
    return means


def coulomb_of_same_strength(law: jl.JointLaw, stress: float) -> jl.CoulombLaw:
    """Build the Coulomb law with the peak and residual friction of a joint law at a normal stress
    (Pa).

    It weakens with the same work as the joint law. The bond becomes cohesion and tension.
    """
    record = jl.direct_shear(
        replace(law, bond=None).joint(),
        to=[RESIDUAL_SLIP * slip_distance(law)],
        normal=stress,
        steps=SHEAR_STEPS,
    )
    friction = record.shear_stress / stress
    slip = record.shear_2
    peak = int(friction.argmax())
    residual = float(friction[-1])
    drop = float(friction[peak] - residual)
    work = float(trapezoid(friction[peak:] - residual, slip[peak:]))
    bond = {"cohesion": law.bond.cohesion, "tension": law.bond.tension} if law.bond else {}
    return jl.CoulombLaw(
        *law.secant_stiffness(stress),
        drop + residual,
        residual_friction=residual,
        residual_cohesion=0.0,
        weakening=2 * work / drop if drop else 0.0,
        plane=0.0,
        **bond,
    )
