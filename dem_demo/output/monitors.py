"""Monitors of a run: slip, shear, points of a rock; and what the law alone says of them."""

from contextlib import suppress

import numpy as np

import jointlaw as jl

from ..dynamics.simulation import Simulation
from ..scene import Scene, rotation

POINT = "x_m", "y_m", "vx_m/s", "vy_m/s"
SLIP_DISTANCE = 2e-3  # m, for laws without a finite mating length
ROUNDS = 50  # most trials of an angle; a handful is enough where there is one


def watched_slips(sim: Simulation) -> dict[tuple[int, int], dict]:
    """What is known at the start of the slips that the scene's [monitor] table names, by the moving
    block and its base."""
    slips, scene = {}, sim.scene
    for moving, base in scene.slip:
        name = law_between(sim, moving, base)
        distance = slip_distance(scene.laws[name])
        length = float(sim.contacts.length[sim.manager.between(moving, base)].sum())
        slips[moving, base] = {
            "block": scene.blocks[moving].name,
            "base": scene.blocks[base].name,
            "law": name,
            "slip_distance": distance,
            "slip_angle": None,
            "slip_time": None,
            "slipped_before": sim.shear_displacement(moving, base) > distance,
            **slip_angle(scene, name, moving, length),
        }
    return slips


def look(slips: dict[tuple[int, int], dict], sim: Simulation) -> None:
    """Note the base angle (degrees) at which a joint of these passes its slip distance."""
    for (moving, base), entry in slips.items():
        waits = entry["slip_angle"] is None and not entry["slipped_before"]
        if waits and sim.shear_displacement(moving, base) > entry["slip_distance"]:
            entry |= {"slip_angle": base_angle(sim, moving, base), "slip_time": sim.time}


def base_angle(sim: Simulation, moving: int, base: int) -> float:
    """Angle (degrees, 0 to 90) of a base against the horizontal that gravity defines; 0 without it.

    Of the base's face that `moving` lies on: the one that its centroid is farthest outside of.
    """
    _, outward = _face(sim, base, moving)
    across, down = np.array([-outward[1], outward[0]]), np.array(sim.scene.gravity)
    return float(np.degrees(np.arctan2(abs(across @ down), abs(outward @ down))))


def law_between(sim: Simulation, moving: int, base: int) -> str:
    """Name of the law of the joint between the faces with which two blocks face each other."""
    one, other = sorted((moving, base))
    edges = [_face(sim, one, other)[0], _face(sim, other, one)[0]]
    return sim.joints.law_names[sim.manager.laws_of(np.array([edges]))[0]]


def _face(sim: Simulation, block: int, other: int) -> tuple[int, np.ndarray]:
    """The edge of a block that another's centroid is farthest outside of, by its number among all
    edges, and its outward normal."""
    x, y, angle = sim.blocks.motion[:3, block]
    corners = sim.scene.blocks[block].local @ rotation(angle).T + [x, y]
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    face = int(((sim.blocks.motion[:2, other] - corners) * outward).sum(axis=1).argmax())
    return sim.manager.outlines.first_corner[block] + face, outward[face]


def readings(sim: Simulation) -> dict[str, float]:
    """What the scene's [monitor] table asks for, now; the unit ends the name. Pins are told as the
    base sees them, which itself is told if it is driven."""
    groups, scene = [], sim.scene
    for moving, base in (*scene.slip, *scene.shear):
        joint = {"base angle_deg": base_angle(sim, moving, base), **_joint(sim, moving, base)}
        groups.append((scene.blocks[moving].name, joint))
    groups += [(f"joint {i + 1}", _joint(sim, *pair)) for i, pair in enumerate(scene.point_joints)]
    origin = base_of(scene, sim.blocks.motion)
    for i, (block, point) in enumerate(scene.points):
        here = _point(sim, block, point) - origin
        values = *here.tolist(), float(np.hypot(*(here[:2] - point)))
        groups.append((f"point {i + 1}", dict(zip((*POINT, "moved_m"), values, strict=True))))
    if scene.base is not None and scene.blocks[scene.base].moves:
        groups.append(("base", dict(zip(POINT, origin.tolist(), strict=True))))
    return {f"{name}: {key}": value for name, group in groups for key, value in group.items()}


def _point(sim: Simulation, block: int, point: tuple[float, float]) -> np.ndarray:
    """Place and velocity (4,) of a point of a block that was drawn at `point` (m, m/s)."""
    x, y, angle, u, v, spin = sim.blocks.motion[:, block]
    right, up = rotation(angle) @ (np.asarray(point) - sim.scene.blocks[block].centroid)
    return np.array([x + right, y + up, u - spin * up, v + spin * right])


def base_of(scene: Scene, motion: np.ndarray) -> np.ndarray:
    """Displacement since the drawing and velocity (4,) of the scene's base at a motion (6, n); zero
    without one."""
    if (base := scene.base) is None:
        return np.zeros(4)
    return motion[[0, 1, 3, 4], base] - [*scene.blocks[base].centroid, 0.0, 0.0]


def _joint(sim: Simulation, moving: int, base: int) -> dict[str, float]:
    """Mean over the joint between two blocks: stresses, closure, sliding, sliding share."""
    joints, share = sim.joints, sim.area_fractions(moving, base)
    columns = [*joints.traction.T, *joints.delta.T, joints.sliding]
    keys = "normal_Pa", "shear_Pa", "closure_m", "slid_m", "sliding_share"
    return {key: float(share @ column) for key, column in zip(keys, columns, strict=True)}


def slip_distance(law: jl.Law) -> float:
    """Sliding (m) that counts as slip: the law's mating length."""
    asperities = law.tables.asperities
    has_mating_length = asperities is not None and asperities.fades
    return asperities.mating_length if has_mating_length else SLIP_DISTANCE


def friction_angle(law: jl.Law, stress: float) -> float:
    """Peak of F2/F1 (degrees) of the law in direct shear at a constant normal stress (Pa)."""
    if isinstance(law, jl.CoulombLaw):
        return float(np.degrees(np.arctan(law.friction + law.cohesion / stress)))
    # friction peaks within a mating length
    record = jl.direct_shear(law.joint(), to=[1.2 * slip_distance(law)], normal=stress, steps=120)
    return float(record.peak_friction_angle)


def slip_angle(scene: Scene, law_name: str, moving: int, length: float) -> dict:
    """Base angle (degrees) at which a block on a joint of `length` (m) should slip, and the stress.

    The normal stress falls as the base tilts, so angle and stress are found together. Both are None
    where the law says nothing: no contact, no gravity, a stress that it cannot carry, water.
    """
    weight, angle = scene.blocks[moving].section.mass * np.hypot(*scene.gravity), 35.0
    with suppress(ValueError, jl.PathError):
        for _ in range(ROUNDS if length > 0 and not scene.wet else 0):
            before, stress = angle, float(weight / length * np.cos(np.radians(angle)))
            angle = friction_angle(scene.laws[law_name], stress)
            if abs(angle - before) <= 5e-3:
                return {"predicted_angle": angle, "normal_stress": stress}
    return {"predicted_angle": None, "normal_stress": None}


def shear_curve(law: jl.Law, stress: float, slid: np.ndarray) -> jl.TestRecord | None:
    """Direct shear of the law alone along the turning points of `slid` (m), at a normal stress.

    None for plain Coulomb and where the law cannot be sheared like this: no normal stress, no
    motion.
    """
    inner = np.flatnonzero(np.diff(np.sign(np.diff(slid)))) + 1
    with suppress(ValueError, jl.PathError):
        if isinstance(law, jl.JointLaw):
            turns = [*slid[inner].tolist(), float(slid[-1])]
            return jl.direct_shear(law.joint(), to=turns, normal=stress, steps=400)
    return None
