"""Monitors of a run: slip, shear, history points; and predictions of the law alone."""

from contextlib import suppress

import numpy as np

import jointlaw as jl

from ..dynamics.simulation import Simulation
from ..scene import Scene, rotation

POINT_COLUMNS = ("x_m", "y_m", "vx_m/s", "vy_m/s")
JOINT_COLUMNS = ("normal_Pa", "shear_Pa", "closure_m", "slip_m", "sliding_fraction")
BOLT_COLUMNS = ("force_N", "elongation_m", "yielding_m")
DEFAULT_SLIP_DISTANCE = 2e-3  # m, for laws without a finite mating length
PEAK_SEARCH = 1.2  # slip distances within which friction peaks
PEAK_SEARCH_STEPS = 120
MAX_ITERATIONS = 50  # of the predicted slip angle; a handful is enough where there is one
ANGLE_TOLERANCE = 5e-3  # degrees, of the predicted slip angle
FIRST_ANGLE = 35.0  # degrees, at which its iteration starts


def start_slip_monitors(sim: Simulation) -> dict[tuple[int, int], dict]:
    """Return the entries of the slips that `[monitor]` names, by moving block and base.

    `slip_distance` (m) is the slip that counts as failure of the joint. `slip_angle` (degrees) and
    `slip_time` (s) are None until then; `slipped_before` tells that it was exceeded before the run
    (of a run that is resumed). `predicted_angle` and `normal_stress`: see `predict_slip`.
    """
    scene = sim.scene
    slips = {}
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
            **predict_slip(scene, name, moving, length),
        }
    return slips


def update_slip_monitors(slips: dict[tuple[int, int], dict], sim: Simulation) -> None:
    """Note base angle and time of each joint that has passed its slip distance since last time."""
    for (moving, base), entry in slips.items():
        is_pending = entry["slip_angle"] is None and not entry["slipped_before"]
        if is_pending and sim.shear_displacement(moving, base) > entry["slip_distance"]:
            entry["slip_angle"] = base_angle(sim, moving, base)
            entry["slip_time"] = sim.time


def base_angle(sim: Simulation, moving: int, base: int) -> float:
    """Angle (degrees, 0 to 90) of a base against the horizontal that gravity defines.

    It is the angle of the base's face below the block `moving`: of the face that its centroid is
    farthest outside of. Zero without gravity.
    """
    _, outward = _facing_edge(sim, base, moving)
    along = np.array([-outward[1], outward[0]])
    gravity = np.array(sim.scene.gravity)
    return float(np.degrees(np.arctan2(abs(along @ gravity), abs(outward @ gravity))))


def law_between(sim: Simulation, moving: int, base: int) -> str:
    """Name of the law of the joint between the edges with which two blocks face each other."""
    first, second = sorted((moving, base))
    edges = [_facing_edge(sim, first, second)[0], _facing_edge(sim, second, first)[0]]
    return sim.joints.law_names[sim.manager.laws_of(np.array([edges]))[0]]


def _facing_edge(sim: Simulation, block: int, other: int) -> tuple[int, np.ndarray]:
    """Find the edge of a block that the centroid of another block is farthest outside of.

    Returns its number among all edges of the scene, and its outward normal.
    """
    x, y, angle = sim.blocks.motion[:3, block]
    corners = sim.scene.blocks[block].local @ rotation(angle).T + [x, y]
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    distances = ((sim.blocks.motion[:2, other] - corners) * outward).sum(axis=1)
    edge = int(distances.argmax())
    return sim.manager.outlines.first_corner[block] + edge, outward[edge]


def read_monitors(sim: Simulation) -> dict[str, float]:
    """Return the present readings of `[monitor]` and of all bolts by name; names end in their unit.

    History points are relative to the base, whose own displacement and velocity are read too if a
    drive moves it.
    """
    scene = sim.scene
    groups = []
    for moving, base in (*scene.slip, *scene.shear):
        joint = {"base angle_deg": base_angle(sim, moving, base), **_read_joint(sim, moving, base)}
        groups.append((scene.blocks[moving].name, joint))
    for i, pair in enumerate(scene.point_joints):
        groups.append((f"joint {i + 1}", _read_joint(sim, *pair)))
    base_motion = base_displacement(scene, sim.blocks.motion)
    for i, (block, point) in enumerate(scene.points):
        motion = _point_motion(sim, block, point) - base_motion
        reading = dict(zip(POINT_COLUMNS, motion.tolist(), strict=True))
        reading["displacement_m"] = float(np.hypot(*(motion[:2] - point)))
        groups.append((f"point {i + 1}", reading))
    for i, ends in enumerate(scene.convergences):
        drawn = float(np.hypot(*np.subtract(ends[0][1], ends[1][1])))
        places = [_point_motion(sim, *end)[:2] for end in ends]
        distance = float(np.hypot(*(places[1] - places[0])))
        columns = {"distance_m": distance, "convergence_m": drawn - distance}
        groups.append((f"convergence {i + 1}", columns))
    bolts = sim.blocks.bolts
    elongation = bolts.elongation(sim.blocks.motion)
    for i, columns in enumerate(zip(bolts.tension, elongation, bolts.yielding, strict=True)):
        reading = dict(zip(BOLT_COLUMNS, map(float, columns), strict=True))
        groups.append((f"bolt {i + 1}", reading))
    if scene.base is not None and scene.blocks[scene.base].moves:
        groups.append(("base", dict(zip(POINT_COLUMNS, base_motion.tolist(), strict=True))))
    return {f"{name}: {key}": value for name, group in groups for key, value in group.items()}


def _point_motion(sim: Simulation, block: int, point: tuple[float, float]) -> np.ndarray:
    """Position and velocity (4,) of the point of a block that was at `point` at first (m, m/s)."""
    x, y, angle, u, v, spin = sim.blocks.motion[:, block]
    arm_x, arm_y = rotation(angle) @ (np.asarray(point) - sim.scene.blocks[block].centroid)
    return np.array([x + arm_x, y + arm_y, u - spin * arm_y, v + spin * arm_x])


def base_displacement(scene: Scene, motion: np.ndarray) -> np.ndarray:
    """Displacement from the scene as drawn, and velocity, of its base (4,), at a motion (6, n).

    Zero without a base.
    """
    base = scene.base
    if base is None:
        return np.zeros(4)
    return motion[[0, 1, 3, 4], base] - [*scene.blocks[base].centroid, 0.0, 0.0]


def _read_joint(sim: Simulation, moving: int, base: int) -> dict[str, float]:
    """Means over the joint between two blocks, by JOINT_COLUMNS."""
    joints = sim.joints
    weights = sim.area_fractions(moving, base)
    columns = [*joints.traction.T, *joints.delta.T, joints.sliding]
    readings = zip(JOINT_COLUMNS, columns, strict=True)
    return {name: float(weights @ column) for name, column in readings}


def slip_distance(law: jl.Law) -> float:
    """Slip (m) that counts as failure of a joint: the mating length of its law."""
    asperities = law.tables.asperities
    has_mating_length = asperities is not None and asperities.interlock_decays
    return asperities.mating_length if has_mating_length else DEFAULT_SLIP_DISTANCE


def friction_angle(law: jl.Law, stress: float) -> float:
    """Peak friction angle (degrees) of a law in direct shear at a constant normal stress (Pa).

    For Coulomb's law from friction and cohesion; for other laws by a simulated test up to a
    multiple of the slip distance of the law.
    """
    if type(law) is jl.CoulombLaw:  # a subclass may have more elements
        return float(np.degrees(np.arctan(law.friction + law.cohesion / stress)))
    slip = PEAK_SEARCH * slip_distance(law)
    record = jl.direct_shear(law.joint(), to=[slip], normal=stress, steps=PEAK_SEARCH_STEPS)
    return float(record.peak_friction_angle)


def predict_slip(scene: Scene, law_name: str, moving: int, length: float) -> dict:
    """Predict by the law alone when a block on a tilting base slips; length (m): of its joint.

    Returns `predicted_angle` (degrees) of the base and `normal_stress` (Pa) at slip. They are found
    together, because the normal stress falls as the base tilts. Both are None without contact or
    gravity, with water, seismic coefficients, bolts or pressures on faces, and for a stress that
    the law cannot carry.
    """
    weight = scene.blocks[moving].section.mass * np.hypot(*scene.gravity)
    angle = FIRST_ANGLE
    other_forces = scene.wet or any(scene.seismic) or scene.bolts or scene.face_pressures
    is_predicted = length > 0 and not other_forces
    with suppress(ValueError, jl.PathError):
        for _ in range(MAX_ITERATIONS if is_predicted else 0):
            previous = angle
            stress = float(weight / length * np.cos(np.radians(angle)))
            angle = friction_angle(scene.laws[law_name], stress)
            if abs(angle - previous) <= ANGLE_TOLERANCE:
                return {"predicted_angle": angle, "normal_stress": stress}
    return {"predicted_angle": None, "normal_stress": None}


def shear_curve(law: jl.Law, stress: float, slip: np.ndarray) -> jl.TestRecord | None:
    """Direct shear of the law alone between the turning points of `slip` (m), at a normal stress
    (Pa).

    None for Coulomb's law, and where the law cannot be sheared like this: without normal stress or
    motion.
    """
    turning = np.flatnonzero(np.diff(np.sign(np.diff(slip)))) + 1
    with suppress(ValueError, jl.PathError):
        if type(law) is not jl.CoulombLaw:
            path = [*slip[turning].tolist(), float(slip[-1])]
            return jl.direct_shear(law.joint(), to=path, normal=stress, steps=400)
    return None
