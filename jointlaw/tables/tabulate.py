"""From a law to its table: the graded grid, and the virgin loading paths that fill it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ..laboratory.normal_control import NormalCondition, closing_increments
from ..law import JointLaw
from ..parameters.resolution import SLIP
from ..support.checks import Array, above, whole
from ..support.version import __version__
from .table import JointTable

FLOOR = 1e-4  # stresses below this share of the largest are held to an absolute tolerance
ROWS = 30  # closures at which friction and dilation are computed
HELD = 1e-9  # of the normal stress
PROBE = 1e-7  # shear probe over closure: small against any curvature, large against rounding


def tabulate(
    law: JointLaw,
    closure: float | None = None,
    shear_limit: float | None = None,
    tolerance: float = 1e-3,
    azimuths: int = 12,
    steps: int = 60,
) -> JointTable:
    """Tabulate the virgin response of a law against closure.

    Parameters
    ----------
    law: a law in 3-D (`plane=None`).
    closure: last closure of the table in m; `law.closure_range` by default.
    shear_limit: shear displacement in m at which friction and dilation are read; the critical
        slip distance by default, and required where that is infinite.
    tolerance: interpolation error allowed between rows, as a share of the value (for values below
        1e-4 of the largest: of that floor), for normal stress and for shear stiffness.
    azimuths: number of azimuths, evenly spaced over the half circle, 3 or more; a divisor of 180.
    steps: steps of the shear path, quadratically graded.

    Raises ValueError for a bad argument.
    """
    require_3d(law)
    end = above("closure", law.closure_range if closure is None else closure, 0.0)
    tolerance = above("tolerance", tolerance, 0.0)
    steps = whole("steps", steps, 2)
    if whole("azimuths", azimuths, 3) > 180 or 180 % azimuths:
        raise ValueError(f"azimuths = {azimuths} must divide 180: columns are named by degree")
    if shear_limit is None:
        if math.isinf(law.critical_slip):
            raise ValueError(
                "shear_limit is missing: law.critical_slip is infinite, so friction has no end "
                "value; state the shear displacement (m) at which it is to be read"
            )
        shear_limit = law.critical_slip
    limit = above("shear_limit", shear_limit, 0.0)
    psi: Array = np.radians(np.arange(azimuths) * (180 // azimuths), dtype=np.float64)
    u, worst = _grid(law, end, psi, tolerance)
    secant, tangent = _normal(law, u)
    kt = _shear_stiffness(law, u, psi)
    peak, mobilised, dilation = _friction(law, u, psi, limit, steps)
    table = JointTable(u, secant * u, secant, tangent, psi, kt, peak, mobilised, dilation, {})
    harmonic = np.abs(table.lookup(u[1:, None], psi).shear_stiffness / kt[1:] - 1).max()
    # degrees by which few nodes miss the friction that a host will rely on
    finer = _friction(replace(law, resolution=SLIP), u, psi[::4], limit, steps)[1]
    missed = np.degrees(np.abs(np.arctan(mobilised[:, ::4]) - np.arctan(finer))).max()
    metadata = _metadata(law, table, tolerance, worst, harmonic, limit, steps)
    return replace(table, metadata=metadata | {"resolution_error_friction_angle": float(missed)})


def require_3d(law: JointLaw) -> None:
    """Refuse a law without the shear in all directions that a table holds."""
    if law.plane is not None:
        raise ValueError(f"law.plane = {law.plane:g}: a table needs a law in 3-D; set plane=None")
    if law.closure_only:
        raise ValueError("law.closure_only = True: a table holds shear; set closure_only=False")


def _metadata(
    law: JointLaw,
    table: JointTable,
    tolerance: float,
    worst: tuple[float, float],
    harmonic: float,
    limit: float,
    steps: int,
) -> dict[str, Any]:
    kn, kt = float(table.kn_tangent.max()), float(table.shear_stiffness.max())
    return {
        "about": f"rock joint tabulated by jointlaw {__version__}, per unit area of joint",
        "units": "un m; sn Pa; kn_secant, kn_tangent, kt Pa/m; mu, mob, dil dimensionless",
        "signs": "un > 0 is closure, sn > 0 is compression; the force on a body that moves by "
        "+delta is -area*traction",
        "azimuth": "degrees in the joint plane from axis 2 towards axis 3: digits of column names",
        "use": "kn_secant is for laws that take the total normal force kn*un; kt is the tangent "
        "for incremental shear, dFs = kt*dus",
        "yielding": "first loading only: unloading keeps the closure that asperities yielded"
        if law.tables.yields
        else "none",
        "loading_path": "virgin joint; kn: pure closure; kt: first shear after pure closure; "
        f"mu, mob, dil: shear to {limit:.6g} m in {steps} steps at constant normal stress; "
        "mu is the largest ratio on the way, mob and dil (opening per shear) are those at the end",
        "shear_limit": limit,
        "tolerance": tolerance,
        "interpolation_error_normal_stress": worst[0],
        "interpolation_error_shear_stiffness": worst[1],
        "azimuth_fit_error": float(harmonic),
        "largest_kn_tangent": kn,
        "largest_kt": kt,
        "critical_time_step": 2 / math.sqrt(max(kn, kt)),
        "critical_time_step_is": "s for 1 kg per m2 of joint: multiply by sqrt(reduced mass/area); "
        "translation of one contact only, see docs/yade.md",
        "law": law.to_toml(),
    }


def _grid(
    law: JointLaw, end: float, psi: Array, tolerance: float
) -> tuple[Array, tuple[float, float]]:
    """Closures from 0 to `end` between which linear interpolation meets the tolerance."""
    u = np.concatenate([[0.0], end * np.geomspace(1e-3, 1.0, 13)])
    axes = psi[[0, len(psi) // 2]]
    top = law.normal_stress(end), _shear_stiffness(law, np.array([end]), axes).max()
    for _ in range(40):
        middle = (u[1:] + u[:-1]) / 2
        secant = _normal(law, u)[0]
        kt, kt_middle = _shear_stiffness(law, u, axes), _shear_stiffness(law, middle, axes)
        stress = law.normal_stress(middle)
        error = np.abs((secant[1:] + secant[:-1]) / 2 * middle - stress)
        error = error / np.maximum(stress, FLOOR * top[0])
        off = np.abs((kt[1:] + kt[:-1]) / 2 - kt_middle).max(axis=1)
        # shear stiffness counts by the stress that it makes: weighted with its share of closure
        off = off * middle / np.maximum(kt_middle.min(axis=1) * middle, FLOOR * top[1] * end)
        bad = np.maximum(error, off) > tolerance
        # a law of few depth cells has small jumps in its shear stiffness: no grid resolves them
        bad &= np.diff(u) > 0.01 * middle
        if not bad.any():
            break
        u = np.sort(np.concatenate([u, middle[bad]]))
    return u, (float(error.max()), float(off.max()))


def _normal(law: JointLaw, u: Array) -> tuple[Array, Array]:
    """Secant and tangent normal stiffness (Pa/m) on the virgin curve; limits at zero closure."""
    x = np.where(u > 0, u, 1e-12 * law.closure_range)
    _, C = law.joints(len(x)).update(np.stack([x, 0 * x, 0 * x], axis=1))
    assert C is not None
    return law.normal_stress(x) / x, C[:, 0, 0]


def _shear_stiffness(law: JointLaw, u: Array, psi: Array) -> Array:
    """Initial tangent shear stiffness (n, p) in Pa/m of joints closed to u, along psi."""
    x = np.where(u > 0, u, 1e-12 * law.closure_range)
    x, angle = np.repeat(x, len(psi)), np.tile(psi, len(u))
    zero = np.zeros_like(x)
    batch = law.joints(len(x))
    batch.update(np.stack([x, zero, zero], axis=1), tangent=False)
    along = np.stack([zero, np.cos(angle), np.sin(angle)], axis=1)
    probe = (PROBE * x)[:, None] * along
    ahead, back = (batch.trial(sign * probe, tangent=False)[0] for sign in (1, -1))
    slope = np.sum((ahead - back) * along, axis=1) / (2 * PROBE * x)
    return np.asarray(slope.reshape(len(u), len(psi)), float)


def _friction(
    law: JointLaw, u: Array, psi: Array, limit: float, steps: int
) -> tuple[Array, Array, Array]:
    """Peak and final shear-to-normal ratio and final dilation (n, p), at constant stress."""
    few = np.geomspace(u[1], u[-1], ROWS)  # friction varies slowly with closure
    x, angle = np.repeat(few, len(psi)), np.tile(psi, len(few))
    zero = np.zeros_like(x)
    batch = law.joints(len(x))
    batch.update(np.stack([x, zero, zero], axis=1), tangent=False)
    goal = batch.F[:, 0]
    along = np.stack([zero, np.cos(angle), np.sin(angle)], axis=1)
    lengths = np.diff(limit * (np.arange(steps + 1) / steps) ** 2)
    peak = ratio = dilation = zero
    for length in lengths:
        step = length * along
        closing = closing_increments(batch, step, NormalCondition(goal, goal), HELD)
        step[:, 0] = closing
        F, _ = batch.update(step, tangent=False)
        ratio = np.sum(F * along, axis=1) / goal
        peak, dilation = np.maximum(peak, ratio), -closing / length
    at = np.log(np.maximum(u, few[0]))
    result = [
        np.array([np.interp(at, np.log(few), column) for column in values.reshape(ROWS, -1).T]).T
        for values in (peak, ratio, dilation)
    ]
    return result[0], result[1], result[2]
