"""The rocks of a scene one by one: for several seeds, with their own laws and with plain Coulomb.

Plain Coulomb has the friction of the asperities themselves, the same in all directions, and
stiffnesses like those of the joint at half the height of the rock. What it lacks is dilation,
hardening and direction: the difference between the two runs is what these do.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

import jointlaw as jl

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.record import Record, far, outcomes
from ..output.run import play
from ..scene import Law, Scene
from .strength import alone


def compare(scene: Scene, seeds: Sequence[int], until: float) -> Iterator[dict]:
    """Every rock of a scene, for each seed and each kind of law; yields outcomes.

    until: model time to stop at (s).
    """
    for name in [rock.name for rock in scene.rocks]:
        for seed in seeds:
            own = alone(scene, name, seed)
            laws = {name: _plain(own, law) for name, law in own.laws.items()}
            run = replace(own.run, max_overlap=0.1)  # constant springs are soft in impacts
            for kind, case in (("joint", own), ("coulomb", replace(own, laws=laws, run=run))):
                yield {"law": kind, "seed": seed, **_run(case, until)}


def _run(scene: Scene, until: float) -> dict:
    sim = Simulation(scene)
    record, trouble = Record(sim), ""
    try:
        play(sim, record, until, far)
    except Refused as error:
        trouble = str(error)
    return outcomes(record)[0] | {"time_s": sim.time, "refused": trouble}


def _plain(scene: Scene, law: Law) -> jl.CoulombLaw:
    if isinstance(law, jl.CoulombLaw):
        return law
    (rock,) = scene.rocks
    blocks = [scene.blocks[i] for i in rock.blocks]
    height = np.ptp(np.concatenate([block.corners[:, 1] for block in blocks]))
    stress = 0.5 * blocks[0].density * np.hypot(*scene.gravity) * height
    stiffness = float(stress / law.closure(stress))
    mu = law.asperity.mu
    return jl.CoulombLaw(stiffness, stiffness / law.asperity.lam, mu, plane=0.0)
