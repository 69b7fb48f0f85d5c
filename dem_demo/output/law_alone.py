"""What the law alone says about a scene: slip angles and direct shear curves."""

import numpy as np

import jointlaw as jl

from ..scene import Scene, is_coulomb

SLIP_DISTANCE = 2e-3  # m, for laws without a critical slip distance
ROUNDS = 50  # most trials of an angle; a handful is enough where there is one


def slip_distance(law: jl.JointLaw) -> float:
    """Sliding (m) that counts as slip: the law's critical slip distance."""
    return law.critical_slip if np.isfinite(law.critical_slip) else SLIP_DISTANCE


def friction_angle(law: jl.JointLaw, stress: float) -> float:
    """Peak of F2/F1 (degrees) of the law in direct shear at a constant normal stress (Pa)."""
    if is_coulomb(law):
        return float(np.degrees(np.arctan(law.asperity.mu)))
    to = [1.2 * slip_distance(law)]  # friction peaks where the contacts begin to be renewed
    record = jl.direct_shear(law.joint(), to=to, normal=stress, steps=120)
    return float(record.peak_friction_angle)


def slip_angle(scene: Scene, law_name: str, moving: int, length: float) -> dict:
    """Base angle (degrees) at which a block on a joint of `length` (m) should slip, and the stress.

    The normal stress falls as the base tilts, so angle and stress are found together. Both are None
    where the law says nothing: no contact, no gravity, a stress that it cannot carry.
    """
    weight, angle = scene.blocks[moving].mass * np.hypot(*scene.gravity), 35.0
    for _ in range(ROUNDS if length > 0 else 0):
        before, stress = angle, float(weight / length * np.cos(np.radians(angle)))
        try:
            angle = friction_angle(scene.laws[law_name], stress)
        except (ValueError, jl.PathError):
            break
        if abs(angle - before) <= 5e-3:
            return {"predicted_angle": angle, "normal_stress": stress}
    return {"predicted_angle": None, "normal_stress": None}


def shear_curve(law: jl.JointLaw, stress: float, slid: np.ndarray) -> jl.Record | None:
    """Direct shear of the law alone along the turning points of `slid` (m), at a normal stress.

    None for plain Coulomb and where the law cannot be sheared like this: no normal stress, no
    motion.
    """
    inner = np.flatnonzero(np.diff(np.sign(np.diff(slid)))) + 1
    turns = [float(u) for u in [*slid[inner], slid[-1]]]
    try:
        if not is_coulomb(law):
            return jl.direct_shear(law.joint(), to=turns, normal=stress, steps=400)
    except (ValueError, jl.PathError):
        pass
    return None
