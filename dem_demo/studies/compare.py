"""The rocks of a scene one by one: for several seeds, with their own laws and with Coulomb's.

"coulomb" has the peak and residual strength that each law itself has at the normal stress that its
joints bear at the start, which is what an engineer would give it: the difference to "joint" is what
the law adds to a strength, such as dilation, and friction that depends on stress and direction.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

import jointlaw as jl

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.monitors import slip_distance
from ..output.record import Record, far, outcomes
from ..output.run import play
from ..scene import USUAL, Scene, springs
from .strength import alone

FAR = 20.0  # slip distances: where the strength of a law is its residual one


def compare(scene: Scene, seeds: Sequence[int], until: float) -> Iterator[dict]:
    """Every rock of a scene, for each seed and each kind of law; yields outcomes, and `laws`:
    Coulomb's joints that stand for joint laws.

    until: model time to stop at (s).
    """
    for name in [rock.name for rock in scene.rocks]:
        for seed in seeds:
            own = alone(scene, name, seed)
            yield {"law": "joint", "seed": seed, "laws": {}, **_run(own, until)}
            stress = stresses(Simulation(own))
            run = replace(own.run, max_overlap=0.1)  # constant springs are soft in impacts
            laws = {name: of_strength(law, stress[name]) for name, law in own.laws.items()
                    if isinstance(law, jl.JointLaw)}  # fmt: skip
            case = replace(own, laws=own.laws | laws, run=run)
            yield {"law": "coulomb", "seed": seed, "laws": laws, **_run(case, until)}


def _run(scene: Scene, until: float) -> dict:
    sim = Simulation(scene)
    record, trouble = Record(sim), ""
    try:
        play(sim, record, until, far)
    except Refused as error:
        trouble = str(error)
    return outcomes(record)[0] | {"time_s": sim.time, "refused": trouble}


def stresses(sim: Simulation) -> dict[str, float]:
    """Mean normal stress (Pa) of the joints of each law, weighted by their forces; the usual one
    where none is pressed."""
    press = np.maximum(sim.joints.traction[:, 0], 0.0)
    force = press * sim.contacts.length
    return {
        name: float(np.average(press[rows], weights=force[rows])) if force[rows].any() else USUAL
        for name, rows in zip(sim.scene.laws, sim.joints.rows, strict=True)
    }


def of_strength(law: jl.JointLaw, stress: float) -> jl.CoulombLaw:
    """Coulomb's joint with the peak and residual friction of a joint law at a normal stress (Pa),
    which it loses with the same work; its bond as cohesion and tension."""
    bare = replace(law, bond=None).joint()
    record = jl.direct_shear(bare, to=[FAR * slip_distance(law)], normal=stress, steps=800)
    friction, slid = record.shear_stress / stress, record.shear_2
    top, residual = int(friction.argmax()), float(friction[-1])
    fall = float(friction[top] - residual)
    work = float(np.trapezoid(friction[top:] - residual, slid[top:]))
    bond = {"cohesion": law.bond.cohesion, "tension": law.bond.tension} if law.bond else {}
    return jl.CoulombLaw(
        *springs(law, stress), fall + residual, residual_friction=residual, residual_cohesion=0.0,
        weakening=2 * work / fall if fall else 0.0, plane=0.0, **bond,
    )  # fmt: skip
