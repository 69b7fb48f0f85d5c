"""Tabulation of a law: a graded grid of closures, and first-loading paths that fill it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ..joints.batch import JointBatch
from ..joints.normal_control import NormalCondition, closing_increments
from ..laws.joint_law import JointLaw
from ..parameters.resolution import SHEAR_RESOLUTION
from ..parameters.toml import text_or_reason
from ..support.checks import Array, integer, more_than
from ..support.version import __version__
from .joint_table import JointTable

ERROR_FLOOR = 1e-4  # of the largest stress: the tolerance of smaller stresses is absolute
FRICTION_ROWS = 30  # closures at which friction and dilation are computed
SHEAR_LIMIT_RATIO = 10.0  # default shear limit over closure range, without a mating length
STRESS_TOLERANCE = 1e-9  # relative, of the constant normal stress
PROBE_RATIO = 1e-7  # shear probe over closure: small against curvature, large against rounding
MIN_CLOSURE_RATIO = 1e-12  # over the closure range: stands for zero, where limits are computed


def tabulate(
    law: Any,
    closure: float | None = None,
    shear_limit: float | None = None,
    tolerance: float = 1e-3,
    azimuths: int = 12,
    steps: int = 60,
) -> JointTable:
    """Tabulate the first loading of a law against closure, without its bond.

    Parameters
    ----------
    law: a `JointLaw` or `CoulombLaw` in 3-D (`plane=None`).
    closure: last closure of the table in m; `law.closure_range` by default.
    shear_limit: shear displacement in m at which friction and dilation are computed; by default
        the mating length, or ten closure ranges where the mating length is infinite.
    tolerance: largest relative interpolation error between rows, of normal stress and of shear
        stiffness; for values below 1e-4 of the largest, relative to 1e-4 of the largest.
    azimuths: number of azimuths, evenly spaced over the half circle, 3 or more; a divisor of 180.
    steps: steps of the shear path, quadratically graded.

    Raises ValueError for a bad argument.

    >>> table = jl.tabulate(law, azimuths=4, tolerance=1e-2)
    >>> table.save("joint.txt")
    >>> same = jl.load_table("joint.txt")
    """
    require_3d(law, "a table")
    given_law = finer = law
    limit = SHEAR_LIMIT_RATIO * law.closure_range
    if isinstance(law, JointLaw):
        law = replace(law, bond=None)
        finer = replace(law, resolution=SHEAR_RESOLUTION)
        limit = law.mating_length if math.isfinite(law.mating_length) else limit
    end = more_than("closure", law.closure_range if closure is None else closure, 0.0)
    tolerance = more_than("tolerance", tolerance, 0.0)
    steps = integer("steps", steps, 2)
    if integer("azimuths", azimuths, 3) > 180 or 180 % azimuths:
        raise ValueError(f"azimuths = {azimuths} must divide 180: columns are named by degree")
    limit = more_than("shear_limit", limit if shear_limit is None else shear_limit, 0.0)
    psi: Array = np.radians(np.arange(azimuths) * (180 // azimuths), dtype=np.float64)
    u, grid_errors = _grid(law, end, psi, tolerance)
    secant, tangent = _normal(law, u)
    kt = _shear_stiffness(law, u, psi)
    peak, mobilised, dilation = _friction(law, u, psi, limit, steps)
    table = JointTable(u, secant * u, secant, tangent, psi, kt, peak, mobilised, dilation, {})
    harmonic = np.abs(table.lookup(u[1:, None], psi).shear_stiffness / kt[1:] - 1).max()
    # hosts rely on this friction: its error by few nodes is stated, in degrees
    fine = _friction(finer, u, psi[::4], limit, steps)[1]
    angle_error = np.degrees(np.abs(np.arctan(mobilised[:, ::4]) - np.arctan(fine)))
    errors = (*grid_errors, float(harmonic), float(angle_error.max()))
    return replace(table, metadata=_metadata(given_law, table, tolerance, errors, limit, steps))


def require_3d(law: Any, what: str) -> None:
    """Refuse a law without shear in all directions. Raises ValueError with the remedy.

    what: the subject of the message, which needs shear in 3-D.
    """
    if law.dim == 1:
        raise ValueError(f"law.closure_only = True: {what} has shear; set closure_only=False")
    if law.plane is not None:
        raise ValueError(f"law.plane = {law.plane:g}: {what} has shear in 3-D; set plane=None")


def _metadata(
    law: Any,
    table: JointTable,
    tolerance: float,
    errors: tuple[float, float, float, float],
    limit: float,
    steps: int,
) -> dict[str, Any]:
    """Metadata of a table; errors: of normal stress, shear stiffness, azimuth and angle (deg)."""
    kn = float(table.kn_tangent.max())
    kt = float(table.shear_stiffness.max())
    return {
        "about": f"rock joint tabulated by jointlaw {__version__}, per unit area of joint",
        "units": "un m; sn Pa; kn_secant, kn_tangent, kt Pa/m; mu, mob, dil dimensionless",
        "signs": "un > 0 is closure, sn > 0 is compression; the force on a body that moves by "
        "+delta is -area*traction",
        "azimuth": "degrees in the joint plane from axis 2 towards axis 3: digits of column names",
        "use": "kn_secant is for laws of the total normal force kn*un; kt is the tangent for "
        "incremental shear, dFs = kt*dus",
        "yielding": "first loading only: asperities yield, and unloading leaves a plastic closure"
        if law.tables.yields
        else "none",
        "degradation": "first loading only: slopes that decreased by stress stay so in unloading"
        if law.tables.degrades_by_stress
        else "none",
        "bond": "left out: this is the joint without its bond"
        if isinstance(law, JointLaw) and law.bond is not None
        else "none",
        "loading_path": "virgin joint; kn: pure closure; kt: first shear after pure closure; "
        f"mu, mob, dil: shear to {limit:.6g} m in {steps} steps at constant normal stress; "
        "mu is the largest ratio up to there, mob and dil (opening per shear) hold at the end",
        "shear_limit": limit,
        "tolerance": tolerance,
        "interpolation_error_normal_stress": errors[0],
        "interpolation_error_shear_stiffness": errors[1],
        "azimuth_fit_error": errors[2],
        "largest_kn_tangent": kn,
        "largest_kt": kt,
        "critical_time_step": 2 / math.sqrt(max(kn, kt)),
        "critical_time_step_is": "s for 1 kg per m2 of joint: multiply by sqrt(reduced mass/area); "
        "translation of one contact only, see docs/particles.md",
        "law": "\n".join(text_or_reason(law)).strip(),
        "resolution_error_friction_angle": errors[3],
    }


def _grid(law: Any, end: float, psi: Array, tolerance: float) -> tuple[Array, tuple[float, float]]:
    """Closures from 0 to `end` (m) between which linear interpolation meets the tolerance.

    Returns them, and the largest errors of normal stress and shear stiffness.
    """
    u = np.concatenate([[0.0], end * np.geomspace(1e-3, 1.0, 13)])
    axes = psi[[0, len(psi) // 2]]
    max_stress = law.normal_stress(end)
    max_stiffness = _shear_stiffness(law, np.array([end]), axes).max()
    for _ in range(40):
        middle = (u[1:] + u[:-1]) / 2
        secant, _ = _normal(law, u)
        kt = _shear_stiffness(law, u, axes)
        kt_middle = _shear_stiffness(law, middle, axes)
        stress = law.normal_stress(middle)
        interpolated = (secant[1:] + secant[:-1]) / 2 * middle
        error = np.abs(interpolated - stress) / np.maximum(stress, ERROR_FLOOR * max_stress)
        kt_error = np.abs((kt[1:] + kt[:-1]) / 2 - kt_middle).max(axis=1)
        # relative to the shear stress at a shear of the closure, so that the floor is a stress
        floor = ERROR_FLOOR * max_stiffness * end
        kt_error = kt_error * middle / np.maximum(kt_middle.min(axis=1) * middle, floor)
        too_coarse = np.maximum(error, kt_error) > tolerance
        # the shear stiffness of a law with few cells has small jumps, which no grid resolves
        too_coarse &= np.diff(u) > 0.01 * middle
        if not too_coarse.any():
            break
        u = np.sort(np.concatenate([u, middle[too_coarse]]))
    return u, (float(error.max()), float(kt_error.max()))


def _normal(law: Any, u: Array) -> tuple[Array, Array]:
    """Secant and tangent normal stiffness (Pa/m) in first loading; limits at zero closure."""
    x = np.where(u > 0, u, MIN_CLOSURE_RATIO * law.closure_range)
    _, C = law.joints(len(x)).update(np.stack([x, 0 * x, 0 * x], axis=1))
    assert C is not None
    return law.normal_stress(x) / x, C[:, 0, 0]


def _closed(law: Any, u: Array, psi: Array) -> tuple[JointBatch, Array]:
    """New joints closed to every u, one for each psi, and their unit vectors of shear (m, 3)."""
    x = np.repeat(u, len(psi))
    angle = np.tile(psi, len(u))
    batch = law.joints(len(x))
    batch.update(np.stack([x, 0 * x, 0 * x], axis=1), tangent=False)
    return batch, np.stack([0 * x, np.cos(angle), np.sin(angle)], axis=1)


def _shear_stiffness(law: Any, u: Array, psi: Array) -> Array:
    """Initial tangent shear stiffness (n, p) in Pa/m of joints closed to u, along psi."""
    x = np.where(u > 0, u, MIN_CLOSURE_RATIO * law.closure_range)
    batch, along = _closed(law, x, psi)
    probe = PROBE_RATIO * np.repeat(x, len(psi))
    F_forward, _ = batch.trial(probe[:, None] * along, tangent=False)
    F_backward, _ = batch.trial(-probe[:, None] * along, tangent=False)
    slope: Array = np.sum((F_forward - F_backward) * along, axis=1) / (2 * probe)
    return slope.reshape(len(u), len(psi))


def _friction(law: Any, u: Array, psi: Array, limit: float, steps: int) -> Array:
    """Shear-to-normal ratios and dilation of joints sheared at constant normal stress.

    Returns (3, n, p) for n closures u (m) before shear and p azimuths psi (rad): the largest ratio
    on the way to the shear displacement `limit` (m), the ratio at the end, and the opening per
    shear in the last of `steps` steps. It is simulated at FRICTION_ROWS closures and interpolated
    to u.
    """
    closures = np.geomspace(u[1], u[-1], FRICTION_ROWS)  # friction varies slowly with closure
    batch, along = _closed(law, closures, psi)
    normal = batch.F[:, 0]
    peak = ratio = dilation = np.zeros(len(along))
    for length in np.diff(limit * (np.arange(steps + 1) / steps) ** 2):
        step = length * along
        closing = closing_increments(batch, step, NormalCondition(normal, normal), STRESS_TOLERANCE)
        step[:, 0] = closing
        F, _ = batch.update(step, tangent=False)
        ratio = np.sum(F * along, axis=1) / normal
        peak = np.maximum(peak, ratio)
        dilation = -closing / length
    log_u = np.log(np.maximum(u, closures[0]))
    results = [values.reshape(FRICTION_ROWS, -1).T for values in (peak, ratio, dilation)]
    rows = [np.interp(log_u, np.log(closures), column) for column in np.concatenate(results)]
    return np.reshape(rows, (3, len(psi), len(u))).transpose(0, 2, 1)
